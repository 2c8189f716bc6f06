//! Records a plan's draws.

use std::ops::Range;

use busbar_gpu::{BindGroup, Buffer, Draw, DrawCount, Pass};
use glam::Vec3;
use smallvec::SmallVec;

use crate::RenderError;
use crate::batch::{Batch, Part, Plan};
use crate::features::FeatureKit;
use crate::gathering::{Gathered, Gathering, View};
use crate::index_cache::IndexCache;
use crate::material::GpuMaterial;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::{Morpher, VERTEX_BYTES};
use crate::pipelines::{Chosen, Shading};
use crate::sight::world_from_mesh;

/// Runs that most meshes have at most.
const USUAL_RUNS: usize = 2;

/// Which sections of a mesh are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sections {
    All,
    Opaque,
    Blended,
}

/// Draws a plan: a draw a section of each batch, and one for what is slender in it.
pub(crate) struct SceneDrawer<'a> {
    pub(crate) models: &'a [Option<GpuModel>],
    pub(crate) cache: &'a IndexCache,
    pub(crate) plan: &'a Plan,
    pub(crate) frame_group: &'a BindGroup,
    /// The plan's instances on the device.
    pub(crate) instances: &'a Buffer,
    pub(crate) feature_kit: &'a FeatureKit,
    /// Vertices of what is on its way; none where all is drawn as it leaves.
    pub(crate) morpher: Option<&'a Morpher>,
    /// Bound after the material's group, where a pipeline takes more.
    pub(crate) more: Option<&'a BindGroup>,
    /// What of the plan is drawn, but for what blends.
    pub(crate) part: Part,
    /// Where small draws are gathered.
    pub(crate) gathering: Option<Gathering<'a>>,
    /// Faces are shown from behind, too.
    pub(crate) shows_backs: bool,
}

/// Draws to be made.
#[derive(Default)]
struct Listed<'a> {
    sections: Vec<Section<'a>>,
    /// Of the instances that are gathered.
    views: Vec<View>,
}

/// A draw of one section.
#[derive(Clone)]
struct Section<'a> {
    order: Order,
    groups: [&'a BindGroup; 4],
    /// All but the groups.
    draw: Draw<'a>,
    /// Where it may be gathered with others.
    gathered: Option<Gathered<'a>>,
}

/// Triangles of a mesh that are drawn alike.
struct Run<'a> {
    chosen: Chosen<'a>,
    /// Of its first section; others have theirs in their vertices.
    material: &'a GpuMaterial,
    is_slender: bool,
    /// Indices.
    part: Range<u32>,
}

impl Run<'_> {
    /// Whether a section's part after it may be drawn with it.
    fn goes_on_with(&self, chosen: &Chosen<'_>, part: &Range<u32>) -> bool {
        !self.chosen.finds_material && !chosen.finds_material && self.part.end == part.start
    }
}

/// What is alike in it is drawn together: pipeline, faces, features, material, and where
/// vertices and indices lie.
type Order = (u8, [bool; 3], u32, [u32; 2]);

/// Of vertices that no arena holds.
const NO_BLOCK: u32 = u32::MAX;

impl<'a> SceneDrawer<'a> {
    /// Draws all batches.
    pub(crate) fn draw(
        &self,
        pass: &mut Pass<'_>,
        shading: &Shading,
        wanted: Sections,
    ) -> Result<DrawCount, RenderError> {
        let mut listed = Listed::default();
        listed.sections.reserve(self.plan.batches.len());
        for batch in self.plan.seen_in(self.part) {
            self.list(&mut listed, shading, &batch, wanted);
        }
        let mut in_order: Vec<&Section<'_>> = listed.sections.iter().collect();
        in_order.sort_by_key(|section| section.order);
        let draws = match &self.gathering {
            Some(gathering) => gather(gathering, &in_order, &listed.views)?,
            None => in_order.into_iter().map(Section::draw).collect(),
        };
        Ok(pass.draw_all(&draws)?)
    }

