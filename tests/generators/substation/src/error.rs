//! Errors of the station's generation.

use busbar_geometry::WeldError;
use thiserror::Error;

/// Error of the station's generation; each is a fault of this crate's dimensions.
#[derive(Debug, Error)]
pub enum StationError {
    /// Shape with a point that is not finite.
    #[error("a shape cannot be welded: {0}; correct its dimensions")]
    Weld(#[from] WeldError),
    /// Position that two shells share, so that welding would join them.
    #[error(
        "{place}: {expected} positions became {found}: two shells share a position; \
         move one of them"
    )]
    ShellsTouch {
        /// Model and part, or the flattened station.
        place: String,
        /// Number of positions of the shells counted one by one.
        expected: usize,
        /// Number of positions after welding.
        found: usize,
    },
    /// Filler geometry that cannot make up the paper's counts.
    #[error("{what} must be {range}, but the sums ask for {found}; change the other models")]
    DoesNotClose {
        /// Name of the quantity that does not match.
        what: &'static str,
        /// Range of sensible values.
        range: String,
        /// Value that would be needed.
        found: i64,
    },
    /// Name in the layout without a model in the catalogue.
    #[error("'{0}' is placed, but there is no such model; add it to the catalogue")]
    NoModel(String),
}
