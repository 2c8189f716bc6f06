//! Collapse stacks: one immutable array of collapses, and the mesh at any
//! cursor on it.
//!
//! The paper's pair of stacks (section III) is one array and a cursor `k`, the
//! number of entries done: S2 = entries[..k] (collapsed), S1 = entries[k..]
//! (to be collapsed). Pop and push is `k + 1` or `k - 1`. Nothing is edited
//! when a cursor moves, so going back loses nothing by construction.
//!
//! Positions are numbered in reverse order of their removal: of V positions,
//! entry `i` removes number `V - 1 - i`, and those below `V - k` survive `k`
//! entries. So neither the array nor anybody's collapse index needs to be kept.

mod build;
mod resolve;
mod tables;
#[cfg(test)]
mod tests;
mod triangle_removal;

use std::ops::Range;

use crate::theta_sharing::{self, SharedCursors};
use crate::{Mesh, SlenderPoint};

pub use build::removal_ranks;
pub use tables::{StackTables, TablesError};
pub(crate) use triangle_removal::removal_cursors;

/// The death index of a triangle that no cursor kills.
pub const NEVER_REMOVED: u32 = u32::MAX;

/// A mesh with everything needed to show it at any cursor.
///
/// Its wedges and triangles are the imported ones, in their order, which is
/// good for vertex locality; its positions are renumbered.
#[derive(Clone, Debug)]
pub struct CollapseStacks {
    mesh: Mesh,
    tables: StackTables,
    slender: Vec<SlenderPoint>,
    /// Cursors of the thetas of its model; none where theta is the mesh's own.
    shared_cursors: Option<SharedCursors>,
}

/// The mesh at one cursor: live triangles in import order.
#[derive(Clone, Debug)]
pub struct ResolvedMesh<'a> {
    stacks: &'a CollapseStacks,
    /// Corners of live triangles, as wedge indices into [`CollapseStacks::mesh`].
    pub triangles: Vec<[u32; 3]>,
    /// For each section of the mesh, its range in `triangles`.
    pub sections: Vec<Range<u32>>,
}

impl CollapseStacks {
    /// Returns the mesh, its positions numbered in reverse order of removal.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the mesh without its tables.
    pub(crate) fn into_mesh(self) -> Mesh {
        self.mesh
    }

    /// Returns the tables that belong to the mesh.
    pub fn tables(&self) -> &StackTables {
        &self.tables
    }

    /// Returns the points of slender and round islands in the mesh as imported.
    pub fn slender_points(&self) -> &[SlenderPoint] {
        &self.slender
    }

    /// Returns the number of positions of the mesh, V.
    pub fn position_count(&self) -> u32 {
        self.mesh.positions.len() as u32
    }

    /// Returns the number of collapses: S1 and S2 together.
    pub fn collapse_count(&self) -> u32 {
        self.tables.parent_start.len() as u32
    }

    /// Iterates over the collapses in order, as (removed, kept) positions.
    pub fn collapses(&self) -> impl ExactSizeIterator<Item = (u32, u32)> + DoubleEndedIterator {
        let last = self.position_count().wrapping_sub(1);
        let kept = |&wedge: &u32| self.mesh.wedges.position[wedge as usize];
        let kept = self.tables.parent_start.iter().rev().map(kept);
        kept.enumerate().map(move |(entry, kept)| (last - entry as u32, kept))
    }

    /// Returns the cursor for a proportion of simplified vertices: of the mesh, or of its model where
    /// [`share_theta`](crate::share_theta) shared it.
    pub fn cursor_for_theta(&self, theta: f64) -> u32 {
        let (positions, collapses) = (self.position_count(), self.collapse_count());
        theta_sharing::cursor(self.shared_cursors.as_ref(), theta, positions, collapses)
    }

    /// Takes the cursors of evenly spaced thetas of its model.
    pub(crate) fn share(&mut self, cursors: SharedCursors) {
        self.shared_cursors = Some(cursors);
    }

    /// Counts the positions that survive at a cursor: those with smaller numbers.
    pub fn surviving(&self, cursor: u32) -> u32 {
        self.position_count() - cursor.min(self.collapse_count())
    }

    /// Counts the triangles that live at a cursor.
    pub fn live_triangles(&self, cursor: u32) -> u64 {
        self.tables.removal_cursor.iter().filter(|&&death| death > cursor).count() as u64
    }

    /// Iterates over the import indices of the triangles that live at a cursor, in the order of
    /// [`ResolvedMesh::triangles`]. A triangle keeps its identity.
    pub fn live(&self, cursor: u32) -> impl Iterator<Item = u32> + '_ {
        (0_u32..)
            .zip(&self.tables.removal_cursor)
            .filter_map(move |(triangle, &death)| (death > cursor).then_some(triangle))
    }

    /// Returns the length of the longest chain of ancestors.
    pub fn max_depth(&self) -> u32 {
        self.tables.max_depth
    }

    /// Returns the smallest cursor at which a triangle is removed, or [`NEVER_REMOVED`].
    pub fn removal_cursor(&self, triangle: usize) -> u32 {
        self.tables.removal_cursor[triangle]
    }

    /// Returns a bound on the geometric error at a cursor, in the mesh's units.
    pub fn error_at(&self, cursor: u32) -> f32 {
        self.tables.error_at(cursor.min(self.collapse_count()))
    }

    /// Returns the farthest cursor whose error is known to be within `error`, in the mesh's units.
    /// The true limit may lie up to a step of the error table farther.
    pub fn cursor_for_error(&self, error: f32) -> u32 {
        self.tables.cursor_for_error(error)
    }

    /// Returns the bytes that the stacks add to a plain indexed mesh.
    pub fn static_bytes(&self) -> usize {
        self.tables.bytes()
    }
}

impl ResolvedMesh<'_> {
    /// Iterates over the live triangles as position indices.
    pub fn position_triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles.iter().map(|&t| self.stacks.mesh.corner_positions(t))
    }

    /// Returns the bound of the position indices.
    pub fn position_count(&self) -> u32 {
        self.stacks.position_count()
    }
}
