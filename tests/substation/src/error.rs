//! Why a station cannot be made.

use busbar_geometry::WeldError;
use thiserror::Error;

/// Why a station cannot be made. All are faults of this crate's dimensions.
#[derive(Debug, Error)]
pub enum StationError {
    /// A shape has a point that is not finite.
    #[error("a shape cannot be welded: {0}; correct its dimensions")]
    Weld(#[from] WeldError),
    /// Two shells share a position, so that welding would join them.
    #[error(
        "{place}: {expected} positions became {found}: two shells share a position; \
         move one of them"
    )]
    ShellsTouch {
        /// Model and part, or the flattened station.
        place: String,
        /// Positions of the shells counted one by one.
        expected: usize,
        /// Positions after welding.
        found: usize,
    },
    /// The parts that close the sums cannot make up for the rest.
    #[error("{what} must be {range}, but the sums ask for {found}; change the other models")]
    DoesNotClose {
        /// What is to close the sum.
        what: &'static str,
        /// What is sensible.
        range: String,
        /// What would be needed.
        found: i64,
    },
    /// The layout names a model that is not in the catalogue.
    #[error("'{0}' is placed, but there is no such model; add it to the catalogue")]
    NoModel(String),
}
