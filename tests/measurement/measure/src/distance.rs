//! Distances between two surfaces by sampling, in both directions.

use anyhow::{Context, Result, ensure};
use busbar_geometry::{Bounds, Topology};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::triangle_tree::{ClosestPoint, TriangleTree};

/// Tolerance within which places count as one, as a share of the diagonal.
const TIE: f64 = 1e-6;

/// Distances between an original and a simplified surface, relative to the
/// diagonal of the box around the original, and how far normals turn.
/// *Forth* is from points of the original to the simplified surface, *back* from
/// points of that to the original.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SurfaceError {
    /// Mean distance from the original to the simplified surface.
    pub mean_forth: f64,
    /// Root mean square distance from the original to the simplified surface.
    pub rms_forth: f64,
    /// Greatest distance from the original to the simplified surface.
    pub max_forth: f64,
    /// Mean angle between the normals of faces forth, degrees.
    pub degrees_forth: f64,
    /// Mean distance from the simplified surface to the original.
    pub mean_back: f64,
    /// Root mean square distance from the simplified surface to the original.
    pub rms_back: f64,
    /// Greatest distance from the simplified surface to the original.
    pub max_back: f64,
    /// Mean angle between the normals of faces back, degrees.
    pub degrees_back: f64,
}

impl SurfaceError {
    /// Returns the larger of both means.
    pub fn mean(&self) -> f64 {
        self.mean_forth.max(self.mean_back)
    }

    /// Returns the larger of both maxima: Hausdorff's distance, as far as sampled.
    pub fn max(&self) -> f64 {
        self.max_forth.max(self.max_back)
    }

    /// Returns the mean over the samples of both directions.
    pub fn mean_of_both(&self) -> f64 {
        (self.mean_forth + self.mean_back) / 2.0
    }

    /// Returns the root mean square over the samples of both directions.
    pub fn rms_of_both(&self) -> f64 {
        ((self.rms_forth.powi(2) + self.rms_back.powi(2)) / 2.0).sqrt()
    }

    /// Returns the mean angle over the samples of both directions, degrees.
    pub fn degrees_of_both(&self) -> f64 {
        (self.degrees_forth + self.degrees_back) / 2.0
    }
}

/// Reference surface with sample points, to compare others with.
pub struct Reference {
    surface: TriangleTree,
    samples: Vec<Sample>,
    diagonal: f64,
    seed: u64,
}

/// Sample point on a surface.
#[derive(Clone, Copy, Debug)]
struct Sample {
    point: DVec3,
    normal: DVec3,
}

impl Reference {
    /// Draws `samples` points, uniformly by area.
    ///
    /// # Errors
    /// When the mesh has no surface.
    pub fn new(original: &Topology, samples: usize, seed: u64) -> Result<Self> {
        let bounds = Bounds::from_points(original.positions.iter().copied());
        let diagonal = bounds.map_or(0.0, |b| (b.max - b.min).as_dvec3().length());
        let samples = sample(original, samples, seed).context("the original has no surface")?;
        ensure!(diagonal > 0.0, "the original has no size");
        Ok(Self { surface: TriangleTree::build(original), samples, diagonal, seed })
    }

    /// Returns the diagonal of the original's bounding box, metres.
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// Compares a simplified mesh; `None` if it has no surface left.
    pub fn compare(&self, simplified: &Topology) -> Option<SurfaceError> {
        let samples = sample(simplified, self.samples.len(), self.seed)?;
        let surface = TriangleTree::build(simplified);
        let forth = self.one_sided_error(&self.samples, &surface);
        let back = self.one_sided_error(&samples, &self.surface);
        Some(SurfaceError {
            mean_forth: forth.mean,
            rms_forth: forth.rms,
            max_forth: forth.max,
            degrees_forth: forth.degrees,
            mean_back: back.mean,
            rms_back: back.rms,
            max_back: back.max,
            degrees_back: back.degrees,
        })
    }

    fn one_sided_error(&self, samples: &[Sample], surface: &TriangleTree) -> OneSidedError {
        let tolerance = self.diagonal * TIE;
        let place = |sample: &Sample| surface.nearest(sample.point, sample.normal, tolerance);
        // Collected first: a parallel sum depends on who adds what.
        let places: Vec<ClosestPoint> = samples.par_iter().map(place).collect();
        let count = samples.len().max(1) as f64;
        let distances = || places.iter().map(|place| place.distance / self.diagonal);
        let angle = |(sample, place): (&Sample, &ClosestPoint)| {
            let cosine = sample.normal.dot(place.normal).clamp(-1.0, 1.0);
            cosine.acos().to_degrees()
        };
        OneSidedError {
            mean: distances().sum::<f64>() / count,
            rms: (distances().map(|d| d * d).sum::<f64>() / count).sqrt(),
            max: distances().fold(0.0, f64::max),
            degrees: samples.iter().zip(&places).map(angle).sum::<f64>() / count,
        }
    }
}

