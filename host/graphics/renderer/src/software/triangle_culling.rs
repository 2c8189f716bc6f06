//! CPU triangle culling: on software rasterizers, the meshes of one model are batched into one
//! indexed draw after back-face and occlusion culling.
//!
//! A software rasterizer pays for each draw, and for each triangle that is back-facing, off screen
//! or occluded. Neighbouring draws that differ only in their triangles are merged. Instances of
//! large meshes are culled one by one, since each has other triangles hidden.

use std::cell::Cell;
use std::collections::HashMap;
use std::ops::Range;

use busbar_geometry::Bounds;
use busbar_gpu::{Buffer, BufferUsage, DrawCall, Gpu};
use busbar_shaders::Instance;
use glam::{Mat4, Vec3};

use super::mesh_data::{CullableTriangles, MIN_TRIANGLES_BY_DEPTH, SoftwareMesh};
use super::occlusion_test::OcclusionTest;
use crate::RenderError;
use crate::instance_transform::world_from_mesh;
use crate::section_draw::{SectionDraw, TriangleSource};

/// Triangles of an instance that it pays to gather by itself where there are more instances:
/// where large faces hide some, and where all that is nearer does.
const MIN_TRIANGLES_BY_FACES: usize = 1024;

/// Triangles that one frame culls; further ones are drawn without culling.
const MAX_FRAME_TRIANGLES: u32 = 2 << 20;

/// Triangles that the first buffer of a frame holds.
const FIRST_TRIANGLES: u32 = 16_384;

/// Bytes of a triangle's indices.
const TRIANGLE_BYTES: u64 = size_of::<[u32; 3]>() as u64;

/// Reports whether so many instances of a batch are culled: one, or several of enough triangles for
/// the occlusion test to pay. Vertices must not be morphed.
pub(super) fn is_culled(
    faces: &CullableTriangles,
    (instances, morphs): (u32, bool),
    occlusion_test: Option<OcclusionTest<'_>>,
) -> bool {
    let fits = faces.count_of(instances) <= u64::from(MAX_FRAME_TRIANGLES);
    let pays = match occlusion_test {
        None => false,
        Some(OcclusionTest::LargeFaces(_)) => faces.count() >= MIN_TRIANGLES_BY_FACES,
        Some(OcclusionTest::FirstPassDepth(_)) => faces.count() >= MIN_TRIANGLES_BY_DEPTH,
    };
    !morphs && (instances == 1 || (pays && fits))
}

/// Triangle culler of one phase of a frame, with the index buffer that it fills.
pub(super) struct TriangleCuller<'a> {
    pub(super) buffer: &'a Buffer,
    /// World space; `None` where there is no one point that all is seen from.
    pub(super) eye: Option<Vec3>,
    /// Occlusion test; `None` without occlusion culling.
    pub(super) occlusion_test: Option<OcclusionTest<'a>>,
    /// Number of triangles written to the buffer.
    pub(super) taken: &'a Cell<u32>,
}

/// Range of a mesh's triangles to be culled and batched.
struct CulledRange<'a> {
    faces: &'a CullableTriangles,
    /// Range of triangles within the mesh.
    range: Range<u32>,
    /// Added to each index.
    first_vertex: u32,
    /// Index of the instance's [`InstanceView`].
    view: u32,
    /// Back-face culling: back-facing triangles are left out.
    culls_back_faces: bool,
}

/// Draw of a section: whole, or of one instance whose triangles are culled.
struct CulledDraw<'s> {
    section: &'s SectionDraw<'s>,
    instances: Range<u32>,
    culled: Option<CulledRange<'s>>,
}

/// Eye and transform of an instance, as culling needs them.
#[derive(Clone, Copy)]
struct InstanceView {
    /// Position of the eye in mesh space.
    eye: Option<Vec3>,
    /// Clip space from that of the mesh, where something is hidden.
    clip_from_mesh: Option<Mat4>,
}

