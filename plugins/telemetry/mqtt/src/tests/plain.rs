//! Plain topics: payloads, retained messages, availability, filters.

use super::*;

const TEXT_OR_JSON: u64 = 1_700_000_000_250;

fn text(text: &str) -> Value {
    Value::Text(Text::cut(text))
}

fn plain(number: u32, kind: ValueKind, topic: &str) -> TagSpec {
    tag(number, kind, json!({ "topic": topic }))
}

#[test]
fn texts_and_json_become_values_of_all_kinds() {
    for version in [3, 5] {
        let Some(broker) = Broker::start() else { return };
        let spec = json!({ "version": version });
        let Some(mut peer) = Client::publisher(broker.port, &spec) else { return };
        let version = if version == 3 { "3.1.1" } else { "5" };
        let json_address =
            |pointer: &str| json!({"topic": "s/j", "pointer": pointer, "time": "/ts"});
        let words = json!({"open": 1, "closed": 2});
        let tags = vec![
            tag(1, ValueKind::F64, json!({"topic": "s/f", "scale": 0.5, "offset": 1.0})),
            plain(2, ValueKind::I64, "s/i"),
            plain(3, ValueKind::Bool, "s/b"),
            plain(4, ValueKind::DoublePoint, "s/d"),
            tag(5, ValueKind::DoublePoint, json!({"topic": "s/w", "values": words})),
            tag(6, ValueKind::F64, json_address("/p/0")),
            tag(7, ValueKind::I64, json_address("/n")),
            tag(8, ValueKind::Bool, json_address("/b")),
            tag(9, ValueKind::F64, json_address("/text")),
            tag(10, ValueKind::F64, json_address("/none")),
            tag(11, ValueKind::Bool, json_address("/p")),
            plain(12, ValueKind::Text, "s/m"),
            tag(13, ValueKind::Text, json_address("/text")),
            tag(14, ValueKind::Text, json_address("/n")),
            tag(15, ValueKind::Text, json_address("/p/0")),
            tag(16, ValueKind::Text, json_address("/p")),
        ];
        let running = start(broker.port, &json!({ "version": version }), tags);
        for (topic, text) in [
            ("s/f", "-3.5"),
            ("s/i", " 42 "),
            ("s/b", "true"),
            ("s/d", "3"),
            ("s/w", "closed"),
            ("s/m", "Hand ⚡\n"),
        ] {
            peer.publish(topic, text);
        }
        let document = json!({
            "p": [230.5], "n": -7, "b": 1, "text": "1e3", "none": null,
            "ts": "2023-11-14T22:13:20.25Z"
        });
        peer.publish("s/j", &document.to_string());
        let expected = [
            (1, Value::F64(-0.75)),
            (2, Value::I64(42)),
            (3, Value::Bool(true)),
            (4, Value::DoublePoint(DoublePoint::BadState)),
            (5, Value::DoublePoint(DoublePoint::On)),
            (6, Value::F64(230.5)),
            (7, Value::I64(-7)),
            (8, Value::Bool(true)),
            (9, Value::F64(1000.0)),
            (12, text("Hand ⚡")),
            (13, text("1e3")),
            (14, text("-7")),
        ];
        for (tag, value) in expected {
            running.wait_for(tag, value);
            let at = if tag < 6 || tag == 12 { None } else { time(TEXT_OR_JSON) };
            assert_eq!(running.recorder.latest(tag).unwrap().source_time, at, "tag {tag}");
        }
        running.wait_for_bad(10, Reason::Sensor);
        for tag in [11, 15, 16] {
            running.wait_for_bad(tag, Reason::Configuration);
        }
    }
}

#[test]
fn texts_come_again_are_cut_and_go_with_an_empty_payload() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let running = start(broker.port, &json!({}), vec![plain(1, ValueKind::Text, "m")]);
    let count = |value: &Value| {
        let samples = running.samples(1);
        samples.iter().filter(|sample| sample.value.as_ref() == Some(value)).count()
    };
    peer.publish("m", "AUTO");
    running.wait_for(1, text("AUTO"));
    // The same text again is news: its source is alive.
    peer.publish("m", "AUTO");
    peer.publish("m", "");
    running.wait("value of a cleared topic", 1, |sample| {
        sample.quality == Quality::Uncertain(Reason::Configuration)
    });
    assert!(count(&text("AUTO")) >= 2);
    peer.publish("m", &"é".repeat(128));
    let cut = text(&format!("{}…", "é".repeat(126)));
    running.wait("cut text", 1, |sample| {
        sample.value.as_ref() == Some(&cut)
            && sample.quality == Quality::Uncertain(Reason::Configuration)
    });
    peer.publish("m", &"é".repeat(127));
    running.wait_for(1, text(&"é".repeat(127)));
}

