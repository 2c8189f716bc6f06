//! Exponential backoff with jitter between attempts to connect.

use std::time::Duration;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::SettingsFaults;

/// Shortest delay between two attempts: a device that is in trouble is asked once a second at most.
pub const MIN_RETRY_MILLIS: u64 = 1000;
/// Longest delay, in milliseconds: ten minutes.
const MAX_RETRY_MILLIS: u64 = 600_000;

/// Delay between attempts to connect. It doubles from `min_seconds` to `max_seconds`, with jitter, so
/// that clients do not reconnect in step.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReconnectSettings {
    /// Shortest delay between attempts, seconds.
    #[schemars(range(min = 1.0, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["min_millis"]))]
    min_seconds: f64,
    /// Longest delay between attempts, seconds.
    #[schemars(range(min = 1.0, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["max_millis"]))]
    max_seconds: f64,
}

impl Default for ReconnectSettings {
    fn default() -> Self {
        Self { min_seconds: MIN_RETRY_MILLIS as f64 / 1_000.0, max_seconds: 30.0 }
    }
}

impl ReconnectSettings {
    /// Checks the setting `reconnect`.
    pub fn parse(&self, faults: &mut SettingsFaults) -> ReconnectBounds {
        let allowed = MIN_RETRY_MILLIS..=MAX_RETRY_MILLIS;
        let min = faults.seconds("reconnect.min_seconds", self.min_seconds, allowed.clone());
        let max = faults.seconds("reconnect.max_seconds", self.max_seconds, allowed);
        if min > max {
            faults.add("reconnect: min_seconds is larger than max_seconds");
        }
        ReconnectBounds { min, max }
    }
}

/// Bounds of the delays between attempts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReconnectBounds {
    /// Shortest delay between attempts.
    pub min: Duration,
    /// Longest delay, not less than the shortest.
    pub max: Duration,
}

/// Exponential backoff with jitter, within a minimum and a maximum.
///
/// Each delay is drawn from the upper half of its step, so that clients of a
/// device that comes back do not all knock at once.
#[derive(Debug)]
pub struct Backoff {
    bounds: ReconnectBounds,
    step: Duration,
    random: fastrand::Rng,
}

impl Backoff {
    /// Creates a backoff with a random seed from the system.
    pub fn new(bounds: ReconnectBounds) -> Self {
        Self::with_random(bounds, fastrand::Rng::new())
    }

    fn with_random(bounds: ReconnectBounds, random: fastrand::Rng) -> Self {
        Self { bounds, step: bounds.min, random }
    }

    /// Returns the delay before the next attempt.
    pub fn next_delay(&mut self) -> Duration {
        let ReconnectBounds { min, max } = self.bounds;
        self.step = self.step.saturating_mul(2).min(max);
        let half = self.step / 2;
        (half + half.mul_f64(self.random.f64())).clamp(min, max)
    }

    /// Resets to a short delay, after a success.
    pub fn reset(&mut self) {
        self.step = self.bounds.min;
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    const BOUNDS: ReconnectBounds =
        ReconnectBounds { min: Duration::from_millis(100), max: Duration::from_secs(3) };

    fn delays(seed: u64, count: usize) -> Vec<u128> {
        let mut backoff = Backoff::with_random(BOUNDS, fastrand::Rng::with_seed(seed));
        (0..count).map(|_| backoff.next_delay().as_millis()).collect()
    }

    fn parse(json: serde_json::Value) -> Result<ReconnectBounds, String> {
        let mut faults = SettingsFaults::default();
        let settings: ReconnectSettings = serde_json::from_value(json).unwrap();
        let reconnect = settings.parse(&mut faults);
        faults.into_result().map(|()| reconnect)
    }

    #[test]
    fn a_device_is_tried_once_a_second_at_most() {
        let mut backoff = Backoff::new(parse(json!({})).unwrap());
        assert!((0..1000).all(|_| backoff.next_delay() >= Duration::from_secs(1)));
        let fault = parse(json!({"min_seconds": 0.999})).unwrap_err();
        assert_eq!(fault, "reconnect.min_seconds: 0.999 is not within 1 to 600");
        let fault = parse(json!({"min_seconds": 3, "max_seconds": 2})).unwrap_err();
        assert_eq!(fault, "reconnect: min_seconds is larger than max_seconds");
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
        let mut backoff = Backoff::with_random(BOUNDS, fastrand::Rng::with_seed(3));
        for _ in 0..4 {
            backoff.next_delay();
        }
        backoff.reset();
        assert!(backoff.next_delay() <= Duration::from_millis(200));
    }
}
