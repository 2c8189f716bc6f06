//! Tags: values of equipment with quality and freshness.
//!
//! Samples go through a bounded [`SampleQueue`] or ring into the [`TagTable`]; the
//! frame reads one consistent [`Snapshot`]. Freshness is decided here, on a clock
//! that never jumps: a value past its limit is stale whatever its source says.
//!
//! Invariant: nothing here knows a protocol, and nothing here draws.
#![doc = include_str!("../DESIGN.md")]

mod changes;
mod derived;
mod events;
mod expression;
mod handle_remap;
mod moment;
mod observed_state;
mod packed;
mod pause;
mod queue;
mod sample;
mod snapshot;
mod spec;
mod table;
mod tag_handle;
mod tag_state;
mod timing_wheel;

pub use events::{Event, EventLog, MAX_EVENTS};
pub use expression::{Expression, ExpressionError, MAX_EXPRESSION_BYTES, MAX_EXPRESSION_DEPTH};
pub use handle_remap::HandleRemap;
pub use moment::Moment;
pub use observed_state::{QualityCounts, TagState};
pub use pause::{ClockReadings, Pause, PauseDetector, PauseEvidence};
pub use queue::{Backlog, MAX_QUEUED_SAMPLES, SampleQueue, Update};
pub use sample::{Change, Sample, SourceTime};
pub use snapshot::Snapshot;
pub use spec::{Scale, TagSet, TagSpec, TagSpecError};
pub use table::TagTable;
pub use tag_handle::TagHandle;
