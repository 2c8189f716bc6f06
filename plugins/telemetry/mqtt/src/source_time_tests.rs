use serde_json::json;

use super::*;

const SECONDS: u64 = 1_700_000_000;

fn at(millis: u64) -> Option<SystemTime> {
    Some(UNIX_EPOCH + Duration::from_millis(millis))
}

#[test]
fn times_are_rfc_3339_or_milliseconds() {
    let cases = [
        (json!(1_700_000_000_123_u64), at(1_700_000_000_123)),
        (json!(1_500.5), Some(UNIX_EPOCH + Duration::from_micros(1_500_500))),
        (json!("2023-11-14T22:13:20Z"), at(1_700_000_000_000)),
        (json!("2023-11-14T23:13:20.5+01:00"), at(1_700_000_000_500)),
        (json!("yesterday"), None),
        (json!("2023-11-14T22:13:20"), None),
        (json!("0001-01-01T00:00:00Z"), None),
        (json!("1969-12-31T23:59:59Z"), None),
        (json!("1700000000123"), None),
        (json!(""), None),
        (json!(true), None),
        (json!([1_700_000_000_123_u64]), None),
        // Seconds and microseconds for milliseconds, and what no clock shows.
        (json!(1_700_000_000), None),
        (json!(1_700_000_000_123_456_u64), None),
        (json!(u64::MAX), None),
        (json!(-0.5), None),
        (json!(-1), None),
        (json!(1e300), None),
        (json!(null), None),
    ];
    for (json, expected) in cases {
        assert_eq!(time_of(&json, None), expected, "{json}");
    }
}

/// Each count of each unit, under each setting: its time, or the remedy.
#[test]
fn counts_are_of_the_unit_set_or_told_with_the_unit_that_they_are_of() {
    let mut rng = fastrand::Rng::with_seed(39);
    for _ in 0..20_000 {
        // Between 2000 and 2100.
        let seconds = rng.u64(946_684_800..4_102_444_800);
        let nanos = seconds * 1_000_000_000 + rng.u64(..1_000_000_000);
        let source = *rng.choice(&TimeUnit::ALL).unwrap();
        let set = *rng
            .choice(&[
                None,
                Some(TimeUnit::S),
                Some(TimeUnit::Ms),
                Some(TimeUnit::Us),
                Some(TimeUnit::Ns),
            ])
            .unwrap();
        let width = 1_000_000_000 / source.per_second();
        let count = nanos / width;
        let is_text = rng.bool();
        let json = if is_text { json!(count.to_string()) } else { json!(count) };
        let is_read = set.unwrap_or_default() == source && (set.is_some() || !is_text);
        let expected = is_read.then(|| UNIX_EPOCH + Duration::from_nanos(count * width));
        let told = format!("{json} of {source:?} under {set:?}");
        assert_eq!(time_of(&json, set), expected, "{told}");
        if expected.is_none() {
            let shown = show_unusable("/ts", &json, set);
            let remedy = if set.is_none() && is_text {
                "a count as text: set time_unit".to_owned()
            } else {
                format!("set time_unit to \"{}\"", source.word())
            };
            assert!(
                shown.contains(&remedy) && shown.contains(&count.to_string()),
                "{told}: {shown}"
            );
        }
    }
}

#[test]
fn fractions_and_what_is_no_count() {
    let s = Some(TimeUnit::S);
    assert_eq!(time_of(&json!(1_700_000_000.25), s), at(1_700_000_000_250));
    assert_eq!(time_of(&json!("1700000000.25"), s), at(1_700_000_000_250));
    for text in [
        "1.7e9",
        "inf",
        "NaN",
        "+1700000000",
        "-1700000000",
        "0x6553F100",
        "1700000000s",
        "",
        ".",
        " ",
    ] {
        assert_eq!(time_of(&json!(text), s), None, "{text}");
    }
    assert_eq!(time_of(&json!("2023-11-14T22:13:20Z"), s), at(SECONDS * 1000));
    let shown = |json: Json| show_unusable("/t", &json, None);
    assert!(shown(json!("2023-11-14T22:13:20")).contains("without a zone"));
    assert!(shown(json!("yesterday")).contains("RFC 3339 with a zone"));
    assert!(shown(json!(-1)).contains("correct the source's clock"));
    assert!(shown(json!("x".repeat(1000))).len() < 300);
}
