//! Encoding of values into cells, the inverse of [`crate::decode`].

use busbar_plugin_sdk::Value;

use crate::address::{ByteOrder, Decoding, Format, WordOrder};

/// Encodes a value into the cells of a point. None where the cells cannot hold it.
pub(super) fn encode(decoding: &Decoding, value: &Value) -> Option<Vec<u16>> {
    match (*decoding, value) {
        (Decoding::Number { format, word_order, scale, offset }, Value::F64(value)) => {
            Some(cells(format, word_order, number_bits(format, (value - offset) / scale)?))
        }
        (Decoding::Integer { format, word_order }, &Value::I64(value)) => {
            Some(cells(format, word_order, integer_bits(format, value.into())?))
        }
        (Decoding::RegisterBit(bit), &Value::Bool(is_on)) => Some(vec![u16::from(is_on) << bit]),
        (Decoding::RegisterBitPair(first), Value::DoublePoint(position)) => {
            Some(vec![u16::from(position.bits()) << first])
        }
        (Decoding::Bit, &Value::Bool(is_on)) => Some(vec![u16::from(is_on)]),
        (Decoding::BitPair, Value::DoublePoint(position)) => {
            let bits = u16::from(position.bits());
            Some(vec![bits & 1, bits >> 1])
        }
        (Decoding::Text { length, byte_order }, Value::Text(text)) => {
            // Where `Text 3` finds no room, its number does.
            let number = || text.as_str().strip_prefix("Text ");
            text_cells(length, byte_order, text.as_str())
                .or_else(|| text_cells(length, byte_order, number()?))
        }
        _ => None,
    }
}

/// Returns the cells of a text, padded with zeros.
fn text_cells(length: u8, byte_order: ByteOrder, text: &str) -> Option<Vec<u16>> {
    let mut bytes = text.as_bytes().to_vec();
    if bytes.len() > usize::from(length) {
        return None;
    }
    bytes.resize(usize::from(length).next_multiple_of(2), 0);
    let (registers, _) = bytes.as_chunks();
    let register = |bytes: &[u8; 2]| match byte_order {
        ByteOrder::Big => u16::from_be_bytes(*bytes),
        ByteOrder::Little => u16::from_le_bytes(*bytes),
    };
    Some(registers.iter().map(register).collect())
}

fn number_bits(format: Format, raw: f64) -> Option<u64> {
    match format {
        Format::F32 => {
            let short = raw as f32;
            short.is_finite().then(|| short.to_bits().into())
        }
        Format::F64 => Some(raw.to_bits()),
        // Casts saturate far beyond what any format holds.
        _ => integer_bits(format, raw.round() as i128),
    }
}

/// Returns the low bits of a number, where the format can hold it.
fn integer_bits(format: Format, number: i128) -> Option<u64> {
    let (low, high) = match format {
        Format::U16 => (0, u16::MAX.into()),
        Format::I16 => (i16::MIN.into(), i16::MAX.into()),
        Format::U32 => (0, u32::MAX.into()),
        Format::I32 => (i32::MIN.into(), i32::MAX.into()),
        Format::U64 => (0, u64::MAX.into()),
        Format::I64 => (i64::MIN.into(), i64::MAX.into()),
        Format::F32 | Format::F64 => return None,
    };
    (low..=high).contains(&number).then_some(number as u64)
}

fn cells(format: Format, word_order: WordOrder, bits: u64) -> Vec<u16> {
    let count = format.registers();
    let cell = |index| {
        let from_low = match word_order {
            WordOrder::Big => count - 1 - index,
            WordOrder::Little => index,
        };
        (bits >> (16 * from_low)) as u16
    };
    (0..count).map(cell).collect()
}

#[cfg(test)]
mod tests {
    use busbar_plugin_sdk::{DoublePoint, Quality, Text};
    use proptest::prelude::*;

    use super::*;
    use crate::decode::{Cells, decode};

    const FORMATS: [Format; 8] = [
        Format::U16,
        Format::I16,
        Format::U32,
        Format::I32,
        Format::U64,
        Format::I64,
        Format::F32,
        Format::F64,
    ];

    fn read_back(decoding: &Decoding, cells: &[u16]) -> Value {
        let (value, quality) = decode(decoding, Cells::Registers(cells)).unwrap();
        assert_eq!(quality, Quality::Good);
        value
    }

    fn text(text: &str) -> Value {
        Value::Text(Text::cut(text))
    }

