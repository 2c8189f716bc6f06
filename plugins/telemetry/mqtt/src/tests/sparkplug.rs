//! Sparkplug B, spoken by pysparkplug.

use super::*;

const GROUP: &str = "north";
const NODE: &str = "station7";
const DEVICE: &str = "bay3";
/// When metrics say that they were measured.
const MEASURED: u64 = 1_700_000_000_123;

/// Value of a metric of type UUID.
const UUID: &str = "9f2c1f5e-6f0a-4d5b-8a3e-0c9d2b7e4a11";

fn metric(number: u32, kind: ValueKind, device: Option<&str>, name: &str) -> TagSpec {
    let mut address = json!({"group": GROUP, "edge_node": NODE, "metric": name});
    if let Some(device) = device {
        address["device"] = json!(device);
    }
    tag(number, kind, address)
}

/// A tag of the node, one of a device.
fn two_tags() -> Vec<TagSpec> {
    vec![
        metric(1, ValueKind::F64, None, "load"),
        metric(2, ValueKind::F64, Some(DEVICE), "current"),
    ]
}

/// Births of both, with aliases.
fn be_born(node: &mut Client, load: f64, current: f64) {
    let of_node = json!([{"name": "load", "alias": 1, "type": "DOUBLE", "value": load}]);
    node.command(&json!({ "birth": of_node }));
    let of_device = json!([{"name": "current", "alias": 2, "type": "FLOAT", "value": current}]);
    node.command(&json!({"birth": of_device, "device": DEVICE}));
}

/// New values by their aliases alone.
fn send(node: &mut Client, load: f64, current: f64) {
    node.command(&json!({"data": [{"alias": 1, "type": "DOUBLE", "value": load}]}));
    let data = json!([{"alias": 2, "type": "FLOAT", "value": current}]);
    node.command(&json!({"data": data, "device": DEVICE}));
}

#[test]
fn metrics_of_all_types_carry_time_and_quality() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let integer = |value: i64| Some(Value::I64(value));
    let text = |text: &str| Some(Value::Text(Text::cut(text)));
    let cases = [
        ("INT8", json!(-5), ValueKind::I64, integer(-5)),
        ("INT16", json!(-300), ValueKind::I64, integer(-300)),
        ("INT32", json!(-70_000), ValueKind::I64, integer(-70_000)),
        ("INT64", json!(-5_000_000_000_i64), ValueKind::I64, integer(-5_000_000_000)),
        ("UINT8", json!(250), ValueKind::I64, integer(250)),
        ("UINT16", json!(65_000), ValueKind::I64, integer(65_000)),
        ("UINT32", json!(4_000_000_000_u32), ValueKind::I64, integer(4_000_000_000)),
        ("UINT64", json!(u64::MAX), ValueKind::F64, Some(Value::F64(u64::MAX as f64))),
        ("UINT64", json!(u64::MAX), ValueKind::I64, None),
        ("FLOAT", json!(1.5), ValueKind::F64, Some(Value::F64(1.5))),
        ("DOUBLE", json!(-0.1), ValueKind::F64, Some(Value::F64(-0.1))),
        ("BOOLEAN", json!(true), ValueKind::Bool, Some(Value::Bool(true))),
        ("STRING", json!("12.5"), ValueKind::F64, Some(Value::F64(12.5))),
        ("TEXT", json!("3"), ValueKind::I64, integer(3)),
        ("UUID", json!("no number"), ValueKind::I64, None),
        ("STRING", json!("AUTO"), ValueKind::Text, text("AUTO")),
        ("STRING", json!(""), ValueKind::Text, text("")),
        ("TEXT", json!("Zähler 7\n"), ValueKind::Text, text("Zähler 7 ")),
        ("UUID", json!(UUID), ValueKind::Text, text(UUID)),
        ("INT64", json!(-5_000_000_000_i64), ValueKind::Text, text("-5000000000")),
        ("UINT64", json!(u64::MAX), ValueKind::Text, text("18446744073709551615")),
        ("BOOLEAN", json!(true), ValueKind::Text, None),
        ("DOUBLE", json!(5.0), ValueKind::Text, None),
        ("DATASET", json!(null), ValueKind::Text, None),
        ("DATETIME", json!(MEASURED), ValueKind::I64, integer(MEASURED as i64)),
        ("UINT8", json!(2), ValueKind::DoublePoint, Some(Value::DoublePoint(DoublePoint::On))),
        ("DATASET", json!(null), ValueKind::F64, None),
        ("FLOAT_ARRAY", json!([1.5]), ValueKind::F64, None),
    ];
    let name = |index: usize| format!("metric {index}");
    let tags = cases.iter().enumerate();
    let tags = tags.map(|(i, case)| metric(i as u32, case.2, Some(DEVICE), &name(i))).collect();
    let running = start(broker.port, &json!({}), tags);
    let metrics: Vec<_> = cases
        .iter()
        .enumerate()
        .map(|(index, (kind, value, ..))| {
            json!({"name": name(index), "type": kind, "value": value, "time": MEASURED})
        })
        .collect();
    node.command(&json!({"birth": []}));
    node.command(&json!({"birth": metrics, "device": DEVICE}));
    for (index, (kind, value, _, expected)) in cases.iter().enumerate() {
        match expected {
            Some(expected) => {
                running.wait_for(index as u32, expected.clone());
                let sample = running.recorder.latest(index as u32).unwrap();
                assert_eq!(sample.source_time, time(MEASURED), "{kind} {value}");
            }
            None => running.wait_for_bad(index as u32, Reason::Configuration),
        }
    }
}

