//! Values of tags and their types.

use crate::code::codes;
use crate::{DoublePoint, Text};

/// Value of a tag.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Value {
    /// Floating-point measurement, in the tag's unit.
    F64(f64),
    /// Integer counter or code.
    I64(i64),
    /// Single point (on or off), such as a contact.
    Bool(bool),
    /// Double point: a switch position.
    DoublePoint(DoublePoint),
    /// Text, such as the name of a mode.
    Text(Text),
}

/// Type of a tag's value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema), schemars(rename = "TagType"))]
#[repr(u8)]
pub enum ValueKind {
    /// A number with fraction.
    #[default]
    F64 = 1,
    /// Type of whole numbers.
    I64 = 2,
    /// Type of on and off.
    Bool = 3,
    /// A switch position: intermediate, off, on, or faulty.
    DoublePoint = 4,
    /// Text of at most 255 bytes: a mode, a meter number, a last message.
    Text = 5,
}

codes!(ValueKind { F64, I64, Bool, DoublePoint, Text });

impl Value {
    /// Returns the type of this value.
    #[inline]
    pub const fn kind(&self) -> ValueKind {
        match self {
            Self::F64(_) => ValueKind::F64,
            Self::I64(_) => ValueKind::I64,
            Self::Bool(_) => ValueKind::Bool,
            Self::DoublePoint(_) => ValueKind::DoublePoint,
            Self::Text(_) => ValueKind::Text,
        }
    }

    /// Converts a quantity to a number; `None` for a state and for text.
    pub const fn as_number(&self) -> Option<f64> {
        match self {
            Self::F64(value) => Some(*value),
            Self::I64(value) => Some(*value as f64),
            Self::Bool(_) | Self::DoublePoint(_) | Self::Text(_) => None,
        }
    }

    /// Returns the value as 64 bits: those of the float, two's complement, 0 or 1, or 0 to 3;
    /// `None` for text.
    #[inline]
    pub const fn bits(&self) -> Option<u64> {
        match self {
            Self::F64(value) => Some(value.to_bits()),
            Self::I64(value) => Some(value.cast_unsigned()),
            Self::Bool(value) => Some(*value as u64),
            Self::DoublePoint(value) => Some(value.bits() as u64),
            Self::Text(_) => None,
        }
    }

    /// Creates a value of a type from its bits; `None` for text. A bool is true for all but 0; a
    /// double point takes the lowest two bits.
    #[inline]
    pub const fn from_bits(kind: ValueKind, bits: u64) -> Option<Self> {
        match kind {
            ValueKind::F64 => Some(Self::F64(f64::from_bits(bits))),
            ValueKind::I64 => Some(Self::I64(bits.cast_signed())),
            ValueKind::Bool => Some(Self::Bool(bits != 0)),
            ValueKind::DoublePoint => Some(Self::DoublePoint(DoublePoint::from_bits(bits))),
            ValueKind::Text => None,
        }
    }
}

impl ValueKind {
    /// Returns the word in settings: `f64`, `i64`, `bool`, `double_point` or `text`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::I64 => "i64",
            Self::Bool => "bool",
            Self::DoublePoint => "double_point",
            Self::Text => "text",
        }
    }

    /// Reports whether values are states: neither quantities nor texts.
    pub const fn is_state(self) -> bool {
        matches!(self, Self::Bool | Self::DoublePoint)
    }

    /// Reports whether values are quantities, which can be scaled, limited and drawn as a trend.
    pub const fn is_quantity(self) -> bool {
        matches!(self, Self::F64 | Self::I64)
    }

    /// Parses a value of this type from text: a number; `true`, `false`, `1` or `0`; a double point
    /// as its two bits, 0 to 3; or any text that fits. Returns `None` for what is none of its type.
    ///
    /// ```
    /// use busbar_types::{DoublePoint, Value, ValueKind};
    ///
    /// assert_eq!(ValueKind::F64.parse("-1.5"), Some(Value::F64(-1.5)));
    /// assert_eq!(ValueKind::Bool.parse("1"), Some(Value::Bool(true)));
    /// assert_eq!(ValueKind::DoublePoint.parse("2"), Some(Value::DoublePoint(DoublePoint::On)));
    /// assert_eq!(ValueKind::I64.parse("1.5"), None);
    /// ```
    pub fn parse(self, text: &str) -> Option<Value> {
        let text = text.trim();
        match self {
            Self::Text => Text::new(text).map(Value::Text),
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
}
