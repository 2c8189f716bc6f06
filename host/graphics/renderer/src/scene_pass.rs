//! Scene pass: draw calls of a plan, sorted by render state.

use std::ops::Range;

use busbar_gpu::{BindGroup, Buffer, DrawCall, DrawCount, RenderPass};
use glam::Vec3;
use smallvec::SmallVec;

use crate::RenderError;
use crate::cpu_triangle_culling::{CulledRange, InstanceView, TriangleCuller};
use crate::draw_plan::{Batch, DrawPhase, DrawPlan};
use crate::features::FeatureResources;
use crate::index_cache::IndexCache;
use crate::material::GpuMaterial;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::{Morpher, VERTEX_BYTES};
use crate::pipelines::{PipelineVariants, SelectedPipeline};
use crate::visibility::world_from_mesh;

/// Runs that most meshes have at most.
const USUAL_RUNS: usize = 2;

/// Filter of a mesh's sections by their material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sections {
    All,
    Opaque,
    Blended,
}

/// Drawer of a plan: a draw for each section of a batch, and one for its slender triangles.
pub(crate) struct SceneDrawer<'a> {
    pub(crate) models: &'a [Option<GpuModel>],
    pub(crate) cache: &'a IndexCache,
    pub(crate) plan: &'a DrawPlan,
    pub(crate) frame_group: &'a BindGroup,
    /// The plan's instances on the device.
    pub(crate) instances: &'a Buffer,
    pub(crate) feature_resources: &'a FeatureResources,
    /// Moved vertices of morphing meshes; `None` draws the finer mesh.
    pub(crate) morpher: Option<&'a Morpher>,
    /// Bound after the material's group, where a pipeline takes more.
    pub(crate) more: Option<&'a BindGroup>,
    /// Drawing phase of the plan; blended sections ignore it.
    pub(crate) phase: DrawPhase,
    /// CPU triangle culler, on software rasterizers.
    pub(crate) culler: Option<TriangleCuller<'a>>,
    /// Faces are shown from behind, too.
    pub(crate) shows_backs: bool,
}

/// Draws to be made.
#[derive(Default)]
struct SectionDraws<'a> {
    sections: Vec<SectionDraw<'a>>,
    /// Views of the instances that are culled.
    views: Vec<InstanceView>,
}

/// A draw of one section.
#[derive(Clone)]
struct SectionDraw<'a> {
    order: StateKey,
    groups: [&'a BindGroup; 4],
    /// All but the groups.
    draw: DrawCall<'a>,
    /// Triangles for CPU culling, where the draw takes part.
    culled: Option<CulledRange<'a>>,
}

/// Triangles of a mesh that are drawn alike.
struct SectionRun<'a> {
    chosen: SelectedPipeline<'a>,
    /// Material of the first section; others have theirs in their vertices.
    material: &'a GpuMaterial,
    is_slender: bool,
    /// Range of indices within the mesh.
    part: Range<u32>,
}

impl SectionRun<'_> {
    /// Reports whether the next part of a section can join this run.
    fn can_extend_with(&self, chosen: &SelectedPipeline<'_>, part: &Range<u32>) -> bool {
        !self.chosen.reads_material && !chosen.reads_material && self.part.end == part.start
    }
}

/// Render state shared by merged draws: pipeline, raster state, material, and the blocks of
/// vertices and indices.
type StateKey = (u8, [bool; 3], u32, [u32; 2]);

/// Block number of vertices outside all arenas.
const NO_BLOCK: u32 = u32::MAX;

