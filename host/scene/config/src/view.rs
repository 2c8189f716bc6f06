//! Views: cameras, theme, quality and section.

use schemars::JsonSchema;
use serde::Deserialize;

/// A place to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraConfig {
    /// Position of the camera, metres.
    pub eye: [f64; 3],
    /// Point that the camera looks at, metres; never the eye itself.
    pub target: [f64; 3],
    /// Vertical field of view in degrees.
    pub fov_degrees: f32,
    /// Projection of the camera.
    pub projection: ProjectionConfig,
    /// JSON pointer of the camera.
    pub pointer: String,
}

/// Projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProjectionConfig {
    /// Perspective projection: distant objects are smaller.
    Perspective,
    /// Orthographic projection: no perspective.
    Orthographic {
        /// Visible height of a picture 16:9 or wider, metres; none for as much as a perspective
        /// view shows at the target.
        height: Option<f32>,
    },
}

/// Settings of the first picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewConfig {
    /// Name of the camera; none to frame the whole scene.
    pub camera: Option<String>,
    /// Background as sRGB red, green and blue.
    pub background: [u8; 3],
    /// Rendering quality; none where it follows the device.
    pub quality: Option<QualityConfig>,
    /// Samples a pixel, 1 or 4; none where they follow the quality.
    pub samples: Option<u32>,
    /// Shows a ground with a grid below the lowest point.
    pub ground: bool,
    /// Fades distant objects into the background.
    pub fog: bool,
    /// Section plane that cuts the scene open.
    pub section: Option<SectionConfig>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Factor on the thetas of models and nodes.
    pub theta_scale: f64,
    /// Target time of a frame in a window, milliseconds; none for no target.
    pub target_frame_millis: Option<f64>,
    /// Duration of a change of detail in a window, seconds; 0 is at once.
    pub morph_seconds: f64,
    /// Duration of a camera transition in a window, seconds; 0 is at once.
    pub transition_seconds: f32,
    /// True where a window's camera turns on for a moment after a drag.
    pub inertia: bool,
    /// Colours of panels and labels.
    pub theme: ThemeConfig,
    /// Factor on the size of panels and labels.
    pub scale: f32,
    /// Path of a font as written, relative to the configuration file; none for the one
    /// built in.
    pub font: Option<String>,
    /// Graphics device, by number or part of its name; none for the best.
    pub device: Option<String>,
}

/// Colours of panels and labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Theme")]
pub enum ThemeConfig {
    /// Theme of light grey.
    #[default]
    Light,
    /// Dark grey, for night shifts.
    Dark,
}

/// Rendering quality of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityConfig {
    /// Lowest cost, for remote desktops and software rasterizers: shapes alone.
    Low,
    /// Materials as they reflect light.
    Medium,
    /// The same with shadows and contact shades.
    High,
}

/// A plane that cuts equipment open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionConfig {
    /// Normal towards the part that is cut away, a unit vector; y is up.
    pub normal: [f32; 3],
    /// Distance of the plane from the origin along the normal, metres.
    pub distance: f64,
}
