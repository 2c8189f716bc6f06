//! Scenarios: what is read, and where exactly a text is at fault.

use busbar_config::{LinkFaultConfig, ScenarioEventConfig, parse, parse_scenario};
use busbar_types::FaultKind;

const CONFIG: &str = r#"{
    "version": 1,
    "plugin_directories": ["plugins"],
    "plugins": { "bay": { "plugin": "modbus_adapter" } },
    "scene": [],
    "tags": {
        "load": { "type": "f64", "range": { "low": 0, "high": 200 },
            "source": { "instance": "bay", "address": {} } },
        "twice": { "type": "f64", "expression": "2 * 3" },
        "Q1": { "type": "double_point", "source": { "instance": "bay", "address": {} } }
    }
}"#;

fn faults(events: &str) -> Vec<(u32, String, String)> {
    let config = parse(CONFIG).expect("a configuration");
    let text = format!("{{ \"version\": 1, \"events\": [\n{events}\n] }}");
    let found = parse_scenario(&text, &config).expect_err("a fault");
    found.into_iter().map(|fault| (fault.line, fault.cause, fault.remedy)).collect()
}

#[test]
fn events_come_in_the_order_of_time() {
    let config = parse(CONFIG).expect("a configuration");
    let text = r#"{ "version": 1, "description": "It trips", "events": [
        { "at_seconds": 9, "tag": "load", "release": true },
        { "at_seconds": 7, "instance": "bay", "link": "link-loss", "for_seconds": 20 },
        { "at_seconds": 5, "tag": "Q1", "value": 0 },
        { "at_seconds": 5, "tag": "load", "value": 120, "over_seconds": 2.5 }
    ] }"#;
    let scenario = parse_scenario(text, &config).expect("a scenario");
    assert_eq!(scenario.description, "It trips");
    let event =
        |at_seconds, tag: &str, value| ScenarioEventConfig { at_seconds, tag: tag.into(), value };
    let expected = [
        event(5.0, "Q1", Some((0.0, 0.0))),
        event(5.0, "load", Some((120.0, 2.5))),
        event(9.0, "load", None),
    ];
    assert_eq!(scenario.events, expected);
    let fault = LinkFaultConfig {
        at_seconds: 7.0,
        for_seconds: 20.0,
        plugin: "bay".into(),
        kind: FaultKind::LinkLoss,
    };
    assert_eq!(scenario.link_faults, [fault]);
}

#[test]
fn every_fault_is_told_with_line_and_remedy() {
    let check = |event: &str, words: &str, remedy: &str| {
        let found = faults(event);
        let fits = |(line, cause, how): &(u32, String, String)| {
            *line == 2 && cause.contains(words) && how.contains(remedy)
        };
        assert!(found.len() == 1 && found.iter().all(fits), "{event}: {found:?}");
    };
    check(r#"{ "at_seconds": 1, "tag": "laod", "value": 1 }"#, "no tag 'laod'", "'load'");
    check(r#"{ "at_seconds": 1, "tag": "twice", "value": 1 }"#, "derived", "derived from");
    check(r#"{ "at_seconds": -1, "tag": "load", "value": 1 }"#, "less than 0", "from 0");
    check(r#"{ "at_seconds": 1, "tag": "load", "value": 300 }"#, "outside the range", "can have");
    check(r#"{ "at_seconds": 1, "tag": "load" }"#, "what the tag does", "release");
    check(r#"{ "at_seconds": 1, "tag": "load", "value": 1, "release": true }"#, "twice", "either");
    check(r#"{ "at_seconds": 1, "tag": "Q1", "value": 1.5 }"#, "never 1.5", "0 to 3");
    check(r#"{ "at_seconds": 1, "tag": "Q1", "value": 1, "over_seconds": 2 }"#, "no way", "jump");
    check(r#"{ "at_seconds": 1 }"#, "nothing", "either");
    check(
        r#"{ "at_seconds": 1, "tag": "Q1", "value": 1, "for_seconds": 3 }"#,
        "no meaning",
        "remove",
    );
    check(
        r#"{ "at_seconds": 1, "instance": "bya", "link": "slow", "for_seconds": 3 }"#,
        "no tag has",
        "'bay'",
    );
    check(
        r#"{ "at_seconds": 1, "instance": "bay", "link": "slow" }"#,
        "'for_seconds' is missing",
        "link-loss",
    );
    check(
        r#"{ "at_seconds": 1, "instance": "bay", "link": "slwo", "for_seconds": 3 }"#,
        "not allowed",
        "slow",
    );
    check(r#"{ "at_seconds": 1, "tag": "load", "vaule": 1, "value": 1 }"#, "'vaule'", "'value'");
}
