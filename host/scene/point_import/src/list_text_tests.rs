use encoding_rs::{GB18030, ISO_8859_5, UTF_8, WINDOWS_1251};

use super::*;

/// Descriptions as lists of a language have them.
const GERMAN: [&str; 6] = [
    "Öltemperatur oben",
    "Kühler Stufe 2 läuft",
    "Überstrom Ausschaltung",
    "Schlüsselschalter",
    "Außentemperatur",
    "Störung Lüfter",
];
const FRENCH: [&str; 4] = [
    "Température d'huile",
    "Défaut général",
    "Disjoncteur fermé",
    "Sectionneur de mise à la terre",
];
const RUSSIAN: [&str; 6] = [
    "Температура масла",
    "Положение выключателя",
    "Ток фазы А",
    "Напряжение 110 кВ",
    "Авария трансформатора",
    "Уровень масла",
];
const CHINESE: [&str; 6] =
    ["主变压器油温", "断路器位置", "母线电压", "隔离开关分位", "有功功率", "绕组温度告警"];

fn list_of(words: &[&str], rng: &mut fastrand::Rng, rows: usize) -> String {
    let mut text = "tag;description;unit;address\r\n".to_owned();
    for row in 0..rows {
        let word = words[rng.usize(..words.len())];
        let unit = *rng.choice(&["kV", "A", "%", ""]).unwrap();
        text += &format!("Q{row};{word};{unit};{row}\r\n");
    }
    text
}

#[test]
fn lists_of_every_system_are_read() {
    let mut rng = fastrand::Rng::with_seed(39);
    for _ in 0..500 {
        let rows = rng.usize(1..30);
        for (words, encoding) in [
            (&GERMAN[..], WINDOWS_1252),
            (&FRENCH, WINDOWS_1252),
            (&RUSSIAN, WINDOWS_1251),
            (&CHINESE, GB18030),
        ] {
            let text = list_of(words, &mut rng, rows);
            let (bytes, ..) = encoding.encode(&text);
            let decoded = decode(&bytes, None).unwrap_or_else(|fault| panic!("{fault}: {text}"));
            assert_eq!(decoded.text, text, "{encoding:?}: {:?}", decoded.remark);
            assert!(decoded.remark.is_some(), "{encoding:?}");
        }
    }
}

#[test]
fn a_unit_alone_tells_western_encoding() {
    for text in ["tag,unit\nA,°C\n", "tag,unit\nA,°\nB,m³/h\nC,mm²\n", "tag,unit\nA,µS\n"] {
        let (bytes, ..) = WINDOWS_1252.encode(text);
        assert_eq!(decode(&bytes, None).unwrap().text, text);
    }
}

#[test]
fn utf_16_and_utf_8_are_read_with_and_without_a_mark() {
    let text = "tag\tdescription\taddress\r\nQ1\tÖl 油 масло °C\t1\r\n";
    for is_little in [true, false] {
        for mark in [&[0xFEFF][..], &[]] {
            let units = mark.iter().copied().chain(text.encode_utf16());
            let bytes: Vec<u8> = units
                .flat_map(
                    |unit: u16| if is_little { unit.to_le_bytes() } else { unit.to_be_bytes() },
                )
                .collect();
            let decoded = decode(&bytes, None).unwrap();
            assert_eq!((&*decoded.text, decoded.remark), (text, None));
        }
    }
    let marked = format!("\u{feff}{text}");
    assert_eq!(decode(marked.as_bytes(), None).unwrap().text, text);
    assert_eq!(decode(text.as_bytes(), None).unwrap().text, text);
}

#[test]
fn bytes_that_are_no_text_are_refused_with_their_line() {
    for bytes in [&b"tag,address\nA,1\nx\xff,2"[..], b"tag\nA\n\x81\x8d\x8f", b"tag\n\n\xfe\xfe"] {
        let fault = decode(bytes, None).unwrap_err();
        assert!(fault.line == 3 && fault.cause.contains("UTF-8"), "{fault}");
    }
    // A lone surrogate.
    let fault = decode(b"\xff\xfea\0\n\0\x00\xd8b\0", None).unwrap_err();
    assert!(fault.line == 2 && fault.cause.contains("UTF-16LE"), "{fault}");
}

#[test]
fn a_named_encoding_is_not_guessed() {
    let text = format!("tag;description\r\n1;{}\r\n", RUSSIAN.join(" "));
    let (bytes, ..) = ISO_8859_5.encode(&text);
    assert!(decode(&bytes, None).map_or(true, |guessed| guessed.text != text));
    for name in ["iso-8859-5", " ISO_8859-5 ", "cyrillic"] {
        let decoded = decode(&bytes, Some(name.parse().unwrap())).unwrap();
        assert_eq!((&*decoded.text, decoded.remark), (&*text, None), "nothing is assumed");
    }
    for (code_page, own) in [("cp932", "Shift_JIS"), ("cp936", "GBK"), ("cp950", "Big5")] {
        assert_eq!(code_page.parse::<ListEncoding>().unwrap().name(), own);
    }
    for wrong in ["", "utf-9", "windows-9999", "iso-2022-cn", "hz-gb-2312"] {
        assert!(wrong.parse::<ListEncoding>().is_err(), "{wrong}");
    }
}

#[test]
fn a_named_encoding_that_is_not_the_lists_is_refused() {
    let utf8 = Some(ListEncoding(UTF_8));
    let (bytes, ..) = WINDOWS_1251.encode("tag;d\n1;a\n2;\u{44f}\n");
    let fault = decode(&bytes, utf8).unwrap_err();
    assert_eq!((fault.line, fault.cause.as_str()), (3, "it is not UTF-8 text"));
    // A mark is certain.
    let marked = "\u{feff}tag;d\n1;\u{44f}\n".as_bytes();
    let fault = decode(marked, Some(ListEncoding(WINDOWS_1251))).unwrap_err();
    assert!(fault.cause.contains("UTF-8 text, not windows-1251"), "{fault}");
    assert_eq!(decode(marked, utf8).unwrap().text, "tag;d\n1;\u{44f}\n");
}
