//! CPU triangle culling: on software rasterizers, the meshes of one model are batched into one
//! indexed draw after back-face and occlusion culling.
//!
//! A software rasterizer pays for each draw, and for each triangle that is back-facing, off screen
//! or occluded. Neighbouring draws that differ only in their triangles are merged. Instances of
//! large meshes are culled one by one, since each has other triangles hidden.

use std::cell::Cell;
use std::ops::Range;

use busbar_geometry::{Bounds, Mesh};
use busbar_gpu::{Buffer, BufferSlice, BufferUsage, Gpu};
use busbar_shaders::Instance;
use glam::{Mat4, Vec3};

use crate::draw_plan::Batch;
use crate::visibility::{OcclusionTest, world_from_mesh};
use crate::{CameraView, RenderError};

/// Triangles of the largest mesh that takes part in CPU culling.
const MAX_MESH_TRIANGLES: usize = 65_536;

/// Triangles of an instance that it pays to gather by itself where there are more instances:
/// where large faces hide some, and where all that is nearer does.
const MIN_TRIANGLES_BY_FACES: usize = 1024;
const MIN_TRIANGLES_BY_DEPTH: usize = 64;

/// More live triangles than there are.
pub(crate) const NEVER_CULLED: usize = usize::MAX;

/// Triangles that one frame culls; further ones are drawn without culling.
const MAX_FRAME_TRIANGLES: u32 = 2 << 20;

/// Triangles that the first buffer of a frame holds.
const FIRST_TRIANGLES: u32 = 16_384;

/// Triangles that are in the picture or not, and are written, together.
const BLOCK: usize = 64;

/// Length of a normal that is kept in whole numbers.
const NORMAL_SCALE: f32 = 127.0;

/// Length of a way to the eye in whole numbers: times [`NORMAL_SCALE`] it fits 16 bits.
const EYE_SCALE: f32 = 255.0;

/// Tolerance of the conservative back-face test on quantised normals and directions, as a share of
/// the distance: half a step along each axis of either, and rounding.
const BACK_FACE_TOLERANCE: f32 = 0.0107;

/// Bytes of a triangle's indices.
const TRIANGLE_BYTES: u64 = size_of::<[u32; 3]>() as u64;

/// Live triangles of a mesh as the processor sees them.
pub(crate) struct CullableTriangles {
    /// In sight of it.
    indices: BufferSlice,
    blocks: TriangleBlocks,
}

/// Quantised normals and bounds of triangles, in blocks of [`BLOCK`].
pub(crate) struct TriangleBlocks {
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
    pub(crate) fn new(mesh: &Mesh, triangles: &[[u32; 3]]) -> Self {
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

    /// Returns the bytes of the blocks of so many triangles.
    pub(crate) fn bytes_of(triangles: usize) -> u64 {
        (triangles.div_ceil(BLOCK) * size_of::<Block>()) as u64
    }
}

impl CullableTriangles {
    /// Pairs indices with their blocks; `None` where the processor cannot read the indices.
    pub(crate) fn new(indices: &BufferSlice, blocks: TriangleBlocks) -> Option<Self> {
        indices.is_host_visible().then(|| Self { indices: indices.clone(), blocks })
    }

    /// Reports whether a batch is culled: one instance, or instances of enough triangles for the
    /// occlusion test to pay. Vertices must not be morphed.
    pub(crate) fn is_culled_for(
        &self,
        batch: &Batch,
        occlusion_test: Option<OcclusionTest<'_>>,
    ) -> bool {
        let fits = self.count_of(batch) <= u64::from(MAX_FRAME_TRIANGLES);
        let least = match occlusion_test {
            None => NEVER_CULLED,
            Some(OcclusionTest::LargeFaces(_)) => MIN_TRIANGLES_BY_FACES,
            Some(OcclusionTest::FirstPassDepth(_)) => MIN_TRIANGLES_BY_DEPTH,
        };
        let pays = || self.count() >= least && fits;
        batch.morph.is_none() && (batch.instances.len() == 1 || pays())
    }

    fn count(&self) -> usize {
        self.blocks.count
    }

    /// Counts the triangles of all instances of a batch.
    pub(crate) fn count_of(&self, batch: &Batch) -> u64 {
        self.count() as u64 * batch.instances.len() as u64
    }

