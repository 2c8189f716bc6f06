//! Back-face culling of triangles in blocks, by quantised normals.

use std::ops::Range;

use busbar_geometry::{Bounds, Mesh};
use glam::Vec3;

/// Triangles that are in the picture or not, and are written, together.
const BLOCK: usize = 64;

/// Length of a normal that is kept in whole numbers.
const NORMAL_SCALE: f32 = 127.0;

/// Length of a way to the eye in whole numbers: times [`NORMAL_SCALE`] it fits 16 bits.
const EYE_SCALE: f32 = 255.0;

/// Tolerance of the conservative back-face test on quantised normals and directions, as a share of
/// the distance: half a step along each axis of either, and rounding.
const BACK_FACE_TOLERANCE: f32 = 0.0107;

/// Quantised normals and bounds of triangles, in blocks of a fixed number of triangles.
pub struct TriangleBlocks {
    blocks: Vec<Block>,
    /// Number of triangles in all blocks.
    count: usize,
}

/// Culling data of up to [`BLOCK`] triangles, mesh space.
struct Block {
    /// Quantised face normals, axis by axis, each [`NORMAL_SCALE`] long.
    normals: [[i8; BLOCK]; 3],
    bounds: Bounds,
}

impl TriangleBlocks {
    /// Prepares the triangles of a mesh, given as wedge indices.
    pub fn new(mesh: &Mesh, triangles: &[[u32; 3]]) -> Self {
        let corners = |&triangle: &[u32; 3]| {
            mesh.corner_positions(triangle).map(|position| mesh.positions[position as usize])
        };
        let block = |triangles: &[[u32; 3]]| {
            let bounds =
                Bounds::from_points(triangles.iter().flat_map(corners)).unwrap_or_default();
            let mut normals = [[0; BLOCK]; 3];
            for (at, triangle) in triangles.iter().enumerate() {
                let [a, b, c] = corners(triangle);
                let normal = (b - a).cross(c - a).normalize_or_zero() * NORMAL_SCALE;
                for (axis, of_axis) in normals.iter_mut().zip(normal.to_array()) {
                    axis[at] = of_axis.round() as i8;
                }
            }
            Block { normals, bounds }
        };
        Self { blocks: triangles.chunks(BLOCK).map(block).collect(), count: triangles.len() }
    }

    /// Returns the number of triangles.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns the bytes of the blocks of so many triangles.
    pub fn bytes_of(triangles: usize) -> u64 {
        (triangles.div_ceil(BLOCK) * size_of::<Block>()) as u64
    }
}

impl TriangleBlocks {
    /// Writes the triangles of a range that may be visible: of blocks with wanted bounds those that
    /// may face an eye, or all without an eye. Returns their number.
    pub fn cull_into(
        &self,
        triangles: &[[u32; 3]],
        range: Range<usize>,
        eye: Option<Vec3>,
        is_wanted: impl Fn(&Bounds) -> bool,
        into: &mut [[u32; 3]],
    ) -> usize {
        let mut count = 0;
        let mut start = range.start;
        while start < range.end {
            let first = start / BLOCK * BLOCK;
            let end = (first + BLOCK).min(range.end);
            let block = &self.blocks[first / BLOCK];
            let triangles = &triangles[start..end];
            let within = start - first..end - first;
            start = end;
            if !is_wanted(&block.bounds) {
                continue;
            }
            let into = &mut into[count..][..triangles.len()];
            let Some(eye) = eye else {
                into.copy_from_slice(triangles);
                count += triangles.len();
                continue;
            };
            let (before, behind) = block.facing_scores(eye);
            let mut kept = 0;
            for (triangle, before) in triangles.iter().zip(&before[within]) {
                into[kept] = *triangle;
                kept += usize::from(*before >= behind);
            }
            count += kept;
        }
        count
    }
}

