//! Records a plan's draws.

use busbar_gpu::{BindGroup, Draw, GpuError, Pass, Pipeline};
use glam::{Mat4, Vec3};

use crate::batch::{Batch, Plan};
use crate::features::FeatureKit;
use crate::index_cache::IndexCache;
use crate::model::GpuModel;

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
    pub(crate) feature_kit: &'a FeatureKit,
}

impl SceneDrawer<'_> {
    /// Draws all batches with one pipeline, and binds materials if it reads
    /// them. Returns the number of draw calls.
    pub(crate) fn draw(
        &self,
        pass: &mut Pass<'_>,
        pipeline: &Pipeline,
        sections: Sections,
        materials: bool,
    ) -> Result<u32, GpuError> {
        let mut calls = 0;
        for batch in &self.plan.batches {
            calls += self.draw_batch(pass, pipeline, batch, sections, materials)?;
        }
        Ok(calls)
    }

    /// Draws blended sections one instance at a time, the farthest first.
    pub(crate) fn draw_blended(
        &self,
        pass: &mut Pass<'_>,
        pipeline: &Pipeline,
        eye: Vec3,
    ) -> Result<u32, GpuError> {
        let mut singles = Vec::new();
        for batch in &self.plan.batches {
            let Some(model) = &self.models[batch.key.model as usize] else {
                continue;
            };
            let mesh = &model.meshes[batch.key.mesh as usize];
            if !mesh.blends {
                continue;
            }
            for index in batch.instances.clone() {
                let instance = &self.plan.instances[index as usize];
                let world_from_mesh = Mat4::from_cols_array_2d(&instance.world_from_mesh);
                let center = world_from_mesh.transform_point3(mesh.center);
                let single = Batch { instances: index..index + 1, ..batch.clone() };
                singles.push((center.distance_squared(eye), single));
            }
        }
        singles.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut calls = 0;
        for (_, single) in &singles {
            calls += self.draw_batch(pass, pipeline, single, Sections::Blended, true)?;
        }
        Ok(calls)
    }

    fn draw_batch(
        &self,
        pass: &mut Pass<'_>,
        pipeline: &Pipeline,
        batch: &Batch,
        wanted: Sections,
        materials: bool,
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
            let groups = [self.frame_group, features, &material.group];
            pass.draw(&Draw {
                pipeline,
                groups: if materials { &groups } else { &groups[..2] },
                vertices,
                indices,
                index_range: range.clone(),
                instance_range: batch.instances.clone(),
                cull_back: !material.double_sided,
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
                Some(u64::from(resolved.triangles) * batch.instances.len() as u64)
            })
            .sum()
    }
}
