//! Numbers in payloads that are no decimal text: hexadecimal text, and bytes in any order.

use std::borrow::Cow;

use data_encoding::HEXLOWER_PERMISSIVE;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::convert::Raw;

/// The last byte of a payload at which a number may begin.
const MAX_FIRST_BYTE: u32 = 16 * 1024 * 1024;
/// Bytes of the widest number.
const MAX_NUMBER_BYTES: usize = 8;
/// Hexadecimal digits of the widest number.
const MAX_HEX_DIGITS: usize = 2 * MAX_NUMBER_BYTES;

/// Format of a payload, or of the text at a pointer, as addresses name it.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum FormatName {
    Text,
    Hex,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

/// Order of bytes or of words of 16 bits.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, PartialOrd, Ord)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ByteOrder {
    /// The most significant one first.
    Big,
    /// The least significant one first.
    Little,
}

/// Form in which the bytes of a number come.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum BytesForm {
    /// Raw bytes, without an encoding.
    Raw,
    /// Hexadecimal text, two digits for each byte.
    Hex,
}

/// Fields of an address that tell the format, as typed.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub(crate) struct RawFormat {
    pub(crate) format: Option<FormatName>,
    pub(crate) byte_order: Option<ByteOrder>,
    pub(crate) word_order: Option<ByteOrder>,
    pub(crate) byte: Option<u32>,
    pub(crate) bytes: Option<BytesForm>,
}

/// Format of a value in a payload.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PayloadFormat {
    /// Text, or a value of JSON.
    #[default]
    Text,
    /// A number as hexadecimal text.
    Hex,
    /// A number as bytes.
    Bytes(ByteFormat),
}

/// A number as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ByteFormat {
    number: NumberType,
    byte_order: ByteOrder,
    word_order: ByteOrder,
    /// First byte of the number; without it the payload is the number alone.
    first: Option<u32>,
    is_hex_text: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum NumberType {
    Unsigned(u8),
    Signed(u8),
    Float(u8),
}

impl NumberType {
    fn bytes(self) -> usize {
        let (Self::Unsigned(bytes) | Self::Signed(bytes) | Self::Float(bytes)) = self;
        bytes.into()
    }
}

impl RawFormat {
    /// Reports whether an address has no field of the format.
    pub(crate) fn is_empty(&self) -> bool {
        self.format.is_none() && !self.has_details()
    }

    fn has_details(&self) -> bool {
        self.byte_order.is_some()
            || self.word_order.is_some()
            || self.byte.is_some()
            || self.bytes.is_some()
    }

    /// Checks it; `has_pointer` where the value is within JSON.
    pub(crate) fn parse(self, has_pointer: bool) -> Result<PayloadFormat, String> {
        let number = match self.format.unwrap_or(FormatName::Text) {
            FormatName::Text | FormatName::Hex if self.has_details() => {
                return Err("byte_order, word_order, byte and bytes are for numbers as bytes: \
                            remove them, or set format to u8, i16, f32 or the like"
                    .into());
            }
            FormatName::Text => return Ok(PayloadFormat::Text),
            FormatName::Hex => return Ok(PayloadFormat::Hex),
            FormatName::U8 => NumberType::Unsigned(1),
            FormatName::I8 => NumberType::Signed(1),
            FormatName::U16 => NumberType::Unsigned(2),
            FormatName::I16 => NumberType::Signed(2),
            FormatName::U32 => NumberType::Unsigned(4),
            FormatName::I32 => NumberType::Signed(4),
            FormatName::U64 => NumberType::Unsigned(8),
            FormatName::I64 => NumberType::Signed(8),
            FormatName::F32 => NumberType::Float(4),
            FormatName::F64 => NumberType::Float(8),
        };
        let is_hex_text = match (self.bytes, has_pointer) {
            (Some(BytesForm::Raw), true) => {
                return Err(
                    "bytes: JSON holds no raw bytes: set it to \"hex\", or remove pointer".into()
                );
            }
            (Some(form), _) => form == BytesForm::Hex,
            (None, has_pointer) => has_pointer,
        };
        let byte_order = match (self.byte_order, number.bytes()) {
            (Some(order), _) => order,
            (None, 1) => ByteOrder::Big,
            (None, _) => {
                return Err(
                    "format: a number of several bytes needs byte_order: \"big\" (the most \
                            significant byte first) or \"little\""
                        .into(),
                );
            }
        };
        if self.byte.is_some_and(|byte| byte > MAX_FIRST_BYTE) {
            return Err(format!("byte: at most {MAX_FIRST_BYTE} is allowed"));
        }
        let word_order = self.word_order.unwrap_or(byte_order);
        let first = self.byte;
        Ok(PayloadFormat::Bytes(ByteFormat { number, byte_order, word_order, first, is_hex_text }))
    }
}

