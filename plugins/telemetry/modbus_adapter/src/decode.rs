//! Cells of a device -> values.

use busbar_plugin_sdk::{DoublePoint, Quality, Reason, Value, text_value_of_bytes};

use crate::address::{ByteOrder, Decoding, Format, WordOrder};

/// Cells of one point within the answer of a device.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cells<'a> {
    /// Holding or input registers.
    Registers(&'a [u16]),
    /// Coils or discrete inputs.
    Bits(&'a [bool]),
}

/// Decodes cells into the value of a point, and its quality: uncertain for a text that is no UTF-8.
///
/// Numbers that are not finite are passed on: the host marks them.
///
/// # Errors
/// [`Reason::OutOfRange`] for a u64 that no i64 can hold, and
/// [`Reason::Configuration`] for cells that do not fit the decoding.
pub(crate) fn decode(decoding: &Decoding, cells: Cells<'_>) -> Result<(Value, Quality), Reason> {
    let value = match (*decoding, cells) {
        (Decoding::Text { length, byte_order }, Cells::Registers(registers)) => {
            return text(length, byte_order, registers);
        }
        (Decoding::Number { format, word_order, scale, offset }, Cells::Registers(registers)) => {
            let raw = number(format, raw_bits(format, word_order, registers)?);
            Value::F64(raw * scale + offset)
        }
        (Decoding::Integer { format, word_order }, Cells::Registers(registers)) => {
            Value::I64(integer(format, raw_bits(format, word_order, registers)?)?)
        }
        (Decoding::RegisterBit(bit), Cells::Registers(&[register])) => {
            Value::Bool(register >> bit & 1 == 1)
        }
        (Decoding::RegisterBitPair(first), Cells::Registers(&[register])) => {
            Value::DoublePoint(DoublePoint::from_bits(u64::from(register >> first)))
        }
        (Decoding::Bit, Cells::Bits(&[bit])) => Value::Bool(bit),
        (Decoding::BitPair, Cells::Bits(&[open, closed])) => {
            Value::DoublePoint(DoublePoint::from_bits(u64::from(open) | u64::from(closed) << 1))
        }
        _ => return Err(Reason::Configuration),
    };
    Ok((value, Quality::Good))
}

/// Decodes a text, without the zeros and spaces at its end.
fn text(length: u8, byte_order: ByteOrder, registers: &[u16]) -> Result<(Value, Quality), Reason> {
    let bytes: Vec<u8> = match byte_order {
        ByteOrder::Big => registers.iter().flat_map(|register| register.to_be_bytes()).collect(),
        ByteOrder::Little => registers.iter().flat_map(|register| register.to_le_bytes()).collect(),
    };
    let bytes = bytes.get(..length.into()).ok_or(Reason::Configuration)?;
    Ok(text_value_of_bytes(bytes))
}

/// Returns the bits of a number, right-aligned.
fn raw_bits(format: Format, word_order: WordOrder, registers: &[u16]) -> Result<u64, Reason> {
    if registers.len() != usize::from(format.registers()) {
        return Err(Reason::Configuration);
    }
    let join = |bits: u64, register: &u16| bits << 16 | u64::from(*register);
    Ok(match word_order {
        WordOrder::Big => registers.iter().fold(0, join),
        WordOrder::Little => registers.iter().rev().fold(0, join),
    })
}

fn number(format: Format, bits: u64) -> f64 {
    match format {
        Format::F32 => f64::from(f32::from_bits(bits as u32)),
        Format::F64 => f64::from_bits(bits),
        // Exact up to 2^53; no measurement has more digits.
        Format::U64 => bits as f64,
        _ => signed(format, bits) as f64,
    }
}

fn integer(format: Format, bits: u64) -> Result<i64, Reason> {
    match format {
        Format::U64 => i64::try_from(bits).map_err(|_| Reason::OutOfRange),
        Format::F32 | Format::F64 => Err(Reason::Configuration),
        _ => Ok(signed(format, bits)),
    }
}

/// Casts that keep the low bits and extend the sign.
fn signed(format: Format, bits: u64) -> i64 {
    match format {
        Format::I16 => i64::from(bits as u16 as i16),
        Format::I32 => i64::from(bits as u32 as i32),
        _ => bits as i64,
    }
}

#[cfg(test)]
mod tests {
    use busbar_plugin_sdk::Text;

    use super::*;

    fn number(format: Format, registers: &[u16], scale: f64, offset: f64) -> [f64; 2] {
        let reversed: Vec<_> = registers.iter().rev().copied().collect();
        [(WordOrder::Big, registers), (WordOrder::Little, &reversed[..])].map(
            |(word_order, registers)| {
                let decoding = Decoding::Number { format, word_order, scale, offset };
                match decode(&decoding, Cells::Registers(registers)).unwrap() {
                    (Value::F64(value), Quality::Good) => value,
                    other => panic!("{other:?}"),
                }
            },
        )
    }

    #[test]
    fn numbers_in_both_word_orders() {
        // Bit patterns by IEEE 754: 230.5 = 0x43668000; pi = 0x400921FB54442D18.
        let cases: &[(Format, &[u16], f64)] = &[
            (Format::U16, &[65535], 65535.0),
            (Format::I16, &[0xFFFE], -2.0),
            (Format::I16, &[0x8000], -32768.0),
            (Format::U32, &[0xFFFF, 0xFFFF], 4_294_967_295.0),
            (Format::U32, &[0x0001, 0x0002], 65538.0),
            (Format::I32, &[0xFFFF, 0xFFFD], -3.0),
            (Format::I32, &[0x8000, 0x0000], -2_147_483_648.0),
            (Format::U64, &[0, 1, 0, 0], 4_294_967_296.0),
            (Format::I64, &[0xFFFF, 0xFFFF, 0xFFFF, 0xFFFB], -5.0),
            (Format::F32, &[0x4366, 0x8000], 230.5),
            (Format::F32, &[0xC366, 0x8000], -230.5),
            (Format::F64, &[0x4009, 0x21FB, 0x5444, 0x2D18], std::f64::consts::PI),
        ];
        for &(format, registers, expected) in cases {
            assert_eq!(number(format, registers, 1.0, 0.0), [expected; 2], "{format:?}");
        }
    }

    #[test]
    fn word_order_matters() {
        let decoding = Decoding::Integer { format: Format::U32, word_order: WordOrder::Little };
        let value = decode(&decoding, Cells::Registers(&[1, 2])).unwrap();
        assert_eq!(value, (Value::I64(131_073), Quality::Good));
    }

    #[test]
    fn scale_comes_before_offset() {
        assert_eq!(number(Format::I16, &[0xFF9C], 0.5, 20.0), [-30.0; 2]);
        assert_eq!(number(Format::U16, &[1000], -0.25, 0.5), [-249.5; 2]);
    }

    #[test]
    fn numbers_that_are_not_finite_pass() {
        assert!(number(Format::F32, &[0x7FC0, 0], 1.0, 0.0)[0].is_nan());
        assert_eq!(number(Format::F32, &[0xFF80, 0], 1.0, 0.0)[0], f64::NEG_INFINITY);
    }

    #[test]
    fn integers_and_bits() {
        let integer = |format| Decoding::Integer { format, word_order: WordOrder::Big };
        let cases: &[(Decoding, Cells<'_>, Result<Value, Reason>)] = &[
            (integer(Format::I16), Cells::Registers(&[0xFFFF]), Ok(Value::I64(-1))),
            (integer(Format::U16), Cells::Registers(&[0xFFFF]), Ok(Value::I64(65535))),
            (integer(Format::I64), Cells::Registers(&[0x8000, 0, 0, 0]), Ok(Value::I64(i64::MIN))),
            (
                integer(Format::U64),
                Cells::Registers(&[0x7FFF, 0xFFFF, 0xFFFF, 0xFFFF]),
                Ok(Value::I64(i64::MAX)),
            ),
            (integer(Format::U64), Cells::Registers(&[0x8000, 0, 0, 0]), Err(Reason::OutOfRange)),
            (integer(Format::U32), Cells::Registers(&[1]), Err(Reason::Configuration)),
            (Decoding::RegisterBit(15), Cells::Registers(&[0x8000]), Ok(Value::Bool(true))),
            (Decoding::RegisterBit(0), Cells::Registers(&[0xFFFE]), Ok(Value::Bool(false))),
            (Decoding::Bit, Cells::Bits(&[true]), Ok(Value::Bool(true))),
            (Decoding::Bit, Cells::Registers(&[1]), Err(Reason::Configuration)),
        ];
        for (decoding, cells, expected) in cases {
            let expected = expected.clone().map(|value| (value, Quality::Good));
            assert_eq!(decode(decoding, *cells), expected, "{decoding:?} {cells:?}");
        }
    }

    #[test]
    fn texts_end_before_their_padding() {
        let decode = |length, byte_order, registers: &[u16]| {
            decode(&Decoding::Text { length, byte_order }, Cells::Registers(registers))
        };
        let text = |text: &str| Value::Text(Text::cut(text));
        let doubtful = Quality::Uncertain(Reason::Configuration);
        let (big, little) = (ByteOrder::Big, ByteOrder::Little);
        // "AUTO", and "é" as C3 A9 in UTF-8.
        let cases: &[(u8, ByteOrder, &[u16], &str, Quality)] = &[
            (4, big, &[0x4155, 0x544F], "AUTO", Quality::Good),
            (4, little, &[0x5541, 0x4F54], "AUTO", Quality::Good),
            (8, big, &[0x4155, 0x544F, 0x2000, 0], "AUTO", Quality::Good),
            (3, big, &[0x4155, 0x544F], "AUT", Quality::Good),
            (3, little, &[0x5541, 0x4F54], "AUT", Quality::Good),
            (4, big, &[0, 0], "", Quality::Good),
            (4, big, &[0x2020, 0x2020], "", Quality::Good),
            (4, big, &[0x2041, 0x4200], " AB", Quality::Good),
            (2, big, &[0xC3A9], "é", Quality::Good),
            (1, big, &[0xC3A9], "\u{fffd}", doubtful),
            (2, big, &[0xFFFF], "\u{fffd}\u{fffd}", doubtful),
        ];
        for &(length, byte_order, registers, expected, quality) in cases {
            let read = decode(length, byte_order, registers);
            assert_eq!(read, Ok((text(expected), quality)), "{length} {registers:x?}");
        }
        let longest = decode(250, big, &[0x5858; 125]);
        assert_eq!(longest, Ok((text(&"X".repeat(250)), Quality::Good)));
        assert_eq!(decode(4, big, &[0x4155]), Err(Reason::Configuration));
        let bits =
            super::decode(&Decoding::Text { length: 2, byte_order: big }, Cells::Bits(&[true]));
        assert_eq!(bits, Err(Reason::Configuration));
    }

    #[test]
    fn double_points_read_open_then_closed() {
        let table = [
            (false, false, DoublePoint::Intermediate),
            (true, false, DoublePoint::Off),
            (false, true, DoublePoint::On),
            (true, true, DoublePoint::BadState),
        ];
        for (open, closed, expected) in table {
            let expected = Ok((Value::DoublePoint(expected), Quality::Good));
            assert_eq!(decode(&Decoding::BitPair, Cells::Bits(&[open, closed])), expected);
            // Ones all around the pair show that only the pair counts.
            let register = !(0b11 << 6) | u16::from(open) << 6 | u16::from(closed) << 7;
            assert_eq!(
                decode(&Decoding::RegisterBitPair(6), Cells::Registers(&[register])),
                expected
            );
        }
    }
}
