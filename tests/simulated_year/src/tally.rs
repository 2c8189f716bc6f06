//! Statistics of a simulated year.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::mem::discriminant;
use std::time::Duration;

use busbar_plugin_sdk::{LinkState, Quality, Sample, Value};

/// Counts of a year, and what it came to.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Simulated time that has passed.
    pub duration: Duration,
    /// Times that the adapter tried to connect.
    pub dials: u64,
    /// The shortest time between two tries of one endpoint by one adapter.
    pub shortest_gap: Option<Duration>,
    /// Faults of the device's link.
    pub faults: u64,
    /// Times that the device was gone, and came back as a new one.
    pub outages: u64,
    /// Times that the adapter was stopped and started.
    pub reloads: u64,
    /// Times that the clock of the adapter's machine was set.
    pub clock_jumps: u64,
    /// Points at which all was well, and every tag good, right and fresh.
    pub quiet_points: u64,
    /// Points at which nothing worked, and every tag was bad for that.
    pub dead_points: u64,
    /// Samples with a time of their source, each of which has that time's value.
    pub timed_samples: u64,
    /// Number of samples without a source timestamp.
    pub untimed_samples: u64,
    /// Bytes on the heap at the year's end beyond those after its first days.
    pub heap_growth: i64,
    /// Greatest growth of the heap within a day, bytes.
    pub heap_peak: u64,
    /// Digest of all samples and link reports with their times.
    pub trace: u64,
}

impl Tally {
    pub(crate) fn note_report(&mut self, at: Duration, (state, message): &(LinkState, String)) {
        self.note(&(at, discriminant(state), message));
    }

    pub(crate) fn note_sample(&mut self, at: Duration, sample: &Sample) {
        let bits = sample.value.map(|value| match value {
            Value::F64(value) => value.to_bits(),
            Value::I64(value) => value.cast_unsigned(),
            Value::Bool(value) => value.into(),
            Value::DoublePoint(value) => value.bits().into(),
        });
        let reason = match sample.quality {
            Quality::Good => None,
            Quality::Uncertain(reason) | Quality::Bad(reason) => Some(discriminant(&reason)),
        };
        let quality = (discriminant(&sample.quality), reason);
        self.note(&(at, sample.tag, bits, quality, sample.source_time));
    }

    fn note(&mut self, what: &impl Hash) {
        let mut hasher = DefaultHasher::new();
        (self.trace, what).hash(&mut hasher);
        self.trace = hasher.finish();
    }
}