#[test]
fn quality_null_and_history_are_heeded() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let running = start(broker.port, &json!({}), two_tags());
    be_born(&mut node, 1.0, 2.0);
    running.wait_for(1, Value::F64(1.0));
    running.wait_for(2, Value::F64(2.0));
    let mut load = |value: f64, more: Json| {
        let mut metric = json!({"alias": 1, "type": "DOUBLE", "value": value});
        metric.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        node.command(&json!({"data": [metric]}));
    };
    let cases = [
        (192, Quality::Good),
        (0, Quality::Bad(Reason::Unknown)),
        (500, Quality::Bad(Reason::Communication)),
    ];
    for (index, (code, quality)) in cases.into_iter().enumerate() {
        let value = 10.0 + index as f64;
        load(value, json!({ "quality": code }));
        running.wait("value", 1, |sample| sample.value == Some(Value::F64(value)));
        assert_eq!(running.recorder.latest(1).unwrap().quality, quality, "{code}");
    }
    load(20.0, json!({}));
    running.wait_for(1, Value::F64(20.0));
    load(21.0, json!({"is_historical": true, "time": MEASURED}));
    running.wait_for(1, Value::F64(21.0));
    let of_past = running.recorder.latest(1).unwrap();
    let flags = SampleFlags::BUFFERED | SampleFlags::HISTORICAL;
    assert_eq!((of_past.source_time, of_past.flags), (time(MEASURED), flags));
    // The message's time is not that of a value of the past.
    load(21.5, json!({"is_historical": true}));
    running.wait_for(1, Value::F64(21.5));
    let ageless = running.recorder.latest(1).unwrap();
    assert_eq!((ageless.source_time, ageless.flags), (None, flags | SampleFlags::TIME_UNUSABLE));
    load(0.0, json!({"is_null": true}));
    running.wait_for_bad(1, Reason::Sensor);
    load(22.0, json!({}));
    running.wait_for(1, Value::F64(22.0));
    assert_eq!(running.recorder.latest(1).unwrap().flags, SampleFlags::LIVE);
}

#[test]
fn deaths_make_bad_what_they_are_of() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let running = start(broker.port, &json!({}), two_tags());
    be_born(&mut node, 1.0, 2.0);
    running.wait_for(2, Value::F64(2.0));
    node.command(&json!({"death": true, "device": DEVICE}));
    running.wait_for_bad(2, Reason::Communication);
    running.wait_for(1, Value::F64(1.0));
    be_born(&mut node, 3.0, 4.0);
    running.wait_for(2, Value::F64(4.0));

    // The will of a connection that is gone already is not the end of this life.
    node.command(&json!({"old_death": 17}));
    send(&mut node, 5.0, 6.0);
    running.wait_for(1, Value::F64(5.0));
    running.wait_for(2, Value::F64(6.0));

    // The broker publishes the will.
    node.command(&json!({"break": true}));
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_bad(2, Reason::Communication);
    be_born(&mut node, 7.0, 8.0);
    running.wait_for(1, Value::F64(7.0));
    running.wait_for(2, Value::F64(8.0));
}

