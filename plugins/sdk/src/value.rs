//! Values and their quality.

use busbar_plugin_abi as abi;

/// A value of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A measurement.
    F64(f64),
    /// A counter or code.
    I64(i64),
    /// A single point.
    Bool(bool),
    /// A double point: a switch position.
    DoublePoint(DoublePoint),
}

/// The type a tag's values have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// [`Value::F64`].
    F64,
    /// [`Value::I64`].
    I64,
    /// [`Value::Bool`].
    Bool,
    /// [`Value::DoublePoint`].
    DoublePoint,
}

/// Position of a switch by two contacts (IEC 60870-5-101, 7.2.6.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DoublePoint {
    /// Neither contact: travelling.
    Intermediate,
    /// Open.
    Off,
    /// Closed.
    On,
    /// Both contacts: a fault.
    BadState,
}

/// Whether a value can be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Usable.
    Good,
    /// Doubtful.
    Uncertain(Reason),
    /// Not usable.
    Bad(Reason),
}

/// Why a value is not good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// None given.
    Unknown,
    /// The link to the device is down.
    Communication,
    /// The device says that its sensor failed.
    Sensor,
    /// Outside the measuring range.
    OutOfRange,
    /// The device refused the address, or its answer does not fit.
    Configuration,
    /// Not connected yet.
    NotConnected,
    /// Not a finite number.
    NotFinite,
    /// Past its freshness limit; only the host gives it.
    Stale,
    /// The time that the source gave is missing where one is promised, unreadable, in
    /// the future or impossible.
    SourceTime,
}

impl Value {
    /// The type of this value.
    pub fn kind(self) -> ValueKind {
        match self {
            Self::F64(_) => ValueKind::F64,
            Self::I64(_) => ValueKind::I64,
            Self::Bool(_) => ValueKind::Bool,
            Self::DoublePoint(_) => ValueKind::DoublePoint,
        }
    }

    pub(crate) fn to_abi(self) -> (u8, u64) {
        match self {
            Self::F64(value) => (abi::BUSBAR_VALUE_F64, value.to_bits()),
            Self::I64(value) => (abi::BUSBAR_VALUE_I64, value as u64),
            Self::Bool(value) => (abi::BUSBAR_VALUE_BOOL, u64::from(value)),
            Self::DoublePoint(value) => (abi::BUSBAR_VALUE_DOUBLE_POINT, value as u64),
        }
    }

    pub(crate) fn from_abi(kind: u8, bits: u64) -> Option<Self> {
        match kind {
            abi::BUSBAR_VALUE_F64 => Some(Self::F64(f64::from_bits(bits))),
            abi::BUSBAR_VALUE_I64 => Some(Self::I64(bits as i64)),
            abi::BUSBAR_VALUE_BOOL => Some(Self::Bool(bits != 0)),
            abi::BUSBAR_VALUE_DOUBLE_POINT => Some(Self::DoublePoint(DoublePoint::from_bits(bits))),
            _ => None,
        }
    }
}

impl ValueKind {
    /// A value of this kind from text: a number; `true`, `false`, `1` or `0`; or
    /// a double point as its two bits, 0 to 3. `None` if it is none.
    ///
    /// ```
    /// use busbar_plugin_sdk::{DoublePoint, Value, ValueKind};
    ///
    /// assert_eq!(ValueKind::F64.parse("-1.5"), Some(Value::F64(-1.5)));
    /// assert_eq!(ValueKind::Bool.parse("1"), Some(Value::Bool(true)));
    /// assert_eq!(ValueKind::DoublePoint.parse("2"), Some(Value::DoublePoint(DoublePoint::On)));
    /// assert_eq!(ValueKind::I64.parse("1.5"), None);
    /// ```
    pub fn parse(self, text: &str) -> Option<Value> {
        let text = text.trim();
        match self {
            Self::F64 => text.parse().ok().map(Value::F64),
            Self::I64 => text.parse().ok().map(Value::I64),
            Self::Bool => match text {
                "true" | "1" => Some(Value::Bool(true)),
                "false" | "0" => Some(Value::Bool(false)),
                _ => None,
            },
            Self::DoublePoint => match text.parse().ok()? {
                bits @ 0..=3 => Some(Value::DoublePoint(DoublePoint::from_bits(bits))),
                _ => None,
            },
        }
    }

