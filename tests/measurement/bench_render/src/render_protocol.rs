//! Render protocol: requests of the bench and replies of a renderer as lines of JSON, as
//! `tests/end_to_end/peers/rendering.py` has them too.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::camera::Camera;

/// Request to a renderer.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum RenderRequest {
    /// Loads a GLB, or a configuration, and prepares to draw it.
    Load {
        path: PathBuf,
        /// Width and height of the picture, pixels.
        size: [u32; 2],
        /// Number of samples a pixel, 1 or 4.
        samples: u32,
    },
    /// Draws a frame from each camera.
    Frames { cameras: Vec<Camera> },
    /// Draws one picture and writes it as a PNG.
    Picture { camera: Camera, path: PathBuf },
}

/// Reply of a renderer.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct RenderReply {
    /// Milliseconds of each frame, from its beginning until the picture is finished.
    #[serde(default)]
    pub(crate) millis: Vec<f64>,
    /// Milliseconds of each frame until it is handed to the device; Busbar's alone.
    #[serde(default)]
    pub(crate) cpu_millis: Vec<f64>,
    /// Milliseconds of occlusion culling between the two passes of each frame; Busbar's alone.
    #[serde(default)]
    pub(crate) hide_millis: Vec<f64>,
    /// Triangles of the last frame; Busbar's alone.
    #[serde(default)]
    pub(crate) triangles: u64,
}
