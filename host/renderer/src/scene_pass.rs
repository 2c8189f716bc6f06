//! Records a plan's draws.

use busbar_gpu::{BindGroup, Buffer, Draw, DrawCount, GpuError, Pass};
use glam::{Vec3, Vec4};

use crate::batch::{Batch, Plan};
use crate::features::FeatureKit;
use crate::index_cache::IndexCache;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::{Morpher, VERTEX_BYTES};
use crate::pipelines::Shading;

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
    /// Faces are shown from behind, too.
    pub(crate) shows_backs: bool,
}

/// A draw of one section.
struct Section<'a> {
    order: Order,
    groups: [&'a BindGroup; 4],
    /// All but the groups.
    draw: Draw<'a>,
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
    ) -> Result<DrawCount, GpuError> {
        let mut sections = Vec::with_capacity(self.plan.batches.len());
        for batch in self.plan.seen() {
            self.list(&mut sections, shading, batch, wanted);
        }
        sections.sort_by_key(|section| section.order);
        draw_all(pass, &sections)
    }

    /// Draws blended sections one instance at a time, the farthest first.
    pub(crate) fn draw_blended(
        &self,
        pass: &mut Pass<'_>,
        shading: &Shading,
        eye: Vec3,
    ) -> Result<DrawCount, GpuError> {
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
                let [x, y, z] = self.plan.instances[index as usize].world_from_mesh;
                let rows = [x, y, z].map(Vec4::from_array);
                let center = rows.map(|row| row.dot(mesh.ball.center.extend(1.0)));
                let single = Batch { instances: index..index + 1, count: 1, ..batch.clone() };
                singles.push((Vec3::from_array(center).distance_squared(eye), single));
            }
        }
        singles.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut sections = Vec::with_capacity(singles.len());
        for (_, single) in &singles {
            self.list(&mut sections, shading, single, Sections::Blended);
        }
        draw_all(pass, &sections)
    }

    /// Lists the draws of a batch.
    fn list<'s>(
        &self,
        sections: &mut Vec<Section<'s>>,
        shading: &'s Shading,
        batch: &Batch,
        wanted: Sections,
    ) where
        'a: 's,
    {
        let Some(model) = &self.models[batch.key.model as usize] else { return };
        let mesh = &model.meshes[batch.key.mesh as usize];
        let Some(resolved) = self.cache.get(batch.key) else { return };
        let Some(indices) = &resolved.indices else { return };
        let Some(vertices) = self.vertices_of(mesh, batch) else { return };
        let first_index = (indices.offset() / size_of::<u32>() as u64) as u32;
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
            let cull_back = !material.double_sided && !self.shows_backs;
            let ways = [cull_back, batch.mirrored, mesh.features.is_some()];
            let features = self.feature_kit.group(mesh.features.as_ref());
            let last = self.more.unwrap_or(self.frame_group);
            for (is_slender, part) in range.parts(shading.widens()) {
                if part.is_empty() {
                    continue;
                }
                let (place, pipeline) = shading.pipeline(batch.highlights, material, is_slender);
                sections.push(Section {
                    order: (place, ways, material.number, [vertices.block, indices.block()]),
                    groups: [self.frame_group, features, &material.group, last],
                    draw: Draw {
                        pipeline,
                        groups: &[],
                        vertices: vertices.buffer,
                        vertex_offset: vertices.offset,
                        first_vertex: vertices.first,
                        instances: self.instances,
                        indices: indices.buffer(),
                        index_range: first_index + part.start..first_index + part.end,
                        instance_range: batch.instances.clone(),
                        cull_back,
                        mirrored: batch.mirrored,
                    },
                });
            }
        }
    }

    fn vertices_of(&self, mesh: &'a GpuMesh, batch: &Batch) -> Option<Vertices<'a>> {
        let slice = mesh.vertices.as_ref()?;
        let moved = self.morpher.and_then(|morpher| morpher.vertices_of(batch));
        let (block, buffer, offset) = moved
            .map_or((slice.block(), slice.buffer(), slice.offset()), |(buffer, offset)| {
                (NO_BLOCK, buffer, offset)
            });
        // Shaders look features up by a vertex's number in its mesh.
        Some(match mesh.features {
            Some(_) => Vertices { block, buffer, offset, first: 0 },
            None => Vertices { block, buffer, offset: 0, first: (offset / VERTEX_BYTES) as u32 },
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
    /// Bytes before the first that shaders count from.
    offset: u64,
    /// Vertices from there to the batch's first.
    first: u32,
}

fn draw_all(pass: &mut Pass<'_>, sections: &[Section<'_>]) -> Result<DrawCount, GpuError> {
    let draws: Vec<Draw<'_>> = sections
        .iter()
        .map(|Section { groups, draw, .. }| Draw {
            groups: &groups[..draw.pipeline.group_count()],
            index_range: draw.index_range.clone(),
            instance_range: draw.instance_range.clone(),
            ..*draw
        })
        .collect();
    pass.draw_all(&draws)
}
