//! How far one surface is from another.

use anyhow::{Context, Result};
use busbar_geometry::Topology;
use glam::Vec3;
use parry3d::math::Vector;
use parry3d::query::PointQuery;
use parry3d::shape::TriMesh;
use rayon::prelude::*;
use serde::Serialize;

/// Distances between an original and a simplified surface, relative to the
/// diagonal of the box around the original.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SurfaceError {
    /// Mean distance from the original to the simplified surface.
    pub mean_forth: f64,
    /// Greatest distance from the original to the simplified surface.
    pub max_forth: f64,
    /// Mean distance from the simplified surface to the original.
    pub mean_back: f64,
    /// Greatest distance from the simplified surface to the original.
    pub max_back: f64,
}

impl SurfaceError {
    /// The larger of both means.
    pub fn mean(&self) -> f64 {
        self.mean_forth.max(self.mean_back)
    }

    /// The larger of both maxima: Hausdorff's distance, as far as sampled.
    pub fn max(&self) -> f64 {
        self.max_forth.max(self.max_back)
    }
}

/// A surface with points drawn on it, to compare others with.
pub struct Reference {
    surface: TriMesh,
    points: Vec<Vec3>,
    diagonal: f64,
    seed: u64,
}

impl Reference {
    /// Draws `samples` points, uniformly by area.
    ///
    /// # Errors
    /// When the mesh has no surface.
    pub fn new(original: &Topology, samples: usize, seed: u64) -> Result<Self> {
        let bounds = busbar_geometry::Bounds::around(original.positions.iter().copied());
        let diagonal = bounds.map_or(0.0, |b| f64::from(b.radius()) * 2.0);
        let points = sample(original, samples, seed).context("the original has no surface")?;
        Ok(Self { surface: surface_of(original)?, points, diagonal, seed })
    }

    /// Compares a simplified mesh; `None` if it has no surface left.
    pub fn compare(&self, simplified: &Topology) -> Option<SurfaceError> {
        let points = sample(simplified, self.points.len(), self.seed)?;
        let surface = surface_of(simplified).ok()?;
        let (mean_forth, max_forth) = distances(&self.points, &surface);
        let (mean_back, max_back) = distances(&points, &self.surface);
        let share = |distance: f64| distance / self.diagonal;
        Some(SurfaceError {
            mean_forth: share(mean_forth),
            max_forth: share(max_forth),
            mean_back: share(mean_back),
            max_back: share(max_back),
        })
    }
}

/// A mesh as parry's.
fn surface_of(mesh: &Topology) -> Result<TriMesh> {
    let vertices = mesh.positions.iter().map(|&p| vector(p)).collect();
    TriMesh::new(vertices, mesh.triangles.clone()).context("a mesh without triangles")
}

/// The same vector in the version of glam that parry uses.
fn vector(v: Vec3) -> Vector {
    Vector::from_array(v.to_array())
}

/// Mean and greatest distance of points from a surface.
fn distances(points: &[Vec3], surface: &TriMesh) -> (f64, f64) {
    let distance = |&point: &Vec3| {
        let point = vector(point);
        f64::from((surface.project_local_point(point, false).point - point).length())
    };
    // Collected first: a parallel sum depends on who adds what.
    let all: Vec<f64> = points.par_iter().map(distance).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    (mean, all.into_iter().fold(0.0, f64::max))
}

/// Points drawn uniformly by area; `None` if there is none.
fn sample(mesh: &Topology, count: usize, seed: u64) -> Option<Vec<Vec3>> {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize]);
    let mut total = 0.0;
    let areas = mesh.triangles.iter().map(|t| {
        let [a, b, c] = corners(t);
        total += f64::from((b - a).cross(c - a).length());
        total
    });
    let areas: Vec<f64> = areas.collect();
    if total <= 0.0 {
        return None;
    }
    let mut random = fastrand::Rng::with_seed(seed);
    let mut point = || {
        let place = random.f64() * total;
        let triangle = areas.partition_point(|&area| area <= place).min(areas.len() - 1);
        let [a, b, c] = corners(&mesh.triangles[triangle]);
        // Osada et al., "Shape distributions" (2002), section 4.2.
        let (root, along) = (random.f32().sqrt(), random.f32());
        a * (1.0 - root) + b * (root * (1.0 - along)) + c * (root * along)
    };
    Some((0..count).map(|_| point()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 2000;

    /// A square of side 2 at a height.
    fn square(height: f32) -> Topology {
        let at = |x: f32, y: f32| Vec3::new(x, y, height);
        Topology {
            positions: vec![at(0.0, 0.0), at(2.0, 0.0), at(2.0, 2.0), at(0.0, 2.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn a_known_displacement_is_found_both_ways() {
        let reference = Reference::new(&square(0.0), SAMPLES, 1).unwrap();
        let error = reference.compare(&square(0.25)).unwrap();
        let expected = 0.25 / 8_f64.sqrt();
        for found in [error.mean_forth, error.max_forth, error.mean_back, error.max_back] {
            assert!((found - expected).abs() < 1e-6, "{error:?}");
        }
        assert!(reference.compare(&square(0.0)).unwrap().max() < 1e-6);
    }

    #[test]
    fn a_missing_half_is_seen_from_the_original_alone() {
        let mut half = square(0.0);
        half.triangles.pop();
        let reference = Reference::new(&square(0.0), SAMPLES, 1).unwrap();
        let error = reference.compare(&half).unwrap();
        assert!(error.max_back < 1e-6);
        // The farthest point of the other half is sqrt(2) from the diagonal,
        // the mean over it a third of that, over both halves a sixth.
        let diagonal = 8_f64.sqrt();
        assert!((error.max_forth - 2_f64.sqrt() / diagonal).abs() < 0.03, "{error:?}");
        assert!((error.mean_forth - 2_f64.sqrt() / 6.0 / diagonal).abs() < 0.01, "{error:?}");
    }

    #[test]
    fn nothing_left_has_no_error() {
        let mut empty = square(0.0);
        empty.triangles.clear();
        let reference = Reference::new(&square(0.0), SAMPLES, 1).unwrap();
        assert!(reference.compare(&empty).is_none());
    }
}