    pub(crate) fn from_abi(kind: u32) -> Option<Self> {
        match u8::try_from(kind).ok()? {
            abi::BUSBAR_VALUE_F64 => Some(Self::F64),
            abi::BUSBAR_VALUE_I64 => Some(Self::I64),
            abi::BUSBAR_VALUE_BOOL => Some(Self::Bool),
            abi::BUSBAR_VALUE_DOUBLE_POINT => Some(Self::DoublePoint),
            _ => None,
        }
    }
}

impl DoublePoint {
    /// From the two bits of a double-point information element; higher bits
    /// are ignored.
    pub fn from_bits(bits: u64) -> Self {
        match bits & 0b11 {
            0 => Self::Intermediate,
            1 => Self::Off,
            2 => Self::On,
            _ => Self::BadState,
        }
    }
}

impl DoublePoint {
    /// The two bits of a double-point information element.
    pub fn bits(self) -> u8 {
        match self {
            Self::Intermediate => 0,
            Self::Off => 1,
            Self::On => 2,
            Self::BadState => 3,
        }
    }
}

impl Reason {
    fn to_abi(self) -> u8 {
        match self {
            Self::Unknown => abi::BUSBAR_REASON_NONE,
            Self::Communication => abi::BUSBAR_REASON_COMMUNICATION,
            Self::Sensor => abi::BUSBAR_REASON_SENSOR,
            Self::OutOfRange => abi::BUSBAR_REASON_OUT_OF_RANGE,
            Self::Configuration => abi::BUSBAR_REASON_CONFIGURATION,
            Self::NotConnected => abi::BUSBAR_REASON_NOT_CONNECTED,
            Self::NotFinite => abi::BUSBAR_REASON_NOT_FINITE,
            Self::Stale => abi::BUSBAR_REASON_STALE,
            Self::SourceTime => abi::BUSBAR_REASON_SOURCE_TIME,
        }
    }

    fn from_abi(reason: u8) -> Self {
        match reason {
            abi::BUSBAR_REASON_COMMUNICATION => Self::Communication,
            abi::BUSBAR_REASON_SENSOR => Self::Sensor,
            abi::BUSBAR_REASON_OUT_OF_RANGE => Self::OutOfRange,
            abi::BUSBAR_REASON_CONFIGURATION => Self::Configuration,
            abi::BUSBAR_REASON_NOT_CONNECTED => Self::NotConnected,
            abi::BUSBAR_REASON_NOT_FINITE => Self::NotFinite,
            abi::BUSBAR_REASON_STALE => Self::Stale,
            abi::BUSBAR_REASON_SOURCE_TIME => Self::SourceTime,
            _ => Self::Unknown,
        }
    }
}

impl Quality {
    pub(crate) fn to_abi(self) -> (u8, u8) {
        match self {
            Self::Good => (abi::BUSBAR_QUALITY_GOOD, abi::BUSBAR_REASON_NONE),
            Self::Uncertain(reason) => (abi::BUSBAR_QUALITY_UNCERTAIN, reason.to_abi()),
            Self::Bad(reason) => (abi::BUSBAR_QUALITY_BAD, reason.to_abi()),
        }
    }

    pub(crate) fn from_abi(quality: u8, reason: u8) -> Self {
        match quality {
            abi::BUSBAR_QUALITY_GOOD => Self::Good,
            abi::BUSBAR_QUALITY_UNCERTAIN => Self::Uncertain(Reason::from_abi(reason)),
            _ => Self::Bad(Reason::from_abi(reason)),
        }
    }

    /// Whether the value can be shown as certain.
    pub fn is_good(self) -> bool {
        self == Self::Good
    }
}
