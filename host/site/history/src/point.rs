//! Point of a time series, with a packed form.

use busbar_tags::Moment;
use busbar_types::{Quality, Value};

/// A point of a history; it holds until the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Time since which the state holds.
    pub at: Moment,
    /// State of the tag.
    pub state: PointState,
}

/// State of a point: a number with its quality, or bad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointState {
    /// A good value, finite.
    Good(f64),
    /// A doubtful value, finite.
    Uncertain(f64),
    /// Value is not usable.
    Bad,
}

impl PointState {
    /// Classifies a tag's value and quality; a value that is no finite number is bad.
    pub fn from_value(value: Option<&Value>, quality: Quality) -> Self {
        let number = value.and_then(Value::as_number).filter(|number| number.is_finite());
        match (number, quality) {
            (Some(number), Quality::Good) => Self::Good(number),
            (Some(number), Quality::Uncertain(_)) => Self::Uncertain(number),
            _ => Self::Bad,
        }
    }

    /// The number, if there is one.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Good(number) | Self::Uncertain(number) => Some(number),
            Self::Bad => None,
        }
    }

    /// Reports whether the value can be relied on.
    pub fn is_good(self) -> bool {
        matches!(self, Self::Good(_))
    }
}

/// Point packed into 16 bytes: the lowest bit of the time marks an uncertain value, and a value
/// that is not a number is a bad one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packed {
    at: u64,
    value: f64,
}

impl Packed {
    pub(crate) fn from_point(Point { at: Moment(at), state }: Point) -> Self {
        match state {
            PointState::Good(value) => Self { at: at & !1, value },
            PointState::Uncertain(value) => Self { at: at | 1, value },
            PointState::Bad => Self { at: at & !1, value: f64::NAN },
        }
    }

    pub(crate) fn point(self) -> Point {
        let state = match self.value {
            value if value.is_nan() => PointState::Bad,
            value if self.at & 1 == 1 => PointState::Uncertain(value),
            value => PointState::Good(value),
        };
        Point { at: self.at(), state }
    }

    pub(crate) fn at(self) -> Moment {
        Moment(self.at & !1)
    }
}
