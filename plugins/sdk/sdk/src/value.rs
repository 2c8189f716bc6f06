//! Values and qualities out of numbers of the ABI.

use busbar_types::{Quality, QualityLevel, Reason, Value, ValueKind};

/// Reads a value; `None` for no value, or one of a kind that is not known.
pub(crate) fn read_value(kind: u8, bits: u64) -> Option<Value> {
    ValueKind::from_code(kind).map(|kind| Value::from_bits(kind, bits))
}

/// Reads a quality. A level that is not known is bad, a reason that is not known is none.
pub(crate) fn read_quality(level: u8, reason: u8) -> Quality {
    let level = QualityLevel::from_code(level).unwrap_or(QualityLevel::Bad);
    Quality::new(level, Reason::from_code(reason).unwrap_or(Reason::Unknown))
}
