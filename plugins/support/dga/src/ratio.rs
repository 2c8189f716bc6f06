//! Ratios of gas concentrations.

/// Ratio of two concentrations: x/0 is infinite, 0/0 cannot be computed and meets no condition.
/// (Other programs take 0 for both.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio(Option<f64>);

impl Ratio {
    /// Computes `numerator / denominator`, of concentrations.
    pub(crate) fn new(numerator: f64, denominator: f64) -> Self {
        Self(match (numerator > 0.0, denominator > 0.0) {
            (_, true) => Some(numerator / denominator),
            (true, false) => Some(f64::INFINITY),
            (false, false) => None,
        })
    }

    /// Returns the value; `None` for 0/0.
    pub fn value(self) -> Option<f64> {
        self.0
    }

    pub(crate) fn is_less(self, limit: f64) -> bool {
        self.0.is_some_and(|value| value < limit)
    }

    pub(crate) fn is_more(self, limit: f64) -> bool {
        self.0.is_some_and(|value| value > limit)
    }

    /// Reports whether the ratio is within a range, both ends included.
    pub(crate) fn is_within(self, low: f64, high: f64) -> bool {
        self.0.is_some_and(|value| (low..=high).contains(&value))
    }
}
