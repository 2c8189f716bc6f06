//! Statistics of a series of figures: count, median, 99th percentile, maximum.

use serde::Serialize;

/// Statistics of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Series {
    /// Number of the values.
    pub count: usize,
    /// Median of the values.
    pub p50: f64,
    /// 99th percentile of the values.
    pub p99: f64,
    /// Greatest of the values.
    pub longest: f64,
}

impl Series {
    /// Computes the statistics of values in any order.
    pub fn from_values(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (values.len().saturating_sub(1) as f64 * share).round() as usize;
            values.get(rank).copied().unwrap_or_default()
        };
        Self { count: values.len(), p50: at(0.5), p99: at(0.99), longest: at(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_those_of_the_sorted_values() {
        let series = Series::from_values((0..=100).rev().map(f64::from).collect());
        assert_eq!(series, Series { count: 101, p50: 50.0, p99: 99.0, longest: 100.0 });
        assert_eq!(Series::from_values(Vec::new()), Series::default());
    }
}
