//! Parts: solids with finishes, which become one mesh.

use busbar_geometry::RawPrimitive;
use glam::Mat4;

use crate::{Finish, Solid};

/// Part of solids that move together and are one mesh in the file.
#[derive(Clone, Debug, Default)]
pub struct Part {
    solids: Vec<(Finish, Solid)>,
}

impl Part {
    /// Creates an empty part.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a solid with its finish.
    pub fn add(&mut self, finish: Finish, solid: Solid) -> &mut Self {
        self.solids.push((finish, solid));
        self
    }

    /// Adds several solids of one finish.
    pub fn add_all(
        &mut self,
        finish: Finish,
        solids: impl IntoIterator<Item = Solid>,
    ) -> &mut Self {
        self.solids.extend(solids.into_iter().map(|solid| (finish, solid)));
        self
    }

    /// Adds another part, placed by `transform`.
    pub fn add_part(&mut self, part: Part, transform: Mat4) -> &mut Self {
        let placed = part.solids.into_iter().map(|(f, solid)| (f, solid.transformed(transform)));
        self.solids.extend(placed);
        self
    }

    /// Iterates over the solids.
    pub fn solids(&self) -> impl Iterator<Item = &Solid> {
        self.solids.iter().map(|(_, solid)| solid)
    }

    /// Returns one primitive per finish, in order of first use; `material_of` numbers the finishes.
    pub(crate) fn primitives(
        &self,
        mut material_of: impl FnMut(Finish) -> u32,
    ) -> Vec<RawPrimitive> {
        let mut primitives: Vec<(Finish, RawPrimitive)> = Vec::new();
        for (finish, solid) in &self.solids {
            let slot = primitives.iter().position(|(f, _)| f == finish).unwrap_or_else(|| {
                let material = Some(material_of(*finish));
                primitives.push((*finish, RawPrimitive { material, ..RawPrimitive::default() }));
                primitives.len() - 1
            });
            solid.append_to(&mut primitives[slot].1);
        }
        primitives.into_iter().map(|(_, primitive)| primitive).collect()
    }
}
