use serde_json::json;

use super::*;

fn parse(json: serde_json::Value, has_pointer: bool) -> Result<PayloadFormat, String> {
    serde_json::from_value::<RawFormat>(json).unwrap().parse(has_pointer)
}

fn read(json: serde_json::Value, payload: &[u8]) -> Result<Raw<'static>, Cow<'static, str>> {
    let PayloadFormat::Bytes(format) = parse(json, false).unwrap() else { panic!("no bytes") };
    format.read(payload)
}

#[test]
fn hexadecimal_numbers_are_read() {
    let cases = [
        ("0x1F", Some(31)),
        ("1F", Some(31)),
        (" 1f ", Some(31)),
        ("1Fh", Some(31)),
        ("&H1F", Some(31)),
        ("0000 001F", Some(31)),
        ("-0x10", Some(-16)),
        ("FFFFFFFFFFFFFFFF", Some(i128::from(u64::MAX))),
        ("10000000000000000", None),
        ("", None),
        ("0x", None),
        ("h", None),
        ("1G", None),
        ("1.5", None),
        ("--1", None),
    ];
    for (text, expected) in cases {
        assert_eq!(hex_number(text), expected, "{text}");
    }
    assert_eq!(prefixed_hex_number("0x1F"), Some(31));
    assert_eq!(prefixed_hex_number("1F"), None);
    assert_eq!(prefixed_hex_number("10"), None);
}

/// Every type, in every order, at every place, raw and as text: what was written is read.
#[test]
fn numbers_as_bytes_are_read_in_every_order() {
    let mut rng = fastrand::Rng::with_seed(39);
    let orders = [("big", "big"), ("little", "little"), ("big", "little"), ("little", "big")];
    for _ in 0..20_000 {
        let bits = rng.u64(..);
        let (name, bytes, expected) = match rng.u8(..10) {
            0 => ("u8", vec![bits as u8], Raw::Int((bits as u8).into())),
            1 => ("i8", vec![bits as u8], Raw::Int((bits as u8 as i8).into())),
            2 => ("u16", (bits as u16).to_be_bytes().into(), Raw::Int((bits as u16).into())),
            3 => ("i16", (bits as u16).to_be_bytes().into(), Raw::Int((bits as i16).into())),
            4 => ("u32", (bits as u32).to_be_bytes().into(), Raw::Int((bits as u32).into())),
            5 => ("i32", (bits as u32).to_be_bytes().into(), Raw::Int((bits as i32).into())),
            6 => ("u64", bits.to_be_bytes().into(), Raw::Int(bits.into())),
            7 => ("i64", bits.to_be_bytes().into(), Raw::Int((bits as i64).into())),
            8 => {
                let value = rng.f32() * 1e6;
                ("f32", value.to_be_bytes().into(), Raw::Float(value.into()))
            }
            _ => {
                let value = rng.f64() * 1e6;
                ("f64", value.to_be_bytes().into(), Raw::Float(value))
            }
        };
        let (byte_order, word_order) = orders[rng.usize(..4)];
        let mut words: Vec<Vec<u8>> = bytes.chunks(2).map(<[u8]>::to_vec).collect();
        if word_order == "little" {
            words.reverse();
        }
        if byte_order == "little" {
            words.iter_mut().for_each(|word| word.reverse());
        }
        let mut payload = words.concat();
        let mut address =
            json!({"format": name, "byte_order": byte_order, "word_order": word_order});
        if rng.bool() {
            let first = rng.usize(..10);
            payload.splice(..0, std::iter::repeat_n(0xAA, first));
            payload.extend(std::iter::repeat_n(0x55, rng.usize(..3)));
            address["byte"] = first.into();
        }
        if rng.bool() {
            let text: String = payload.iter().map(|byte| format!("{byte:02X}")).collect();
            payload = text.into_bytes();
            address["bytes"] = "hex".into();
        }
        assert_eq!(read(address.clone(), &payload), Ok(expected), "{address} {payload:02X?}");
    }
}

#[test]
fn payloads_of_another_length_are_told() {
    let f32 = json!({"format": "f32", "byte_order": "big"});
    let told = |payload: &[u8]| read(f32.clone(), payload).unwrap_err().into_owned();
    assert!(told(&[1, 2, 3]).contains("a payload of 3 bytes, where its format has 4 from byte 0"));
    assert!(told(b"25.50").contains("a payload of 5 bytes"));
    let at = json!({"format": "u16", "byte_order": "big", "byte": 4});
    assert!(read(at.clone(), &[0; 5]).is_err() && read(at, &[0; 6]).is_ok());
    let hex = json!({"format": "u8", "bytes": "hex"});
    assert!(read(hex.clone(), b"1").is_err() && read(hex, b"0x1f") == Ok(Raw::Int(31)));
}

#[test]
fn formats_that_cannot_be_are_refused() {
    for (address, has_pointer, part) in [
        (json!({"byte_order": "big"}), false, "set format to u8"),
        (json!({"format": "hex", "byte": 1}), false, "set format to u8"),
        (json!({"format": "f32"}), false, "needs byte_order"),
        (json!({"format": "u8", "byte": 99_999_999}), false, "byte: at most"),
        (json!({"format": "u8", "bytes": "raw"}), true, "set it to \"hex\""),
    ] {
        let fault = parse(address.clone(), has_pointer).unwrap_err();
        assert!(fault.contains(part), "{address}: {fault}");
    }
}
