//! Records a plan's draws.

use busbar_gpu::{BindGroup, Buffer, Draw, GpuError, Pass};
use glam::{Vec3, Vec4};

use crate::batch::{Batch, Plan};
use crate::features::FeatureKit;
use crate::index_cache::IndexCache;
use crate::model::GpuModel;
use crate::morph::Morpher;
use crate::pipelines::Shading;

/// Which sections of a mesh are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sections {
    All,
    Opaque,
    Blended,
}

/// Draws a plan, one call a section of each batch.
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

impl SceneDrawer<'_> {
    /// Draws all batches. Returns the number of draw calls.
    pub(crate) fn draw(
        &self,
        pass: &mut Pass<'_>,
        shading: &Shading,
        sections: Sections,
    ) -> Result<u32, GpuError> {
        let mut calls = 0;
        for batch in self.plan.seen() {
            calls += self.draw_batch(pass, shading, batch, sections)?;
        }
        Ok(calls)
    }

    /// Draws blended sections one instance at a time, the farthest first.
    pub(crate) fn draw_blended(
        &self,
        pass: &mut Pass<'_>,
        shading: &Shading,
        eye: Vec3,
    ) -> Result<u32, GpuError> {
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
        let mut calls = 0;
        for (_, single) in &singles {
            calls += self.draw_batch(pass, shading, single, Sections::Blended)?;
        }
        Ok(calls)
    }

    fn draw_batch(
        &self,
        pass: &mut Pass<'_>,
        shading: &Shading,
        batch: &Batch,
        wanted: Sections,
    ) -> Result<u32, GpuError> {
        let Some(model) = &self.models[batch.key.model as usize] else {
            return Ok(0);
        };
        let mesh = &model.meshes[batch.key.mesh as usize];
        let Some(resolved) = self.cache.get(batch.key) else {
            return Ok(0);
        };
        let (Some(vertices), Some(indices)) = (&mesh.vertices, &resolved.buffer) else {
            return Ok(0);
        };
        let moved = self.morpher.and_then(|morpher| morpher.vertices_of(batch));
        let (vertices, vertex_offset) = moved.unwrap_or((vertices, 0));
        let features = self.feature_kit.group(mesh.features.as_ref());
        let mut calls = 0;
        for (section, range) in mesh.stacks.mesh().sections.iter().zip(&resolved.sections) {
            let material = model.material(section.material);
            let is_wanted = match wanted {
                Sections::All => true,
                Sections::Opaque => !material.blends,
                Sections::Blended => material.blends,
            };
            if !is_wanted || range.is_empty() {
                continue;
            }
            let pipeline = shading.pipeline(batch.highlights, material);
            let last = self.more.unwrap_or(self.frame_group);
            let groups = [self.frame_group, features, &material.group, last];
            pass.draw(&Draw {
                pipeline,
                groups: &groups[..pipeline.group_count()],
                vertices,
                vertex_offset,
                instances: self.instances,
                indices,
                index_range: range.clone(),
                instance_range: batch.instances.clone(),
                cull_back: !material.double_sided && !self.shows_backs,
                mirrored: batch.mirrored,
            })?;
            calls += 1;
        }
        Ok(calls)
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
