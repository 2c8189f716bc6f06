//! Load by its ways, and inputs that are not used.

use std::time::Duration;

use busbar_plugin_sdk::{Binding, Origin, Quality, Reason, Text, Value, ValueKind};

use super::*;

const PLAUSIBLE: Plausible = Plausible {
    load: Interval::new(0.0, 1.8),
    ambient: Interval::new(-25.0, 40.0),
    fixed_ambient: 20.0,
};

fn read(settings: &str, values: &[(&str, &str, Option<f64>)]) -> OperatingPoint {
    let settings =
        format!(r#"{{ "equipment": "=T1", "rated_power": 40, "rated_voltage": 110{settings} }}"#);
    let settings = serde_json::from_str(&settings).unwrap();
    let binding = |(role, unit, _): &(&str, &str, Option<f64>)| Binding {
        node: 7,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("T1.{role}"),
        tag_name: String::new(),
        unit: (*unit).into(),
        node_id: "=T1".into(),
        role: (*role).into(),
    };
    let value = |(_, _, value): &(&str, &str, Option<f64>)| TagValue {
        value: Some(Value::F64(value.unwrap_or(1.0))),
        quality: value.map_or(Quality::Bad(Reason::Stale), |_| Quality::Good),
        age: Duration::ZERO,
        origin: Origin::LIVE,
    };
    let bindings: Vec<_> = values.iter().map(binding).collect();
    let inputs = Inputs::new(&settings, &bindings);
    assert!(inputs.findings.is_empty(), "{:?}", inputs.findings);
    let values: Vec<_> = values.iter().map(value).collect();
    Reader { settings: &settings, inputs: &inputs, values: &values, plausible: PLAUSIBLE }
        .read(None)
}

fn assert_load(point: &OperatingPoint, low: f64, high: f64) {
    let load = point.load;
    assert!((load.low - low).abs() < 1e-9 && (load.high - high).abs() < 1e-9, "{point:?}");
}

#[test]
fn the_load_is_the_current() {
    assert_load(&read("", &[("load", "%", Some(80.0))]), 0.8, 0.8);
    assert_load(&read("", &[("load", "p.u.", Some(0.8))]), 0.8, 0.8);
    let current = r#", "rated_current": 200"#;
    assert_load(&read(current, &[("load", "A", Some(160.0))]), 0.8, 0.8);
    assert_load(&read(current, &[("current", "kA", Some(0.16))]), 0.8, 0.8);
    // The phase with the greatest current counts.
    let phases = [("current", "A", Some(160.0)), ("current", "A", Some(180.0))];
    assert_load(&read(current, &phases), 0.9, 0.9);
    // Of rated power and voltage: 209.9 A.
    let rated = 40e3 / (3f64.sqrt() * 110.0);
    assert_load(&read("", &[("current", "A", Some(rated))]), 1.0, 1.0);
}

#[test]
fn apparent_power_goes_by_the_measured_voltage() {
    let at =
        |voltage| read("", &[("apparent_power", "MVA", Some(40.0)), ("voltage", "kV", voltage)]);
    assert_load(&at(Some(110.0)), 1.0, 1.0);
    assert_load(&at(Some(88.0)), 1.25, 1.25);
    // A voltage that is bad or implausible leaves bounds.
    assert_load(&at(None), 1.0 / 1.2, 1.25);
    assert_load(&at(Some(0.02)), 1.0 / 1.2, 1.25);
    assert_load(&read("", &[("apparent_power", "kVA", Some(-20e3))]), 0.5, 0.5);
}

#[test]
fn active_power_alone_is_a_lower_bound() {
    let both = [("active_power", "MW", Some(-24.0)), ("reactive_power", "Mvar", Some(18.0))];
    assert_load(&read("", &both), 0.75, 0.75);
    assert_load(&read("", &both[..1]), 0.6, 1.8);
    let without = [both[0], ("reactive_power", "Mvar", None)];
    assert_load(&read("", &without), 0.6, 1.8);
    assert_load(&read("", &[("load", "MW", Some(24.0))]), 0.6, 1.8);
}

#[test]
fn the_rated_current_goes_by_the_tap() {
    let taps =
        r#", "taps": [{ "tap": 1, "rated_current": 180 }, { "tap": 9, "rated_current": 220 }]"#;
    let at = |tap| read(taps, &[("current", "A", Some(198.0)), ("tap", "", tap)]);
    assert_load(&at(Some(1.0)), 1.1, 1.1);
    assert_load(&at(Some(9.0)), 0.9, 0.9);
    assert_load(&at(None), 0.9, 1.1);
    assert_load(&at(Some(5.0)), 0.9, 1.1);
    assert!(at(Some(5.0)).doubts[0].contains("which no tap is"));
}

#[test]
fn implausible_inputs_are_not_used() {
    for load in [-5.0, 301.0, f64::NAN, f64::INFINITY] {
        let point = read("", &[("load", "%", Some(load))]);
        assert_load(&point, 0.0, 1.8);
        assert!(point.used.is_empty() && !point.is_load_measured, "{load}");
        assert_eq!(point.doubts.len(), 1, "{:?}", point.doubts);
    }
    for (ambient, unit) in [(-61.0, "°C"), (61.0, "°C"), (-300.0, "°F"), (20.0, "K")] {
        let point = read("", &[("load", "%", Some(50.0)), ("ambient", unit, Some(ambient))]);
        assert_eq!(point.ambient, PLAUSIBLE.ambient, "{ambient} {unit}");
    }
    let fahrenheit = read("", &[("load", "%", Some(50.0)), ("ambient", "°F", Some(77.0))]);
    assert!((fahrenheit.ambient.middle() - 25.0).abs() < 1e-9 && fahrenheit.ambient.is_point());
}

#[test]
fn the_next_way_counts_where_one_is_bad() {
    let current = r#", "rated_current": 200"#;
    let values = [("current", "A", None), ("apparent_power", "MVA", Some(20.0))];
    let point = read(current, &values);
    assert_load(&point, 0.5, 0.5);
    assert_eq!(point.used, [1]);
    // Of three phases one is bad: a lower bound.
    let phases = [("current", "A", Some(160.0)), ("current", "A", None)];
    assert_load(&read(current, &phases), 0.8, 1.8);
}

#[test]
fn ways_that_tell_different_loads_are_bounds() {
    let current = r#", "rated_current": 200"#;
    let with = |amps, megawatts, mvar| {
        let values = [
            ("current", "A", Some(amps)),
            ("active_power", "MW", Some(megawatts)),
            ("reactive_power", "Mvar", mvar),
        ];
        read(current, &values)
    };
    // A current transformer that is short-circuited shows nothing beside full power.
    let dead = with(0.0, 32.0, Some(24.0));
    assert_load(&dead, 0.0, 1.0);
    assert_eq!(dead.used, [0, 1, 2]);
    assert!(dead.doubts.iter().any(|of| of.contains("two ways")), "{:?}", dead.doubts);
    // Power that is missing beside a current.
    assert_load(&with(200.0, 0.0, Some(0.0)), 0.0, 1.0);
    // Active power alone is at least that much.
    assert_load(&with(100.0, 32.0, None), 0.5, 0.8);
    for (megawatts, mvar) in [(40.0, Some(0.0)), (36.5, Some(0.0)), (20.0, None)] {
        assert_load(&with(200.0, megawatts, mvar), 1.0, 1.0);
    }
}

#[test]
fn a_stage_that_is_not_known_may_be_any() {
    let stages =
        r#", "stages": [{ "stage": 0, "cooling": "ONAN" }, { "stage": 1, "cooling": "ONAF" }]"#;
    let at = |stage, fault| {
        let values = [("load", "%", Some(50.0)), ("fans", "", stage), ("cooler_fault", "", fault)];
        let point = read(stages, &values);
        (point.stages.clone(), point.cooler_fault)
    };
    assert_eq!(at(Some(0.0), Some(0.0)), (0..1, CoolerFault::None));
    assert_eq!(at(Some(1.0), Some(0.0)), (1..2, CoolerFault::None));
    assert_eq!(at(None, Some(0.0)), (0..2, CoolerFault::None));
    assert_eq!(at(Some(7.0), Some(0.0)), (0..2, CoolerFault::None));
    assert_eq!(at(Some(1.0), None), (0..2, CoolerFault::Unknown));
    assert_eq!(at(Some(1.0), Some(1.0)), (0..2, CoolerFault::Reported));
}

#[test]
fn a_step_that_begins_unknown_is_between_the_bounds_of_its_beginning() {
    let tags = |load, ambient| [("load", "%", load), ("ambient", "°C", ambient)];
    let blind = read("", &tags(None, Some(20.0)));
    let seen = read("", &tags(Some(50.0), Some(22.0)));
    let (load, ambient, _) = seen.since(Some(&blind));
    // What was known counts as it is at the end, what was not between its bounds.
    assert_eq!([load, ambient], [Interval::new(0.0, 1.8), Interval::point(22.0)]);
    let (load, ..) = seen.since(Some(&seen));
    assert!(load.is_point());
    let (load, ..) = blind.since(Some(&seen));
    assert_eq!(load, Interval::new(0.0, 1.8));
}

#[test]
fn a_text_is_no_number_and_no_state() {
    let settings = r#"{ "equipment": "=T1", "stages": [{ "stage": 0, "cooling": "ONAN" }] }"#;
    let settings = serde_json::from_str(settings).unwrap();
    let binding = |role: &str, kind| Binding {
        node: 7,
        kind,
        limit_low: None,
        limit_high: None,
        tag_id: format!("T1.{role}"),
        tag_name: String::new(),
        unit: String::new(),
        node_id: "=T1".into(),
        role: role.into(),
    };
    let roles = ["load", "ambient", "cooler_stage", "cooler_fault"];
    for kind in [ValueKind::F64, ValueKind::Text] {
        let mut bindings = roles.map(|role| binding(role, ValueKind::F64));
        bindings[2].kind = kind;
        bindings[3].kind = kind;
        let inputs = Inputs::new(&settings, &bindings);
        for word in ["", "0", "20", "off"] {
            let value = Some(Value::Text(Text::new(word).unwrap()));
            let (quality, age, origin) = (Quality::Good, Duration::ZERO, Origin::LIVE);
            let value = TagValue { value, quality, age, origin };
            let values = [(); 4].map(|()| value.clone());
            let reader = Reader {
                settings: &settings,
                inputs: &inputs,
                values: &values,
                plausible: PLAUSIBLE,
            };
            let point = reader.read(None);
            assert!(!point.is_load_measured && point.used.is_empty(), "{point:?}");
            assert_eq!(point.cooler_fault, CoolerFault::Unknown);
            assert!((point.ambient.low, point.ambient.high) == (-25.0, 40.0), "{point:?}");
            for role in roles {
                let words = format!("{} (T1.{role}) is no number", role.replace('_', " "));
                assert!(point.doubts.contains(&words), "{words}: {:?}", point.doubts);
            }
        }
    }
}
