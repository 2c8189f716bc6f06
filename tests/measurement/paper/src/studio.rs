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

/// Direction from the model towards the eye.
const DIRECTION: Vec3 = vec3(-0.52, 0.36, -0.78);
/// Factor of the room left around the model.
const MARGIN: f32 = 1.05;
/// Linear light of the background, as of paper.
const BACKGROUND: [f32; 3] = [0.87, 0.87, 0.85];
/// Distance of the eye from the model, in diagonals of its bounding box.
const DISTANCE: f32 = 20.0;

/// Studio with a fixed camera for pictures of one model.
pub struct Studio {
    renderer: Renderer,
    camera: CameraView,
}

/// Model to be rendered in the studio.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Collapse stacks of the model.
    pub stacks: &'a Arc<CollapseStacks>,
    /// Materials by the index that the mesh's sections use.
    pub materials: &'a [Material],
}

impl Studio {
    /// Creates a studio whose camera frames all of `points` exactly.
    ///
    /// # Errors
    /// When there is no usable device.
    pub fn new(points: &[Vec3], size: [u32; 2]) -> Result<Self> {
        let renderer = Renderer::headless(RendererOptions::default(), size)?;
        Ok(Self { renderer, camera: parallel_view(points, size[0] as f32 / size[1] as f32) })
    }

    /// Renders a picture of a model after `cursor` collapses.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn render(
        &mut self,
        subject: Subject<'_>,
        cursor: u32,
        wireframe: bool,
    ) -> Result<Picture> {
        let model = self.renderer.upload_model(ModelUpload {
            stacks: std::slice::from_ref(subject.stacks),
            materials: subject.materials,
            textures: &[],
        })?;
        let instance = DrawInstance {
            model,
            mesh: 0,
            cursor,
            morph: None,
            world_from_mesh: Mat4::IDENTITY,
            object: 1,
            first_feature: None,
            highlight: [0.0; 4],
        };
        self.renderer.draw(&Frame {
            wireframe,
            background: BACKGROUND,
            ..Frame::new(self.camera, &[instance])
        })?;
        let picture = self.renderer.read_picture()?;
        self.renderer.remove_model(model);
        Ok(picture)
    }
}

/// Returns a parallel projection that frames the points, reverse-Z as all views of the renderer.
fn parallel_view(points: &[Vec3], aspect: f32) -> CameraView {
    let back = DIRECTION.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    // In the camera's axes.
    let seen = points.iter().map(|p| vec3(p.dot(right), p.dot(up), p.dot(back)));
    let bounds = Bounds::from_points(seen).unwrap_or(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE });
    let half = (bounds.max - bounds.min) * 0.5;
    let height = half.y.max(half.x / aspect) * MARGIN;
    let width = height * aspect;
    let (radius, distance) = (bounds.radius(), bounds.radius() * 2.0 * DISTANCE);
    let center = bounds.center();
    let eye = right * center.x + up * center.y + back * (center.z + distance);
    let (near, far) = (distance - radius * 2.0, distance + radius * 2.0);
    CameraView {
        camera_from_world: view::look_to_mat4(eye, -back, Vec3::Y),
        projection: vulkan::orthographic(-width, width, -height, height, far, near),
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
    fn points_fill_the_view_and_near_is_one() {
        let bounds = Bounds { min: vec3(-5.0, 0.0, -3.0), max: vec3(5.0, 9.0, 3.0) };
        let points = bounds.corners();
        let camera = parallel_view(&points, 16.0 / 9.0);
        let clip = |point: Vec3| camera.clip_from_world().project_point3(point);
        let seen = Bounds::from_points(points.map(clip)).unwrap();
        assert!((seen.max.y - 1.0 / MARGIN).abs() < 1e-3, "{seen:?}");
        assert!((seen.min.y + 1.0 / MARGIN).abs() < 1e-3, "{seen:?}");
        assert!(seen.max.x < 1.0 && seen.min.x > -1.0, "{seen:?}");
        assert!(seen.min.z >= 0.0 && seen.max.z <= 1.0, "{seen:?}");
        let back = DIRECTION.normalize();
        assert!(clip(bounds.center() + back).z > clip(bounds.center() - back).z);
    }
}
