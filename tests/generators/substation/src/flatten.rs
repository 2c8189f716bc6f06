//! Station as one mesh in world space, with the equipment of each triangle.

use std::collections::HashMap;
use std::fmt::Write;

use busbar_geometry::{RawPrimitive, weld};
use busbar_scene::{Material, Model, ModelNode};
use glam::{DMat4, Mat4, Vec3};

use crate::catalogue::Entry;
use crate::{Station, StationError};

/// Station flattened into one mesh.
#[derive(Debug)]
pub struct FlatStation {
    /// Model of one node with one mesh: a section for each material, a feature for each piece of
    /// equipment.
    pub model: Model,
    /// Runs of triangles of one piece of equipment, in order, covering all.
    pub runs: Vec<Run>,
}

/// Consecutive triangles of one piece of equipment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Index of the first triangle in the mesh.
    pub first_triangle: usize,
    /// Number of triangles, at least 1.
    pub triangle_count: usize,
    /// Id of the equipment.
    pub equipment: String,
}

#[derive(Default)]
struct Flattener {
    materials: Vec<Material>,
    primitives: Vec<RawPrimitive>,
    /// Equipment ids in the order of placements; the index is the feature.
    equipment: Vec<String>,
    /// Feature and triangle count, for each primitive.
    owners: Vec<Vec<(u32, usize)>>,
    positions: usize,
}

impl Station {
    /// Merges all triangles into one mesh, by material, then by equipment.
    ///
    /// # Errors
    /// [`StationError`] if two shells of one piece of equipment share a position
    /// in the world.
    pub fn flatten(&self) -> Result<FlatStation, StationError> {
        let mut flattener = Flattener::default();
        for placement in &self.placements {
            let entry = self
                .catalogue
                .get(&placement.model)
                .ok_or_else(|| StationError::NoModel(placement.model.clone()))?;
            flattener.add(entry, &placement.id(), placement.world_from_model());
        }
        flattener.finish()
    }
}

impl Flattener {
    fn add(&mut self, entry: &Entry, equipment: &str, world_from_model: Mat4) {
        let model = &entry.model;
        let feature = self.equipment.len() as u32;
        self.equipment.push(equipment.to_owned());
        for (node, model_from_node) in model.nodes.iter().zip(model.model_from_nodes()) {
            let Some(mesh) = node.mesh.map(|mesh| &model.meshes[mesh as usize]) else { continue };
            let world_from_node = world_from_model * model_from_node.as_mat4();
            self.positions += mesh.positions.len();
            let place = |wedge: u32| -> (Vec3, Vec3) {
                let position = mesh.wedges.position[wedge as usize] as usize;
                let normal = mesh.wedges.normal[wedge as usize];
                (
                    world_from_node.transform_point3(mesh.positions[position]),
                    world_from_node.transform_vector3(normal),
                )
            };
            for section in &mesh.sections {
                let material = section.material.map(|m| &model.materials[m as usize]);
                let slot = self.slot(material.cloned().unwrap_or_default());
                let first = section.first_triangle as usize;
                let triangles = &mesh.triangles[first..first + section.triangle_count as usize];
                let primitive = &mut self.primitives[slot];
                let mut renumbered: HashMap<u32, u32> = HashMap::new();
                for corners in triangles {
                    let triangle = corners.map(|wedge| {
                        *renumbered.entry(wedge).or_insert_with(|| {
                            let (position, normal) = place(wedge);
                            primitive.positions.push(position);
                            primitive.normals.push(normal);
                            primitive.features.push(feature);
                            primitive.positions.len() as u32 - 1
                        })
                    });
                    primitive.triangles.push(triangle);
                }
                note_owner(&mut self.owners[slot], feature, triangles.len());
            }
        }
    }

    fn slot(&mut self, material: Material) -> usize {
        self.materials.iter().position(|known| *known == material).unwrap_or_else(|| {
            let index = Some(self.materials.len() as u32);
            self.primitives.push(RawPrimitive { material: index, ..RawPrimitive::default() });
            self.owners.push(Vec::new());
            self.materials.push(material);
            self.materials.len() - 1
        })
    }

    fn finish(self) -> Result<FlatStation, StationError> {
        let (mesh, report) = weld(&self.primitives)?;
        if mesh.positions.len() != self.positions || report.coincident_triangles > 0 {
            return Err(StationError::ShellsTouch {
                place: "the flattened station".to_owned(),
                expected: self.positions,
                found: mesh.positions.len(),
            });
        }
        let mut runs = Vec::new();
        let mut first_triangle = 0;
        for (feature, triangle_count) in self.owners.into_iter().flatten() {
            let equipment = self.equipment[feature as usize].clone();
            runs.push(Run { first_triangle, triangle_count, equipment });
            first_triangle += triangle_count;
        }
        let node = ModelNode {
            name: "substation".to_owned(),
            parent: None,
            parent_from_node: DMat4::IDENTITY,
            mesh: Some(0),
        };
        let model = Model {
            meshes: vec![mesh],
            features: vec![self.equipment],
            materials: self.materials,
            textures: Vec::new(),
            nodes: vec![node],
        };
        Ok(FlatStation { model, runs })
    }
}

fn note_owner(owners: &mut Vec<(u32, usize)>, feature: u32, triangles: usize) {
    if triangles == 0 {
        return;
    }
    match owners.last_mut() {
        Some((last, count)) if *last == feature => *count += triangles,
        _ => owners.push((feature, triangles)),
    }
}

impl FlatStation {
    /// Formats the runs as CSV.
    pub fn equipment_csv(&self) -> String {
        let mut csv = "first_triangle,triangle_count,equipment\n".to_owned();
        for Run { first_triangle, triangle_count, equipment } in &self.runs {
            // Writing to a string does not fail.
            let _ = writeln!(csv, "{first_triangle},{triangle_count},{equipment}");
        }
        csv
    }
}
