//! What is measured on: the paper's substation as one mesh, imported.

use anyhow::{Context, Result};
use busbar_geometry::{CollapseSequence, Mesh, RawPrimitive};
use busbar_gltf_import::ImportLimits;
use substation::Station;
use weighted_collapse::{CollapseList, Order, Progress, Reading};

/// Decides how the equipment stands; as the generator does by itself.
const SEED: u64 = 1;

/// The mesh as imported, and as optimisers see it.
pub(crate) struct Scene {
    pub(crate) mesh: Mesh,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Scene {
    /// Generates the paper-mode scene and imports it from the bytes of its file.
    pub(crate) fn paper() -> Result<Self> {
        let flat = Station::generate(SEED)?.flatten()?;
        let bytes = busbar_gltf_export::write_glb(&flat.model)?;
        let imported = busbar_gltf_import::import_bytes(&bytes, None, &ImportLimits::default())?;
        let meshes = imported.model.meshes.into_iter();
        Ok(Self::of(meshes.last().context("the scene has no mesh")?))
    }

    fn of(mesh: Mesh) -> Self {
        let topology = mesh.topology();
        let positions = topology.positions.iter().map(|p| p.to_array()).collect();
        Self { mesh, positions, triangles: topology.triangles }
    }

    /// The collapse sequence of the whole mesh.
    pub(crate) fn optimize(&self, order: Order, max_threads: usize) -> Result<CollapseList> {
        let mesh = weighted_collapse::Mesh {
            positions: &self.positions,
            triangles: &self.triangles,
            wedges: None,
        };
        let progress = &mut Progress::unwatched();
        Ok(weighted_collapse::collapse_list(mesh, &Reading::BUSBAR, order, max_threads, progress)?)
    }

    /// The paper's sequence, checked.
    pub(crate) fn sequence(&self) -> Result<CollapseSequence> {
        let list = self.optimize(Order::Paper, weighted_collapse::MAX_THREADS)?;
        let entries = list.collapses.iter().map(|c| busbar_geometry::Collapse {
            removed: c.removed,
            kept: c.kept,
            error: c.error,
        });
        Ok(CollapseSequence::new(entries.collect(), self.positions.len() as u32)?)
    }

    /// The mesh as a file would give it, a primitive a section.
    pub(crate) fn primitives(&self) -> Vec<RawPrimitive> {
        let wedges = &self.mesh.wedges;
        let sections = self.mesh.sections.iter().map(|section| {
            let first = section.first_triangle as usize;
            let triangles = &self.mesh.triangles[first..first + section.triangle_count as usize];
            let corners = || triangles.iter().flatten().copied();
            let least = corners().min().unwrap_or(0);
            let vertices = corners().max().map_or(0..0, |most| least as usize..most as usize + 1);
            RawPrimitive {
                positions: wedges.position[vertices.clone()]
                    .iter()
                    .map(|&position| self.mesh.positions[position as usize])
                    .collect(),
                normals: wedges.normal[vertices.clone()].to_vec(),
                uvs: wedges.uv[vertices.clone()].to_vec(),
                features: wedges.position[vertices]
                    .iter()
                    .filter_map(|&position| self.mesh.features.get(position as usize).copied())
                    .collect(),
                triangles: triangles.iter().map(|t| t.map(|wedge| wedge - least)).collect(),
                material: section.material,
            }
        });
        sections.collect()
    }
}

#[cfg(test)]
mod tests {
    use busbar_geometry::weld;
    use glam::Vec3;

    use super::*;

    /// What is welded again is what was imported.
    #[test]
    fn primitives_are_those_of_the_mesh() {
        let square = |x: f32, material| RawPrimitive {
            positions: [[0., 0.], [1., 0.], [1., 1.], [0., 1.]]
                .map(|[y, z]| Vec3::new(x * y, y, z))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: Some(material),
            ..RawPrimitive::default()
        };
        let (mesh, report) = weld(&[square(0.0, 0), square(1.0, 1)]).unwrap();
        assert!(report.positions < report.vertices_in, "an edge is shared");
        let scene = Scene::of(mesh.clone());
        assert_eq!(weld(&scene.primitives()).unwrap().0, mesh);
        let sequence = scene.sequence().unwrap();
        assert_eq!(sequence.len() as usize, mesh.positions.len() - 1);
    }
}
