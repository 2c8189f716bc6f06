use encoding_rs::{GB18030, WINDOWS_1251, WINDOWS_1252};

use super::*;

/// A file whose declaration names an encoding, in that encoding.
fn file(label: &str, text: &str, encoding: &'static Encoding) -> Vec<u8> {
    let text = format!("<?xml version=\"1.0\" encoding=\"{label}\"?>\n<a>{text}</a>");
    encoding.encode(&text).0.into_owned()
}

fn utf16(text: &str, is_little: bool, has_mark: bool) -> Vec<u8> {
    let units = has_mark.then_some(0xFEFF).into_iter().chain(text.encode_utf16());
    let bytes = |unit: u16| if is_little { unit.to_le_bytes() } else { unit.to_be_bytes() };
    units.flat_map(bytes).collect()
}

#[test]
fn declared_encodings_are_read() {
    for (label, text, encoding) in [
        ("UTF-8", "Öl 油 масло", UTF_8),
        ("utf-8", "°C", UTF_8),
        ("windows-1252", "Öltemperatur °C – µ", WINDOWS_1252),
        ("ISO-8859-1", "Kühler, é", WINDOWS_1252),
        ("cp1252", "ß", WINDOWS_1252),
        ("windows-1251", "Температура масла, °C", WINDOWS_1251),
        ("Windows-1251", "кВ", WINDOWS_1251),
        ("GB18030", "油温, 主变压器 №1 𠀀", GB18030),
        ("gb2312", "油温", GB18030),
        ("GBK", "油温", GB18030),
        ("CP936", "油温", GB18030),
    ] {
        let decoded = decode(&file(label, text, encoding)).unwrap();
        assert!(decoded.text.contains(&format!("<a>{text}</a>")), "{label}: {}", decoded.text);
        assert_eq!(decoded.remark, None, "{label}");
    }
}

#[test]
fn utf_16_is_known_by_its_mark_or_its_first_characters() {
    let text = "<?xml version='1.0' encoding='UTF-16'?>\n<a>油温 °C масло</a>";
    for (is_little, has_mark) in [(true, true), (true, false), (false, true), (false, false)] {
        let decoded = decode(&utf16(text, is_little, has_mark)).unwrap();
        assert_eq!((decoded.text.as_str(), decoded.remark), (text, None));
    }
    // A mark counts before a declaration that a tool forgot to change.
    let marked =
        [&b"\xEF\xBB\xBF"[..], "<?xml version=\"1.0\" encoding=\"utf-16\"?><ä/>".as_bytes()];
    assert!(decode(&marked.concat()).unwrap().text.ends_with("<ä/>"));
    assert!(decode(marked[1]).unwrap().text.ends_with("<ä/>"));
}

#[test]
fn what_is_in_another_encoding_than_it_declares_is_told() {
    let text = "<?xml version=\"1.0\"?>\n<b/>\n<a>\u{d6}l</a>";
    let (bytes, ..) = WINDOWS_1252.encode(text);
    let DecodedFile { text, remark } = decode(&bytes).unwrap();
    assert!(text.ends_with("<a>\u{FFFD}l</a>"), "{text}");
    let remark = remark.unwrap();
    assert!(remark.starts_with("line 3: ") && remark.contains("windows-1252"), "{remark}");
    for label in ["EBCDIC-CP-US", "", "x", "iso-2022-kr"] {
        let fault = decode(&file(label, "", UTF_8)).unwrap_err();
        assert!(fault.contains(&format!("'{label}'")) && fault.contains("UTF-8"), "{fault}");
    }
}

#[test]
fn any_bytes_are_text_or_a_fault() {
    let mut rng = fastrand::Rng::with_seed(39);
    let labels = ["utf-8", "gb18030", "windows-1251", "utf-16", "?", "shift_jis"];
    for _ in 0..20_000 {
        let start = format!("<?xml encoding='{}'?>", labels[rng.usize(..labels.len())]);
        let mut bytes: Vec<u8> = start.bytes().take(rng.usize(..40)).collect();
        bytes.extend((0..rng.usize(..20)).map(|_| rng.u8(..)));
        if let Ok(decoded) = decode(&bytes) {
            let has_none = !decoded.text.contains(NO_CHARACTER);
            assert!(decoded.remark.is_none() == has_none, "{decoded:?}");
        }
    }
}