    /// Draws blended sections one instance at a time, the farthest first.
    pub(crate) fn draw_blended(
        &self,
        pass: &mut Pass<'_>,
        shading: &Shading,
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
                let center = world_from_mesh.transform_point3(mesh.ball.center);
                let distance = center.distance_squared(eye);
                singles.push((distance, batch.single(index)));
            }
        }
        singles.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut listed = Listed::default();
        for (_, single) in &singles {
            self.list(&mut listed, shading, single, Sections::Blended);
        }
        let draws: Vec<_> = listed.sections.iter().map(Section::draw).collect();
        Ok(pass.draw_all(&draws)?)
    }

    /// Lists the draws of a batch.
    fn list<'s>(
        &self,
        Listed { sections, views }: &mut Listed<'s>,
        shading: &'s Shading,
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
        let gathering = self.gathering.as_ref().filter(|_| wanted != Sections::Blended);
        let gathered = gathering.and_then(|gathering| {
            let faces = resolved.gathered(batch, gathering.hiding())?;
            let first_view = views.len() as u32;
            let seen = &self.plan.instances[batch.range()];
            views.extend(seen.iter().map(|instance| gathering.view_of(instance)));
            Some((faces, first_view))
        });
        let mut runs: SmallVec<[Run<'_>; USUAL_RUNS]> = SmallVec::new();
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
            for (is_slender, part) in range.parts(shading.widens()) {
                let chosen = shading.pipeline(batch, material, is_slender);
                match runs.last_mut() {
                    _ if part.is_empty() => {}
                    Some(last) if last.goes_on_with(&chosen, &part) => last.part.end = part.end,
                    _ => runs.push(Run { chosen, material, is_slender, part }),
                }
            }
        }
        for Run { chosen, material, is_slender, part } in runs {
            let Chosen { place, pipeline, finds_features, finds_material } = chosen;
            let cull_back = !material.double_sided && !self.shows_backs;
            let features = mesh.features.as_ref().filter(|_| finds_features);
            let (vertex_offset, first_vertex) = match features {
                // By a vertex's number in its mesh.
                Some(_) => (vertices.offset, 0),
                None => (0, (vertices.offset / VERTEX_BYTES) as u32),
            };
            let ways = [cull_back, batch.mirrored, features.is_some()];
            let material_number = if finds_material { material.number } else { 0 };
            let section = Section {
                order: (place, ways, material_number, [vertices.block, indices.block()]),
                groups: [
                    self.frame_group,
                    self.feature_kit.group(features),
                    &material.group,
                    self.more.unwrap_or(self.frame_group),
                ],
                draw: Draw {
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
                gathered: None,
            };
            let Some((faces, first_view)) = gathered.filter(|_| features.is_none()) else {
                sections.push(section);
                continue;
            };
            // Each instance by itself: of each something else is seen.
            sections.extend(batch.instances.clone().zip(first_view..).map(|(index, view)| {
                let range = part.start / 3..part.end / 3;
                let skips_backs = cull_back && !is_slender;
                let draw = Draw { instance_range: index..index + 1, ..section.draw.clone() };
                let gathered = Gathered { faces, range, first_vertex, view, skips_backs };
                Section { draw, gathered: Some(gathered), ..section.clone() }
            }));
        }
    }

    fn vertices_of(&self, mesh: &'a GpuMesh, batch: &Batch) -> Option<Vertices<'a>> {
        let slice = mesh.vertices.as_ref()?;
        let moved = self.morpher.and_then(|morpher| morpher.vertices_of(batch));
        Some(match moved {
            Some((buffer, offset)) => Vertices { block: NO_BLOCK, buffer, offset },
            None => {
                let (block, buffer, offset) = (slice.block(), slice.buffer(), slice.offset());
                Vertices { block, buffer, offset }
            }
        })
    }

    /// Live triangles over all instances.
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

/// Where the vertices of a batch are.
struct Vertices<'a> {
    block: u32,
    buffer: &'a Buffer,
    /// Bytes before the first.
    offset: u64,
}

/// One draw for those beside each other that differ in their triangles alone.
fn gather<'s>(
    gathering: &Gathering<'s>,
    sections: &[&'s Section<'s>],
    views: &[View],
) -> Result<Vec<Draw<'s>>, RenderError> {
    let mut draws = Vec::with_capacity(sections.len());
    for alike in sections.chunk_by(|one, next| one.is_gathered_with(next)) {
        let parts = alike.iter().filter_map(|section| section.gathered.as_ref());
        let indices = match &alike[0].gathered {
            Some(_) => gathering.gather(parts, views)?,
            None => None,
        };
        match indices {
            Some(index_range) if index_range.is_empty() => {}
            Some(index_range) => {
                let indices = gathering.buffer();
                draws.push(Draw { indices, index_range, first_vertex: 0, ..alike[0].draw() });
            }
            None => draws.extend(alike.iter().map(|section| section.draw())),
        }
    }
    Ok(draws)
}

impl Section<'_> {
    fn draw(&self) -> Draw<'_> {
        let groups = &self.groups[..self.draw.pipeline.group_count()];
        Draw { groups, ..self.draw.clone() }
    }

    fn is_gathered_with(&self, next: &Self) -> bool {
        self.gathered.is_some()
            && next.gathered.is_some()
            && self.order == next.order
            && self.draw.instance_range == next.draw.instance_range
    }
}
