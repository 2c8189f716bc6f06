//! Against asyncua, an independent implementation.

use std::time::Instant;

use busbar_plugin_sdk::{DoublePoint, Text};

use peer_process::Peer;

use super::peer;
use super::*;

/// Test time 2026-01-02 03:04:05.678 UTC, milliseconds since 1970.
const TIME_MILLIS: u64 = 1_767_323_045_678;

/// Data type, kind of tag, and two pairs of a server's value and the tag's.
type Case = (&'static str, ValueKind, [(Json, Value); 2]);

fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    let numbers = [
        ("SByte", -128, 127),
        ("Byte", 0, 255),
        ("Int16", -32_768, 32_767),
        ("UInt16", 0, 65_535),
        ("Int32", -2_147_483_648, 2_147_483_647),
        ("UInt32", 0, 4_294_967_295),
        ("Int64", i64::MIN, i64::MAX),
        ("UInt64", 0, i64::MAX),
    ];
    for (name, low, high) in numbers {
        let values = [low, high].map(|value| (json!(value), Value::I64(value)));
        cases.push((name, ValueKind::I64, values));
    }
    let booleans = [true, false].map(|value| (json!(value), Value::Bool(value)));
    cases.push(("Boolean", ValueKind::Bool, booleans));
    let floats = [-230.5, 1024.25].map(|value| (json!(value), Value::F64(value)));
    cases.push(("Float", ValueKind::F64, floats.clone()));
    cases.push(("Double", ValueKind::F64, floats));
    cases.push(("String", ValueKind::F64, [("1.5", 1.5), ("-2", -2.0)].map(number)));
    cases.push(("LocalizedText", ValueKind::F64, [("1.5", 1.5), ("-2", -2.0)].map(number)));
    for name in ["String", "LocalizedText"] {
        cases.push((
            name,
            ValueKind::Text,
            ["AUTO", "Wärme 電"].map(|text| (json!(text), self::text(text))),
        ));
    }
    let numbers = [u64::MAX, 42].map(|value| (json!(value), text(&value.to_string())));
    cases.push(("UInt64", ValueKind::Text, numbers));
    let time = i64::try_from(TIME_MILLIS).unwrap();
    let times = [time, time + 1].map(|millis| (json!(millis), Value::I64(millis)));
    cases.push(("DateTime", ValueKind::I64, times));
    // An enumeration is an Int32.
    let positions = [(1, DoublePoint::Off), (2, DoublePoint::On)]
        .map(|(code, state)| (json!(code), Value::DoublePoint(state)));
    cases.push(("Int32", ValueKind::DoublePoint, positions));
    cases
}

fn number((text, value): (&str, f64)) -> (Json, Value) {
    (json!(text), Value::F64(value))
}

fn text(text: &str) -> Value {
    Value::Text(Text::cut(text))
}

#[test]
fn a_long_text_is_cut_and_uncertain_and_other_types_are_bad() {
    let nodes = [
        node("long", "String", &json!("x".repeat(256))),
        node("empty", "String", &json!("")),
        node("float", "Double", &json!(1.0)),
        node("Boolean", "Boolean", &json!(true)),
    ];
    let Some(peer) = peer::start(&json!({"nodes": nodes})) else { return };
    let names = ["long", "empty", "float", "Boolean"];
    let tags = (0..).zip(names).map(|(index, name)| tag(index, ValueKind::Text, name));
    let running = start(peer.port, &json!({}), tags.collect());
    let cut = Some(text(&format!("{}…", "x".repeat(252))));
    running.wait("cut text", 0, |sample| {
        sample.value == cut && sample.quality == Quality::Uncertain(Reason::Configuration)
    });
    running.wait_for(1, text(""));
    running.wait_for_bad(2, Reason::Configuration);
    running.wait_for_bad(3, Reason::Configuration);
}

