//! Picture comparison of meshes from all around.

use anyhow::{Context, Result};
use busbar_geometry::{Bounds, Topology};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::raster::{ShadedView, View, draw};
use crate::shading::{CREASE_DEGREES, creased_normals};
use crate::similarity::ssim;

/// Directions towards the eye: the corners of a cube, a little turned, so that no view looks along
/// square edges.
const VIEWS: [Vec3; 8] = [
    Vec3::new(1.0, 0.7, 0.8),
    Vec3::new(0.8, 0.6, -1.0),
    Vec3::new(-1.0, 0.8, -0.7),
    Vec3::new(-0.7, 0.7, 1.0),
    Vec3::new(1.0, -0.6, 0.6),
    Vec3::new(0.6, -0.7, -1.0),
    Vec3::new(-1.0, -0.5, -0.8),
    Vec3::new(-0.6, -0.8, 1.0),
];
/// Size of a picture, pixels.
const SIZE: [u32; 2] = [512, 512];

/// Pictures of an original mesh.
pub struct Gallery {
    views: Vec<View>,
    shots: Vec<ShadedView>,
}

/// Difference of a level's pictures from the original's, over all views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PictureError {
    /// Mean structural similarity, 1 for equal pictures.
    pub ssim: f64,
    /// Number of pixels that only one of both covers, as a share of those that the original covers.
    pub silhouette: f64,
}

impl Gallery {
    /// Renders an original's pictures. Normals come from its faces, as those of levels do, so that
    /// only the surface is judged here.
    ///
    /// # Errors
    /// When the mesh has no points.
    pub fn new(original: &Topology) -> Result<Self> {
        let bounds = Bounds::from_points(original.positions.iter().copied());
        let bounds = bounds.context("the original has no points")?;
        let views: Vec<View> =
            VIEWS.iter().map(|&towards_eye| View::of_box(bounds, towards_eye, 1.0)).collect();
        let shots = shots(original, &views);
        Ok(Self { views, shots })
    }

    /// Compares a simplified mesh.
    ///
    /// # Errors
    /// None that could be mended; pictures are all of one size.
    pub fn compare(&self, simplified: &Topology) -> Result<PictureError> {
        let shots = shots(simplified, &self.views);
        let mut similarity = 0.0;
        let (mut covered, mut different) = (0, 0);
        for (original, level) in self.shots.iter().zip(&shots) {
            similarity += ssim(&original.shades, &level.shades)?;
            covered += original.covered.iter().filter(|&&covered| covered).count();
            let pairs = original.covered.iter().zip(&level.covered);
            different += pairs.filter(|(original, level)| original != level).count();
        }
        Ok(PictureError {
            ssim: similarity / self.shots.len() as f64,
            silhouette: different as f64 / covered.max(1) as f64,
        })
    }
}

fn shots(mesh: &Topology, views: &[View]) -> Vec<ShadedView> {
    let normals = creased_normals(mesh, CREASE_DEGREES);
    views.par_iter().map(|view| draw(mesh, &normals, view, SIZE)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a box without its lid.
    fn tray(width: f32) -> Topology {
        let corner =
            |i: u32| Vec3::new((i & 1) as f32 * width, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [0, 4, 6, 2], [1, 3, 7, 5]];
        Topology {
            positions: (0..8).map(corner).collect(),
            triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        }
    }

    #[test]
    fn the_same_mesh_has_the_same_pictures() {
        let error = Gallery::new(&tray(1.0)).unwrap().compare(&tray(1.0)).unwrap();
        assert_eq!(error.silhouette, 0.0);
        assert!((error.ssim - 1.0).abs() < 1e-9, "{error:?}");
    }

    #[test]
    fn a_part_that_is_gone_is_seen() {
        let gallery = Gallery::new(&tray(1.0)).unwrap();
        let narrow = gallery.compare(&tray(0.9)).unwrap();
        // A tenth of its width is about half a tenth of its outline's area.
        assert!((0.02..0.09).contains(&narrow.silhouette), "{narrow:?}");
        let half = gallery.compare(&tray(0.5)).unwrap();
        assert!(half.silhouette > 3.0 * narrow.silhouette, "{half:?}");
        assert!(half.ssim < narrow.ssim && narrow.ssim < 1.0, "{half:?}");
        let mut nothing = tray(1.0);
        nothing.triangles.clear();
        assert_eq!(gallery.compare(&nothing).unwrap().silhouette, 1.0);
    }
}
