//! Render protocol: requests of the bench and replies of a renderer as lines of JSON, as
//! `tests/peers/rendering.py` has them too.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::camera::Camera;

/// Request to a renderer.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum Wanted {
    /// Load a GLB, or a configuration, and get ready to draw it.
    Load {
        path: PathBuf,
        /// Width and height of the picture, pixels.
        size: [u32; 2],
        /// Samples a pixel, 1 or 4.
        samples: u32,
    },
    /// Draw a frame from each camera.
    Frames { cameras: Vec<Camera> },
    /// Draw one and write it as a PNG.
    Picture { camera: Camera, path: PathBuf },
}

/// Reply of a renderer.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Answer {
    /// A frame each, from its beginning until the picture is finished.
    #[serde(default)]
    pub(crate) millis: Vec<f64>,
    /// A frame each, from its beginning until it is handed to the device; of ours alone.
    #[serde(default)]
    pub(crate) cpu_millis: Vec<f64>,
    /// A frame each, what is done between the parts of it that the device draws; of ours alone.
    #[serde(default)]
    pub(crate) hide_millis: Vec<f64>,
    /// Triangles of the last frame; of ours alone.
    #[serde(default)]
    pub(crate) triangles: u64,
}
