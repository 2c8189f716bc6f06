//! Which equipment is under random pixels, and whether simplification changes
//! the answer.
//!
//! A pick of the viewer draws the scene for one pixel, so thousands of them
//! take long. Here rays are cast instead at the same mesh; a sample of the
//! pixels is picked through the viewer as well, and the two compared.

use anyhow::{Context, Result};
use busbar_geometry::CollapseStacks;
use busbar_renderer::CameraView;
use busbar_viewer::Viewer;
use glam::{Mat4, Vec3, vec3};
use parry3d::query::{Ray, RayCullingMode};
use parry3d::shape::TriMesh;
use rayon::prelude::*;
use serde::Serialize;
use substation::Run;

use crate::frames;
use crate::progress::Progress;
use crate::scene::{OVERVIEW, OVERVIEW_EYE, OVERVIEW_FOV_DEGREES, OVERVIEW_TARGET};
use crate::surface_error::{surface_of, vector};
use crate::topology::live;

/// Triangles are looked for this far from the eye, metres.
const MAX_DISTANCE: f32 = 10_000.0;

/// How picks at a theta differ from those at theta 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PickChanges {
    /// Theta compared with 0.
    pub theta: f64,
    /// Pixels, drawn uniformly.
    pub pixels: usize,
    /// Pixels on equipment at theta 0.
    pub on_equipment: usize,
    /// Pixels on equipment, then on another piece.
    pub to_other: usize,
    /// Pixels on equipment, then on the background.
    pub to_background: usize,
    /// Pixels on the background, then on equipment.
    pub from_background: usize,
    /// Pixels picked through the viewer too, at both thetas.
    pub viewer_picks: usize,
    /// Of these, picks that gave the equipment that the ray found.
    pub viewer_agrees: usize,
}

impl PickChanges {
    /// Pixels whose pick changed.
    pub fn changed(&self) -> usize {
        self.to_other + self.to_background + self.from_background
    }
}

/// The paper's scene as rays see it.
pub struct PickScene<'a> {
    stacks: &'a CollapseStacks,
    /// Per imported triangle: whose it is, index into `runs`' names.
    equipment: Vec<&'a str>,
    /// Pixels.
    size: [u32; 2],
}

impl<'a> PickScene<'a> {
    /// `runs` say whose the imported triangles are.
    ///
    /// # Errors
    /// When they do not cover the mesh.
    pub fn new(stacks: &'a CollapseStacks, runs: &'a [Run], size: [u32; 2]) -> Result<Self> {
        let names = runs.iter();
        let equipment: Vec<&str> = names
            .flat_map(|run| std::iter::repeat_n(run.equipment.as_str(), run.triangle_count))
            .collect();
        let count = stacks.mesh().triangles.len();
        anyhow::ensure!(
            equipment.len() == count,
            "{} triangles belong to equipment, but the scene has {count}",
            equipment.len()
        );
        Ok(Self { stacks, equipment, size })
    }

    /// Compares picks at `theta` with those at theta 0 over random pixels; the
    /// first `viewer_picks` of them go through the viewer too.
    ///
    /// # Errors
    /// The device's.
    pub fn compare(
        &self,
        viewer: &mut Viewer,
        (theta, pixels, viewer_picks): (f64, usize, usize),
        progress: &Progress,
    ) -> Result<PickChanges> {
        let mut random = fastrand::Rng::with_seed(70);
        let pixels: Vec<[u32; 2]> =
            (0..pixels).map(|_| self.size.map(|side| random.u32(0..side))).collect();
        let viewer_picks = viewer_picks.min(pixels.len());
        let before = self.cast(0.0, &pixels)?;
        let after = self.cast(theta, &pixels)?;
        let mut changes = PickChanges {
            theta,
            pixels: pixels.len(),
            on_equipment: before.iter().flatten().count(),
            to_other: 0,
            to_background: 0,
            from_background: 0,
            viewer_picks: 2 * viewer_picks,
            viewer_agrees: 0,
        };
        for pair in before.iter().zip(&after) {
            match pair {
                (Some(a), Some(b)) => changes.to_other += usize::from(a != b),
                (Some(_), None) => changes.to_background += 1,
                (None, Some(_)) => changes.from_background += 1,
                (None, None) => {}
            }
        }
        viewer.resize(self.size);
        viewer.use_camera(OVERVIEW)?;
        for (theta, expected) in [(0.0, &before), (theta, &after)] {
            frames::settle(viewer, theta)?;
            for (&pixel, &expected) in pixels.iter().zip(expected).take(viewer_picks) {
                let picked = viewer.pick(pixel)?;
                let picked = picked.as_deref().map(|id| id.split_once('/').map_or(id, |s| s.1));
                changes.viewer_agrees += usize::from(picked == expected);
                progress.step();
            }
        }
        Ok(changes)
    }

