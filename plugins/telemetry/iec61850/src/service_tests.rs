use super::*;

fn read(bytes: &[u8]) -> Result<Value, Error> {
    let data = Cursor::new(bytes).next_required().unwrap();
    value_of(&AccessResult::Success(data)).map(Result::unwrap)
}

/// Wraps an element in a structure, whose length takes one or three bytes.
fn structure(content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len()).unwrap();
    let head = match length {
        0..=127 => vec![0xA2, length as u8],
        _ => [&[0xA2, 0x82][..], &length.to_be_bytes()].concat(),
    };
    [&head, content].concat()
}

#[test]
fn a_text_that_is_no_text_of_its_type_leaves_what_is_beside_it() {
    // Latin-1 in a VisibleString, broken UTF-8 in an MMSString, and an integer.
    let members = [&b"\x8A\x03S\xFCd"[..], b"\x90\x02\xC3(", b"\x85\x01\x05"].concat();
    let other = |tag, bytes: &[u8]| Value::Other { tag, constructed: false, bytes: bytes.to_vec() };
    let expected = Value::Structure(vec![
        other(tag::VISIBLE_STRING, b"S\xFCd"),
        other(tag::MMS_STRING, b"\xC3("),
        Value::Integer(5),
    ]);
    assert_eq!(read(&structure(&members)).unwrap(), expected);
    let sound = structure(b"\x8A\x04AUTO\x90\x02\xC3\xBC");
    let texts = vec![Value::VisibleString("AUTO".into()), Value::MmsString("ü".into())];
    assert_eq!(read(&sound).unwrap(), Value::Structure(texts));
}

#[test]
fn limits_hold_for_texts_and_structures() {
    let long = |byte: u8| [&[0x8A, 0x82, 0x10, 0x01][..], &[byte; 4097]].concat();
    assert!(read(&long(b'x')).is_err() && read(&long(0xFC)).is_err());
    let nested = |levels| (0..levels).fold(vec![0x83, 1, 1], |inner, _| structure(&inner));
    assert!(read(&nested(LIMITS.max_depth)).is_ok());
    assert!(read(&nested(LIMITS.max_depth + 1)).is_err());
    let wide = |members: usize| structure(&[0x83, 1, 1].repeat(members));
    assert!(read(&wide(LIMITS.max_dataset_members)).is_ok());
    assert!(read(&wide(LIMITS.max_dataset_members + 1)).is_err());
    // A boolean of no byte is at fault, not only for itself.
    assert!(read(&structure(&[0x83, 0])).is_err());
}
