//! Fuzzing of scenarios: any text is a scenario or faults with places and remedies. Events are in
//! order, within their limits, and refer to items of the configuration.

use std::sync::OnceLock;

use busbar_config::{Config, parse, parse_scenario};

const CONFIG: &str = r#"{
    "version": 1,
    "plugin_directories": ["plugins"],
    "plugins": { "bay": { "plugin": "modbus_adapter" } },
    "scene": [],
    "tags": {
        "load": { "type": "f64", "range": { "low": 0, "high": 200 },
            "source": { "instance": "bay", "address": {} } },
        "twice": { "type": "f64", "expression": "2 * 3" },
        "trip": { "type": "bool", "source": { "instance": "bay", "address": {} } },
        "Q1": { "type": "double_point", "source": { "instance": "bay", "address": {} } }
    }
}"#;
/// Longest duration of a scenario, seconds: a year.
const MAX_SECONDS: f64 = 366.0 * 86_400.0;

/// Runs one input; reports whether it is a scenario.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    static READ: OnceLock<Config> = OnceLock::new();
    let config = READ.get_or_init(|| parse(CONFIG).expect("it is a configuration"));
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let scenario = match parse_scenario(text, config) {
        Ok(scenario) => scenario,
        Err(faults) => {
            assert!(!faults.is_empty(), "refused without a word");
            for fault in faults {
                assert!(!fault.cause.is_empty() && !fault.remedy.is_empty(), "{fault:?}");
            }
            return false;
        }
    };
    assert!(scenario.events.is_sorted_by(|a, b| a.at_seconds <= b.at_seconds));
    assert!(scenario.link_faults.is_sorted_by(|a, b| a.at_seconds <= b.at_seconds));
    for event in &scenario.events {
        assert!((0.0..=MAX_SECONDS).contains(&event.at_seconds), "{event:?}");
        let Some((value, over)) = event.value else { continue };
        assert!((0.0..=MAX_SECONDS).contains(&over), "{event:?}");
        let most = match event.tag.as_str() {
            "load" => 200.0,
            "trip" => 1.0,
            "Q1" => 3.0,
            other => panic!("no device has {other}"),
        };
        assert!((0.0..=most).contains(&value), "{event:?}");
    }
    for fault in &scenario.link_faults {
        assert!(fault.plugin == "bay" && fault.for_seconds > 0.0, "{fault:?}");
        assert!((0.0..=MAX_SECONDS).contains(&fault.at_seconds), "{fault:?}");
    }
    true
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("scenario", fuzz_one);
}
