//! Values of tags and their quality.

use busbar_plugin_abi as abi;

/// Value of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Floating-point measurement, in the tag's unit.
    F64(f64),
    /// Integer counter or code.
    I64(i64),
    /// Single point (on or off).
    Bool(bool),
    /// Double point: a switch position.
    DoublePoint(DoublePoint),
}

/// Type of a tag's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DoublePoint {
    /// Neither contact closed: the switch travels.
    Intermediate,
    /// Switch that is open.
    Off,
    /// Switch that is closed.
    On,
    /// Both contacts closed: a fault.
    BadState,
}

/// Quality of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Value that is usable.
    Good,
    /// Value that is doubtful.
    Uncertain(Reason),
    /// Value that is not usable.
    Bad(Reason),
}

/// Reason of a quality that is not good.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Reason that nobody gave.
    Unknown,
    /// Link to the device that is down.
    Communication,
    /// Sensor that failed, as the device says.
    Sensor,
    /// Value outside the measuring range.
    OutOfRange,
    /// Address that the device refused, or an answer that does not fit.
    Configuration,
    /// Device that is not connected yet.
    NotConnected,
    /// Value that is not a finite number.
    NotFinite,
    /// Value past its freshness limit; only the host gives this reason.
    Stale,
    /// Source timestamp that is missing where one is promised, unreadable, in the future or
    /// impossible.
    SourceTime,
}

impl Value {
    /// Returns the type of this value.
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
    /// Parses a value of this kind from text: a number; `true`, `false`, `1` or `0`; or a double
    /// point as its two bits, 0 to 3. Returns `None` for other text.
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
    /// Creates a position from the two bits of a double-point information element; higher bits are
    /// ignored.
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
    /// Returns the two bits of a double-point information element.
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

    /// Reports whether the value can be shown as certain.
    pub fn is_good(self) -> bool {
        self == Self::Good
    }
}
