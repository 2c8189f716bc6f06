use proptest::prelude::*;

use super::*;

fn format(decimal: &str, thousands: Option<&str>) -> NumberFormat {
    NumberFormat::new(Separators::parse(decimal, thousands).unwrap())
}

#[test]
fn a_point_under_a_decimal_comma_separates_thousands_or_is_refused() {
    let (plain, german) = (format(",", None), format(",", Some(".")));
    assert_eq!(german.parse_f64("1.234"), Ok(1234.0));
    assert_eq!(german.parse_f64("1.234,5"), Ok(1234.5));
    assert_eq!(german.parse_f64("-1.234.567,25"), Ok(-1_234_567.25));
    assert_eq!(german.parse_f64("1234,5"), Ok(1234.5));
    for text in ["1.234", "1.234,5", "1.2", "1,2,3", "1,234.5"] {
        let fault = plain.parse_f64(text).unwrap_err();
        assert!(fault.contains(text) && fault.contains("`thousands`"), "{fault}");
    }
    for text in ["1.2", "12.34", "1.2345", "1234.567", ".123", "1..234", "1,234.567", "1.234,567.8"]
    {
        assert!(german.parse_f64(text).is_err(), "{text}");
    }
    let us = format(".", Some(","));
    assert_eq!(us.parse_f64("1,234.5"), Ok(1234.5));
    assert_eq!(us.parse_f64("1,234"), Ok(1234.0));
    assert_eq!(us.parse_i64("12,345,678"), Ok(12_345_678));
    assert!(us.parse_f64("1,23").is_err());
    assert!(format(".", None).parse_f64("1,234").is_err());
    let swiss = format(".", Some("'"));
    assert_eq!(swiss.parse_f64("1'234.5"), Ok(1234.5));
    assert_eq!(swiss.parse_f64("1\u{2019}234.5"), Ok(1234.5));
    let french = format(",", Some(" "));
    for text in ["1 234,5", "1\u{a0}234,5", "1\u{202f}234,5"] {
        assert_eq!(french.parse_f64(text), Ok(1234.5));
    }
}

#[test]
fn whole_numbers_may_be_written_with_a_fraction_of_zeros() {
    let plain = NumberFormat::default();
    for (text, number) in [
        ("7.0", 7),
        ("7", 7),
        ("-7.000", -7),
        ("7e2", 700),
        ("1.5e1", 15),
        ("0", 0),
        ("0.000", 0),
        ("0e9999", 0),
        ("70e-1", 7),
        ("+7", 7),
        ("\u{2212}7", -7),
        ("9223372036854775807", i64::MAX),
        ("-9223372036854775808", i64::MIN),
        ("9007199254740993.0", 9_007_199_254_740_993),
    ] {
        assert_eq!(plain.parse_i64(text), Ok(number), "{text}");
    }
    for text in ["7.5", "9223372036854775808", "1e19", "7.0.0", "", "x", "1e-1", "0x10", "NaN"] {
        assert!(plain.parse_i64(text).is_err(), "{text}");
    }
    assert_eq!(format(",", Some(".")).parse_i64("1.234,0"), Ok(1234));
}

#[test]
fn units_are_split_off_numbers_alone() {
    let plain = NumberFormat::default();
    for (text, number, unit) in [
        ("88.25 %", "88.25", Some("%")),
        ("61.5 °C", "61.5", Some("°C")),
        ("61.5°C", "61.5", Some("°C")),
        ("5 kV", "5", Some("kV")),
        ("5kV", "5", Some("kV")),
        ("1e3 A", "1e3", Some("A")),
        ("-3 Mvar", "-3", Some("Mvar")),
        ("7", "7", None),
        ("open", "open", None),
        ("5 apples", "5 apples", None),
        ("A", "A", None),
        ("", "", None),
    ] {
        assert_eq!(plain.split_unit(text, None), (number, unit), "{text}");
    }
    assert_eq!(plain.split_unit("5 apples", Some("apples")), ("5", Some("apples")));
}

#[test]
fn separators_are_checked() {
    for (decimal, thousands, part) in [
        (";", None, "decimal: ';'"),
        (".", Some("."), "thousands: the same as decimal"),
        (".", Some("x"), "thousands: 'x'"),
        (".", Some(""), "thousands: ''"),
        (".", Some(",,"), "thousands: ',,'"),
    ] {
        assert!(Separators::parse(decimal, thousands).unwrap_err().contains(part));
    }
}

/// Writes whole thousands with separators.
fn grouped(number: u64, separator: &str) -> String {
    let digits = number.to_string();
    let first = (digits.len() - 1) % 3 + 1;
    let mut text = digits[..first].to_owned();
    for group in digits.as_bytes()[first..].chunks(3) {
        text += separator;
        text += std::str::from_utf8(group).unwrap();
    }
    text
}

proptest! {
    #[test]
    fn what_is_written_in_a_format_is_read_in_it_and_in_no_other(
        number in 0..10_000_000_000_u64, cents in 0..100_u64, style in 0..5_usize,
    ) {
        let styles = [(".", None), (",", None), (".", Some(",")), (",", Some(".")), (",", Some(" "))];
        let (decimal, thousands) = styles[style];
        let text = format!("{}{decimal}{cents:02}", grouped(number, thousands.unwrap_or("")));
        let expected: f64 = format!("{number}.{cents:02}").parse().unwrap();
        prop_assert_eq!(format(decimal, thousands).parse_f64(&text), Ok(expected));
        // Two digits after the decimal sign are no group: no other format reads another number.
        for (decimal, thousands) in styles {
            if let Ok(read) = format(decimal, thousands).parse_f64(&text) {
                prop_assert_eq!(read, expected);
            }
        }
    }

    #[test]
    fn any_text_is_a_number_or_refused(text in "[-+0-9eE., ']{0,24}|\\PC{0,12}") {
        for (decimal, thousands) in [(".", None), (",", Some(".")), (",", Some(" "))] {
            let format = format(decimal, thousands);
            if let Ok(whole) = format.parse_i64(&text) {
                let number = format.parse_f64(&text).unwrap();
                prop_assert!((number - whole as f64).abs() <= number.abs() * 1e-15);
            }
            let _ = format.split_unit(&text, None);
        }
    }
}
