//! Level-of-detail extraction: the live triangles of a mesh at a cursor.

use super::{CollapseStacks, ResolvedMesh};
use crate::Section;

/// No wedge has this index.
const UNKNOWN: u32 = u32::MAX;

impl CollapseStacks {
    /// Resolves the mesh at a cursor by filtering and relabelling triangles.
    pub fn resolve(&self, cursor: u32) -> ResolvedMesh<'_> {
        let live = self.live_triangles(cursor) as usize;
        if cursor == 0 && live == self.mesh.triangles.len() {
            return self.imported();
        }
        if 3 * live < self.mesh.wedges.len() {
            let mut few = self.filter(cursor, live, |wedge| wedge);
            if self.climb(few.triangles.as_flattened_mut(), cursor).is_some() {
                return few;
            }
        }
        let standing = self.representative_wedges(cursor);
        self.filter(cursor, live, |wedge| standing[wedge as usize])
    }

    /// Returns the mesh without any removed triangle.
    fn imported(&self) -> ResolvedMesh<'_> {
        let range = |s: &Section| s.first_triangle..s.first_triangle + s.triangle_count;
        ResolvedMesh {
            stacks: self,
            triangles: self.mesh.triangles.clone(),
            sections: self.mesh.sections.iter().map(range).collect(),
        }
    }

    /// Filters the live triangles and relabels their corners.
    fn filter(&self, cursor: u32, live: usize, stand: impl Fn(u32) -> u32) -> ResolvedMesh<'_> {
        let mut resolved = ResolvedMesh {
            stacks: self,
            triangles: Vec::with_capacity(live),
            sections: Vec::with_capacity(self.mesh.sections.len()),
        };
        for section in &self.mesh.sections {
            let start = resolved.triangles.len() as u32;
            let first = section.first_triangle as usize;
            let all = first..first + section.triangle_count as usize;
            let triangles = self.mesh.triangles[all.clone()].iter();
            let deaths = &self.tables.removal_cursor[all];
            let live = triangles.zip(deaths).filter(|&(_, &death)| death > cursor);
            resolved.triangles.extend(live.map(|(corners, _)| corners.map(&stand)));
            resolved.sections.push(start..resolved.triangles.len() as u32);
        }
        resolved
    }

    /// Moves corners up to their first surviving ancestors, all by one step at a time and without
    /// unpredictable branches. Gives up where that takes more steps than there are wedges.
    fn climb(&self, corners: &mut [u32], cursor: u32) -> Option<()> {
        let surviving = self.surviving(cursor);
        let is_removed = |wedge: u32| self.mesh.wedges.position[wedge as usize] >= surviving;
        let mut pending = vec![0; corners.len()];
        let mut count = 0;
        for (corner, &wedge) in (0..).zip(&*corners) {
            pending[count] = corner;
            count += usize::from(is_removed(wedge));
        }
        pending.truncate(count);
        let mut steps_left = self.mesh.wedges.len();
        while !pending.is_empty() {
            steps_left = steps_left.checked_sub(pending.len())?;
            let mut kept = 0;
            for i in 0..pending.len() {
                let corner = pending[i];
                let parent = self.parent(corners[corner as usize] as usize) as u32;
                corners[corner as usize] = parent;
                pending[kept] = corner;
                kept += usize::from(is_removed(parent));
            }
            pending.truncate(kept);
        }
        Some(())
    }

    /// Returns the representative of each wedge at a cursor.
    pub fn representative_wedges(&self, cursor: u32) -> Vec<u32> {
        let positions = self.mesh.wedges.position.as_slice();
        let surviving = self.surviving(cursor);
        let mut standing = vec![UNKNOWN; positions.len()];
        for wedge in 0..positions.len() {
            // Up to an ancestor that survives, or whose own is known...
            let mut ancestor = wedge;
            while standing[ancestor] == UNKNOWN && positions[ancestor] >= surviving {
                ancestor = self.parent(ancestor);
            }
            let stands = match standing[ancestor] {
                UNKNOWN => ancestor as u32,
                known => known,
            };
            standing[ancestor] = stands;
            // ...and once more to tell all on the way, so that no chain is
            // climbed twice however long it is.
            let mut descendant = wedge;
            while descendant != ancestor {
                standing[descendant] = stands;
                descendant = self.parent(descendant);
            }
        }
        standing
    }

    /// Returns the parent of a wedge, which represents it once its position is removed.
    fn parent(&self, wedge: usize) -> usize {
        let fixed = self.position_count() - self.collapse_count();
        let removed = self.mesh.wedges.position[wedge] - fixed;
        let start = self.tables.parent_start[removed as usize];
        start as usize + usize::from(self.tables.parent_offset[wedge])
    }
}
