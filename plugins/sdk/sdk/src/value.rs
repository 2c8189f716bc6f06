//! Values and qualities out of numbers of the ABI, and text values of sources.

use busbar_plugin_abi as abi;
use busbar_types::{DoublePoint, Quality, QualityLevel, Reason, Text, Value, ValueKind};

/// Reads a value of its fields; `None` for no value, or one of a kind that is not known.
///
/// # Safety
/// The text of a value of kind text is null or readable for its length.
pub(crate) unsafe fn read_value(fields: abi::ValueFields) -> Option<Value> {
    Some(match ValueKind::from_code(fields.kind)? {
        ValueKind::F64 => Value::F64(fields.number),
        ValueKind::I64 => Value::I64(fields.integer),
        ValueKind::Bool => Value::Bool(fields.integer != 0),
        ValueKind::DoublePoint => {
            Value::DoublePoint(DoublePoint::from_bits(fields.integer.cast_unsigned()))
        }
        // SAFETY: as the caller vouches.
        ValueKind::Text => match unsafe { crate::boundary::text(fields.text) } {
            Ok(text) => Value::Text(Text::cut(text)),
            Err(_) => return None,
        },
    })
}

/// Makes the value of a text tag of what a source sent, with its quality: uncertain where it is not
/// whole (see [`Text`]), as the host has it too.
pub fn text_value(text: &str) -> (Value, Quality) {
    judged(Text::cut(text))
}

/// Makes the value of a text tag of bytes that a source sent: up to the first zero byte, as strings
/// of C have it, and without the blanks that pad it at its end. Its quality is that of
/// [`text_value`].
pub fn text_value_of_bytes(bytes: &[u8]) -> (Value, Quality) {
    let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    judged(Text::from_utf8_lossy(text.trim_ascii_end()))
}

fn judged(text: Text) -> (Value, Quality) {
    let is_whole = text.is_whole();
    let quality = if is_whole { Quality::Good } else { Quality::Uncertain(Reason::Configuration) };
    (Value::Text(text), quality)
}

/// Reads a quality. A level that is not known is bad, a reason that is not known is none.
pub(crate) fn read_quality(level: u8, reason: u8) -> Quality {
    let level = QualityLevel::from_code(level).unwrap_or(QualityLevel::Bad);
    Quality::new(level, Reason::from_code(reason).unwrap_or(Reason::Unknown))
}
