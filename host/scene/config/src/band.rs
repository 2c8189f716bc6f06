//! Bands of values, open at either end.

/// An interval, open where a bound is missing. `low` is less than `high`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Band {
    /// Least value within the band.
    pub low: Option<f64>,
    /// Greatest value within the band.
    pub high: Option<f64>,
}

impl Band {
    /// Reports whether a value lies within the band.
    pub fn contains(&self, value: f64) -> bool {
        self.low.is_none_or(|low| value >= low) && self.high.is_none_or(|high| value <= high)
    }
}
