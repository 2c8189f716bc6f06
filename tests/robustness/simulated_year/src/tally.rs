//! Statistics of a simulated year.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::mem::discriminant;
use std::time::Duration;

use busbar_plugin_sdk::{LinkState, Quality, Sample, Value};

/// Counts of a year, and the digest of its course.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Simulated time that has passed.
    pub duration: Duration,
    /// Number of the adapter's dial attempts.
    pub dials: u64,
    /// Shortest time between two attempts at one endpoint by one adapter.
    pub shortest_gap: Option<Duration>,
    /// Number of faults of the device's link.
    pub faults: u64,
    /// Number of outages, after each of which a new device started.
    pub outages: u64,
    /// Number of restarts of the adapter.
    pub reloads: u64,
    /// Number of jumps of the adapter's clock.
    pub clock_jumps: u64,
    /// Number of checks without disturbance, at which every tag was good, right and fresh.
    pub quiet_points: u64,
    /// Number of checks without any connection, at which every tag was bad for that reason.
    pub dead_points: u64,
    /// Number of samples with a source timestamp, each of which has that time's value.
    pub timed_samples: u64,
    /// Number of samples without a source timestamp.
    pub untimed_samples: u64,
    /// Growth of the heap from the first days to the year's end, bytes.
    pub heap_growth: i64,
    /// Greatest growth of the heap within a day, bytes.
    pub heap_peak: u64,
    /// Digest of all samples and link reports with their times.
    pub trace: u64,
}

impl Tally {
    pub(crate) fn note_report(&mut self, at: Duration, (state, message): &(LinkState, String)) {
        self.digest(&(at, discriminant(state), message));
    }

    pub(crate) fn note_sample(&mut self, at: Duration, sample: &Sample) {
        let value = sample.value.as_ref().map(|value| match value {
            Value::Text(text) => (None, Some(text)),
            value => (value.bits(), None),
        });
        let reason = match sample.quality {
            Quality::Good => None,
            Quality::Uncertain(reason) | Quality::Bad(reason) => Some(discriminant(&reason)),
        };
        let quality = (discriminant(&sample.quality), reason);
        self.digest(&(at, sample.tag, value, quality, sample.source_time));
    }

    fn digest(&mut self, what: &impl Hash) {
        let mut hasher = DefaultHasher::new();
        (self.trace, what).hash(&mut hasher);
        self.trace = hasher.finish();
    }
}