#[test]
fn after_a_gap_nothing_is_good_until_the_next_birth() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let running = start(broker.port, &json!({}), two_tags());
    be_born(&mut node, 1.0, 2.0);
    running.wait_for(2, Value::F64(2.0));
    let skipping = json!({"data": [{"alias": 1, "type": "DOUBLE", "value": 3.0}], "skip": 1});
    node.command(&skipping);
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_bad(2, Reason::Communication);
    // An alias may mean something else by now; a name does not.
    send(&mut node, 5.0, 6.0);
    let named = json!({"data": [{"name": "load", "type": "DOUBLE", "value": 7.0}]});
    node.command(&named);
    running.wait_for(1, Value::F64(7.0));
    let samples = running.recorder.recording().samples;
    let untrusted = [3.0, 5.0, 6.0].map(|value| Some(Value::F64(value)));
    assert!(samples.iter().all(|sample| !untrusted.contains(&sample.value)));
    running.wait_for_bad(2, Reason::Communication);
    be_born(&mut node, 8.0, 9.0);
    running.wait_for(2, Value::F64(9.0));
}

#[test]
fn what_cannot_be_assigned_is_a_gap_of_its_device() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let running = start(broker.port, &json!({"max_payload_bytes": 1024}), two_tags());
    let topic = format!("spBv1.0/{GROUP}/DDATA/{NODE}/{DEVICE}");
    let alias = |alias: u32| json!([{"alias": alias, "type": "FLOAT", "value": 5.0}]);
    let faults = [
        // An alias that no birth told, one of the node for a device, and neither name nor alias.
        Some(json!({"data": alias(99), "device": DEVICE})),
        Some(json!({"data": alias(1), "device": DEVICE})),
        Some(json!({"data": [{"type": "FLOAT", "value": 5.0}], "device": DEVICE})),
        // Bytes that are no payload, and more of them than are taken.
        None,
    ];
    let long = "x".repeat(1025);
    for (number, fault) in (0_u8..).zip(faults.iter().chain([&None])) {
        let value = f64::from(number);
        be_born(&mut node, value, value + 100.0);
        running.wait_for(1, Value::F64(value));
        running.wait_for(2, Value::F64(value + 100.0));
        match fault {
            Some(data) => node.command(data),
            None => peer.publish(&topic, if number == 3 { "garbage" } else { &long }),
        }
        running.wait_for_bad(2, Reason::Communication);
        assert!(running.recorder.latest(1).unwrap().quality.is_good(), "its own message");
    }
}

#[test]
fn devices_that_number_their_aliases_on_their_own_are_told_apart() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let tags = vec![
        metric(1, ValueKind::F64, Some("a"), "current"),
        metric(2, ValueKind::F64, Some("b"), "current"),
    ];
    let running = start(broker.port, &json!({}), tags);
    node.command(&json!({"birth": []}));
    for (device, value) in [("a", 1.0), ("b", 2.0)] {
        let birth = json!([{"name": "current", "alias": 0, "type": "FLOAT", "value": value}]);
        node.command(&json!({"birth": birth, "device": device}));
    }
    running.wait_for(2, Value::F64(2.0));
    for (device, value) in [("a", 3.0), ("b", 4.0)] {
        let data = json!([{"alias": 0, "type": "FLOAT", "value": value}]);
        node.command(&json!({"data": data, "device": device}));
    }
    running.wait_for(1, Value::F64(3.0));
    running.wait_for(2, Value::F64(4.0));
}

