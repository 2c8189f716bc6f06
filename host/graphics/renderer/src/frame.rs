//! Contents of one frame, and the statistics of drawing it.

use busbar_geometry::Bounds;
use busbar_gpu::StageMillis;

use crate::{CameraView, DrawInstance, EguiFrame, Ground, InstanceSource, Polylines, SectionPlane};

/// Everything one picture shows.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// Camera that the frame is seen from.
    pub camera: CameraView,
    /// Instances to draw; may be empty.
    pub instances: InstanceSource<'a>,
    /// Tints of the objects 1, 2 and so on, as [`DrawInstance::highlight`]; read
    /// for features only. Empty where none of them is tinted.
    pub object_highlights: &'a [[f32; 4]],
    /// Triangles' edges over a light fill. On a device that cannot draw lines
    /// ([`Renderer::can_draw_wireframe`](crate::Renderer::can_draw_wireframe))
    /// the fill is shown without them.
    pub wireframe: bool,
    /// Background colour in linear rgb.
    pub background: [f32; 3],
    /// The ground below the equipment; not at low quality, in wireframes or from below.
    pub ground: Option<Ground>,
    /// Distance at which fog hides half of a surface, metres. Not at low quality or in wireframes.
    pub fog_distance: Option<f32>,
    /// Around all that casts a shadow, world space in metres; `None` for no shadows. At
    /// high quality alone, and not in wireframes.
    pub shadow_bounds: Option<Bounds>,
    /// Objects with an outline; the last mention of an object counts.
    pub outlined: &'a [OutlinedObject],
    /// Section plane that cuts geometry away.
    pub section: Option<SectionPlane>,
    /// Lines and faces in the world; not in wireframes, and not picked.
    pub polylines: Option<Polylines<'a>>,
    /// Panels over the picture.
    pub overlay: Option<EguiFrame<'a>>,
    /// Share of the picture's width and height, [`MIN_SCENE_RESOLUTION`] to 1, at which the scene is
    /// drawn; it is then scaled up to the picture, and panels are drawn over it at full resolution.
    pub scene_resolution: f32,
}

/// Smallest [`Frame::scene_resolution`]. Below it the patterns of values that are not good could not
/// be told apart.
pub const MIN_SCENE_RESOLUTION: f32 = 0.5;

impl<'a> Frame<'a> {
    /// Instances alone, before black, listed for this frame.
    pub fn new(camera: CameraView, instances: &'a [DrawInstance]) -> Self {
        Self {
            camera,
            instances: InstanceSource::Listed(instances),
            object_highlights: &[],
            wireframe: false,
            background: [0.0; 3],
            ground: None,
            fog_distance: None,
            shadow_bounds: None,
            outlined: &[],
            section: None,
            polylines: None,
            overlay: None,
            scene_resolution: 1.0,
        }
    }

    /// Returns the share of the picture's width and height that the scene's image has.
    fn scene_share(&self) -> f32 {
        match self.scene_resolution {
            share if share.is_nan() => MIN_SCENE_RESOLUTION,
            share => share.clamp(MIN_SCENE_RESOLUTION, 1.0),
        }
    }

    /// Returns the size of the scene's image for a picture of `size` pixels.
    pub(crate) fn scene_size(&self, size: [u32; 2]) -> [u32; 2] {
        let scaled = |pixels: u32| (pixels as f32 * self.scene_share()).round() as u32;
        size.map(|pixels| scaled(pixels).clamp(1, pixels.max(1)))
    }

    /// Returns the pixels of the scene's image in one point, in which lines and patterns are
    /// measured. In a picture they are at least one pixel a point.
    pub(crate) fn scene_pixels_per_point(&self) -> f32 {
        let pixels_per_point = self.overlay.map_or(1.0, |overlay| overlay.pixels_per_point);
        pixels_per_point.max(1.0) * self.scene_share()
    }
}

/// An object with an outline: a light line with a dark one around it, at least two pixels
/// wide in all, dashed where something lies before the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutlinedObject {
    /// Object as in [`DrawInstance::object`], or that of a feature.
    pub object: u32,
    /// Reason for the outline.
    pub kind: OutlineKind,
}

/// Reason why an object has an outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutlineKind {
    /// The pointer is over it: the thinner line.
    Hovered = 1,
    /// Selection of the object by the user.
    Selected = 2,
}

/// Statistics of one frame. All are zero for a skipped frame of a minimised window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Live triangles, summed over instances.
    pub triangles: u64,
    /// Instances that may be seen: they are in the picture, and not known to be hidden. Parts
    /// of a model in one place count as one.
    pub visible_instances: u32,
    /// Draw calls, without those of the panels.
    pub draw_calls: u32,
    /// Commands that ask for them: those beside each other that are alike are one, where the
    /// device can.
    pub draw_commands: u32,
    /// CPU time until the GPU has the frame's commands, or those of the first pass, milliseconds.
    /// Waiting for the GPU is left out.
    pub cpu_millis: f64,
    /// Time that the frame waited for the depth of the first pass, milliseconds.
    pub depth_wait_millis: f64,
    /// CPU time of occlusion culling after the first pass, milliseconds. Software rasterizers spend
    /// it in place of drawing.
    pub occlusion_millis: f64,
    /// Part of `cpu_millis` spent on meshes at new cursors.
    pub resolve_millis: f64,
    /// Meshes at new cursors that came onto the device, and ways to them.
    pub resolved: u32,
    /// True where the scene's image was kept of an earlier frame, which the figures of the scene
    /// are then of.
    pub is_scene_kept: bool,
    /// Redraw of the shadow map in this frame.
    pub shadows_drawn: bool,
    /// Requests ([`Renderer::request`](crate::Renderer::request)) that are not
    /// done.
    pub waiting: u32,
    /// GPU time of the last frame that it finished; `None` before the first,
    /// and on devices without timestamps.
    pub gpu_millis: Option<f64>,
    /// GPU time of each stage: `upload`, `shadows`, `near`, `scene`, `occlusion`, `outline` and
    /// `panels`, as far as there are any. The remainder is presenting the picture.
    pub gpu_stages: StageMillis,
}

/// A picture read back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Rows from the top; four sRGB bytes a pixel, the last opaque alpha.
    pub rgba8: Vec<u8>,
}