impl<'a> SceneDrawer<'a> {
    /// Draws all batches of the phase.
    pub(crate) fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        shading: &PipelineVariants,
        wanted: Sections,
    ) -> Result<DrawCount, RenderError> {
        let mut draws_of_sections = SectionDraws::default();
        draws_of_sections.sections.reserve(self.plan.batches.len());
        for batch in self.plan.visible_in(self.phase) {
            self.list(&mut draws_of_sections, shading, &batch, wanted);
        }
        let mut in_order: Vec<&SectionDraw<'_>> = draws_of_sections.sections.iter().collect();
        in_order.sort_by_key(|section| section.order);
        let draws = match &self.culler {
            Some(culler) => batch_culled(culler, &in_order, &draws_of_sections.views)?,
            None => in_order.into_iter().map(SectionDraw::draw).collect(),
        };
        Ok(pass.draw_all(&draws)?)
    }

    /// Draws blended sections one instance at a time, the farthest first.
    pub(crate) fn draw_blended(
        &self,
        pass: &mut RenderPass<'_>,
        shading: &PipelineVariants,
        eye: Vec3,
    ) -> Result<DrawCount, RenderError> {
        let mut singles = Vec::new();
        for batch in self.plan.seen() {
            let Some(model) = &self.models[batch.key.model as usize] else {
                continue;
            };
            let mesh = &model.meshes[batch.key.mesh as usize];
            if !mesh.blends {
                continue;
            }
            for index in batch.instances.clone() {
                let world_from_mesh = world_from_mesh(&self.plan.instances[index as usize]);
                let center = world_from_mesh.transform_point3(mesh.sphere.center);
                let distance = center.distance_squared(eye);
                singles.push((distance, batch.single(index)));
            }
        }
        singles.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut draws_of_sections = SectionDraws::default();
        for (_, single) in &singles {
            self.list(&mut draws_of_sections, shading, single, Sections::Blended);
        }
        let draws: Vec<_> = draws_of_sections.sections.iter().map(SectionDraw::draw).collect();
        Ok(pass.draw_all(&draws)?)
    }

    /// Lists the draws of a batch.
    fn list<'s>(
        &self,
        SectionDraws { sections, views }: &mut SectionDraws<'s>,
        shading: &'s PipelineVariants,
        batch: &Batch,
        wanted: Sections,
    ) where
        'a: 's,
    {
        let Some(model) = &self.models[batch.key.model as usize] else { return };
        let mesh = &model.meshes[batch.key.mesh as usize];
        let Some(resolved) = self.cache.get(batch.key) else { return };
        let Some(vertices) = self.vertices_of(mesh, batch) else { return };
        let Some(indices) = &resolved.indices else { return };
        let first_index = (indices.offset() / size_of::<u32>() as u64) as u32;
        // What blends is drawn in an order of its own.
        let culler = self.culler.as_ref().filter(|_| wanted != Sections::Blended);
        let culled = culler.and_then(|culler| {
            let faces = resolved.cullable(batch, culler.occlusion_test())?;
            let first_view = views.len() as u32;
            let seen = &self.plan.instances[batch.range()];
            views.extend(seen.iter().map(|instance| culler.view_of(instance)));
            Some((faces, first_view))
        });
        let mut runs: SmallVec<[SectionRun<'_>; USUAL_RUNS]> = SmallVec::new();
        for (section, range) in mesh.stacks.mesh().sections.iter().zip(&resolved.sections) {
            let material = model.material(section.material);
            let is_wanted = match wanted {
                Sections::All => true,
                Sections::Opaque => !material.blends,
                Sections::Blended => material.blends,
            };
            if !is_wanted {
                continue;
            }
            for (is_slender, part) in range.parts(shading.has_slender()) {
                let chosen = shading.pipeline(batch, material, is_slender);
                match runs.last_mut() {
                    _ if part.is_empty() => {}
                    Some(last) if last.can_extend_with(&chosen, &part) => last.part.end = part.end,
                    _ => runs.push(SectionRun { chosen, material, is_slender, part }),
                }
            }
        }
        for SectionRun { chosen, material, is_slender, part } in runs {
            let SelectedPipeline { place, pipeline, reads_features, reads_material } = chosen;
            let cull_back = !material.double_sided && !self.shows_backs;
            let features = mesh.features.as_ref().filter(|_| reads_features);
            let (vertex_offset, first_vertex) = match features {
                // By a vertex's number in its mesh.
                Some(_) => (vertices.offset, 0),
                None => (0, (vertices.offset / VERTEX_BYTES) as u32),
            };
            let raster_state = [cull_back, batch.mirrored, features.is_some()];
            let material_number = if reads_material { material.number } else { 0 };
            let section = SectionDraw {
                order: (place, raster_state, material_number, [vertices.block, indices.block()]),
                groups: [
                    self.frame_group,
                    self.feature_resources.group(features),
                    &material.group,
                    self.more.unwrap_or(self.frame_group),
                ],
                draw: DrawCall {
                    pipeline,
                    groups: &[],
                    vertices: vertices.buffer,
                    vertex_offset,
                    first_vertex,
                    instances: self.instances,
                    indices: indices.buffer(),
                    index_range: first_index + part.start..first_index + part.end,
                    instance_range: batch.instances.clone(),
                    cull_back,
                    mirrored: batch.mirrored,
                },
                culled: None,
            };
            let Some((faces, first_view)) = culled.filter(|_| features.is_none()) else {
                sections.push(section);
                continue;
            };
            // Each instance by itself: of each something else is seen.
            sections.extend(batch.instances.clone().zip(first_view..).map(|(index, view)| {
                let range = part.start / 3..part.end / 3;
                let culls_back_faces = cull_back && !is_slender;
                let draw = DrawCall { instance_range: index..index + 1, ..section.draw.clone() };
                let culled = CulledRange { faces, range, first_vertex, view, culls_back_faces };
                SectionDraw { draw, culled: Some(culled), ..section.clone() }
            }));
        }
    }

    fn vertices_of(&self, mesh: &'a GpuMesh, batch: &Batch) -> Option<VertexSource<'a>> {
        let slice = mesh.vertices.as_ref()?;
        let moved = self.morpher.and_then(|morpher| morpher.vertices_of(batch));
        Some(match moved {
            Some((buffer, offset)) => VertexSource { block: NO_BLOCK, buffer, offset },
            None => {
                let (block, buffer, offset) = (slice.block(), slice.buffer(), slice.offset());
                VertexSource { block, buffer, offset }
            }
        })
    }

    /// Counts the live triangles over all instances.
    pub(crate) fn triangles(&self) -> u64 {
        self.plan
            .batches
            .iter()
            .filter_map(|batch| {
                let resolved = self.cache.get(batch.key)?;
                Some(u64::from(resolved.triangles) * u64::from(batch.count))
            })
            .sum()
    }
}

/// Buffer and offset of a batch's vertices.
struct VertexSource<'a> {
    block: u32,
    buffer: &'a Buffer,
    /// Bytes before the first.
    offset: u64,
}

