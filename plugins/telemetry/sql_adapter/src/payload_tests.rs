use proptest::prelude::*;

use super::*;

#[test]
fn fields_are_read() {
    let payload = Payload::parse(
        r#"{"tag": "T1.Oil", "value": 61.5, "quality": "good", "time": 1700000000, "more": {}}"#,
    )
    .unwrap();
    assert_eq!(payload.key(), "T1.Oil");
    let reading = payload.reading();
    assert_eq!(reading.value, Cell::Float(61.5));
    assert_eq!(reading.quality, Some(Cell::Text("good".into())));
    assert_eq!(reading.time, Some(Cell::Int(1_700_000_000)));
}

#[test]
fn what_is_missing_is_told_from_what_is_null() {
    let parse = |text| Payload::parse(text).unwrap();
    let bare = parse(r#"{"key": "a", "value": null}"#);
    assert_eq!(bare.reading().value, Cell::Null);
    assert_eq!(bare.reading().time, None);
    let dateless = parse(r#"{"key": "a", "value": 1, "time": null}"#);
    assert_eq!(dateless.reading().time, Some(Cell::Null));
}

#[test]
fn hostile_payloads_are_refused_and_not_repeated() {
    let deep = format!(r#"{{"key": "a", "value": {}"#, "[".repeat(7000));
    let long_key = format!(r#"{{"key": "{}", "value": 1}}"#, "k".repeat(MAX_NAME_BYTES + 1));
    let texts = [
        "",
        "hunter2",
        "[1, 2]",
        r#""hunter2""#,
        r#"{"key": "hunter2"}"#,
        r#"{"value": 1}"#,
        r#"{"key": 5, "value": "hunter2"}"#,
        r#"{"key": "a", "tag": "b", "value": 1}"#,
        r#"{"key": "a", "value": 1, "value": 2}"#,
        r#"{"key": "a", "value": 1e999}"#,
        r#"{"key": "a", "value": NaN}"#,
        r#"{"key": "a", "value": 1} hunter2"#,
        &deep,
        &long_key,
    ];
    for text in texts {
        let fault = Payload::parse(text).unwrap_err().what;
        assert!(!fault.contains("hunter2") && fault.len() < 200, "{fault}");
    }
    let odd = [
        (r#"{"key": "a", "value": [1]}"#, "a list"),
        (r#"{"key": "a", "value": {"b": 1}}"#, "an object"),
    ];
    for (text, words) in odd {
        let payload = Payload::parse(text).unwrap();
        assert!(matches!(payload.reading().value, Cell::Unusable(what) if what == words));
    }
}

#[test]
fn whose_it_is_is_told_where_that_can_be_trusted() {
    let key = |text: &str| Payload::parse(text).unwrap_err().key;
    assert_eq!(key(r#"{"key": "a"}"#).as_deref(), Some("a"));
    assert_eq!(key(r#"{"tag": "a", "value": 1, "value": 2}"#).as_deref(), Some("a"));
    for text in [
        "",
        r#"{"key": "a", "value": 6"#,
        r#"{"key": "a", "key": "b", "value": 1}"#,
        r#"{"key": "a", "value": 1} b"#,
        r#"{"value": 1}"#,
    ] {
        assert_eq!(key(text), None, "{text}");
    }
}

proptest! {
    #[test]
    fn nothing_panics(text in ".{0,200}") {
        let _ = Payload::parse(&text);
    }

    #[test]
    fn nothing_like_a_payload_panics(
        text in r#"\{"(key|tag|value|time)":[ "\[\]{}0-9a-z\\,.:-]{0,60}\}?"#
    ) {
        if let Ok(payload) = Payload::parse(&text) {
            let _ = payload.reading();
        }
    }
}
