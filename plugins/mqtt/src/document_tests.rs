use super::*;

#[test]
fn times_are_rfc_3339_or_milliseconds() {
    let at = |millis| Some(UNIX_EPOCH + Duration::from_millis(millis));
    let cases = [
        (serde_json::json!(1_700_000_000_123_u64), at(1_700_000_000_123)),
        (serde_json::json!(1_500.5), Some(UNIX_EPOCH + Duration::from_micros(1_500_500))),
        (serde_json::json!("2023-11-14T22:13:20Z"), at(1_700_000_000_000)),
        (serde_json::json!("2023-11-14T23:13:20.5+01:00"), at(1_700_000_000_500)),
        (serde_json::json!("yesterday"), None),
        (serde_json::json!("2023-11-14T22:13:20"), None),
        (serde_json::json!("0001-01-01T00:00:00Z"), None),
        (serde_json::json!("1969-12-31T23:59:59Z"), None),
        (serde_json::json!("1700000000123"), None),
        (serde_json::json!(""), None),
        (serde_json::json!(true), None),
        (serde_json::json!([1_700_000_000_123_u64]), None),
        // Microseconds for milliseconds, and what no clock shows.
        (serde_json::json!(1_700_000_000_123_456_u64), None),
        (serde_json::json!(u64::MAX), None),
        (serde_json::json!(-0.5), None),
        (serde_json::json!(-1), None),
        (serde_json::json!(1e300), None),
        (serde_json::json!(null), None),
    ];
    for (json, expected) in cases {
        assert_eq!(time_of(&json), expected, "{json}");
    }
}
