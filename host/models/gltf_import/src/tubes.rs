//! Lines and points as slender tubes, which the renderer draws a pixel wide from afar.

use glam::Vec3;

/// Sides of a tube: with five it is round enough to be taken for a slender island.
const SIDES: usize = 5;
/// Triangles of a tube, which has no ends.
pub(crate) const TRIANGLES_OF_TUBE: usize = 2 * SIDES;

/// Length over radius of the thickest tube; slender islands begin at a quarter of it.
const SLENDERNESS: f32 = 240.0;
/// Largest radius of a line, metres.
const MAX_RADIUS: f32 = 0.001;
/// Length of a point's tube as a share of the diagonal around all points.
const POINT_SHARE: f32 = 0.001;
/// Smallest radius as a share of the coordinates: less is lost in their last bits.
const MIN_SHARE: f32 = 4e-7;

/// Tubes around lines: for each vertex the vertex of the file, and the way from there.
pub(crate) struct Tubes {
    pub(crate) sources: Vec<usize>,
    pub(crate) offsets: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Tubes {
    /// Makes tubes around segments; one that ends where it begins is a point.
    pub(crate) fn new(segments: &[[u32; 2]], position: impl Fn(usize) -> Vec3) -> Self {
        let points = || segments.as_flattened().iter().map(|&vertex| position(vertex as usize));
        let low = points().fold(Vec3::INFINITY, Vec3::min);
        let high = points().fold(Vec3::NEG_INFINITY, Vec3::max);
        let diagonal = if segments.is_empty() { 0.0 } else { low.distance(high) };
        let point_length = if diagonal > 0.0 { diagonal * POINT_SHARE } else { POINT_SHARE };
        let mut tubes = Self { sources: Vec::new(), offsets: Vec::new(), triangles: Vec::new() };
        for &[from, to] in segments {
            let ends = [from, to].map(|vertex| position(vertex as usize));
            let [start, end] = ends;
            let (axis, half) = match (end - start).try_normalize() {
                Some(axis) => (axis, 0.0),
                None => (Vec3::Y, 0.5 * point_length),
            };
            let length = start.distance(end) + 2.0 * half;
            let size = start.abs().max(end.abs()).max_element();
            let radius = (length / SLENDERNESS).min(MAX_RADIUS).max(size * MIN_SHARE);
            tubes.add([from, to], axis, half, radius);
        }
        tubes
    }

    /// Adds a tube that is longer by `half` at both ends.
    fn add(&mut self, ends: [u32; 2], axis: Vec3, half: f32, radius: f32) {
        let first = self.sources.len() as u32;
        let across = axis.any_orthonormal_vector();
        let beside = axis.cross(across);
        for (vertex, along) in ends.into_iter().zip([-half, half]) {
            for side in 0..SIDES {
                let angle = std::f32::consts::TAU * side as f32 / SIDES as f32;
                let outward = across * angle.cos() + beside * angle.sin();
                self.sources.push(vertex as usize);
                self.offsets.push(outward * radius + axis * along);
            }
        }
        let sides = SIDES as u32;
        for side in 0..sides {
            let next = (side + 1) % sides;
            let [a, b] = [first + side, first + next];
            self.triangles.push([a, b, b + sides]);
            self.triangles.push([a, b + sides, a + sides]);
        }
    }
}
