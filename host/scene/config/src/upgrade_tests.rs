use super::*;

fn upgraded(text: &str) -> String {
    upgrade(text, |_| RenamedSettings::default()).expect("it can be read").text
}

#[test]
fn layout_and_order_stay() {
    let text = r##"{
  "version": 1,
  "scene": [],
  "tags": {
    "a": { "type": "f64", "freshness_millis": 1500, "source": { "plugin": "plc", "address": [1,2] } },
    "b":   { "type": "f64", "dead_band":0.5, "set_by_host": true }
  },
  "view": { "quality": "low", "size": [640, 480], "background": "#d8dadd" },
  "alarm_handling": {
    "log_directory": "log",
    "max_shelving_minutes": 60,
    "sources": [{ "plugin": "plc", "stale_after_seconds": 20 }]
  },
  "supervision": { "call_millis": 2500 }
}
"##;
    let expected = r##"{
  "version": 1,
  "scene": [],
  "tags": {
    "a": { "type": "f64", "freshness_seconds": 1.5, "source": { "instance": "plc", "address": [1,2] } },
    "b":   { "type": "f64", "deadband":0.5, "set_by_host": true }
  },
  "graphics": {
    "quality": "low"
  },
  "theme": {
    "background": "#d8dadd"
  },
  "window": {
    "size": [640, 480]
  },
  "alarm_handling": {
    "log_directory": "log",
    "max_shelving_seconds": 3600
  },
  "alarm_sources": [{ "instance": "plc", "stale_after_seconds": 20 }],
  "supervision": { "call_seconds": 2.5 }
}
"##;
    assert_eq!(upgraded(text), expected);
    assert_eq!(upgraded(expected), expected);
}

#[test]
fn a_scenario_is_known_by_its_events() {
    let text =
        r#"{ "version": 1, "events": [{ "at": 5, "plugin": "bay", "link": "slow", "for": 2 }] }"#;
    let expected = r#"{ "version": 1, "events": [{ "at_seconds": 5, "instance": "bay", "link": "slow", "for_seconds": 2 }] }"#;
    assert_eq!(upgraded(text), expected);
}

#[test]
fn two_names_of_one_setting_are_an_error() {
    let text = r#"{ "version": 1, "scene": [], "view": { "size": [1, 2] }, "window": { "size": [3, 4] } }"#;
    let faults = upgrade(text, |_| RenamedSettings::default()).expect_err("both are given");
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].pointer, "/view/size");
    assert!(faults[0].cause.contains("'/window/size', which is given too"), "{}", faults[0].cause);
}
