//! How fast a compartment loses gas.

use std::collections::VecDeque;

/// Samples that are kept: as many as the window is divided into.
const MAX_SAMPLES: usize = 240;
/// Share of the window that must have passed before a rate is told.
const LEAST_SHARE: f64 = 0.25;
const NANOS_A_YEAR: f64 = 365.25 * 86_400e9;

/// Normalised pressures over a window of time.
#[derive(Clone, Debug)]
pub struct Trend {
    window_nanos: i64,
    samples: VecDeque<(i64, f64)>,
}

impl Trend {
    /// Nothing yet, of a window of so many seconds.
    pub fn new(window_seconds: f64) -> Self {
        Self { window_nanos: (window_seconds * 1e9) as i64, samples: VecDeque::new() }
    }

    /// Takes a pressure at an instant; what comes in short succession, or after the clock
    /// was set back, begins anew or is left out.
    pub fn push(&mut self, nanos: i64, pressure: f64) {
        if let Some(&(last, _)) = self.samples.back() {
            if nanos < last {
                self.samples.clear();
            } else if nanos - last < self.window_nanos / MAX_SAMPLES as i64 {
                return;
            }
        }
        while self.samples.front().is_some_and(|(at, _)| nanos - at > self.window_nanos) {
            self.samples.pop_front();
        }
        if self.samples.len() > MAX_SAMPLES {
            self.samples.pop_front();
        }
        self.samples.push_back((nanos, pressure));
    }

    /// Loss in percent of `filling` a year, by least squares; none before a quarter of the
    /// window has passed.
    pub fn percent_a_year(&self, filling: f64) -> Option<f64> {
        let (&(first, _), &(last, _)) = (self.samples.front()?, self.samples.back()?);
        if self.samples.len() < 3
            || ((last - first) as f64) < LEAST_SHARE * self.window_nanos as f64
        {
            return None;
        }
        let count = self.samples.len() as f64;
        let years = |nanos: i64| (nanos - first) as f64 / NANOS_A_YEAR;
        let mean_time = self.samples.iter().map(|(at, _)| years(*at)).sum::<f64>() / count;
        let mean = self.samples.iter().map(|(_, pressure)| pressure).sum::<f64>() / count;
        let (mut product, mut square) = (0.0, 0.0);
        for (at, pressure) in &self.samples {
            let time = years(*at) - mean_time;
            product += time * (pressure - mean);
            square += time * time;
        }
        (square > 0.0).then(|| -100.0 * product / square / filling)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY: i64 = 86_400_000_000_000;

    #[test]
    fn a_steady_loss_is_found_and_memory_is_bounded() {
        let mut trend = Trend::new(30.0 * 86_400.0);
        // 7 bar lose 1 % a year: 0.07 / 365.25 a day.
        for hour in 0..24 * 60 {
            let days = f64::from(hour) / 24.0;
            trend.push(i64::from(hour) * DAY / 24, 7.0 - 0.07 / 365.25 * days);
            assert_eq!(trend.percent_a_year(7.0).is_some(), days >= 7.5, "{days} days");
        }
        let rate = trend.percent_a_year(7.0).expect("a rate");
        assert!((rate - 1.0).abs() < 1e-6, "{rate} % a year");
        assert!(trend.samples.len() <= MAX_SAMPLES + 1, "{}", trend.samples.len());
        trend.push(0, 7.0);
        assert_eq!(trend.percent_a_year(7.0), None, "the clock was set back");
    }
}
