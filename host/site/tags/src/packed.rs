//! Values as words, which the tag table copies and compares.

use busbar_types::{Text, Value, ValueKind};

/// Value, or none, as words that are copied and compared whole. Not-a-number equals itself here.
/// The bits of a text, which is stored apart, are a number that changes with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Packed {
    pub(crate) bits: u64,
    /// Kind of the value; none where there is no value.
    pub(crate) kind: Option<ValueKind>,
}

impl Packed {
    /// Packs a value; `None` for a text.
    #[inline]
    pub(crate) fn from_value(value: &Value) -> Option<Self> {
        Some(Self { bits: value.bits()?, kind: Some(value.kind()) })
    }

    #[inline]
    pub(crate) fn is_none(self) -> bool {
        self.kind.is_none()
    }

    /// Returns the value, if there is one. `text` is that of a text.
    #[inline]
    pub(crate) fn unpack(self, text: Option<&Text>) -> Option<Value> {
        let kind = self.kind?;
        Value::from_bits(kind, self.bits).or_else(|| text.cloned().map(Value::Text))
    }
}
