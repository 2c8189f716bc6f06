//! The devices of a serial line that do not answer.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use busbar_link::{Backoff, Reconnect};
use tokio::time::Instant;

use crate::address::Point;

/// Which units are silent, and when each is asked again: the line is not held up
/// by those that are off.
#[derive(Debug)]
pub(crate) struct Units {
    count: usize,
    delays: Reconnect,
    silent: BTreeMap<u8, Silence>,
}

#[derive(Debug)]
struct Silence {
    backoff: Backoff,
    retry_at: Instant,
}

impl Units {
    pub(crate) fn new(points: &[Point], delays: Reconnect) -> Self {
        let all: BTreeSet<_> = points.iter().map(|point| point.unit).collect();
        Self { count: all.len(), delays, silent: BTreeMap::new() }
    }

    /// Whether a unit is not to be asked now.
    pub(crate) fn is_left_alone(&self, unit: u8, now: Instant) -> bool {
        self.silent.get(&unit).is_some_and(|silence| now < silence.retry_at)
    }

    /// A unit did not answer; how long it is left alone.
    pub(crate) fn note_silence(&mut self, unit: u8, now: Instant) -> Duration {
        let new = || Silence { backoff: Backoff::new(self.delays), retry_at: now };
        let silence = self.silent.entry(unit).or_insert_with(new);
        let delay = silence.backoff.next_delay();
        silence.retry_at = now + delay;
        delay
    }

    /// A unit answered; whether it had been silent.
    pub(crate) fn note_answer(&mut self, unit: u8) -> bool {
        self.silent.remove(&unit).is_some()
    }

    /// Whether there is nobody left.
    pub(crate) fn are_all_silent(&self) -> bool {
        self.silent.len() >= self.count
    }

    /// The silent ones, for operators; none if all answer.
    pub(crate) fn silent(&self) -> Option<String> {
        let units: Vec<_> = self.silent.keys().map(u8::to_string).collect();
        let plural = if units.len() > 1 { "s" } else { "" };
        (!units.is_empty()).then(|| format!("no answer from unit{plural} {}", units.join(", ")))
    }
}
