//! Statistics of measured times.

use serde::Serialize;

/// Median and tail of a series of times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Series {
    /// Number of measured times.
    pub count: usize,
    /// Median of the times, milliseconds.
    pub p50_ms: f64,
    /// 99th percentile of the times, milliseconds.
    pub p99_ms: f64,
}

impl Series {
    /// Computes the statistics of times in milliseconds.
    pub fn from_millis(mut millis: Vec<f64>) -> Self {
        millis.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * millis.len().saturating_sub(1) as f64).round() as usize;
            millis.get(rank).copied().unwrap_or(0.0)
        };
        Self { count: millis.len(), p50_ms: at(0.5), p99_ms: at(0.99) }
    }

    /// Returns the frame rate at the median.
    pub fn fps(&self) -> f64 {
        if self.p50_ms > 0.0 { 1e3 / self.p50_ms } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_ranks() {
        let series = Series::from_millis((0..=100).rev().map(f64::from).collect());
        assert_eq!((series.count, series.p50_ms, series.p99_ms), (101, 50.0, 99.0));
        assert_eq!(series.fps(), 20.0);
        assert_eq!(Series::from_millis(Vec::new()), Series::default());
    }
}
