//! Tags: values of equipment with quality and freshness.
//!
//! Samples go through a bounded [`SampleQueue`] into the [`TagTable`]; the
//! frame reads one consistent [`Snapshot`]. Freshness is decided here, on the
//! monotonic clock: a value past its limit is stale whatever its source says.
//!
//! Invariant: nothing here knows a protocol, and nothing here draws.

mod queue;
mod table;
mod value;

pub use queue::{MAX_QUEUED_SAMPLES, SampleQueue};
pub use table::{QualityCounts, Snapshot, TagHandle, TagSpec, TagState, TagTable};
pub use value::{DoublePoint, Quality, Reason, Sample, Value, ValueKind};
