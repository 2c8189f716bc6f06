use super::*;

fn style(seen: &[&str]) -> NumberStyle {
    let mut style = NumberStyle::default();
    seen.iter().for_each(|text| style.observe(text));
    style
}

#[test]
fn numbers_are_read_by_what_they_show_themselves() {
    for (text, expected) in [
        ("12", 12.0),
        ("-12.5", -12.5),
        ("12,5", 12.5),
        ("0,125", 0.125),
        ("0.125", 0.125),
        ("1234,567", 1234.567),
        ("1.234,5", 1234.5),
        ("1,234.5", 1234.5),
        ("1.234.567", 1_234_567.0),
        ("1,234,567", 1_234_567.0),
        ("1 234,5", 1234.5),
        ("1\u{a0}234", 1234.0),
        ("-1'234.5", -1234.5),
        ("1e-3", 0.001),
        ("1,5e3", 1500.0),
        (".5", 0.5),
        (",5", 0.5),
        ("+3", 3.0),
    ] {
        assert_eq!(style(&[]).parse(text), Ok(expected), "{text}");
    }
    for text in [
        "",
        "x",
        "NaN",
        "inf",
        "1.2.3",
        "1,2,3",
        "12 34",
        "1.23,456.7",
        "1..2",
        "--1",
        "1e999",
        "1 2",
        "0x10",
    ] {
        assert_eq!(style(&[]).parse(text), Err(NumberFault::NoNumber), "{text}");
    }
}

#[test]
fn one_mark_with_three_digits_is_read_as_the_rest_of_the_list_is() {
    for text in ["1.234", "1,234", "-123.456", "12,000"] {
        let by = |mark: char, other: char| -> f64 {
            text.replace(other, "").replace(mark, ".").parse().unwrap()
        };
        let (by_point, by_comma) = (by('.', ','), by(',', '.'));
        assert_eq!(style(&["0.5", "7"]).parse(text), Ok(by_point), "{text}");
        assert_eq!(style(&["0,5", "7"]).parse(text), Ok(by_comma), "{text}");
        let ambiguous = Err(NumberFault::Ambiguous([by_point, by_comma]));
        assert_eq!(style(&["7", text]).parse(text), ambiguous, "{text}");
        assert_eq!(style(&["0.5", "0,5"]).parse(text), ambiguous, "{text}");
    }
}

/// Numbers written in a style are never read as others, whatever the list shows.
#[test]
fn a_number_is_read_as_it_was_written_or_refused() {
    let mut rng = fastrand::Rng::with_seed(39);
    for _ in 0..50_000 {
        let is_comma = rng.bool();
        let (decimal, thousands) = if is_comma { (',', '.') } else { ('.', ',') };
        let write = |rng: &mut fastrand::Rng| {
            let magnitude = 10_u64.pow(rng.u32(1..8));
            let whole = rng.u64(..magnitude);
            let digits = rng.usize(..5);
            let fraction: String = (0..digits).map(|_| rng.digit(10)).collect();
            let mut text = whole.to_string();
            if rng.bool() {
                let mut start = text.len();
                while start > 3 {
                    start -= 3;
                    text.insert(start, thousands);
                }
            }
            let value: f64 = format!("{whole}.{fraction}0").parse().unwrap();
            if digits > 0 {
                text.push(decimal);
                text += &fraction;
            }
            (text, value)
        };
        let all: Vec<_> = (0..rng.usize(1..6)).map(|_| write(&mut rng)).collect();
        let style = style(&all.iter().map(|(text, _)| text.as_str()).collect::<Vec<_>>());
        for (text, value) in &all {
            match style.parse(text) {
                Ok(read) => assert_eq!(read, *value, "{text} in {all:?}"),
                Err(NumberFault::Ambiguous(both)) => assert!(both.contains(value), "{text}"),
                Err(fault) => panic!("{text}: {fault:?}"),
            }
        }
    }
}
