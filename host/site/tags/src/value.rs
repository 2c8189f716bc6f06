//! Tag values and their qualities.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A value of a tag.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// Measurement, a floating-point number.
    F64(f64),
    /// A counter or code.
    I64(i64),
    /// Single point, such as a contact.
    Bool(bool),
    /// Double point, such as a switch position.
    DoublePoint(DoublePoint),
}

/// The type a tag's values have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ValueKind {
    /// Type of [`Value::F64`] values.
    F64,
    /// Type of [`Value::I64`] values.
    I64,
    /// Type of [`Value::Bool`] values.
    Bool,
    /// Type of [`Value::DoublePoint`] values.
    DoublePoint,
}

/// Position of a switch by two contacts (IEC 60870-5-101, 7.2.6.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DoublePoint {
    /// Neither contact is closed: the switch is travelling.
    Intermediate,
    /// The switch is open.
    Off,
    /// The switch is closed.
    On,
    /// Both contacts are closed: a fault.
    BadState,
}

/// Reliability of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quality {
    /// The value is usable.
    Good,
    /// The value is doubtful.
    Uncertain(Reason),
    /// Value is not usable.
    Bad(Reason),
}

/// Reason why a value is not good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// The source gave none.
    Unknown,
    /// The link to the device is down.
    Communication,
    /// The device reports a failure of its sensor.
    Sensor,
    /// Outside the measuring range.
    OutOfRange,
    /// The device refused the address, or its answer does not fit.
    Configuration,
    /// No value has been received yet.
    NotConnected,
    /// The value is not a finite number.
    NotFinite,
    /// Past its freshness limit.
    Stale,
    /// The time that the source gave is missing where one is promised, unreadable, in
    /// the future or impossible.
    SourceTime,
}

impl Value {
    /// The type of this value.
    #[inline]
    pub fn kind(self) -> ValueKind {
        match self {
            Self::F64(_) => ValueKind::F64,
            Self::I64(_) => ValueKind::I64,
            Self::Bool(_) => ValueKind::Bool,
            Self::DoublePoint(_) => ValueKind::DoublePoint,
        }
    }

    /// Converts a quantity to a number.
    pub fn as_number(self) -> Option<f64> {
        match self {
            Self::F64(value) => Some(value),
            Self::I64(value) => Some(value as f64),
            Self::Bool(_) | Self::DoublePoint(_) => None,
        }
    }
}

/// Value, or none, as words that are copied and compared whole. Not-a-number equals itself here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Packed {
    pub(crate) bits: u64,
    /// Kind of the value; none where there is no value.
    pub(crate) kind: Option<ValueKind>,
}

impl Packed {
    #[inline]
    pub(crate) fn from_value(value: Value) -> Self {
        let bits = match value {
            Value::F64(value) => value.to_bits(),
            Value::I64(value) => value as u64,
            Value::Bool(value) => u64::from(value),
            Value::DoublePoint(value) => value as u64,
        };
        Self { bits, kind: Some(value.kind()) }
    }

    #[inline]
    pub(crate) fn is_none(self) -> bool {
        self.kind.is_none()
    }

    #[inline]
    pub(crate) fn unpack(self) -> Option<Value> {
        Some(match self.kind? {
            ValueKind::F64 => Value::F64(f64::from_bits(self.bits)),
            ValueKind::I64 => Value::I64(self.bits as i64),
            ValueKind::Bool => Value::Bool(self.bits != 0),
            ValueKind::DoublePoint => Value::DoublePoint(match self.bits {
                0 => DoublePoint::Intermediate,
                1 => DoublePoint::Off,
                2 => DoublePoint::On,
                _ => DoublePoint::BadState,
            }),
        })
    }
}

impl Quality {
    /// Reports whether the quality is good.
    pub fn is_good(self) -> bool {
        self == Self::Good
    }

    /// `good`, `uncertain` or `bad`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Uncertain(_) => "uncertain",
            Self::Bad(_) => "bad",
        }
    }

    /// Returns the reason of a quality that is not good.
    pub fn reason(self) -> Option<Reason> {
        match self {
            Self::Good => None,
            Self::Uncertain(reason) | Self::Bad(reason) => Some(reason),
        }
    }

    /// 0 for good, 1 for uncertain, 2 for bad.
    #[inline]
    pub(crate) fn rank(self) -> u8 {
        match self {
            Self::Good => 0,
            Self::Uncertain(_) => 1,
            Self::Bad(_) => 2,
        }
    }

    /// The worse of two; the first where they are alike.
    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        if other.rank() > self.rank() { other } else { self }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "no reason given",
            Self::Communication => "communication",
            Self::Sensor => "sensor",
            Self::OutOfRange => "out of range",
            Self::Configuration => "configuration",
            Self::NotConnected => "not connected",
            Self::NotFinite => "not finite",
            Self::Stale => "stale",
            Self::SourceTime => "source time",
        })
    }
}

impl fmt::Display for DoublePoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Intermediate => "travelling",
            Self::Off => "open",
            Self::On => "closed",
            Self::BadState => "invalid",
        })
    }
}