    pub(crate) fn bytes(&self) -> u64 {
        TriangleBlocks::bytes_of(self.count())
    }
}

impl TriangleBlocks {
    /// Writes the triangles of a range that may be visible: of blocks with wanted bounds those that
    /// may face an eye, or all without an eye. Returns their number.
    fn cull_into(
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

/// Triangle culler of one frame, with the index buffer that it fills.
pub(crate) struct TriangleCuller<'a> {
    buffer: &'a Buffer,
    /// World space; `None` where there is no one point that all is seen from.
    eye: Option<Vec3>,
    /// Occlusion test; `None` without occlusion culling.
    occlusion_test: Option<OcclusionTest<'a>>,
    /// Number of triangles written to the buffer.
    taken: Cell<u32>,
}

/// Range of a mesh's triangles to be culled and batched.
#[derive(Clone)]
pub(crate) struct CulledRange<'a> {
    pub(crate) faces: &'a CullableTriangles,
    /// Range of triangles within the mesh.
    pub(crate) range: Range<u32>,
    /// Added to each index.
    pub(crate) first_vertex: u32,
    /// Index of the instance's [`InstanceView`].
    pub(crate) view: u32,
    /// Back-face culling: back-facing triangles are left out.
    pub(crate) culls_back_faces: bool,
}

/// Eye and transform of an instance, as culling needs them.
#[derive(Clone, Copy)]
pub(crate) struct InstanceView {
    /// Position of the eye in mesh space.
    eye: Option<Vec3>,
    /// Clip space from that of the mesh, where something is hidden.
    clip_from_mesh: Option<Mat4>,
}

impl<'a> TriangleCuller<'a> {
    pub(crate) fn new(
        buffer: &'a Buffer,
        camera: &CameraView,
        occlusion_test: Option<OcclusionTest<'a>>,
    ) -> Self {
        let eye = (!camera.is_orthographic()).then_some(camera.eye);
        Self { buffer, eye, occlusion_test, taken: Cell::new(0) }
    }

    pub(crate) fn view_of(&self, instance: &Instance) -> InstanceView {
        let eye = self.eye.map(|eye| world_from_mesh(instance).inverse().transform_point3(eye));
        InstanceView {
            eye,
            clip_from_mesh: self
                .occlusion_test
                .map(|occlusion_test| occlusion_test.clip_from_mesh(instance)),
        }
    }

    /// Returns the occlusion test, if occlusion culling is on.
    pub(crate) fn occlusion_test(&self) -> Option<OcclusionTest<'a>> {
        self.occlusion_test
    }

    pub(crate) fn buffer(&self) -> &'a Buffer {
        self.buffer
    }

    /// Culls parts one after the other into the buffer. Returns the range of indices, or `None`
    /// where the buffer has no room.
    pub(crate) fn cull<'p>(
        &self,
        parts: impl Iterator<Item = &'p CulledRange<'p>> + Clone,
        views: &[InstanceView],
    ) -> Result<Option<Range<u32>>, RenderError> {
        let most: u64 = parts.clone().map(|part| part.range.len() as u64).sum();
        let first = self.taken.get();
        let start = u64::from(first) * TRIANGLE_BYTES;
        if start + most * TRIANGLE_BYTES > self.buffer.size() {
            return Ok(None);
        }
        let (mut count, mut done) = (0, Ok(()));
        self.buffer.write_with(start, most * TRIANGLE_BYTES, |into| {
            // Index buffers begin at multiples of four bytes, and slices of them of 256.
            let places: &mut [[u32; 3]] = bytemuck::cast_slice_mut(into);
            done = parts.into_iter().try_for_each(|part| {
                let CulledRange { faces, range, first_vertex, view, culls_back_faces } = part;
                let view = &views[*view as usize];
                let eye = view.eye.filter(|_| *culls_back_faces);
                let hidden = self.occlusion_test.zip(view.clip_from_mesh.as_ref());
                let is_wanted = |bounds: &Bounds| {
                    hidden.is_none_or(|(occlusion_test, clip)| {
                        occlusion_test.is_box_visible(clip, bounds)
                    })
                };
                let range = range.start as usize..range.end as usize;
                faces.indices.read_with(|bytes| {
                    let triangles = bytemuck::cast_slice(bytes);
                    let places = &mut places[count..];
                    let added = faces.blocks.cull_into(triangles, range, eye, is_wanted, places);
                    for corner in places[..added].as_flattened_mut() {
                        *corner += first_vertex;
                    }
                    count += added;
                })
            });
        })?;
        done?;
        let end = first + count as u32;
        self.taken.set(end);
        Ok(Some(3 * first..3 * end))
    }
}

/// Returns the least number of live triangles from which a mesh is culled on software rasterizers.
/// Parts of a model always are; single meshes where it pays. Very large meshes never are: they gain
/// little, and their normals would take memory.
pub(crate) fn min_culled_triangles(mesh: &Mesh, is_part: bool) -> usize {
    match mesh.triangles.len() {
        ..=MAX_MESH_TRIANGLES if is_part => 0,
        ..=MAX_MESH_TRIANGLES => MIN_TRIANGLES_BY_DEPTH,
        _ => NEVER_CULLED,
    }
}

/// Makes room for so many triangles, up to the limit of a frame.
pub(crate) fn reserve(
    buffer: &mut Option<Buffer>,
    gpu: &Gpu,
    triangles: u64,
) -> Result<(), RenderError> {
    let room = buffer.as_ref().map_or(0, |buffer| buffer.size() / TRIANGLE_BYTES);
    let wanted = triangles.min(u64::from(MAX_FRAME_TRIANGLES));
    if wanted > room {
        let bytes = wanted.next_power_of_two().max(FIRST_TRIANGLES.into()) * TRIANGLE_BYTES;
        *buffer = Some(Buffer::new(gpu, "culled indices", BufferUsage::HostIndex, bytes)?);
    }
    Ok(())
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
