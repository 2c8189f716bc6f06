//! The bounded queue between adapters and the tag table.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use crate::Sample;

/// Samples that one queue holds. When it is full the oldest go first: a later
/// value of a tag is worth more than an earlier one.
pub const MAX_QUEUED_SAMPLES: usize = 1 << 18;

/// A queue that adapters' threads fill and the frame drains. One a plugin, so
/// that a flooding plugin drops its own samples only.
#[derive(Debug, Default)]
pub struct SampleQueue {
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    samples: VecDeque<Sample>,
    dropped: u64,
}

impl SampleQueue {
    /// Adds a batch without waiting for room; returns how many of it stay.
    pub fn publish(&self, batch: impl IntoIterator<Item = Sample>) -> usize {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let mut added = 0;
        for sample in batch {
            if state.samples.len() >= MAX_QUEUED_SAMPLES {
                state.samples.pop_front();
                state.dropped += 1;
            }
            state.samples.push_back(sample);
            added += 1;
        }
        added.min(MAX_QUEUED_SAMPLES)
    }

    /// Takes everything queued.
    pub fn drain(&self) -> VecDeque<Sample> {
        std::mem::take(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner).samples)
    }

    /// Samples dropped since the start.
    pub fn dropped(&self) -> u64 {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).dropped
    }
}
