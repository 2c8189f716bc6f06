use super::*;

#[test]
fn names_of_the_web_and_of_other_programs_are_known() {
    for (name, bytes, text) in [
        ("windows-1252", &b"\xd6ltemp"[..], "Öltemp"),
        ("CP1252", b"\xd6l", "Öl"),
        ("windows-1251", b"\xcc\xe0\xf1\xeb\xee", "Масло"),
        ("cp1251", b"\xcc", "М"),
        ("gb18030", b"\xd3\xcd\xce\xc2", "油温"),
        ("cp936", b"\xd3\xcd", "油"),
        ("utf-16le", b"O\0i\0l\0", "Oil"),
        ("UTF-16BE", b"\0O\0i\0l", "Oil"),
        ("latin-1", b"\xfc", "ü"),
        ("utf-8", "Öl".as_bytes(), "Öl"),
    ] {
        assert_eq!(TextEncoding::from_name(name).unwrap().decode(bytes), text, "{name}");
    }
    for name in ["", "klingon", "iso-2022-kr", "cp0"] {
        let fault = TextEncoding::from_name(name).unwrap_err();
        assert!(fault.contains("windows-1252"), "{fault}");
    }
}

#[test]
fn a_mark_goes_before_a_name() {
    let given = TextEncoding::from_name("windows-1252").ok();
    for (bytes, text) in [
        (&b"\xff\xfeO\0"[..], "O"),
        (b"\xfe\xff\0O", "O"),
        (b"\xef\xbb\xbf\xc3\x96", "Ö"),
        (b"\xd6", "Ö"),
    ] {
        assert_eq!(TextEncoding::decode_text(given, bytes), (text.into(), false));
    }
    assert_eq!(TextEncoding::decode_text(None, b"\xd6"), ("Ö".into(), true));
}