#[test]
fn quality_comes_from_the_payload() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let address = json!({"topic": "q", "pointer": "/v", "quality": "/q", "time": "/t"});
    let settings = json!({"qualities": {"OK": "good", "held": "uncertain"}});
    let running = start(broker.port, &settings, vec![tag(1, ValueKind::I64, address)]);
    let cases = [
        (json!("good"), Quality::Good),
        (json!("BAD"), Quality::Bad(Reason::Unknown)),
        (json!("ok"), Quality::Good),
        (json!("Held"), Quality::Uncertain(Reason::Unknown)),
        (json!(192), Quality::Good),
        (json!(64), Quality::Uncertain(Reason::Unknown)),
        (json!(0), Quality::Bad(Reason::Unknown)),
        (json!(500), Quality::Bad(Reason::Communication)),
        (json!("no such word"), Quality::Uncertain(Reason::Configuration)),
        (json!(null), Quality::Uncertain(Reason::Configuration)),
    ];
    for (number, (quality, expected)) in cases.into_iter().enumerate() {
        let payload = json!({"v": number, "q": quality, "t": TEXT_OR_JSON + number as u64});
        peer.publish("q", &payload.to_string());
        running.wait("quality", 1, |sample| sample.value == Some(Value::I64(number as i64)));
        let sample = running.recorder.latest(1).unwrap();
        assert_eq!(sample.quality, expected, "{quality}");
        assert_eq!(sample.source_time, time(TEXT_OR_JSON + number as u64));
    }
}

#[test]
fn a_retained_value_without_a_time_is_not_taken_for_live() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    peer.retain("r/text", "1.5");
    peer.retain("r/timed", &json!({"v": 2.5, "t": TEXT_OR_JSON}).to_string());
    let tags = || {
        vec![
            plain(1, ValueKind::F64, "r/text"),
            tag(2, ValueKind::F64, json!({"topic": "r/timed", "pointer": "/v", "time": "/t"})),
        ]
    };
    let uncertain = start(broker.port, &json!({}), tags());
    // The host makes it uncertain (source time).
    uncertain.wait("flag", 1, |sample| sample.flags == SampleFlags::TIME_UNUSABLE);
    assert_eq!(uncertain.recorder.latest(1).unwrap().value, Some(Value::F64(1.5)));
    // Its source says how old it is, so the host decides.
    uncertain.wait_for(2, Value::F64(2.5));
    let stored = uncertain.recorder.latest(2).unwrap();
    assert_eq!((stored.source_time, stored.flags), (time(TEXT_OR_JSON), SampleFlags::BUFFERED));
    start(broker.port, &json!({"retained": "good"}), tags()).wait_for(1, Value::F64(1.5));
    let ignoring = start(broker.port, &json!({"retained": "ignore"}), tags());
    ignoring.wait_for(2, Value::F64(2.5));
    assert_eq!(ignoring.recorder.latest(1).unwrap().quality, Quality::Bad(Reason::NotConnected));

    peer.retain("r/text", "2.5");
    for running in [&uncertain, &ignoring] {
        running.wait_for(1, Value::F64(2.5));
        assert_eq!(running.recorder.latest(1).unwrap().flags, SampleFlags::LIVE);
    }
}

#[test]
fn a_time_that_cannot_be_used_makes_its_value_doubtful() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let address = json!({"topic": "t", "pointer": "/v", "time": "/ts"});
    let running = start(broker.port, &json!({}), vec![tag(1, ValueKind::I64, address)]);
    let zoneless = json!("2023-11-14T22:13:20");
    let unusable = [
        json!("yesterday"),
        zoneless,
        json!(""),
        json!("1700000000123"),
        json!(null),
        json!(1e300),
        json!(-1),
        json!(1_700_000_000_123_456_u64),
        json!(true),
        json!([1]),
    ];
    let cases = unusable.iter().map(|ts| json!({ "ts": ts })).chain([json!({})]);
    for (number, case) in (0..).zip(cases) {
        let mut payload = case.clone();
        payload["v"] = json!(number);
        peer.publish("t", &payload.to_string());
        running.wait("value", 1, |sample| sample.value == Some(Value::I64(number)));
        let sample = running.recorder.latest(1).unwrap();
        let found = (sample.source_time, sample.flags);
        assert_eq!(found, (None, SampleFlags::TIME_UNUSABLE), "{case}");
    }
    // One of another clock is handed on as it is, for the host to judge, older ones, too.
    for (number, ts) in [(100, TEXT_OR_JSON), (101, TEXT_OR_JSON - 5000), (102, 4_000_000_000_000)]
    {
        peer.publish("t", &json!({"v": number, "ts": ts}).to_string());
        running.wait("value", 1, |sample| sample.value == Some(Value::I64(number)));
        let sample = running.recorder.latest(1).unwrap();
        assert_eq!((sample.source_time, sample.flags), (time(ts), SampleFlags::LIVE));
    }
}

