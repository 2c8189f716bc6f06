//! Settings that make no sense are refused with place and remedy.

use super::*;

#[test]
fn settings_that_make_no_sense_are_refused_by_name() {
    for (settings, words) in [
        (r#"{ "transformers": [] }"#, "name 1 to 1000 transformers"),
        (
            r#"{ "transformers": [{ "equipment": "=T1", "loss_ratio": 0 }] }"#,
            "transformer '=T1': loss_ratio is 0: give 0.1 to 10000",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1" }, { "equipment": "=T1" }] }"#,
            "'=T1' is named twice; keep one",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1" }], "ambient": 75 }"#,
            "ambient is 75: give -60 to 60",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1" }], "plausible_ambient": [30, 10] }"#,
            "the lesser first",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1", "plausible_load": [0.5, 9] }] }"#,
            "plausible_load is [0.5, 9]",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1" }], "longest_step_seconds": 0 }"#,
            "longest_step_seconds is 0",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1" }], "state_file": "states.json" }"#,
            "no absolute path; ${folder}/",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1", "moisture": 4 }] }"#,
            "moisture is 4: give 0 to 3.5",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1", "taps": [{ "tap": 1, "rated_current": 0 }] }] }"#,
            "rated_current of a tap is 0",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1", "stages": [{ "stage": 1, "cooling": "ONAN" }, { "stage": 1, "cooling": "ONAF" }] }] }"#,
            "stage 1 is given twice",
        ),
        (
            r#"{ "transformers": [{ "equipment": "=T1", "size": "small", "loading": "short_time_emergency" }] }"#,
            "give top_oil_limit and hot_spot_limit",
        ),
    ] {
        let fault = serde_json::from_str::<Settings>(settings).unwrap().fault();
        assert!(fault.as_ref().is_some_and(|fault| fault.contains(words)), "{settings}: {fault:?}");
    }
    let plain = r#"{ "transformers": [{ "equipment": "=T1" }], "state_file": "/var/lib/s.json" }"#;
    assert_eq!(serde_json::from_str::<Settings>(plain).unwrap().fault(), None);
}
