//! Validation of meshes that come from outside: the invariants of every welded mesh.

use super::{Mesh, NO_FEATURE};

impl Mesh {
    /// Reports whether the mesh keeps the invariants of welding. Every index is in range, and every
    /// position is finite and has a wedge. The corners of a triangle have different positions and
    /// one feature below `features`. Sections cover all triangles in order.
    pub fn is_welded(&self, features: usize) -> bool {
        self.has_whole_arrays(features)
            && self.positions.iter().all(|position| position.is_finite())
            && self.every_position_has_a_wedge()
            && self.triangles.iter().all(|&triangle| self.is_sound(triangle))
    }

    fn has_whole_arrays(&self, features: usize) -> bool {
        let Self { positions, wedges, triangles, sections, features: of_positions } = self;
        let count = wedges.position.len();
        let are_parallel = [wedges.normal.len(), wedges.uv.len(), wedges.section.len()]
            .iter()
            .all(|&other| other == count);
        let is_one = |&feature: &u32| feature == NO_FEATURE || (feature as usize) < features;
        let has_features = of_positions.is_empty() || of_positions.len() == positions.len();
        let mut next = 0;
        let follows = sections.iter().all(|section| {
            let begins = section.first_triangle == next;
            next = next.saturating_add(section.triangle_count);
            begins
        });
        let sections = sections.len();
        are_parallel
            && has_features
            && of_positions.iter().all(is_one)
            && follows
            && next as usize == triangles.len()
            && wedges.section.iter().all(|&section| (section as usize) < sections)
    }

    fn every_position_has_a_wedge(&self) -> bool {
        let mut has_one = vec![false; self.positions.len()];
        let stands = |&position: &u32| {
            has_one.get_mut(position as usize).map(|has_one| *has_one = true).is_some()
        };
        self.wedges.position.iter().all(stands) && has_one.into_iter().all(|has_one| has_one)
    }

    /// Reports whether a triangle's wedges exist and its corners differ and share a feature. The
    /// wedges' positions are known to exist.
    fn is_sound(&self, triangle: [u32; 3]) -> bool {
        let position = |wedge: u32| self.wedges.position.get(wedge as usize).copied();
        let [Some(a), Some(b), Some(c)] = triangle.map(position) else { return false };
        let feature = |position: u32| self.features.get(position as usize);
        a != b && b != c && c != a && feature(a) == feature(b) && feature(b) == feature(c)
    }
}
