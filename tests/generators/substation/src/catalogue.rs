//! Catalogue of the station's models.

use std::collections::BTreeMap;

use busbar_scene::Model;
use demo_model::Assembly;
use glam::Mat4;

use crate::StationError;
use crate::body::Body;

/// Models by name, in the order of their names.
#[derive(Debug, Default)]
pub struct Catalogue {
    entries: BTreeMap<String, Entry>,
}

/// Model with its counts.
#[derive(Debug)]
pub struct Entry {
    /// Model with its materials and meshes.
    pub model: Model,
    /// Counts of welded positions and triangles of all its nodes.
    pub counts: Counts,
}

/// Counts of welded positions and triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of welded positions.
    pub vertices: usize,
    /// Number of welded triangles.
    pub triangles: usize,
}

impl Catalogue {
    /// Returns a model if the name is known.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.get(name)
    }

    /// Iterates over all models with their names.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Entry)> {
        self.entries.iter().map(|(name, entry)| (name.as_str(), entry))
    }

    /// Adds a model of one part.
    pub(crate) fn add(&mut self, name: &str, body: Body) -> Result<(), StationError> {
        self.add_parts(name, &[body], &[("body".to_owned(), 0, Mat4::IDENTITY)])
    }

    /// Adds a model of named parts; each names its body by index and its place.
    pub(crate) fn add_parts(
        &mut self,
        name: &str,
        bodies: &[Body],
        parts: &[(String, usize, Mat4)],
    ) -> Result<(), StationError> {
        let (mut assembly, root) = Assembly::new(name);
        let meshes =
            bodies.iter().map(|body| assembly.mesh(&body.part)).collect::<Result<Vec<_>, _>>()?;
        for (part_name, body, place) in parts {
            assembly.place(part_name, root, meshes[*body], *place);
        }
        let model = assembly.into_model();
        for (index, (mesh, body)) in model.meshes.iter().zip(bodies).enumerate() {
            if mesh.positions.len() != body.positions {
                return Err(StationError::ShellsTouch {
                    place: format!("model {name}, mesh {index}"),
                    expected: body.positions,
                    found: mesh.positions.len(),
                });
            }
        }
        let mut counts = Counts::default();
        for (_, body, _) in parts {
            let mesh = &model.meshes[*body];
            counts.vertices += mesh.positions.len();
            counts.triangles += mesh.triangles.len();
        }
        self.entries.insert(name.to_owned(), Entry { model, counts });
        Ok(())
    }
}