#[test]
fn what_cannot_be_read_makes_the_value_before_uncertain() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let json_address = json!({"topic": "j", "pointer": "/v"});
    let tags = vec![plain(1, ValueKind::I64, "t"), tag(2, ValueKind::I64, json_address)];
    let running = start(broker.port, &json!({"max_payload_bytes": 1024}), tags);
    // Nothing was shown that could be doubtful.
    peer.publish("t", "one");
    running.wait_for_bad(1, Reason::Configuration);
    let long = format!("5{}", " ".repeat(1024));
    let unusable = [
        ("t", "NaN"),
        ("t", "inf"),
        ("t", "1.5"),
        ("t", ""),
        ("t", "one"),
        ("t", &*long),
        ("j", ""),
        ("j", "{}"),
        ("j", "{\"v\":1"),
        ("j", "{\"w\":1}"),
        ("j", "{\"v\":{}}"),
        ("j", "{\"v\":\"NaN\"}"),
        ("j", &long),
    ];
    for (number, (topic, text)) in (0..).zip(unusable) {
        let tag = if topic == "t" { 1 } else { 2 };
        let usable = if tag == 1 { number.to_string() } else { json!({"v": number}).to_string() };
        peer.publish(topic, &usable);
        running.wait_for(tag, Value::I64(number));
        peer.publish(topic, text);
        running.wait_for_quality(tag, Quality::Uncertain(Reason::Configuration));
        assert_eq!(running.recorder.latest(tag).unwrap().value, None, "the one before stays");
    }
    // As long as is taken.
    peer.publish("t", &long[..1024]);
    running.wait_for(1, Value::I64(5));
}

#[test]
fn an_availability_that_cannot_be_read_is_none() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let availability = json!([{"topic": "s/status", "covers": "s/#"}]);
    let settings = json!({"availability": availability, "max_payload_bytes": 1024});
    let running = start(broker.port, &settings, vec![plain(1, ValueKind::I64, "s/a")]);
    for (number, state) in (0..).zip(["offline", "", &*"x".repeat(1025)]) {
        peer.publish("s/status", "online");
        peer.publish("s/a", &number.to_string());
        running.wait_for(1, Value::I64(number));
        peer.publish("s/status", state);
        running.wait_for_bad(1, Reason::Communication);
    }
}

#[test]
fn one_filter_feeds_many_tags() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let topic = |tag: u32| format!("site{}/bay{}/p", tag % 7, tag);
    let tags = (1..=300).map(|tag| plain(tag, ValueKind::I64, &topic(tag))).collect();
    let filters = json!({"subscriptions": ["+/+/p", "site1/#"], "qos": 0});
    let running = start(broker.port, &filters, tags);
    for tag in 1..=300 {
        peer.publish(&topic(tag), &tag.to_string());
    }
    for tag in 1..=300 {
        running.wait_for(tag, Value::I64(tag.into()));
    }
}

#[test]
fn a_last_will_makes_the_tags_of_its_source_bad() {
    let Some(broker) = Broker::start() else { return };
    let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
    let will = json!({"will": {"topic": "site7/status", "payload": "{\"state\": \"offline\"}"}});
    let Some(mut gateway) = Client::publisher(broker.port, &will) else { return };
    let settings = json!({"availability": [
        {"topic": "site7/status", "covers": "site7/#", "pointer": "/state"}
    ]});
    let tags = vec![plain(1, ValueKind::I64, "site7/a"), plain(2, ValueKind::I64, "site8/a")];
    let running = start(broker.port, &settings, tags);
    gateway.retain("site7/status", "{\"state\": \"online\"}");
    gateway.publish("site7/a", "1");
    peer.publish("site8/a", "1");
    running.wait_for(1, Value::I64(1));
    running.wait_for(2, Value::I64(1));

    gateway.command(&json!({"break": true}));
    running.wait_for_bad(1, Reason::Communication);
    // What still comes from there is no better, whoever sends it.
    peer.publish("site7/a", "2");
    running.wait("value", 1, |sample| sample.value == Some(Value::I64(2)));
    let of_gone = running.recorder.latest(1).unwrap().quality;
    assert_eq!(of_gone, Quality::Bad(Reason::Communication));
    assert!(running.recorder.latest(2).unwrap().quality.is_good());

    peer.retain("site7/status", "{\"state\": \"online\"}");
    peer.publish("site7/a", "3");
    running.wait_for(1, Value::I64(3));
}

#[test]
fn a_message_that_is_too_long_costs_nothing_else() {
    for (version, qos) in [("3.1.1", 0), ("3.1.1", 1), ("3.1.1", 2), ("5", 1)] {
        let Some(broker) = Broker::start() else { return };
        let Some(mut peer) = Client::publisher(broker.port, &json!({})) else { return };
        let settings = json!({"version": version, "qos": 2, "max_payload_bytes": 1024});
        let running = start(broker.port, &settings, vec![plain(1, ValueKind::I64, "t")]);
        // More than the broker lets be on its way without a confirmation (20).
        for number in 1..=25 {
            let long = json!({"topic": "t", "payload": "x".repeat(300_000), "qos": qos});
            peer.command(&json!({ "publish": long }));
            let short = json!({"topic": "t", "payload": number.to_string(), "qos": qos});
            peer.command(&json!({ "publish": short }));
        }
        running.wait_for(1, Value::I64(25));
        let links = running.recorder.recording().links;
        assert!(links.iter().all(|(state, _)| *state != LinkState::Down), "{links:?}");
    }
}