/// Merges neighbouring draws that differ only in their triangles.
fn batch_culled<'s>(
    culler: &TriangleCuller<'s>,
    sections: &[&'s SectionDraw<'s>],
    views: &[InstanceView],
) -> Result<Vec<DrawCall<'s>>, RenderError> {
    let mut draws = Vec::with_capacity(sections.len());
    for alike in sections.chunk_by(|one, next| one.can_merge_with(next)) {
        let parts = alike.iter().filter_map(|section| section.culled.as_ref());
        let indices = match &alike[0].culled {
            Some(_) => culler.cull(parts, views)?,
            None => None,
        };
        match indices {
            Some(index_range) if index_range.is_empty() => {}
            Some(index_range) => {
                let indices = culler.buffer();
                draws.push(DrawCall { indices, index_range, first_vertex: 0, ..alike[0].draw() });
            }
            None => draws.extend(alike.iter().map(|section| section.draw())),
        }
    }
    Ok(draws)
}

impl SectionDraw<'_> {
    fn draw(&self) -> DrawCall<'_> {
        let groups = &self.groups[..self.draw.pipeline.group_count()];
        DrawCall { groups, ..self.draw.clone() }
    }

    fn can_merge_with(&self, next: &Self) -> bool {
        self.culled.is_some()
            && next.culled.is_some()
            && self.order == next.order
            && self.draw.instance_range == next.draw.instance_range
    }
}
