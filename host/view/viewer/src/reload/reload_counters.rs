//! Outcomes of configuration reloads, and their counters.

use std::time::{Duration, Instant};

/// Bytes of a fault that are kept to be shown; a file may have two hundred.
const MAX_FAULT_BYTES: usize = 4_000;

/// Outcome of a configuration reload.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReloadOutcome {
    /// Configuration is shown from the next frame on.
    Shown,
    /// Configuration is the same as before.
    Same,
    /// Configuration is faulty, as the text says; the previous scene stays.
    Refused(String),
}

/// Counters and last fault of configuration reloads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReloadCounters {
    /// Configurations that were shown in place of the one before.
    pub good: u64,
    /// Configurations that were refused for faults.
    pub bad: u64,
    /// Time from the file's settling to the frame that shows it, without the frame itself; of the
    /// last good reload.
    pub last: Option<Duration>,
    /// Faults of the file on the disk; none while it is shown.
    pub fault: Option<String>,
}

impl ReloadCounters {
    /// Counts the outcome of a reload.
    pub(crate) fn note(&mut self, outcome: &ReloadOutcome, since: Instant) {
        match outcome {
            ReloadOutcome::Shown => {
                self.good += 1;
                (self.last, self.fault) = (Some(since.elapsed()), None);
            }
            ReloadOutcome::Same => self.fault = None,
            ReloadOutcome::Refused(fault) => {
                self.bad += 1;
                self.fault = Some(shortened(fault));
            }
        }
    }
}

fn shortened(fault: &str) -> String {
    if fault.len() <= MAX_FAULT_BYTES {
        return fault.to_owned();
    }
    let end = (0..=MAX_FAULT_BYTES).rev().find(|end| fault.is_char_boundary(*end)).unwrap_or(0);
    format!("{}\u{2026}", &fault[..end])
}
