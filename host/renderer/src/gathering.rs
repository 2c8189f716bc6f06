//! Where the processor draws, each draw costs time, and so does a triangle that faces away from
//! the eye, is beside the picture or hidden. So small draws beside each other that differ in
//! their triangles alone are gathered into one, without those.

use std::cell::Cell;
use std::ops::Range;

use busbar_geometry::{Bounds, Mesh};
use busbar_gpu::{Buffer, BufferUsage, Gpu};
use busbar_shaders::Instance;
use glam::{Mat4, Vec3, Vec4};

use crate::batch::Batch;
use crate::sight::{Before, world_from_mesh};
use crate::{CameraView, RenderError};

/// Triangles of the largest mesh that is gathered.
const MAX_MESH_TRIANGLES: usize = 65_536;

/// Triangles of an instance that it pays to gather by itself where there are more instances.
const LEAST_BY_ITSELF: usize = 1024;

/// Triangles that a frame gathers; what is beyond is drawn as it is.
const MAX_FRAME_TRIANGLES: u32 = 2 << 20;

/// Triangles that the first buffer of a frame holds.
const FIRST_TRIANGLES: u32 = 16_384;

/// Triangles that are in the picture or not, and are written, together.
const BLOCK: usize = 64;

/// Of distances that are this share of all involved, the sign may be wrong.
const ROUNDING: f32 = 1e-5;

/// Bytes of a triangle's indices.
const TRIANGLE_BYTES: u64 = size_of::<[u32; 3]>() as u64;

/// Live triangles of a mesh as the processor sees them.
pub(crate) struct Faces {
    triangles: Vec<[u32; 3]>,
    outlook: Outlook,
}

/// Where triangles are and whence they are seen.
pub(crate) struct Outlook {
    /// Of each, the normal and distance of its plane, mesh space: a point before it has a
    /// product above zero.
    planes: Vec<Vec4>,
    /// The farthest plane from the origin.
    reach: f32,
    /// Around each [`BLOCK`] of them, mesh space.
    boxes: Vec<Bounds>,
}

impl Outlook {
    pub(crate) fn of(mesh: &Mesh, triangles: &[[u32; 3]]) -> Self {
        let corners = |&triangle: &[u32; 3]| {
            mesh.corner_positions(triangle).map(|position| mesh.positions[position as usize])
        };
        let plane = |triangle: &[u32; 3]| {
            let [a, b, c] = corners(triangle);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            normal.extend(-normal.dot(a))
        };
        let around = |block: &[[u32; 3]]| {
            Bounds::around(block.iter().flat_map(corners)).unwrap_or_default()
        };
        let planes: Vec<Vec4> = triangles.iter().map(plane).collect();
        let reach = planes.iter().fold(0.0, |reach, plane| plane.w.abs().max(reach));
        Self { planes, reach, boxes: triangles.chunks(BLOCK).map(around).collect() }
    }

    /// Bytes of that of so many triangles.
    pub(crate) fn bytes_of(triangles: usize) -> u64 {
        (triangles * size_of::<Vec4>() + triangles.div_ceil(BLOCK) * size_of::<Bounds>()) as u64
    }
}

impl Faces {
    pub(crate) fn of(triangles: Vec<[u32; 3]>, outlook: Outlook) -> Self {
        Self { triangles, outlook }
    }

    /// Whether they are gathered: those of one instance, or so many that it pays to look at
    /// each instance by itself. Their vertices are the mesh's own.
    pub(crate) fn are_gathered_of(&self, batch: &Batch) -> bool {
        let is_worth_it = batch.instances.len() == 1 || self.triangles.len() >= LEAST_BY_ITSELF;
        is_worth_it && batch.way.is_none()
    }

    /// Triangles of all instances of a batch.
    pub(crate) fn count_of(&self, batch: &Batch) -> u64 {
        self.triangles.len() as u64 * batch.instances.len() as u64
    }

    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.triangles.as_slice()) as u64 + Outlook::bytes_of(self.triangles.len())
    }

    /// Gives the triangles of a range, at most a block at a time: of blocks whose boxes are
    /// wanted those that may face an eye, or all where there is none.
    fn facing(
        &self,
        range: Range<usize>,
        eye: Option<Vec3>,
        is_wanted: impl Fn(&Bounds) -> bool,
        mut give: impl FnMut(&[[u32; 3]]),
    ) {
        let Outlook { planes, reach, boxes } = &self.outlook;
        let mut start = range.start;
        while start < range.end {
            let block = start / BLOCK;
            let end = ((block + 1) * BLOCK).min(range.end);
            let (triangles, planes) = (&self.triangles[start..end], &planes[start..end]);
            start = end;
            if !is_wanted(&boxes[block]) {
                continue;
            }
            let Some(eye) = eye else {
                give(triangles);
                continue;
            };
            let behind = -ROUNDING * (eye.length() + reach);
            let eye = eye.extend(1.0);
            let mut kept = [[0; 3]; BLOCK];
            let mut count = 0;
            for (triangle, plane) in triangles.iter().zip(planes) {
                kept[count] = *triangle;
                // What is not a number does not.
                let faces_away = plane.dot(eye) < behind;
                count += usize::from(!faces_away);
            }
            give(&kept[..count]);
        }
    }
}

/// What a frame gathers.
pub(crate) struct Gathering<'a> {
    buffer: &'a Buffer,
    /// World space; `None` where there is no one point that all is seen from.
    eye: Option<Vec3>,
    /// `None` where nothing is hidden.
    before: Option<&'a Before>,
    /// Triangles in it.
    taken: Cell<u32>,
}

