//! Pictures of one model in parallel projection, as the paper's Figures 6 to 8.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use busbar_geometry::{Bounds, CollapseStacks};
use busbar_renderer::{CameraView, DrawInstance, Frame, ModelUpload, Renderer, RendererOptions};
use busbar_scene::Material;
use busbar_viewer::Picture;
use glam::camera::rh::{proj::vulkan, view};
use glam::{Mat4, Vec3, vec3};
use image::{ImageFormat, RgbaImage};

/// Towards the eye.
const DIRECTION: Vec3 = vec3(-0.52, 0.36, -0.78);
/// Room left around the model.
const MARGIN: f32 = 1.05;
/// Linear light of the background, as of paper.
const BACKGROUND: [f32; 3] = [0.87, 0.87, 0.85];
/// How far off the eye stands, in diagonals of the box around the model.
const DISTANCE: f32 = 20.0;

/// A fixed camera in front of models of one size.
pub struct Studio {
    renderer: Renderer,
    camera: CameraView,
}

/// What stands in the studio.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Its stacks.
    pub stacks: &'a Arc<CollapseStacks>,
    /// What its sections name.
    pub materials: &'a [Material],
}

impl Studio {
    /// A studio whose camera has all of `bounds` in view.
    ///
    /// # Errors
    /// When there is no usable device.
    pub fn new(bounds: Bounds, size: [u32; 2]) -> Result<Self> {
        let renderer = Renderer::headless(RendererOptions::default(), size)?;
        Ok(Self { renderer, camera: parallel_view(bounds, size[0] as f32 / size[1] as f32) })
    }

    /// Takes a picture of a model after `cursor` collapses.
    ///
    /// # Errors
    /// The device's.
    pub fn shoot(&mut self, subject: Subject<'_>, cursor: u32, wireframe: bool) -> Result<Picture> {
        let model = self.renderer.upload_model(ModelUpload {
            stacks: std::slice::from_ref(subject.stacks),
            materials: subject.materials,
            textures: &[],
        })?;
        let instance = DrawInstance {
            model,
            mesh: 0,
            cursor,
            world_from_mesh: Mat4::IDENTITY,
            object: 1,
            highlight: [0.0; 4],
        };
        self.renderer.draw(&Frame {
            camera: self.camera,
            instances: &[instance],
            wireframe,
            background: BACKGROUND,
            overlay: None,
        })?;
        let picture = self.renderer.read_picture()?;
        self.renderer.remove_model(model);
        Ok(picture)
    }
}

/// A parallel view of a box, reverse-Z as all views of the renderer.
fn parallel_view(bounds: Bounds, aspect: f32) -> CameraView {
    let back = DIRECTION.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let extent = |axis: Vec3| {
        let reach = bounds.corners().map(|corner| (corner - bounds.center()).dot(axis).abs());
        reach.into_iter().fold(0.0, f32::max) * MARGIN
    };
    let height = extent(up).max(extent(right) / aspect);
    let width = height * aspect;
    let (radius, distance) = (bounds.radius(), bounds.radius() * 2.0 * DISTANCE);
    let eye = bounds.center() + back * distance;
    CameraView {
        camera_from_world: view::look_to_mat4(eye, -back, Vec3::Y),
        projection: vulkan::orthographic(
            -width,
            width,
            -height,
            height,
            distance + radius * 2.0,
            distance - radius * 2.0,
        ),
        eye,
    }
}

/// Writes a picture as PNG.
///
/// # Errors
/// When the file cannot be written.
pub fn save(picture: &Picture, path: &Path) -> Result<()> {
    let image = RgbaImage::from_raw(picture.width, picture.height, picture.rgba8.clone())
        .context("a picture has another size than it says")?;
    image
        .save_with_format(path, ImageFormat::Png)
        .with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_is_in_view_and_near_is_one() {
        let bounds = Bounds { min: vec3(-5.0, 0.0, -3.0), max: vec3(5.0, 9.0, 3.0) };
        let camera = parallel_view(bounds, 16.0 / 9.0);
        let mut widest: f32 = 0.0;
        for corner in bounds.corners() {
            let clip = camera.clip_from_world().project_point3(corner);
            assert!(clip.x.abs() < 1.0 && clip.y.abs() < 1.0, "{corner}: {clip}");
            assert!((0.0..=1.0).contains(&clip.z), "{corner}: {clip}");
            widest = widest.max(clip.x.abs()).max(clip.y.abs());
        }
        assert!((widest - 1.0 / MARGIN).abs() < 1e-3);
        let depth = |offset: f32| {
            let back = DIRECTION.normalize();
            camera.clip_from_world().project_point3(bounds.center() + back * offset).z
        };
        assert!(depth(1.0) > depth(-1.0));
    }
}
