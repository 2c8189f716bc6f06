//! Poses of parts that are moved from their modelled place.

use std::collections::HashMap;

use glam::{DMat4, Mat4};

use crate::node_index::NodeAddress;
use crate::parts::Parts;

/// Poses of moved parts, in their own spaces. Few parts are moved at a time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Poses {
    /// By placement: parts with their poses.
    of_placements: HashMap<u32, Vec<(u32, Mat4)>>,
}

impl Poses {
    /// Moves a part; `None` puts it back where its model has it. Whether that changes it.
    pub(crate) fn set(
        &mut self,
        NodeAddress { placement, part }: NodeAddress,
        pose: Option<Mat4>,
    ) -> bool {
        let Some(part) = part else { return false };
        let moved = self.of_placements.entry(placement).or_default();
        let known = moved.iter().position(|(other, _)| *other == part);
        let was = known.map(|at| moved[at].1);
        match (known, pose) {
            (Some(at), Some(pose)) => moved[at].1 = pose,
            (Some(at), None) => drop(moved.swap_remove(at)),
            (None, Some(pose)) => moved.push((part, pose)),
            (None, None) => {}
        }
        if moved.is_empty() {
            self.of_placements.remove(&placement);
        }
        was != pose
    }

    /// Returns the transform of a part in its placement, with its own pose and those of its
    /// ancestors.
    pub(crate) fn placement_from(&self, parts: &Parts, placement: u32, part: u32) -> DMat4 {
        let as_modelled = parts.all[part as usize].placement_from_part;
        let Some(moved) = self.of_placements.get(&placement) else { return as_modelled };
        let mut placement_from_part = as_modelled;
        let mut above = Some(part);
        while let Some(index) = above {
            let own = &parts.all[index as usize];
            if let Some((_, pose)) = moved.iter().find(|(other, _)| *other == index) {
                let from_own = own.placement_from_part;
                let moved_own = from_own * pose.as_dmat4() * from_own.inverse();
                placement_from_part = moved_own * placement_from_part;
            }
            above = own.parent;
        }
        placement_from_part
    }
}