#[test]
fn every_type_is_read_with_its_source_time() {
    let cases = cases();
    let name = |index: u32| format!("N{index}");
    let nodes: Vec<_> = (0..)
        .zip(&cases)
        .map(|(index, (kind, _, [(first, _), _]))| node(&name(index), kind, first))
        .collect();
    let Some(mut peer) = peer::start(&json!({"nodes": nodes})) else { return };
    let tags = (0..).zip(&cases).map(|(index, (_, kind, _))| tag(index, *kind, &name(index)));
    let running = start(peer.port, &json!({}), tags.collect());
    for (index, (_, _, [(_, expected), _])) in (0..).zip(&cases) {
        running.wait_for(index, expected.clone());
    }
    let states: Vec<_> = running.recorder.recording().links.iter().map(|link| link.0).collect();
    assert_eq!(states, [LinkState::Connecting, LinkState::Up]);
    let wanted = UNIX_EPOCH + Duration::from_millis(TIME_MILLIS);
    for (index, (kind, _, [_, (second, expected)])) in (0..).zip(&cases) {
        let mut changed = node(&name(index), kind, second);
        changed["time_millis"] = json!(TIME_MILLIS);
        peer.command(&json!({"set": changed}));
        running.wait_for_any(index, |sample| {
            sample.value.as_ref() == Some(expected) && sample.source_time == Some(wanted)
        });
        // It is old, and so now: the server vouches for it.
        running.wait("confirmation", index, |sample| {
            sample.value.as_ref() == Some(expected) && sample.source_time.is_none()
        });
    }
}

#[test]
fn elements_bits_states_and_scales_are_read() {
    let nodes = [
        node("array", "Double", &json!([1.0, 2.5, -7.0])),
        node("word", "UInt16", &json!(0x8001)),
        node("text", "String", &json!("CLOSED")),
        node("raw", "Int16", &json!(2305)),
    ];
    let spec = json!({"namespaces": ["urn:first"], "nodes": nodes});
    let Some(mut peer) = peer::start(&spec) else { return };
    let of = |tag, kind, node: &str, more: Json| {
        let mut spec = self::tag(tag, kind, node);
        spec.address.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        spec
    };
    let mut by_uri = tag(6, ValueKind::I64, "raw");
    // The nodes are in the namespace of the first URI, whatever its index.
    by_uri.address = json!({"node": "nsu=urn:first;s=raw"});
    let tags = vec![
        of(0, ValueKind::F64, "array", json!({"index": 1})),
        of(1, ValueKind::F64, "array", json!({"index": 2})),
        of(2, ValueKind::Bool, "word", json!({"bit": 15})),
        of(3, ValueKind::Bool, "word", json!({"bit": 1})),
        of(4, ValueKind::DoublePoint, "text", json!({"states": {"OPEN": "off", "CLOSED": "on"}})),
        of(5, ValueKind::F64, "raw", json!({"scale": 0.1, "offset": 0.5, "deadband": 9.5})),
        by_uri,
        of(7, ValueKind::F64, "array", json!({"index": 3})),
        of(8, ValueKind::F64, "missing", json!({})),
        of(9, ValueKind::Bool, "raw", json!({})),
    ];
    let running = start(peer.port, &json!({}), tags);
    running.wait_for(0, Value::F64(2.5));
    running.wait_for(1, Value::F64(-7.0));
    running.wait_for(2, Value::Bool(true));
    running.wait_for(3, Value::Bool(false));
    running.wait_for(4, Value::DoublePoint(DoublePoint::On));
    running.wait_for(5, Value::F64(2305.0 * 0.1 + 0.5));
    running.wait_for(6, Value::I64(2305));
    for tag in [7, 8, 9] {
        running.wait_for_bad(tag, Reason::Configuration);
    }
    // Within the dead band nothing comes.
    for (raw, shown) in [(2310, 2305), (2320, 2320)] {
        peer.command(&json!({"set": node("raw", "Int16", &json!(raw))}));
        running.wait_for(6, Value::I64(raw));
        running.wait_for(5, Value::F64(f64::from(shown) * 0.1 + 0.5));
    }
}