impl Block {
    /// Computes the facing score of each triangle to an eye, and the threshold below which a
    /// triangle is certainly back-facing.
    fn facing_scores(&self, eye: Vec3) -> ([i16; BLOCK], i16) {
        // From a triangle it is seen as from the middle, but for this.
        let to_eye = eye - self.bounds.center();
        let distance = to_eye.length();
        let aside =
            self.bounds.min.distance(self.bounds.max) * 0.5 / distance + BACK_FACE_TOLERANCE;
        let [to_x, to_y, to_z] =
            (to_eye * (EYE_SCALE / distance)).to_array().map(|of_axis| of_axis.round() as i16);
        let [xs, ys, zs] = &self.normals;
        let before = std::array::from_fn(|at| {
            let [x, y, z] = [xs[at], ys[at], zs[at]].map(i16::from);
            // No normal and no way is longer than fits.
            x.wrapping_mul(to_x)
                .wrapping_add(y.wrapping_mul(to_y))
                .wrapping_add(z.wrapping_mul(to_z))
        });
        (before, (-aside * EYE_SCALE * NORMAL_SCALE).floor() as i16)
    }
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{RawPrimitive, weld};
    use proptest::prelude::*;

    use super::*;

    fn mesh(corners: &[[[f32; 3]; 3]]) -> Mesh {
        let primitive = RawPrimitive {
            positions: corners.iter().flatten().map(|&corner| corner.into()).collect(),
            triangles: (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..RawPrimitive::default()
        };
        weld(&[primitive]).unwrap().0
    }

    fn blocks_of(mesh: &Mesh) -> TriangleBlocks {
        TriangleBlocks::new(mesh, &mesh.triangles)
    }

    proptest! {
        /// In order, and none that shows its front to the eye is missed, nor one of a block
        /// that is not wanted given.
        #[test]
        fn what_faces_the_eye_is_kept(
            corners in prop::collection::vec(
                prop::array::uniform3(prop::array::uniform3(-9.0_f32..9.0)), 1..150),
            eye in prop::array::uniform3(-99.0_f32..99.0),
            first in 0_usize..150,
            unwanted in 0_usize..3,
        ) {
            let mesh = mesh(&corners);
            let blocks = blocks_of(&mesh);
            let range = first.min(mesh.triangles.len())..mesh.triangles.len();
            let mut all = vec![[0; 3]; range.len()];
            let mut kept = all.clone();
            let triangles = &mesh.triangles;
            let count = blocks.cull_into(triangles, range.clone(), None, |_| true, &mut all);
            prop_assert_eq!(count, all.len());
            prop_assert_eq!(&all, &mesh.triangles[range.clone()]);
            let boxes: Vec<Bounds> = blocks.blocks.iter().map(|block| block.bounds).collect();
            let is_wanted = |bounds: &Bounds| Some(bounds) != boxes.get(unwanted);
            let from = Some(eye.into());
            let count =
                blocks.cull_into(triangles, range.clone(), from, is_wanted, &mut kept);
            kept.truncate(count);
            let eye = Vec3::from(eye).as_dvec3();
            let mut left = kept.iter().peekable();
            for (number, triangle) in range.clone().zip(&all) {
                let corners = mesh.corner_positions(*triangle);
                let [a, b, c] = corners.map(|p| mesh.positions[p as usize].as_dvec3());
                let before = (b - a).cross(c - a).normalize_or_zero().dot(eye - a);
                let is_kept = left.next_if(|kept| *kept == triangle).is_some();
                if number / BLOCK == unwanted {
                    prop_assert!(!is_kept);
                    continue;
                }
                prop_assert!(is_kept || before <= 0.0, "{before}");
                // Of small blocks, those that face away are left out.
                let bounds = &boxes[number / BLOCK];
                let size = f64::from(bounds.min.distance(bounds.max));
                let slack = size + 0.02 * (size + a.distance(eye));
                prop_assert!(!is_kept || before >= -slack, "{before} {slack}");
            }
            prop_assert_eq!(left.next(), None);
        }
    }

    #[test]
    fn an_eye_that_is_nowhere_sees_all() {
        let mesh = mesh(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
        let mut kept = [[0; 3]];
        let blocks = blocks_of(&mesh);
        let eye = Some(Vec3::NAN);
        let count = blocks.cull_into(&mesh.triangles, 0..1, eye, |_| true, &mut kept);
        assert_eq!((count, kept[0]), (1, mesh.triangles[0]));
    }
}
