//! Interval arithmetic for quantities that are known between two bounds.

/// Closed interval of a quantity; a point where the quantity is known.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Interval {
    /// Least value of the quantity.
    pub(crate) low: f64,
    /// Greatest value of the quantity.
    pub(crate) high: f64,
}

impl Interval {
    /// Interval between two bounds, the lesser of which comes first.
    pub(crate) const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// Interval of one value.
    pub(crate) const fn point(value: f64) -> Self {
        Self { low: value, high: value }
    }

    /// Interval of a value and a tolerance to both sides.
    pub(crate) fn around(value: f64, tolerance: f64) -> Self {
        Self { low: value - tolerance, high: value + tolerance }
    }

    pub(crate) fn is_point(self) -> bool {
        self.low == self.high
    }

    pub(crate) fn width(self) -> f64 {
        self.high - self.low
    }

    pub(crate) fn middle(self) -> f64 {
        self.low.midpoint(self.high)
    }

    /// Least interval that holds both.
    pub(crate) fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Interval that both share; `None` where there is none.
    pub(crate) fn intersection(self, other: Self) -> Option<Self> {
        let shared = Self { low: self.low.max(other.low), high: self.high.min(other.high) };
        (shared.low <= shared.high).then_some(shared)
    }

    /// Bounds under a function that never falls.
    pub(crate) fn map(self, rising: impl Fn(f64) -> f64) -> Self {
        Self { low: rising(self.low), high: rising(self.high) }
    }
}

impl std::ops::Add for Interval {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { low: self.low + other.low, high: self.high + other.high }
    }
}

impl std::ops::Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { low: self.low - other.high, high: self.high - other.low }
    }
}