#[test]
fn quality_is_carried_over() {
    let Some(mut peer) = peer::start(&json!({"nodes": [node("A", "Double", &json!(1.0))]})) else {
        return;
    };
    let running = start(peer.port, &json!({}), vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for(1, Value::F64(1.0));
    let cases = [
        (0x808C_0000_u32, Quality::Bad(Reason::Sensor)),
        (0x8031_0000, Quality::Bad(Reason::Communication)),
        (0x4090_0000, Quality::Bad(Reason::Communication)),
        (0x4094_0000, Quality::Uncertain(Reason::OutOfRange)),
        (0x4093_0000, Quality::Uncertain(Reason::Sensor)),
        (0x0096_0000, Quality::Uncertain(Reason::Unknown)),
        (0x0000_0000, Quality::Good),
    ];
    for (number, (status, quality)) in (2..).zip(cases) {
        let value = f64::from(number);
        let mut changed = node("A", "Double", &json!(value));
        changed["status"] = json!(status);
        peer.command(&json!({"set": changed}));
        // asyncua sends no value beside a bad status.
        let expected = (!matches!(quality, Quality::Bad(_))).then_some(Value::F64(value));
        running
            .wait("quality", 1, |sample| (&sample.value, sample.quality) == (&expected, quality));
    }
}

#[test]
fn a_value_that_does_not_change_stays_fresh() {
    let mut old = node("A", "Double", &json!(1.0));
    old["time_millis"] = json!(TIME_MILLIS);
    let Some(peer) = peer::start(&json!({"nodes": [old]})) else { return };
    let mut quick = tag(1, ValueKind::F64, "A");
    quick.freshness = Duration::from_millis(800);
    let running = start(peer.port, &json!({}), vec![quick]);
    running.wait_for(1, Value::F64(1.0));
    running.recorder.clear();
    let (mut last, began) = (Instant::now(), Instant::now());
    let mut longest = Duration::ZERO;
    while began.elapsed() < Duration::from_secs(3) {
        if running.recorder.latest(1).is_some() {
            longest = longest.max(last.elapsed());
            last = Instant::now();
            running.recorder.clear();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let longest = longest.max(last.elapsed());
    assert!(longest < Duration::from_millis(800), "{longest:?} without a sign of life");
}

#[test]
fn many_tags_have_several_subscriptions() {
    let names: Vec<_> = (0..250).map(|index| format!("N{index}")).collect();
    let nodes: Vec<_> =
        (0..).zip(&names).map(|(value, name)| node(name, "Int32", &json!(value))).collect();
    let Some(mut peer) = peer::start(&json!({"nodes": nodes})) else { return };
    let tags = (0..).zip(&names).map(|(index, name)| tag(index, ValueKind::I64, name)).collect();
    let running = start(peer.port, &json!({"items_per_subscription": 60}), tags);
    for index in 0..250 {
        running.wait_for(index, Value::I64(index.into()));
    }
    for index in [0, 59, 60, 249] {
        peer.command(&json!({"set": node(&format!("N{index}"), "Int32", &json!(-1))}));
        running.wait_for(index, Value::I64(-1));
    }
}

#[test]
fn a_killed_server_makes_tags_bad_and_a_restarted_one_good() {
    let spec = |value: f64| json!({"nodes": [node("A", "Double", &json!(value))]});
    let Some(peer) = peer::start(&spec(5.0)) else { return };
    let port = peer.port;
    let running = start(port, &json!({}), vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for(1, Value::F64(5.0));
    running.recorder.clear();
    let _peer = peer.restart(&spec(50.0));
    running.wait_for(1, Value::F64(50.0));
    let recording = running.recorder.recording();
    let bad = recording.samples.iter().find(|sample| !sample.quality.is_good()).unwrap();
    assert_eq!(bad.quality, Quality::Bad(Reason::Communication), "at once");
    let down = recording.links.iter().find(|(state, _)| *state == LinkState::Down).unwrap();
    assert!(down.1.starts_with(&format!("opc.tcp://127.0.0.1:{port}/test: ")), "{down:?}");
    assert!(down.1.contains("; next try in 0."), "{down:?}");
    let last = recording.links.back().cloned();
    assert_eq!(last, Some((LinkState::Up, format!("opc.tcp://127.0.0.1:{port}/test: connected"))));
}

#[test]
#[cfg(target_os = "linux")]
fn a_frozen_server_makes_tags_bad_within_the_silence() {
    let Some(peer) = peer::start(&json!({"nodes": [node("A", "Double", &json!(5.0))]})) else {
        return;
    };
    let settings = json!({"silence_seconds": 1.5, "connect_timeout_seconds": 1});
    let running = start(peer.port, &settings, vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for(1, Value::F64(5.0));
    // Idle for longer than the silence: the server answers, and the tag stays.
    std::thread::sleep(Duration::from_millis(2500));
    assert!(running.recorder.latest(1).unwrap().quality.is_good());
    peer.signal("STOP");
    let frozen = Instant::now();
    running.wait_for_bad(1, Reason::Communication);
    let took = frozen.elapsed();
    // Half a second for a loaded machine.
    assert!(took < Duration::from_millis(1500 + 500), "{took:?}");
    running.wait_for_link(LinkState::Down, "the server was silent for 1500 ms");
    peer.signal("CONT");
    running.wait_for(1, Value::F64(5.0));
}

#[test]
fn a_node_that_comes_later_is_found() {
    let Some(mut peer) = peer::start(&json!({})) else { return };
    let running = start(peer.port, &json!({}), vec![tag(1, ValueKind::F64, "late")]);
    running.wait_for_bad(1, Reason::Configuration);
    peer.command(&json!({"add": node("late", "Double", &json!(7.0))}));
    let found = |seen: &Recording| seen.latest(1).is_some_and(|s| s.quality.is_good());
    assert!(running.recorder.wait_until(Duration::from_secs(45), found));
}

#[test]
fn a_plugin_that_stops_says_goodbye() {
    let Some(mut peer) = peer::start(&json!({"nodes": [node("A", "Double", &json!(5.0))]})) else {
        return;
    };
    let mut running = start(peer.port, &json!({}), vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for(1, Value::F64(5.0));
    let count = |peer: &mut Peer| peer.ask(&json!({"sessions": true}));
    assert_eq!(count(&mut peer), "1");
    running.plugin.stop();
    let deadline = Instant::now() + PATIENCE;
    while count(&mut peer) != "0" {
        assert!(Instant::now() < deadline, "the session is still there");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn another_server_of_the_set_takes_over() {
    let spec = |value: f64| json!({"nodes": [node("A", "Double", &json!(value))]});
    let (Some(first), Some(second)) = (peer::start(&spec(1.0)), peer::start(&spec(2.0))) else {
        return;
    };
    let settings = json!({"redundancy": [format!("opc.tcp://127.0.0.1:{}/test", second.port)]});
    let running = start(first.port, &settings, vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for(1, Value::F64(1.0));
    drop(first);
    running.wait_for(1, Value::F64(2.0));
}

#[test]
fn a_node_in_another_unit_than_its_tag_is_never_good() {
    let cases = [
        ("MW", json!({"name": "MW"}), true),
        ("MW", json!({"name": "kW"}), false),
        ("°C", json!({"name": "", "id": 4_604_232}), false),
        ("°C", json!({"name": "Grad", "id": 4_408_652}), true),
        ("A", json!({"name": "apples"}), true),
        ("Mvar", json!({"name": "kvar", "id": 5_062_994}), false),
        ("A", json!(null), true),
        ("", json!({"name": "kW"}), true),
    ];
    let nodes: Vec<_> = (0..)
        .zip(&cases)
        .map(|(index, (_, unit, _)): (u32, _)| {
            let mut node = node(&format!("N{index}"), "Double", &json!(61.5));
            node["unit"] = unit.clone();
            node
        })
        .collect();
    let Some(mut peer) = peer::start(&json!({"nodes": nodes})) else { return };
    let of = |index: u32, unit: &str, address: Json| {
        let mut spec = tag(index, ValueKind::F64, &format!("N{}", index % 100));
        spec.address.as_object_mut().unwrap().extend(address.as_object().unwrap().clone());
        TagSpec { unit: unit.into(), ..spec }
    };
    let mut tags: Vec<_> =
        (0..).zip(&cases).map(|(index, (unit, ..))| of(index, unit, json!({}))).collect();
    // A tag that scales has a unit of its own.
    tags.push(of(101, "MW", json!({"scale": 0.001})));
    let running = start(peer.port, &json!({}), tags);
    running.wait_for(101, Value::F64(61.5 * 0.001));
    for (index, (unit, stated, is_good)) in (0..).zip(&cases) {
        match is_good {
            true => running.wait_for(index, Value::F64(61.5)),
            false => running.wait_for_bad(index, Reason::Configuration),
        }
        let has_good = running.samples(index).iter().any(|sample| sample.quality.is_good());
        assert_eq!(has_good, *is_good, "{unit} {stated}");
    }
    // A new value is no better.
    peer.command(&json!({"set": node("N1", "Double", &json!(62.5))}));
    peer.command(&json!({"set": node("N0", "Double", &json!(62.5))}));
    running.wait_for(0, Value::F64(62.5));
    running.wait_for_bad(1, Reason::Configuration);
    assert!(running.samples(1).iter().all(|sample| !sample.quality.is_good()));
}
