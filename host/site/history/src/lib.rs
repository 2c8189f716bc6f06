//! The last hours of tags, in memory, within limits.
//!
//! Each change of a number is a [`Point`]; a tag is what its last point says until the
//! next. The newest points are kept as they came, older ones reduced: of each bucket of
//! [`BUCKET`] the first, the least, the greatest and the last stay, and the first that was
//! not good, so that neither a spike nor a gap is ever lost ("M4" of U. Jugel et al.,
//! Proc. VLDB Endowment 7(10), 2014). What is drawn is reduced once more, to columns of
//! the picture.
//!
//! Invariant: knows tags alone; reads no clock and no file.

mod history;
mod point;
mod reduce;
mod series;

pub use history::{History, MAX_TAGS};
pub use point::{Point, PointState};
pub use series::{BUCKET, MAX_AGE, MAX_FINE_POINTS};
