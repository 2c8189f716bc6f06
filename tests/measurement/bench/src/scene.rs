//! Test scene: the paper's substation as one mesh, imported.

use anyhow::{Context, Result};
use busbar_geometry::{
    Bounds, CollapseSequence, Mesh, NO_FEATURE, RawPrimitive, Section, Topology, Wedges,
};
use busbar_gltf_import::ImportLimits;
use glam::{Vec2, Vec3};
use substation::Station;
use weighted_collapse::{MAX_THREADS, Order};

use crate::optimizers::{Input, sequence};

/// Seed of the equipment's erection tolerance, which is the generator's default.
const SEED: u64 = 1;

/// Mesh as imported, and in the form of optimisers' input.
pub(crate) struct Scene {
    pub(crate) mesh: Mesh,
    /// Names of the mesh's features.
    features: Vec<String>,
    pub(crate) topology: Topology,
}

impl Scene {
    /// Generates the paper-mode scene and imports it from the bytes of its file.
    pub(crate) fn paper() -> Result<Self> {
        let flat = Station::generate(SEED)?.flatten()?;
        let bytes = busbar_gltf_export::write_glb(&flat.model)?;
        let imported = busbar_gltf_import::import_bytes(&bytes, None, &ImportLimits::default())?;
        let mut model = imported.model;
        let features = model.features.pop().unwrap_or_default();
        Ok(Self::from_mesh(model.meshes.pop().context("the scene has no mesh")?, features))
    }

    fn from_mesh(mesh: Mesh, features: Vec<String>) -> Self {
        Self { topology: mesh.topology(), mesh, features }
    }

    /// Computes the paper's sequence, checked.
    pub(crate) fn sequence(&self) -> Result<CollapseSequence> {
        let list = Input::new(&self.mesh).weighted(Order::Paper, MAX_THREADS)?;
        sequence(&list, self.mesh.positions.len())
    }

    /// Returns positions and triangles alone, which meshoptimizer gets.
    pub(crate) fn bare(&self) -> Mesh {
        let Topology { positions, triangles } = self.topology.clone();
        let count = positions.len();
        let wedges = Wedges {
            position: (0..count as u32).collect(),
            normal: vec![Vec3::ZERO; count],
            uv: vec![Vec2::ZERO; count],
            section: vec![0; count],
        };
        let triangle_count = triangles.len() as u32;
        let sections = vec![Section { material: None, first_triangle: 0, triangle_count }];
        Mesh { positions, wedges, triangles, sections, features: Vec::new() }
    }

    /// Returns the bounding box of all equipment whose id begins with `start`; `None` if there is
    /// none.
    pub(crate) fn bounds_of(&self, start: &str) -> Option<Bounds> {
        let is_meant = |&feature: &u32| {
            let name = (feature != NO_FEATURE).then(|| self.features.get(feature as usize));
            name.flatten().is_some_and(|name| name.starts_with(start))
        };
        let points = self.mesh.positions.iter().zip(&self.mesh.features);
        Bounds::from_points(
            points.filter(|(_, feature)| is_meant(feature)).map(|(&point, _)| point),
        )
    }

    /// Returns the mesh as the primitives of a file, one a section.
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

    /// Primitives of the scene weld to the imported mesh again.
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
        let scene = Scene::from_mesh(mesh.clone(), Vec::new());
        assert_eq!(weld(&scene.primitives()).unwrap().0, mesh);
        let sequence = scene.sequence().unwrap();
        assert_eq!(sequence.len() as usize, mesh.positions.len() - 1);
    }
}
