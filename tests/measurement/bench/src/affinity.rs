//! Processor affinity: work on one core, and its processor time.

use anyhow::{Context, Result};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use rustix::time::{ClockId, clock_gettime};

/// Seconds that this process has spent on cores. On one core, with nobody
/// waiting, this is how long work takes on a machine that does nothing else,
/// whatever this one does.
pub(crate) fn processor_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Keeps this thread, and those that it starts, on the first of its cores until
/// dropped.
pub(crate) struct OneCore {
    before: CpuSet,
}

impl OneCore {
    pub(crate) fn hold() -> Result<Self> {
        let before = sched_getaffinity(None).context("cannot ask for this thread's cores")?;
        let first = (0..CpuSet::MAX_CPU).find(|&core| before.is_set(core));
        let mut one = CpuSet::new();
        one.set(first.context("this thread has no core")?);
        sched_setaffinity(None, &one).context("cannot stay on one core")?;
        Ok(Self { before })
    }
}

impl Drop for OneCore {
    fn drop(&mut self) {
        // What was granted before is granted again.
        let _ = sched_setaffinity(None, &self.before);
    }
}

#[cfg(test)]
mod tests {
    use std::thread::available_parallelism;

    use super::*;

    #[test]
    fn work_takes_processor_time() {
        let start = processor_seconds();
        let sum = (0..20_000_000_u64).fold(0, |sum, i| std::hint::black_box(sum ^ i));
        assert!(processor_seconds() > start, "{sum}");
    }

    #[test]
    fn one_core_is_held_and_given_back() {
        let before = available_parallelism().unwrap();
        let one = OneCore::hold().unwrap();
        assert_eq!(available_parallelism().unwrap().get(), 1);
        drop(one);
        assert_eq!(available_parallelism().unwrap(), before);
    }
}
