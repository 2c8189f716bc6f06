//! Delays between tries to connect.

use std::time::Duration;

/// Doubling, jittered delays within a minimum and a maximum.
///
/// Each delay is drawn from the upper half of its step, so that clients of a
/// device that comes back do not all knock at once.
#[derive(Debug)]
pub(crate) struct Backoff {
    min: Duration,
    max: Duration,
    step: Duration,
    random: fastrand::Rng,
}

impl Backoff {
    pub(crate) fn new(min: Duration, max: Duration, random: fastrand::Rng) -> Self {
        Self { min, max, step: min, random }
    }

    /// The delay before the next try.
    pub(crate) fn next_delay(&mut self) -> Duration {
        self.step = self.step.saturating_mul(2).min(self.max);
        let half = self.step / 2;
        (half + half.mul_f64(self.random.f64())).clamp(self.min, self.max)
    }

    /// After a success: the next delay is a short one again.
    pub(crate) fn reset(&mut self) {
        self.step = self.min;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delays(seed: u64, count: usize) -> Vec<u128> {
        let random = fastrand::Rng::with_seed(seed);
        let mut backoff = Backoff::new(Duration::from_millis(100), Duration::from_secs(3), random);
        (0..count).map(|_| backoff.next_delay().as_millis()).collect()
    }

    #[test]
    fn delays_double_within_their_bounds() {
        for seed in 0..200 {
            let bounds = [100..=200, 200..=400, 400..=800, 800..=1600, 1500..=3000, 1500..=3000];
            for (delay, bounds) in delays(seed, bounds.len()).iter().zip(bounds) {
                assert!(bounds.contains(delay), "seed {seed}: {delay} in {bounds:?}");
            }
        }
    }

    #[test]
    fn clients_differ_and_seeds_repeat() {
        assert_eq!(delays(1, 5), delays(1, 5));
        assert_ne!(delays(1, 5), delays(2, 5));
    }

    #[test]
    fn a_success_starts_over() {
        let mut backoff = Backoff::new(
            Duration::from_millis(100),
            Duration::from_secs(3),
            fastrand::Rng::with_seed(3),
        );
        for _ in 0..4 {
            backoff.next_delay();
        }
        backoff.reset();
        assert!(backoff.next_delay() <= Duration::from_millis(200));
    }
}
