//! Types of tags' values, and bands of them.

use schemars::JsonSchema;
use serde::Deserialize;

/// Type of a tag's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TagType {
    /// A number with fraction.
    F64,
    /// Type of whole numbers.
    I64,
    /// Type of on and off.
    Bool,
    /// A switch position: intermediate, off, on, or faulty.
    DoublePoint,
}

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