#[test]
fn an_alias_of_two_metrics_makes_both_bad_until_the_next_birth() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let mut tags = two_tags();
    tags.push(metric(3, ValueKind::F64, Some(DEVICE), "voltage"));
    let running = start(broker.port, &json!({}), tags);
    be_born(&mut node, 1.0, 2.0);
    running.wait_for(2, Value::F64(2.0));
    let birth = |alias: u32| {
        json!({"device": DEVICE, "birth": [
            {"name": "current", "alias": 2, "type": "FLOAT", "value": 5.0},
            {"name": "voltage", "alias": alias, "type": "FLOAT", "value": 6.0},
        ]})
    };
    node.command(&birth(2));
    running.wait_for_bad(2, Reason::Configuration);
    running.wait_for_bad(3, Reason::Configuration);
    let data = json!([{"alias": 2, "type": "FLOAT", "value": 7.0}]);
    node.command(&json!({"data": data, "device": DEVICE}));
    node.command(&json!({"data": [{"alias": 1, "type": "DOUBLE", "value": 8.0}]}));
    running.wait_for(1, Value::F64(8.0));
    for tag in [2, 3] {
        let quality = running.recorder.latest(tag).unwrap().quality;
        assert_eq!(quality, Quality::Bad(Reason::Configuration));
    }
    node.command(&birth(3));
    running.wait_for(2, Value::F64(5.0));
    running.wait_for(3, Value::F64(6.0));
}

#[test]
fn sequence_numbers_begin_anew_after_255() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let running = start(broker.port, &json!({}), two_tags());
    be_born(&mut node, 1.0, 2.0);
    for number in 0..300 {
        send(&mut node, 10.0 + f64::from(number), 2.0);
    }
    running.wait_for(1, Value::F64(309.0));
    let bad = |sample: &Sample| sample.quality == Quality::Bad(Reason::Communication);
    assert!(!running.recorder.recording().samples.iter().any(bad));
}

#[test]
fn births_are_asked_for_only_if_the_settings_say_so() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    be_born(&mut node, 1.0, 2.0);
    // It came too late for the births: aliases mean nothing to it.
    let silent = start(broker.port, &json!({}), two_tags());
    send(&mut node, 3.0, 4.0);
    let unasked = json!({"data": [{"name": "load", "type": "DOUBLE", "value": 5.0}]});
    node.command(&unasked);
    silent.wait_for(1, Value::F64(5.0));
    assert_eq!(silent.recorder.latest(2).unwrap().quality, Quality::Bad(Reason::NotConnected));
    node.command(&json!({"commands": 0}));

    let asking = start(broker.port, &json!({"sparkplug": {"request_rebirth": true}}), two_tags());
    node.command(&json!({"commands": 1}));
    be_born(&mut node, 6.0, 7.0);
    for running in [&silent, &asking] {
        running.wait_for(1, Value::F64(6.0));
        running.wait_for(2, Value::F64(7.0));
    }
}

#[test]
fn a_primary_host_says_that_it_is_there_and_that_it_is_gone() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let settings = json!({"sparkplug": {"primary_host": "wall"}});
    let mut running = start(broker.port, &settings, two_tags());
    node.command(&json!({"state": "wall", "online": true}));
    running.plugin.stop();
    node.command(&json!({"state": "wall", "online": false}));
}

#[test]
fn a_metric_that_no_birth_has_is_a_fault_of_the_configuration() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let mut tags = two_tags();
    tags.push(metric(3, ValueKind::F64, Some(DEVICE), "misspelt"));
    let running = start(broker.port, &json!({}), tags);
    be_born(&mut node, 1.0, 2.0);
    running.wait_for(2, Value::F64(2.0));
    running.wait_for_bad(3, Reason::Configuration);
}

#[test]
fn a_metric_in_another_unit_than_its_tag_is_never_good() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut node) = Client::node(broker.port, GROUP, NODE) else { return };
    let cases = [("MW", "MW"), ("MW", "kW"), ("°C", "degC"), ("°C", "degF"), ("A", "apples")];
    let tags = (0..).zip(cases).map(|(number, (unit, _))| TagSpec {
        unit: unit.into(),
        ..metric(number, ValueKind::F64, None, &format!("m{number}"))
    });
    let running = start(broker.port, &json!({}), tags.collect());
    let metrics: Vec<_> = (0..)
        .zip(cases)
        .map(|(number, (_, unit)): (u32, _)| {
            json!({"name": format!("m{number}"), "type": "DOUBLE", "value": 61.5, "unit": unit})
        })
        .collect();
    node.command(&json!({ "birth": metrics }));
    for (number, (tag, source)) in (0..).zip(cases) {
        match (tag, source) {
            ("MW", "kW") | ("°C", "degF") => running.wait_for_bad(number, Reason::Configuration),
            _ => running.wait_for(number, Value::F64(61.5)),
        }
    }
}
