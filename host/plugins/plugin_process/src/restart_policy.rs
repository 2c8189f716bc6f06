//! Restart policy of crashed plugins: exponential backoff with jitter, and quarantine.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Limit of remembered crashes where the policy has a higher one or none.
const MAX_REMEMBERED: usize = 64;
/// The share of a delay that chance takes away at most, so that plugins that
/// died together do not come back together.
const JITTER: f64 = 0.5;

/// Restart policy of a plugin's process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestartPolicy {
    /// Delay before the first restart; it doubles with each death in the window.
    /// Zero starts again at once, always.
    pub first_delay: Duration,
    /// Upper bound of the delay.
    pub longest_delay: Duration,
    /// Crashes within the window that put a plugin in quarantine; 0 for no limit.
    pub max_deaths: u32,
    /// Window over which crashes are counted.
    pub window: Duration,
}

impl Default for RestartPolicy {
    fn default() -> Self {
        Self {
            first_delay: Duration::from_millis(200),
            longest_delay: Duration::from_secs(30),
            max_deaths: 3,
            window: Duration::from_secs(600),
        }
    }
}

/// Deadlines of calls, after which a plugin's process is killed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Deadlines {
    /// Deadline of loading, creating, checking, starting and configuring, besides an addition for
    /// each tag.
    pub lifecycle: Duration,
    /// Between two reports of progress of an optimiser or a command.
    pub optimize: Duration,
}

impl Default for Deadlines {
    fn default() -> Self {
        Self { lifecycle: Duration::from_secs(10), optimize: Duration::from_secs(120) }
    }
}

/// Decision after a crash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RestartDecision {
    /// Start again after this delay.
    RestartAfter(Duration),
    /// Leave it ended until somebody restarts it.
    Quarantine,
}

/// The deaths of one plugin.
#[derive(Debug, Default)]
pub(crate) struct CrashHistory {
    recent: VecDeque<Instant>,
    all: u64,
}

impl CrashHistory {
    /// Records a crash and decides. `chance` is 0 to 1.
    pub(crate) fn record(
        &mut self,
        policy: &RestartPolicy,
        now: Instant,
        chance: f64,
    ) -> RestartDecision {
        self.all += 1;
        self.recent.push_back(now);
        while self.recent.len() > MAX_REMEMBERED
            || self.recent.front().is_some_and(|&then| now - then > policy.window)
        {
            self.recent.pop_front();
        }
        let deaths = self.recent.len() as u32;
        let limit = policy.max_deaths.min(MAX_REMEMBERED as u32);
        if limit > 0 && deaths >= limit {
            return RestartDecision::Quarantine;
        }
        let doubled = policy.first_delay.saturating_mul(1 << (deaths - 1).min(31));
        let delay = doubled.min(policy.longest_delay);
        RestartDecision::RestartAfter(delay.mul_f64(1.0 - JITTER * chance.clamp(0.0, 1.0)))
    }

    /// Forgets what led to quarantine.
    pub(crate) fn reset(&mut self) {
        self.recent.clear();
    }

    /// Returns the number of crashes so far.
    pub(crate) fn count(&self) -> u64 {
        self.all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn delays_grow_and_the_third_death_is_the_last() {
        let (policy, start) = (RestartPolicy::default(), Instant::now());
        let mut deaths = CrashHistory::default();
        assert_eq!(
            deaths.record(&policy, start, 0.0),
            RestartDecision::RestartAfter(policy.first_delay)
        );
        assert_eq!(
            deaths.record(&policy, start + SECOND, 0.0),
            RestartDecision::RestartAfter(policy.first_delay * 2)
        );
        assert_eq!(deaths.record(&policy, start + 2 * SECOND, 0.0), RestartDecision::Quarantine);
        deaths.reset();
        assert_eq!(
            deaths.record(&policy, start + 3 * SECOND, 1.0),
            RestartDecision::RestartAfter(policy.first_delay / 2)
        );
        assert_eq!(deaths.count(), 4);
    }

    #[test]
    fn deaths_far_apart_are_forgotten() {
        let (policy, start) = (RestartPolicy::default(), Instant::now());
        let mut deaths = CrashHistory::default();
        for i in 0..10 {
            let now = start + (policy.window + SECOND) * i;
            assert_eq!(
                deaths.record(&policy, now, 0.0),
                RestartDecision::RestartAfter(policy.first_delay)
            );
        }
    }

    #[test]
    fn without_a_limit_delays_grow_to_the_longest_and_nothing_overflows() {
        let policy = RestartPolicy { max_deaths: 0, ..RestartPolicy::default() };
        let (mut deaths, now) = (CrashHistory::default(), Instant::now());
        let last = (0..1000).map(|_| deaths.record(&policy, now, 0.0)).last();
        assert_eq!(last, Some(RestartDecision::RestartAfter(policy.longest_delay)));
        assert!(deaths.recent.len() <= MAX_REMEMBERED);
        let at_once = RestartPolicy { first_delay: Duration::ZERO, ..policy };
        assert_eq!(
            deaths.record(&at_once, now, 0.3),
            RestartDecision::RestartAfter(Duration::ZERO)
        );
    }
}