impl ByteFormat {
    /// Reads the number from bytes, or from text that stands for them.
    ///
    /// # Errors
    /// In words: no such bytes, or too few or many of them.
    pub(crate) fn read(self, payload: &[u8]) -> Result<Raw<'static>, Cow<'static, str>> {
        let decoded;
        let payload = if self.is_hex_text {
            decoded = bytes_of_hex(payload).ok_or("no text of hexadecimal bytes")?;
            decoded.as_slice()
        } else {
            payload
        };
        let count = self.number.bytes();
        let first = self.first.unwrap_or(0) as usize;
        let is_whole = self.first.is_some() || payload.len() == count;
        let bytes = payload.get(first..first.saturating_add(count)).filter(|_| is_whole);
        let Some(bytes) = bytes else {
            return Err(format!(
                "a payload of {} bytes, where its format has {count} from byte {first}",
                payload.len()
            )
            .into());
        };
        Ok(self.number_of(bytes))
    }

    /// Puts the bytes into order, the most significant first, and reads them.
    fn number_of(self, bytes: &[u8]) -> Raw<'static> {
        let mut number = [0; MAX_NUMBER_BYTES];
        let ordered = &mut number[MAX_NUMBER_BYTES - bytes.len()..];
        ordered.copy_from_slice(bytes);
        if self.byte_order == ByteOrder::Little {
            ordered.chunks_mut(2).for_each(<[u8]>::reverse);
        }
        if self.word_order == ByteOrder::Little && bytes.len() > 2 {
            // Words of 16 bits change places, and keep their bytes.
            ordered.reverse();
            ordered.chunks_mut(2).for_each(<[u8]>::reverse);
        }
        let unsigned = u64::from_be_bytes(number);
        let unused_bits = 8 * (MAX_NUMBER_BYTES - bytes.len()) as u32;
        match self.number {
            NumberType::Unsigned(_) => Raw::Int(unsigned.into()),
            NumberType::Signed(_) => {
                Raw::Int((((unsigned << unused_bits) as i64) >> unused_bits).into())
            }
            NumberType::Float(4) => Raw::Float(f32::from_bits(unsigned as u32).into()),
            NumberType::Float(_) => Raw::Float(f64::from_bits(unsigned)),
        }
    }
}

/// Reads a number of hexadecimal digits: `1F`, `0x1F`, `-0x1F`, `1Fh`, `0000 001F`.
pub(crate) fn hex_number(text: &str) -> Option<i128> {
    let text = text.trim();
    let (sign, text) = match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let digits = without_prefix(text).or_else(|| text.strip_suffix(['h', 'H'])).unwrap_or(text);
    let digits: String = digits.chars().filter(|c| !" _:".contains(*c)).collect();
    let is_number = (1..=MAX_HEX_DIGITS).contains(&digits.len())
        && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_number.then(|| u64::from_str_radix(&digits, 16).ok()).flatten().map(|n| sign * i128::from(n))
}

/// Reads a hexadecimal number that its prefix shows to be one: `0x1F`.
pub(crate) fn prefixed_hex_number(text: &str) -> Option<i128> {
    let unsigned = text.trim().trim_start_matches(['-', '+']);
    without_prefix(unsigned).and_then(|_| hex_number(text))
}

fn without_prefix(text: &str) -> Option<&str> {
    ["0x", "0X", "&h", "&H"].iter().find_map(|prefix| text.strip_prefix(prefix))
}

/// Reads bytes of two hexadecimal digits each: `41C80000`, `0x41 C8 00 00`.
fn bytes_of_hex(text: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(text).ok()?.trim();
    let text = without_prefix(text).unwrap_or(text);
    let digits: String = text.chars().filter(|c| !" _:-".contains(*c)).collect();
    HEXLOWER_PERMISSIVE.decode(digits.as_bytes()).ok()
}

#[cfg(test)]
#[path = "payload_format_tests.rs"]
mod tests;