impl<'a> TriangleCuller<'a> {
    /// Culls the triangles of sections, in order, and merges neighbouring draws that differ only in
    /// their triangles. `instances` are those of the plan.
    pub(super) fn draws(
        &self,
        instances: &[Instance],
        sections: &[&'a SectionDraw<'a>],
    ) -> Result<Vec<DrawCall<'a>>, RenderError> {
        let (listed, views) = self.list(instances, sections);
        let mut draws = Vec::with_capacity(listed.len());
        for alike in listed.chunk_by(CulledDraw::can_merge_with) {
            let indices = match &alike[0].culled {
                Some(_) => {
                    self.cull(alike.iter().filter_map(|draw| draw.culled.as_ref()), &views)?
                }
                None => None,
            };
            match indices {
                Some(index_range) if index_range.is_empty() => {}
                Some(index_range) => {
                    let indices = self.buffer;
                    let draw = alike[0].call();
                    draws.push(DrawCall { indices, index_range, first_vertex: 0, ..draw });
                }
                None => draws.extend(alike.iter().map(CulledDraw::call)),
            }
        }
        Ok(draws)
    }

    /// Lists the draws, culled ones for each instance by itself: of each something else is seen.
    fn list(
        &self,
        instances: &[Instance],
        sections: &[&'a SectionDraw<'a>],
    ) -> (Vec<CulledDraw<'a>>, Vec<InstanceView>) {
        let mut listed = Vec::with_capacity(sections.len());
        let mut views = Vec::new();
        // Sections of a batch show the same instances.
        let mut first_views: HashMap<u32, u32, foldhash::fast::RandomState> = HashMap::default();
        for &section in sections {
            let range = section.draw.instance_range.clone();
            let Some((faces, source)) = self.cullable(section) else {
                listed.push(CulledDraw { section, instances: range, culled: None });
                continue;
            };
            let first_view = *first_views.entry(source.batch).or_insert_with(|| {
                let first_view = views.len() as u32;
                let seen = &instances[range.start as usize..range.end as usize];
                views.extend(seen.iter().map(|instance| self.view_of(instance)));
                first_view
            });
            listed.extend(range.zip(first_view..).map(|(instance, view)| {
                let culled = CulledRange {
                    faces,
                    range: source.range.clone(),
                    first_vertex: section.draw.first_vertex,
                    view,
                    culls_back_faces: section.draw.cull_back && !source.is_slender,
                };
                let instances = instance..instance + 1;
                CulledDraw { section, instances, culled: Some(culled) }
            }));
        }
        (listed, views)
    }

    /// Returns the triangles of a section, if it is culled.
    fn cullable(
        &self,
        section: &'a SectionDraw<'a>,
    ) -> Option<(&'a CullableTriangles, &'a TriangleSource<'a>)> {
        let source = section.source.as_ref()?;
        let faces = source.resolved.data::<SoftwareMesh>()?.faces.as_ref()?;
        let instances = section.draw.instance_range.len() as u32;
        let batch = (instances, source.morphs);
        is_culled(faces, batch, self.occlusion_test).then_some((faces, source))
    }

    fn view_of(&self, instance: &Instance) -> InstanceView {
        let eye = self.eye.map(|eye| world_from_mesh(instance).inverse().transform_point3(eye));
        let clip_from_mesh = self.occlusion_test.map(|test| test.clip_from_mesh(instance));
        InstanceView { eye, clip_from_mesh }
    }

    /// Culls parts one after the other into the buffer. Returns the range of indices, or `None`
    /// where the buffer has no room.
    fn cull<'p>(
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
                faces.indices().read_with(|bytes| {
                    let triangles = bytemuck::cast_slice(bytes);
                    let places = &mut places[count..];
                    let added = faces.blocks().cull_into(triangles, range, eye, is_wanted, places);
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

impl<'s> CulledDraw<'s> {
    fn call(&self) -> DrawCall<'s> {
        DrawCall { instance_range: self.instances.clone(), ..self.section.call() }
    }

    fn can_merge_with(&self, next: &Self) -> bool {
        self.culled.is_some()
            && next.culled.is_some()
            && self.section.order == next.section.order
            && self.instances == next.instances
    }
}

/// Makes room for so many triangles, up to the limit of a frame.
pub(super) fn reserve(
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
