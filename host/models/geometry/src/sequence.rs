//! Collapse sequence: the ordered list of half-edge collapses that an optimiser makes.

use thiserror::Error;

/// One half-edge collapse: `removed` moves onto `kept` and is gone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collapse {
    /// Position that the collapse removes.
    pub removed: u32,
    /// Position that stands for it from then on.
    pub kept: u32,
    /// Geometric error after this collapse, in the mesh's units. Never
    /// decreases along a sequence.
    pub error: f32,
}

/// A checked sequence: each entry removes a live position onto another live
/// one, so that the parents form a forest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CollapseSequence {
    entries: Vec<Collapse>,
    position_count: u32,
    theta_by_mesh: bool,
}

/// Reasons why a list of collapses is no sequence. An optimiser plugin is at fault.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum SequenceError {
    /// A position index does not exist.
    #[error("collapse {index} names position {position}, but the mesh has {count}")]
    OutOfRange {
        /// Index of the faulty entry.
        index: usize,
        /// Position that it names.
        position: u32,
        /// Number of positions there are.
        count: u32,
    },
    /// A position collapses onto itself.
    #[error("collapse {index} moves position {position} onto itself")]
    SelfCollapse {
        /// Index of the faulty entry.
        index: usize,
        /// Position collapsed onto itself.
        position: u32,
    },
    /// A position that an earlier entry removed is used again.
    #[error("collapse {index} uses position {position}, which an earlier collapse removed")]
    AlreadyRemoved {
        /// Index of the faulty entry.
        index: usize,
        /// Position that was removed already.
        position: u32,
    },
    /// The error is negative, not finite, or smaller than the one before it.
    #[error("collapse {index} has an error that is not finite or decreases")]
    BadError {
        /// Index of the faulty entry.
        index: usize,
    },
}

impl CollapseSequence {
    /// Checks a list of collapses over `position_count` positions.
    ///
    /// # Errors
    /// The first entry that breaks a rule.
    pub fn new(entries: Vec<Collapse>, position_count: u32) -> Result<Self, SequenceError> {
        let mut removed = vec![false; position_count as usize];
        let mut last_error = 0.0;
        for (index, entry) in entries.iter().enumerate() {
            for position in [entry.removed, entry.kept] {
                match removed.get(position as usize) {
                    None => {
                        return Err(SequenceError::OutOfRange {
                            index,
                            position,
                            count: position_count,
                        });
                    }
                    Some(true) => return Err(SequenceError::AlreadyRemoved { index, position }),
                    Some(false) => {}
                }
            }
            if entry.removed == entry.kept {
                return Err(SequenceError::SelfCollapse { index, position: entry.removed });
            }
            if !entry.error.is_finite() || entry.error < last_error {
                return Err(SequenceError::BadError { index });
            }
            last_error = entry.error;
            removed[entry.removed as usize] = true;
        }
        Ok(Self { entries, position_count, theta_by_mesh: false })
    }

    /// Makes a sequence in which nothing collapses.
    pub fn empty(position_count: u32) -> Self {
        Self { entries: Vec::new(), position_count, theta_by_mesh: false }
    }

    /// Sets whether theta is a share of this mesh, not of its model.
    #[must_use]
    pub fn with_theta_by_mesh(self, theta_by_mesh: bool) -> Self {
        Self { theta_by_mesh, ..self }
    }

    /// Reports whether theta is a share of this mesh, not of its model.
    pub fn is_theta_by_mesh(&self) -> bool {
        self.theta_by_mesh
    }

    /// Returns the collapses in order.
    pub fn entries(&self) -> &[Collapse] {
        &self.entries
    }

    /// Returns the number of collapses.
    pub fn len(&self) -> u32 {
        self.entries.len() as u32
    }

    /// Reports whether nothing collapses.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns the number of positions of the mesh this sequence belongs to.
    pub fn position_count(&self) -> u32 {
        self.position_count
    }
}

/// Converts a proportion `theta` of simplified vertices to a cursor (the paper's section IV, in
/// welded positions): `round(theta * V)`, at most the number of collapses.
pub fn theta_to_cursor(theta: f64, position_count: u32, collapse_count: u32) -> u32 {
    let wanted = (theta.clamp(0.0, 1.0) * f64::from(position_count)).round() as u32;
    wanted.min(collapse_count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(removed: u32, kept: u32, error: f32) -> Collapse {
        Collapse { removed, kept, error }
    }

    #[test]
    fn refuses_what_is_no_forest() {
        let check = |entries: Vec<Collapse>| CollapseSequence::new(entries, 4).unwrap_err();
        assert!(matches!(check(vec![entry(4, 0, 0.0)]), SequenceError::OutOfRange { .. }));
        assert!(matches!(check(vec![entry(1, 1, 0.0)]), SequenceError::SelfCollapse { .. }));
        assert!(matches!(
            check(vec![entry(1, 0, 0.0), entry(2, 1, 0.0)]),
            SequenceError::AlreadyRemoved { index: 1, position: 1 }
        ));
        assert!(matches!(
            check(vec![entry(1, 0, 0.0), entry(1, 2, 0.0)]),
            SequenceError::AlreadyRemoved { index: 1, position: 1 }
        ));
        assert!(matches!(check(vec![entry(1, 0, f32::NAN)]), SequenceError::BadError { .. }));
        assert!(matches!(
            check(vec![entry(1, 0, 2.0), entry(2, 0, 1.0)]),
            SequenceError::BadError { index: 1 }
        ));
    }

    #[test]
    fn theta_counts_vertices_as_table_one_does() {
        let cursor = |theta| theta_to_cursor(theta, 536_141, 536_140);
        assert_eq!(536_141 - cursor(0.0), 536_141);
        assert_eq!(536_141 - cursor(0.70), 160_842);
        assert_eq!(536_141 - cursor(0.85), 80_421);
        assert_eq!(theta_to_cursor(1.0, 8, 7), 7);
    }
}
