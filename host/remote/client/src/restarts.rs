//! Restart delays of a viewer that ended: exponential backoff by the ends of the last minute.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Ends in the last minute that cost no delay: a driver may fall over more than once.
const FREE_ENDS: usize = 3;
/// Delay after one more end; it doubles with each.
const FIRST_DELAY: Duration = Duration::from_millis(100);
const WINDOW: Duration = Duration::from_secs(60);
/// Ends that are remembered.
const MAX_REMEMBERED: usize = 64;

/// The ends of a view's viewers.
#[derive(Debug)]
pub(crate) struct Restarts {
    ends: VecDeque<Instant>,
    longest: Duration,
}

impl Restarts {
    pub(crate) fn new(longest: Duration) -> Self {
        Self { ends: VecDeque::new(), longest }
    }

    /// Notes an end; how long to wait.
    pub(crate) fn note(&mut self, now: Instant) -> Duration {
        self.ends.push_back(now);
        while self.ends.len() > MAX_REMEMBERED
            || self.ends.front().is_some_and(|&then| now.saturating_duration_since(then) > WINDOW)
        {
            self.ends.pop_front();
        }
        match self.ends.len() {
            ..=FREE_ENDS => Duration::ZERO,
            count => {
                let doublings = (count - FREE_ENDS - 1).min(16) as u32;
                FIRST_DELAY.saturating_mul(1 << doublings).min(self.longest)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_grow_up_to_their_limit_and_are_forgiven() {
        let (mut restarts, start) = (Restarts::new(Duration::from_secs(5)), Instant::now());
        let delays: Vec<_> =
            (0..11).map(|n| restarts.note(start + Duration::from_millis(n)).as_millis()).collect();
        assert_eq!(delays, [0, 0, 0, 100, 200, 400, 800, 1600, 3200, 5000, 5000]);
        for _ in 0..1000 {
            restarts.note(start);
        }
        assert!(restarts.ends.len() <= MAX_REMEMBERED);
        assert_eq!(restarts.note(start + Duration::from_secs(70)), Duration::ZERO);
    }
}
