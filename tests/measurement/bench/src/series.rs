//! Series of measurements of one figure.

use std::time::Instant;

use serde_json::{Value, json};

use crate::affinity::processor_seconds;

/// Measurements of one figure, at least one once it is reported.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    pub(crate) name: String,
    /// Unit of the values: "ms", or "" for a ratio.
    pub(crate) unit: &'static str,
    values: Vec<f64>,
    /// Greatest median that meets the bar.
    pub(crate) bar: Option<f64>,
}

impl Series {
    /// Creates a series without measurements.
    pub(crate) fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit, values: Vec::new(), bar: None }
    }

    /// Creates a series of a figure that does not vary.
    pub(crate) fn exact(name: impl Into<String>, unit: &'static str, value: f64) -> Self {
        Self { values: vec![value], ..Self::new(name, unit) }
    }

    /// Returns the series with the greatest median that meets its bar.
    pub(crate) fn at_most(mut self, bar: f64) -> Self {
        self.bar = Some(bar);
        self
    }

    /// Adds one measured value.
    pub(crate) fn push(&mut self, value: f64) {
        self.values.push(value);
    }

    /// Runs work on one core and adds its milliseconds of processor time.
    pub(crate) fn processor<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = processor_seconds();
        let result = work();
        self.push((processor_seconds() - start) * 1e3);
        result
    }

    /// Runs work and adds its milliseconds by the clock.
    pub(crate) fn time<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.push(start.elapsed().as_secs_f64() * 1e3);
        result
    }

    /// Returns the measurement of the last round.
    pub(crate) fn last(&self) -> f64 {
        self.values.last().copied().unwrap_or(f64::NAN)
    }

    /// Returns the number of measurements.
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns the value that a share of the measurements does not exceed, by nearest rank: 0 is
    /// the least, 0.5 the (lower) median, 1 the greatest.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        let rank = (share * sorted.len() as f64).ceil() as usize;
        sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    }

    /// Reports whether the median meets the bar; `None` without a bar.
    pub(crate) fn is_met(&self) -> Option<bool> {
        self.bar.map(|bar| self.quantile(0.5) <= bar)
    }

    pub(crate) fn json(&self) -> Value {
        json!({
            "unit": self.unit,
            "median": self.quantile(0.5),
            "min": self.quantile(0.0),
            "max": self.quantile(1.0),
            "p99": self.quantile(0.99),
            "count": self.len(),
            "bar": self.bar,
            "met": self.is_met(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_measurements() {
        let mut series = Series::new("x", "ms").at_most(50.0);
        (1..=100).rev().for_each(|value| series.push(f64::from(value)));
        let quantiles = [0.0, 0.5, 0.99, 1.0].map(|share| series.quantile(share));
        assert_eq!(quantiles, [1.0, 50.0, 99.0, 100.0]);
        assert_eq!(series.is_met(), Some(true));
        assert_eq!(series.at_most(49.0).is_met(), Some(false));
        assert_eq!(Series::exact("y", "", 2.0).quantile(0.99), 2.0);
    }
}
