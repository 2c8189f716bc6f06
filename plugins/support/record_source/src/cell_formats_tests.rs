use proptest::prelude::*;
use text_table::Separators;

use super::*;

const SECOND: i64 = 1_000_000_000;

fn formats(list: serde_json::Value, decimal: &str, thousands: Option<&str>) -> CellFormats {
    let mut all = serde_json::json!({
        "title": "T", "kind": "business", "source": null, "equipment": "E",
        "columns": [{ "column": "A" }],
    });
    if let (Some(all), Some(list)) = (all.as_object_mut(), list.as_object()) {
        all.extend(list.clone());
    }
    let list: ListSettings<()> = serde_json::from_value(all).unwrap();
    CellFormats::with_separators(&list, Separators::parse(decimal, thousands).unwrap()).unwrap()
}

fn iso() -> CellFormats {
    formats(serde_json::json!({}), ".", None)
}

#[test]
fn dates_and_times_are_read_and_others_are_not() {
    for (text, seconds) in [
        ("1970-01-01", 0),
        ("2024-02-29", 1_709_164_800),
        ("1970-01-02 01:02", 86_400 + 3720),
        ("1970-01-01T00:00:09", 9),
        ("1970-01-01T02:00:00+02:00", 0),
    ] {
        assert_eq!(iso().unix_nanos(text), Ok(seconds * SECOND), "{text}");
        assert_eq!(iso().date(text).unwrap(), text);
    }
    for text in [
        "",
        "2023-02-29",
        "2026-13-01",
        "23.11.2026",
        "2026-11-23x",
        "äöü-äö-äö",
        "2026-11-23T",
        "2026-11-23 25:00",
        "9999-12-31",
        "2026-11-23 10:00:00:00",
    ] {
        assert!(iso().unix_nanos(text).is_err(), "{text}");
    }
}

#[test]
fn dates_have_the_format_and_the_zone_of_the_list() {
    for (format, zone, text, date, unix) in [
        ("%d.%m.%Y", "UTC", "02.01.2026", "2026-01-02T00:00:00+00:00", 1_767_312_000),
        (
            "%d.%m.%Y %H:%M",
            "Europe/Berlin",
            "02.01.2026 03:04",
            "2026-01-02T03:04:00+01:00",
            1_767_319_440,
        ),
        ("excel", "UTC", "46024.5", "2026-01-02T12:00:00+00:00", 1_767_355_200),
        ("unix_millis", "UTC", "1767323045000", "2026-01-02T03:04:05+00:00", 1_767_323_045),
    ] {
        let list = serde_json::json!({ "time_format": format, "zone": zone });
        let formats = formats(list, ".", None);
        assert_eq!(formats.unix_nanos(text), Ok(unix * SECOND), "{format}");
        assert_eq!(formats.date(text).unwrap(), date, "{format}");
        assert_eq!(iso().unix_nanos(&formats.date(text).unwrap()), Ok(unix * SECOND));
        assert!(formats.unix_nanos("soon").unwrap_err().contains("'soon' is not"), "{format}");
    }
}

#[test]
fn numbers_become_those_with_a_decimal_point() {
    let german = formats(serde_json::json!({}), ",", Some("."));
    for (text, unit, number) in [
        ("1.234,5", "", "1234.5"),
        ("61,5 kV", "kV", "61.5"),
        ("61,5 kV", "KV", "61.5"),
        ("-7", "", "-7"),
    ] {
        assert_eq!(german.number(text, unit).unwrap(), number, "{text}");
    }
    for (text, unit, part) in [
        ("1.23", "", "`thousands`"),
        ("61,5 kV", "V", "is in kV, its column in V"),
        ("61,5 kV", "", "give the column its `unit`"),
        ("x", "", "'x' is no number"),
    ] {
        assert!(german.number(text, unit).unwrap_err().contains(part), "{text}");
    }
}

proptest! {
    #[test]
    fn whatever_text_is_read_or_refused(text in "\\PC{0,30}") {
        let _ = iso().unix_nanos(&text);
        let _ = iso().number(&text, "kV");
    }
}