/// A part of a mesh to be gathered.
#[derive(Clone)]
pub(crate) struct Gathered<'a> {
    pub(crate) faces: &'a Faces,
    /// Triangles.
    pub(crate) range: Range<u32>,
    /// Added to each index.
    pub(crate) first_vertex: u32,
    pub(crate) view: View,
    /// Those that face away are left out.
    pub(crate) skips_backs: bool,
}

/// How an instance is seen.
#[derive(Clone, Copy)]
pub(crate) struct View {
    /// Mesh space.
    eye: Option<Vec3>,
    /// Clip space from that of the mesh, where something is hidden.
    clip_from_mesh: Option<Mat4>,
}

impl<'a> Gathering<'a> {
    pub(crate) fn into(
        buffer: &'a Buffer,
        camera: &CameraView,
        before: Option<&'a Before>,
    ) -> Self {
        let eye = (!camera.is_orthographic()).then_some(camera.eye);
        Self { buffer, eye, before, taken: Cell::new(0) }
    }

    pub(crate) fn view_of(&self, instance: &Instance) -> View {
        let eye = self.eye.map(|eye| world_from_mesh(instance).inverse().transform_point3(eye));
        View { eye, clip_from_mesh: self.before.map(|before| before.clip_from_mesh(instance)) }
    }

    pub(crate) fn buffer(&self) -> &'a Buffer {
        self.buffer
    }

    /// Puts parts beside each other; tells which indices they are, or nothing where there is
    /// no room for them.
    pub(crate) fn gather<'p>(
        &self,
        parts: impl Iterator<Item = &'p Gathered<'p>> + Clone,
    ) -> Result<Option<Range<u32>>, RenderError> {
        let most: u64 = parts.clone().map(|part| part.range.len() as u64).sum();
        let first = self.taken.get();
        let start = u64::from(first) * TRIANGLE_BYTES;
        if start + most * TRIANGLE_BYTES > self.buffer.size() {
            return Ok(None);
        }
        let mut count = 0;
        self.buffer.write_by(start, most * TRIANGLE_BYTES, |into| {
            let (places, _) = into.as_chunks_mut::<{ TRIANGLE_BYTES as usize }>();
            for Gathered { faces, range, first_vertex, view, skips_backs } in parts {
                let eye = view.eye.filter(|_| *skips_backs);
                let hidden = self.before.zip(view.clip_from_mesh.as_ref());
                let is_wanted = |bounds: &Bounds| {
                    hidden.is_none_or(|(before, clip)| before.may_see_in(clip, bounds))
                };
                let range = range.start as usize..range.end as usize;
                faces.facing(range, eye, is_wanted, |triangles| {
                    for (place, triangle) in places[count..].iter_mut().zip(triangles) {
                        *place = bytemuck::cast(triangle.map(|wedge| wedge + first_vertex));
                    }
                    count += triangles.len();
                });
            }
        })?;
        let end = first + count as u32;
        self.taken.set(end);
        Ok(Some(3 * first..3 * end))
    }
}

/// Whether a mesh is gathered with others, where there are any: what is large gains little.
pub(crate) fn is_small(mesh: &Mesh) -> bool {
    mesh.triangles.len() <= MAX_MESH_TRIANGLES
}

/// Makes room for so many triangles, as far as a frame may have it.
pub(crate) fn ready(
    buffer: &mut Option<Buffer>,
    gpu: &Gpu,
    triangles: u64,
) -> Result<(), RenderError> {
    let room = buffer.as_ref().map_or(0, |buffer| buffer.size() / TRIANGLE_BYTES);
    let wanted = triangles.min(u64::from(MAX_FRAME_TRIANGLES));
    if wanted > room {
        let bytes = wanted.next_power_of_two().max(FIRST_TRIANGLES.into()) * TRIANGLE_BYTES;
        *buffer = Some(Buffer::new(gpu, "gathered indices", BufferUsage::HostIndex, bytes)?);
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

    fn faces_of(mesh: &Mesh) -> Faces {
        Faces::of(mesh.triangles.clone(), planes_of(mesh, &mesh.triangles))
    }

    proptest! {
        /// In order, and none that shows its front to the eye is missed.
        #[test]
        fn what_faces_the_eye_is_kept(
            corners in prop::collection::vec(
                prop::array::uniform3(prop::array::uniform3(-9.0_f32..9.0)), 1..40),
            eye in prop::array::uniform3(-20.0_f32..20.0),
            first in 0_usize..20,
        ) {
            let mesh = mesh(&corners);
            let faces = faces_of(&mesh);
            let range = first.min(mesh.triangles.len())..mesh.triangles.len();
            let (mut all, mut kept) = (Vec::new(), Vec::new());
            faces.facing(range.clone(), None, |some| all.extend_from_slice(some));
            faces.facing(range.clone(), Some(eye.into()), |some| kept.extend_from_slice(some));
            prop_assert_eq!(&all, &mesh.triangles[range]);
            let eye = Vec3::from(eye).as_dvec3();
            let mut left = kept.iter().peekable();
            for triangle in &all {
                let corners = mesh.corner_positions(*triangle);
                let [a, b, c] = corners.map(|p| mesh.positions[p as usize].as_dvec3());
                let before = (b - a).cross(c - a).normalize_or_zero().dot(eye - a);
                let is_kept = left.next_if(|kept| *kept == triangle).is_some();
                prop_assert!(is_kept || before <= 0.0, "{before}");
                prop_assert!(!is_kept || before >= -1e-2, "{before}");
            }
            prop_assert_eq!(left.next(), None);
        }
    }

    #[test]
    fn an_eye_that_is_nowhere_sees_all() {
        let mesh = mesh(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
        let mut kept = 0;
        let faces = faces_of(&mesh);
        faces.facing(0..1, Some(Vec3::NAN), |some| kept += some.len());
        assert_eq!(kept, 1);
    }
}