    /// The equipment under each pixel at a theta.
    fn cast(&self, theta: f64, pixels: &[[u32; 2]]) -> Result<Vec<Option<&'a str>>> {
        let cursor = self.stacks.cursor_at(theta);
        let surface = surface_of(&live(self.stacks, cursor)).context("nothing is left to pick")?;
        let imported: Vec<u32> = self.stacks.live(cursor).collect();
        let camera = overview_camera(self.size);
        let world_from_clip = camera.clip_from_world().inverse();
        let pick = |&pixel: &[u32; 2]| {
            let hit = first_hit(&surface, camera.eye, direction(world_from_clip, pixel, self.size));
            hit.map(|triangle| self.equipment[imported[triangle] as usize])
        };
        Ok(pixels.par_iter().map(pick).collect())
    }
}

/// The overview as the viewer sees it.
fn overview_camera(size: [u32; 2]) -> CameraView {
    let [eye, target] =
        [OVERVIEW_EYE, OVERVIEW_TARGET].map(|p| vec3(p[0] as f32, p[1] as f32, p[2] as f32));
    let fov_y = OVERVIEW_FOV_DEGREES.to_radians() as f32;
    let aspect = size[0] as f32 / size[1] as f32;
    CameraView::look_at(eye, target, Vec3::Y, fov_y, aspect, 1.0)
}

/// From the eye through the middle of a pixel.
fn direction(world_from_clip: Mat4, pixel: [u32; 2], size: [u32; 2]) -> Vec3 {
    let clip = |i: usize| (pixel[i] as f32 + 0.5) / size[i] as f32 * 2.0 - 1.0;
    let on_ray = |depth: f32| world_from_clip.project_point3(vec3(clip(0), clip(1), depth));
    // Depth is 1 at the near plane and falls from there.
    (on_ray(0.5) - on_ray(1.0)).normalize_or_zero()
}

/// The nearest triangle that looks at the eye; others are not drawn.
fn first_hit(surface: &TriMesh, eye: Vec3, direction: Vec3) -> Option<usize> {
    let ray = Ray::new(vector(eye), vector(direction));
    let culling = RayCullingMode::IgnoreBackfaces;
    let hit = surface.cast_local_ray_with_culling(&ray, MAX_DISTANCE, culling)?;
    Some(hit.subshape as usize)
}

#[cfg(test)]
mod tests {
    use busbar_geometry::Topology;

    use super::*;

    fn square(facing: bool) -> TriMesh {
        let positions = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| vec3(x, y, -5.0))
            .to_vec();
        let mut triangles = vec![[0, 1, 2], [0, 2, 3]];
        if !facing {
            triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
        surface_of(&Topology { positions, triangles }).unwrap()
    }

    #[test]
    fn rays_hit_what_looks_at_them() {
        let along = |x: f32, y: f32| vec3(x, y, -5.0).normalize();
        assert_eq!(first_hit(&square(true), Vec3::ZERO, along(0.5, -0.5)), Some(0));
        assert_eq!(first_hit(&square(true), Vec3::ZERO, along(-0.5, 0.5)), Some(1));
        assert_eq!(first_hit(&square(true), Vec3::ZERO, along(1.5, 0.5)), None);
        assert_eq!(first_hit(&square(false), Vec3::ZERO, along(0.5, -0.5)), None);
    }

    #[test]
    fn rays_go_through_the_middle_of_pixels() {
        let size = [1280, 720];
        let camera = overview_camera(size);
        let world_from_clip = camera.clip_from_world().inverse();
        for pixel in [[0, 0], [1279, 719], [640, 360], [17, 411]] {
            let point = camera.eye + direction(world_from_clip, pixel, size) * 120.0;
            let clip = camera.clip_from_world().project_point3(point);
            for (axis, along) in [clip.x, clip.y].into_iter().enumerate() {
                let found = (along + 1.0) * 0.5 * size[axis] as f32 - 0.5;
                assert!((found - pixel[axis] as f32).abs() < 0.02, "{pixel:?}: {found}");
            }
        }
    }
}
