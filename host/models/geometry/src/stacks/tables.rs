//! Tables of collapse stacks: parents, removal cursors and errors.

use thiserror::Error;

/// Steps in which the errors of a sequence are kept.
const MAX_ERROR_STEPS: usize = 4096;

/// Tables of collapse stacks. They belong to one mesh, can be stored, and make
/// stacks again with [`CollapseStacks::restore`](crate::CollapseStacks::restore).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StackTables {
    /// For each position that is ever removed, by number (so the last one
    /// removed comes first): the first wedge of the position it moves onto.
    pub parent_start: Vec<u32>,
    /// For each wedge: which of the wedges from there on stands for it.
    pub parent_offset: Vec<u8>,
    /// For each triangle: the smallest cursor at which two of its corners share
    /// a position, or [`NEVER_REMOVED`](crate::NEVER_REMOVED).
    pub removal_cursor: Vec<u32>,
    /// The greatest error of each step of equally many entries.
    pub errors: Vec<f32>,
    /// The longest chain of ancestors.
    pub max_depth: u32,
    /// True if theta is a share of this mesh, not of its model.
    pub theta_by_mesh: bool,
}

/// Reasons why tables do not belong to a mesh.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum TablesError {
    /// An array is longer or shorter than the mesh needs.
    #[error("{found} {what} for {expected}")]
    Length {
        /// Name of the array.
        what: &'static str,
        /// Length of the array.
        found: usize,
        /// The length it must have.
        expected: usize,
    },
    /// Positions are not numbered each once.
    #[error("the numbers of positions are no permutation")]
    NoPermutation,
    /// A wedge stands for one that is removed later, or does not exist.
    #[error("wedge {wedge} has no earlier parent")]
    NoParent {
        /// Index of the faulty wedge.
        wedge: usize,
    },
}

impl StackTables {
    /// Samples the greatest error of every step of entries.
    pub(super) fn sample_errors(errors: impl ExactSizeIterator<Item = f32>) -> Vec<f32> {
        let count = errors.len();
        let step = step(count);
        errors
            .enumerate()
            .filter(|(entry, _)| (entry + 1) % step == 0 || entry + 1 == count)
            .map(|(_, error)| error)
            .collect()
    }

    pub(super) fn error_at(&self, cursor: u32) -> f32 {
        let entry = cursor as usize;
        if entry == 0 {
            return 0.0;
        }
        let step = step(self.parent_start.len());
        self.errors.get((entry - 1) / step).copied().unwrap_or(0.0)
    }

    /// Returns the farthest cursor that is known to have no greater error.
    pub(super) fn cursor_for_error(&self, error: f32) -> u32 {
        let count = self.parent_start.len();
        let within = self.errors.partition_point(|&e| e <= error);
        (within * step(count)).min(count) as u32
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.parent_start.as_slice())
            + size_of_val(self.parent_offset.as_slice())
            + size_of_val(self.removal_cursor.as_slice())
            + size_of_val(self.errors.as_slice())
    }
}

fn step(entries: usize) -> usize {
    entries.div_ceil(MAX_ERROR_STEPS).max(1)
}
