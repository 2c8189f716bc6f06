//! Values as words, which the tag table copies and compares.

use busbar_types::{Value, ValueKind};

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
        Self { bits: value.bits(), kind: Some(value.kind()) }
    }

    #[inline]
    pub(crate) fn is_none(self) -> bool {
        self.kind.is_none()
    }

    #[inline]
    pub(crate) fn unpack(self) -> Option<Value> {
        self.kind.map(|kind| Value::from_bits(kind, self.bits))
    }
}