    #[test]
    fn what_does_not_fit_is_nothing() {
        let number = |format, scale| Decoding::Number {
            format,
            word_order: WordOrder::Big,
            scale,
            offset: 0.0,
        };
        for (decoding, value) in [
            (number(Format::U16, 0.1), Value::F64(6553.6)),
            (number(Format::U16, 1.0), Value::F64(-1.0)),
            (number(Format::I16, 0.001), Value::F64(40.0)),
            (number(Format::F32, 1e-30), Value::F64(1e30)),
            (number(Format::F64, 1.0), Value::I64(1)),
            (Decoding::Integer { format: Format::U32, word_order: WordOrder::Big }, Value::I64(-1)),
            (Decoding::Bit, Value::F64(1.0)),
            (Decoding::Bit, text("1")),
            (Decoding::Text { length: 3, byte_order: ByteOrder::Big }, text("AUTO")),
            (Decoding::Text { length: 3, byte_order: ByteOrder::Big }, Value::I64(1)),
        ] {
            assert_eq!(encode(&decoding, &value), None, "{decoding:?} {value:?}");
        }
    }

    #[test]
    fn states_are_read_as_they_were_written() {
        for position in
            [DoublePoint::Intermediate, DoublePoint::Off, DoublePoint::On, DoublePoint::BadState]
        {
            let value = Value::DoublePoint(position);
            let decoding = Decoding::RegisterBitPair(6);
            let cells = encode(&decoding, &value).unwrap();
            assert_eq!(read_back(&decoding, &cells), value);
            let cells = encode(&Decoding::BitPair, &value).unwrap();
            let bits: Vec<_> = cells.iter().map(|&cell| cell != 0).collect();
            let read = decode(&Decoding::BitPair, Cells::Bits(&bits));
            assert_eq!(read, Ok((value, Quality::Good)));
        }
        for is_on in [false, true] {
            let value = Value::Bool(is_on);
            let decoding = Decoding::RegisterBit(15);
            assert_eq!(read_back(&decoding, &encode(&decoding, &value).unwrap()), value);
        }
    }

    proptest! {
        #[test]
        fn numbers_are_read_as_they_were_written(
            format in prop::sample::select(&FORMATS[..]),
            is_big in any::<bool>(),
            value in -1e7..1e7,
            scale in prop::sample::select(&[0.001, 0.1, 1.0, -2.5][..]),
            offset in -100.0..100.0,
        ) {
            let word_order = if is_big { WordOrder::Big } else { WordOrder::Little };
            let decoding = Decoding::Number { format, word_order, scale, offset };
            if let Some(cells) = encode(&decoding, &Value::F64(value)) {
                prop_assert_eq!(cells.len(), usize::from(format.registers()));
                let Value::F64(read) = read_back(&decoding, &cells) else { panic!() };
                let step = if matches!(format, Format::F32 | Format::F64) { 2e-7 } else { 0.5 };
                // A float keeps 24 bits of what lies on the wire.
                let size = if step < 0.5 { ((value - offset) / scale).abs() } else { 1.0 };
                let most = step * scale.abs() * size.max(1e-30) + 1e-6;
                prop_assert!((read - value).abs() <= most, "{} {}", read, value);
            } else {
                prop_assert!(!matches!(format, Format::F32 | Format::F64 | Format::I64));
            }
        }

        #[test]
        fn integers_are_read_as_they_were_written(
            format in prop::sample::select(&FORMATS[..6]),
            is_big in any::<bool>(),
            value in any::<i64>(),
            shift in 0_u32..64,
        ) {
            let word_order = if is_big { WordOrder::Big } else { WordOrder::Little };
            let decoding = Decoding::Integer { format, word_order };
            let value = Value::I64(value >> shift);
            if let Some(cells) = encode(&decoding, &value) {
                prop_assert_eq!(cells.len(), usize::from(format.registers()));
                prop_assert_eq!(read_back(&decoding, &cells), value);
            }
        }

        #[test]
        fn texts_are_read_as_they_were_written(
            length in 1_u8..=250,
            is_big in any::<bool>(),
            written in "[a-zà-ÿ電 ]{0,90}",
        ) {
            let byte_order = if is_big { ByteOrder::Big } else { ByteOrder::Little };
            let decoding = Decoding::Text { length, byte_order };
            // Spaces at the end are padding.
            let value = text(written.trim_end_matches(' '));
            match encode(&decoding, &value) {
                Some(cells) => {
                    prop_assert_eq!(cells.len(), usize::from(length.div_ceil(2)));
                    prop_assert_eq!(read_back(&decoding, &cells), value);
                }
                None => prop_assert!(written.len() > usize::from(length)),
            }
        }
    }
}
