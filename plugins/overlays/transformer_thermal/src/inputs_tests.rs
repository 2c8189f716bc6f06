//! Findings on tags that are missing or cannot be converted.

use busbar_plugin_sdk::ValueKind;

use super::*;

fn binding(role: &str, unit: &str) -> Binding {
    Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("T1.{role}"),
        tag_name: role.into(),
        unit: unit.into(),
        node_id: "=T1".into(),
        role: role.into(),
    }
}

fn inputs(settings: &str, bindings: &[(&str, &str)]) -> Inputs {
    let settings = format!(r#"{{ "equipment": "=T1"{settings} }}"#);
    let bindings: Vec<_> = bindings.iter().map(|(role, unit)| binding(role, unit)).collect();
    Inputs::new(&serde_json::from_str(&settings).unwrap(), &bindings)
}

#[test]
fn what_is_missing_is_a_finding_with_a_remedy() {
    let power = r#", "rated_power": 40"#;
    let taps = r#", "taps": [{ "tap": 1, "rated_current": 200 }]"#;
    let stages = r#", "stages": [{ "stage": 0, "cooling": "ONAN" }]"#;
    for (settings, bindings, words) in [
        ("", &[][..], "no tag tells the load of '=T1'"),
        ("", &[("ambient", "°C")][..], "\"untelemetered\": true"),
        ("", &[("load", "A")][..], "give rated_current"),
        ("", &[("load", "kA")][..], "give rated_current"),
        ("", &[("load", "MVA")][..], "give rated_power"),
        ("", &[("load", "MW")][..], "give rated_power"),
        ("", &[("load", "bar")][..], "which is no unit of a ratio; give the tag one of"),
        (r#", "rated_load": 90"#, &[("load", "°C")][..], "which tells no load"),
        ("", &[("current", "A")][..], "give rated_current"),
        (r#", "rated_current": 200"#, &[("current", "kV")][..], "no unit of current"),
        ("", &[("apparent_power", "MVA")][..], "give rated_power"),
        ("", &[("active_power", "MW")][..], "give rated_power"),
        (power, &[("apparent_power", "MVA"), ("voltage", "kV")][..], "give rated_voltage"),
        (power, &[("apparent_power", "MW")][..], "no unit of apparent power"),
        (taps, &[("current", "A")][..], "bind one to it in the role 'tap'"),
        (stages, &[("load", "%")][..], "in the role 'cooler_stage' or 'fans'"),
        ("", &[("load", "%"), ("ambient", "bar")][..], "no unit of temperature"),
        ("", &[("load", "%"), ("top_oil", "A")][..], "no unit of temperature"),
    ] {
        let found = inputs(settings, bindings).findings;
        assert!(found.len() == 1 && found[0].contains(words), "{settings} {bindings:?}: {found:?}");
        assert!(found[0].contains("; "), "{found:?}");
    }
}

/// A rated load in another unit than its tag would make every load a small one.
#[test]
fn a_rated_load_of_another_unit_is_a_finding() {
    let known = r#""rated_power": 40, "rated_voltage": 110, "rated_current": 210"#;
    for (rated, unit, is_fault) in [
        (100.0, "%", false),
        (80.0, "%", false),
        (1.0, "p.u.", false),
        (100.0, "p.u.", true),
        (1.0, "%", true),
        (400.0, "%", true),
        (210.0, "A", false),
        (0.21, "kA", false),
        (210.0, "kA", true),
        (0.21, "A", true),
        (40.0, "MVA", false),
        (40_000.0, "kVA", false),
        (40_000.0, "MVA", true),
        (40.0, "kW", true),
        (32.0, "MW", false),
        // A tag without a unit has that of its rated load.
        (7.0, "", false),
    ] {
        let settings = format!(r#", {known}, "rated_load": {rated}"#);
        let found = inputs(&settings, &[("load", unit)]).findings;
        assert_eq!(!found.is_empty(), is_fault, "{rated} {unit}: {found:?}");
        assert!(found.iter().all(|of| of.contains("rated_load would be")), "{found:?}");
    }
}

#[test]
fn what_is_there_is_no_finding() {
    let rated = r#", "rated_power": 40, "rated_voltage": 110, "rated_current": 210"#;
    for (settings, bindings) in [
        ("", &[("load", "%")][..]),
        // One way of the load is enough: ratings of the others may be missing.
        ("", &[("load", "%"), ("current", "A"), ("active_power", "MW"), ("voltage", "kV")][..]),
        ("", &[("load", "p.u."), ("ambient", "°F")][..]),
        (r#", "rated_load": 400"#, &[("load", "A")][..]),
        (r#", "rated_load": 40"#, &[("load", "MW")][..]),
        (rated, &[("load", "A")][..]),
        (rated, &[("load", "MVA")][..]),
        (rated, &[("current", "kA"), ("current", "A")][..]),
        (rated, &[("apparent_power", "kVA"), ("voltage", "V")][..]),
        (rated, &[("active_power", "MW"), ("reactive_power", "Mvar")][..]),
        ("", &[("top_oil", "°C"), ("hot_spot", "K")][..]),
        (r#", "untelemetered": true"#, &[][..]),
    ] {
        let found = inputs(settings, bindings).findings;
        assert!(found.is_empty(), "{settings} {bindings:?}: {found:?}");
    }
}

#[test]
fn a_unit_that_is_missing_is_assumed_and_told() {
    let found = inputs("", &[("load", ""), ("ambient", "")]).assumptions;
    assert_eq!(found, ["load in %", "ambient in °C"]);
    let power = inputs(r#", "rated_power": 40"#, &[("apparent_power", "MVA")]).assumptions;
    assert_eq!(power, ["rated voltage"]);
}

#[test]
fn a_tag_without_numbers_is_a_finding() {
    let mut switch = binding("load", "%");
    switch.kind = ValueKind::Bool;
    let settings = serde_json::from_str(r#"{ "equipment": "=T1" }"#).unwrap();
    let found = Inputs::new(&settings, &[switch]).findings;
    assert!(found.len() == 1 && found[0].contains("has no numbers; bind one"), "{found:?}");
}

#[test]
fn a_text_is_a_finding_in_every_role() {
    let power = r#", "rated_power": 40, "rated_voltage": 110"#;
    let taps = r#", "taps": [{ "tap": 1, "rated_current": 200 }]"#;
    let stages = r#", "stages": [{ "stage": 0, "cooling": "ONAN" }]"#;
    let rated = r#", "rated_load": 90"#;
    let current = r#", "rated_current": 200"#;
    for (settings, bindings, words) in [
        ("", &[("load", "%")][..], "has no numbers; bind one"),
        ("", &[("load", "")][..], "has no numbers; bind one"),
        (rated, &[("load", "%")][..], "has no numbers; bind one"),
        (current, &[("current", "A")][..], "has no numbers; bind one"),
        (power, &[("apparent_power", "MVA")][..], "has no numbers; bind one"),
        (power, &[("active_power", "MW")][..], "has no numbers; bind one"),
        (power, &[("reactive_power", "Mvar"), ("active_power", "MW")][..], "has no numbers"),
        (power, &[("voltage", "kV"), ("active_power", "MW")][..], "has no numbers"),
        (taps, &[("tap", ""), ("current", "A")][..], "is a text; bind one with numbers or a state"),
        (stages, &[("fans", ""), ("load", "%")][..], "is a text; bind one"),
        (stages, &[("cooler_stage", ""), ("load", "%")][..], "is a text; bind one"),
        ("", &[("cooler_fault", ""), ("load", "%")][..], "is a text; bind one"),
        ("", &[("ambient", "°C"), ("load", "%")][..], "has no numbers"),
        ("", &[("top_oil", "°C"), ("load", "%")][..], "has no numbers"),
        ("", &[("hot_spot", "°C"), ("load", "%")][..], "has no numbers"),
    ] {
        let settings = format!(r#"{{ "equipment": "=T1"{settings} }}"#);
        let mut bindings: Vec<_> =
            bindings.iter().map(|(role, unit)| binding(role, unit)).collect();
        bindings[0].kind = ValueKind::Text;
        let found = Inputs::new(&serde_json::from_str(&settings).unwrap(), &bindings).findings;
        assert!(found.len() == 1 && found[0].contains(words), "{settings} {bindings:?}: {found:?}");
        assert!(found[0].contains(&format!("'{}'", bindings[0].tag_id)), "{found:?}");
    }
}

#[test]
fn a_voltage_of_no_use_is_assumed_and_told() {
    let settings = r#"{ "equipment": "=T1", "rated_power": 40, "rated_voltage": 110 }"#;
    let mut bindings = [binding("apparent_power", "MVA"), binding("voltage", "kV")];
    bindings[1].kind = ValueKind::Text;
    let inputs = Inputs::new(&serde_json::from_str(settings).unwrap(), &bindings);
    assert_eq!(inputs.assumptions, ["rated voltage"]);
}