/// Distances of one direction.
struct OneSidedError {
    mean: f64,
    rms: f64,
    max: f64,
    degrees: f64,
}

/// Draws points by area, one in each of `count` equal shares of it; `None` if there is no area.
fn sample(mesh: &Topology, count: usize, seed: u64) -> Option<Vec<Sample>> {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize].as_dvec3());
    let mut total = 0.0;
    let areas = mesh.triangles.iter().map(|t| {
        let [a, b, c] = corners(t);
        total += (b - a).cross(c - a).length();
        total
    });
    let areas: Vec<f64> = areas.collect();
    if total <= 0.0 {
        return None;
    }
    let mut random = fastrand::Rng::with_seed(seed);
    let mut draw = |index: usize| {
        let place = (index as f64 + random.f64()) / count as f64 * total;
        let triangle = areas.partition_point(|&area| area <= place).min(areas.len() - 1);
        let [a, b, c] = corners(&mesh.triangles[triangle]);
        // Osada et al., "Shape distributions" (2002), section 4.2.
        let (root, along) = (random.f64().sqrt(), random.f64());
        let point = a * (1.0 - root) + b * (root * (1.0 - along)) + c * (root * along);
        Sample { point, normal: (b - a).cross(c - a).normalize_or_zero() }
    };
    Some((0..count).map(&mut draw).collect())
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    const SAMPLES: usize = 2000;

    /// Returns a square of side 2 at a height.
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
        let found = [
            error.mean_forth,
            error.rms_forth,
            error.max_forth,
            error.mean_back,
            error.rms_back,
            error.max_back,
        ];
        assert!(found.iter().all(|found| (found - expected).abs() < 1e-9), "{error:?}");
        assert!(error.degrees_of_both() < 1e-4, "{error:?}");
        assert!(reference.compare(&square(0.0)).unwrap().max() < 1e-9);
    }

    #[test]
    fn a_missing_half_is_seen_from_the_original_alone() {
        let mut half = square(0.0);
        half.triangles.pop();
        let reference = Reference::new(&square(0.0), SAMPLES, 1).unwrap();
        let error = reference.compare(&half).unwrap();
        assert!(error.max_back < 1e-9);
        // The farthest point of the other half is sqrt(2) from the diagonal,
        // the mean over it a third of that, over both halves a sixth; of the
        // squares a sixth over it, over both a twelfth.
        let diagonal = 8_f64.sqrt();
        assert!((error.max_forth - 2_f64.sqrt() / diagonal).abs() < 0.03, "{error:?}");
        assert!((error.mean_forth - 2_f64.sqrt() / 6.0 / diagonal).abs() < 0.01, "{error:?}");
        let rms = (2.0 / 12.0_f64).sqrt() / diagonal;
        assert!((error.rms_forth - rms).abs() < 0.01, "{error:?}");
        assert!(error.rms_of_both() >= error.mean_of_both());
    }

    #[test]
    fn a_turned_surface_has_its_angle() {
        let mut turned = square(0.0);
        // About the x axis by 30 degrees.
        for point in &mut turned.positions {
            *point = Vec3::new(point.x, point.y * 0.75_f32.sqrt(), point.y * 0.5);
        }
        let reference = Reference::new(&square(0.0), SAMPLES, 1).unwrap();
        let error = reference.compare(&turned).unwrap();
        assert!((error.degrees_of_both() - 30.0).abs() < 1e-3, "{error:?}");
        let mut inside_out = square(0.0);
        inside_out.triangles.iter_mut().for_each(|t| t.reverse());
        assert!((reference.compare(&inside_out).unwrap().degrees_forth - 180.0).abs() < 1e-3);
    }

    #[test]
    fn nothing_left_has_no_error() {
        let mut empty = square(0.0);
        empty.triangles.clear();
        let reference = Reference::new(&square(0.0), SAMPLES, 1).unwrap();
        assert!(reference.compare(&empty).is_none());
    }
}
