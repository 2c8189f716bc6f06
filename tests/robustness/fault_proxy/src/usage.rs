//! Resource usage of this process, by which a test finds leaks.

use std::fs;
use std::sync::Once;

/// Initialisation of an event loop, which leaves descriptors for signals behind, once a process.
static EVENT_LOOP: Once = Once::new();

/// Descriptors and threads of this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResourceUsage {
    /// Number of open descriptors.
    pub descriptors: usize,
    /// Number of running threads.
    pub threads: usize,
}

impl ResourceUsage {
    /// Counts the open resources.
    ///
    /// # Panics
    /// Where there is no `/proc`.
    pub fn now() -> Self {
        EVENT_LOOP.call_once(|| {
            drop(tokio::runtime::Builder::new_current_thread().enable_all().build());
        });
        let count = |path| fs::read_dir(path).expect("Linux has it").count();
        Self { descriptors: count("/proc/self/fd"), threads: count("/proc/self/task") }
    }

    /// Checks that neither count is above `before`.
    ///
    /// # Panics
    /// Panics if a count is above `before`.
    #[track_caller]
    pub fn assert_within(self, before: Self) {
        let is_within = self.descriptors <= before.descriptors && self.threads <= before.threads;
        assert!(is_within, "{before:?}, then {self:?}");
    }

    /// Returns the larger of both counts.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self {
            descriptors: self.descriptors.max(other.descriptors),
            threads: self.threads.max(other.threads),
        }
    }
}
