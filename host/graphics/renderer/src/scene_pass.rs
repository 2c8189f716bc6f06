//! Scene pass: draw calls of the visible instances, sorted by render state.

use std::ops::Range;

use busbar_gpu::{BindGroup, Buffer, DrawCall, DrawCount, RenderPass};
use glam::Vec3;
use smallvec::SmallVec;

use crate::RenderError;
use crate::batch::{Batch, DrawPhase};
use crate::draw_reduction::DrawReduction;
use crate::features::FeatureResources;
use crate::index_cache::IndexCache;
use crate::instance_culling::VisibleInstances;
use crate::instance_transform::world_from_mesh;
use crate::material::GpuMaterial;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::{Morpher, VERTEX_BYTES};
use crate::pipelines::{PipelineVariants, SelectedPipeline};
use crate::section_draw::{SectionDraw, TriangleSource};

/// Runs that most meshes have at most.
const USUAL_RUNS: usize = 2;

/// Filter of a mesh's sections by their material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sections {
    All,
    Opaque,
    Blended,
}

/// Drawer of visible instances: a draw for each section of a batch, and one for its slender
/// triangles.
pub(crate) struct SceneDrawer<'a> {
    pub(crate) models: &'a [Option<GpuModel>],
    pub(crate) cache: &'a IndexCache,
    pub(crate) plan: &'a VisibleInstances,
    pub(crate) frame_group: &'a BindGroup,
    /// The visible instances on the device.
    pub(crate) instances: &'a Buffer,
    pub(crate) feature_resources: &'a FeatureResources,
    /// Moved vertices of morphing meshes; `None` draws the finer mesh.
    pub(crate) morpher: Option<&'a Morpher>,
    /// Bound after the material's group, where a pipeline takes more.
    pub(crate) more: Option<&'a BindGroup>,
    /// Drawing phase of the plan; blended sections ignore it.
    pub(crate) phase: DrawPhase,
    /// Reduction of the draws that do not blend.
    pub(crate) reduction: &'a dyn DrawReduction,
    /// Faces are shown from behind, too.
    pub(crate) shows_backs: bool,
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
        let mut sections = Vec::with_capacity(self.plan.batches.len());
        for (number, batch) in (0..).zip(self.plan.visible_in(self.phase)) {
            self.list(&mut sections, shading, (number, &batch), wanted);
        }
        let mut in_order: Vec<&SectionDraw<'_>> = sections.iter().collect();
        in_order.sort_by_key(|section| section.order);
        let draws = self.reduction.reduce(&self.plan.instances, &in_order)?;
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
        let mut sections = Vec::new();
        for (number, (_, single)) in (0..).zip(&singles) {
            self.list(&mut sections, shading, (number, single), Sections::Blended);
        }
        let draws: Vec<_> = sections.iter().map(SectionDraw::call).collect();
        Ok(pass.draw_all(&draws)?)
    }

    /// Lists the draws of a batch.
    fn list<'s>(
        &self,
        sections: &mut Vec<SectionDraw<'s>>,
        shading: &'s PipelineVariants,
        (number, batch): (u32, &Batch),
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
            sections.push(SectionDraw {
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
                source: features.is_none().then(|| TriangleSource {
                    resolved,
                    batch: number,
                    morphs: batch.morph.is_some(),
                    is_slender,
                    range: part.start / 3..part.end / 3,
                }),
            });
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
