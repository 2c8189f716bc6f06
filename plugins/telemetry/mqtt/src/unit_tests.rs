//! Units that sources state, every pair of the table: a value in another unit than the tag's is
//! never good, by Sparkplug and by plain topics.

use std::time::Instant;

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Quality, Reason, TagSpec, Value, ValueKind};
use serde_json::{Value as Json, json};
use source_units::testing::unit_pairs;
use srad_types::payload::{
    DataType, Message, Metric, Payload, PropertySet, PropertyValue, metric, property_value,
};

use crate::points;
use crate::session::Event;
use crate::settings::Settings;
use crate::subscriber::{Plan, Subscriber};

struct Peer {
    subscriber: Subscriber,
    recorder: Recorder,
    sequence: u64,
}

impl Peer {
    /// Subscribes to tags: unit and address.
    fn new(tags: &[(&str, Json)]) -> Self {
        let spec = |(tag, (unit, address)): (u32, &(&str, Json))| TagSpec {
            unit: (*unit).to_owned(),
            ..tag_spec(tag, "t", ValueKind::F64, address.clone())
        };
        let tags: Vec<_> = (0..).zip(tags).map(spec).collect();
        let raw = json!({"host": "h", "subscriptions": ["u/#"]});
        let config = serde_json::from_value::<Settings>(raw).unwrap().parse().unwrap();
        let plan = Plan::new(points::parse(tags.iter()).unwrap(), &config).unwrap();
        let recorder = Recorder::new();
        let mut subscriber = Subscriber::new(plan, &config, recorder.sink(), host());
        subscriber.note(Event::Connected, Instant::now());
        Self { subscriber, recorder, sequence: 0 }
    }

    fn publish(&mut self, topic: &str, payload: &[u8]) {
        let topic = topic.as_bytes();
        let message = Event::Message { topic, payload, is_retained: false };
        self.subscriber.note(message, Instant::now());
        self.subscriber.flush();
    }

    fn send(&mut self, kind: &str, metrics: Vec<Metric>) {
        let (timestamp, seq) = (Some(1_700_000_000_000), Some(self.sequence));
        self.sequence += 1;
        let payload = Payload { timestamp, metrics, seq, ..Payload::default() }.encode_to_vec();
        self.publish(&format!("spBv1.0/g/{kind}/e"), &payload);
    }

    fn state(&self, tag: usize) -> (Option<Value>, Quality) {
        let sample = self.recorder.latest(tag as u32).unwrap();
        (sample.value, sample.quality)
    }
}

/// Outcome of a value: good, or bad without a value.
fn expected(value: f64, is_good: bool) -> (Option<Value>, Quality) {
    if is_good {
        (Some(Value::F64(value)), Quality::Good)
    } else {
        (None, Quality::Bad(Reason::Configuration))
    }
}

fn metric(name: &str, value: f64, unit: Option<(&str, property_value::Value)>) -> Metric {
    Metric {
        name: Some(name.to_owned()),
        datatype: Some(DataType::Double as u32),
        value: Some(metric::Value::DoubleValue(value)),
        properties: unit.map(|(key, value)| PropertySet {
            keys: vec!["Quality".into(), key.to_owned()],
            values: [property_value::Value::IntValue(192), value]
                .map(|value| PropertyValue { value: Some(value), ..PropertyValue::default() })
                .into(),
        }),
        ..Metric::default()
    }
}

fn text(unit: &str) -> property_value::Value {
    property_value::Value::StringValue(unit.to_owned())
}

fn metric_tag(name: &str) -> Json {
    json!({"group": "g", "edge_node": "e", "metric": name})
}

#[test]
fn every_pair_of_units_is_judged_in_births_and_in_data_without_them() {
    let pairs = unit_pairs();
    let name = |index: usize| format!("m{index}");
    let tags: Vec<_> =
        pairs.iter().enumerate().map(|(i, pair)| (pair.tag, metric_tag(&name(i)))).collect();
    let mut peer = Peer::new(&tags);
    const KEYS: [&str; 4] = ["engUnit", "Engineering Units", "engineering_unit", "Unit"];
    let of = |index: usize, value: f64| {
        let key = KEYS[index % KEYS.len()];
        metric(&name(index), value, Some((key, text(pairs[index].source))))
    };
    peer.send("NBIRTH", (0..pairs.len()).map(|index| of(index, 1.5)).collect());
    for (index, pair) in pairs.iter().enumerate() {
        assert_eq!(peer.state(index), expected(1.5, pair.may_be_good), "{pair:?}");
    }
    // Data seldom repeat properties: the birth's hold on.
    let plain = (0..pairs.len()).map(|index| metric(&name(index), 2.5, None)).collect();
    peer.send("NDATA", plain);
    for (index, pair) in pairs.iter().enumerate() {
        assert_eq!(peer.state(index), expected(2.5, pair.may_be_good), "{pair:?}");
    }
}

#[test]
fn a_unit_counts_until_another_one_is_stated() {
    let mut scaled = metric_tag("m");
    scaled["scale"] = json!(1.0);
    let mut peer = Peer::new(&[("MW", metric_tag("m")), ("", metric_tag("m")), ("MW", scaled)]);
    let states = |peer: &Peer| [0, 1, 2].map(|tag| peer.state(tag).1.is_good());
    peer.send("NBIRTH", vec![metric("m", 1.0, Some(("engUnit", text("kW"))))]);
    // A tag whose samples are scaled, by the host or by its address, has a unit of its own.
    assert_eq!(states(&peer), [false, true, true]);
    peer.send("NDATA", vec![metric("m", 2.0, Some(("engUnit", text("MW"))))]);
    assert_eq!(states(&peer), [true, true, true]);
    peer.send("NDATA", vec![metric("m", 3.0, Some(("engUnit", text("W"))))]);
    assert_eq!(states(&peer), [false, true, true]);
    // A birth without the property takes the statement back.
    peer.sequence = 0;
    peer.send("NBIRTH", vec![metric("m", 4.0, None)]);
    assert_eq!(states(&peer), [true, true, true]);
    let unreadable = property_value::Value::IntValue(7);
    peer.send("NDATA", vec![metric("m", 5.0, Some(("engUnit", unreadable)))]);
    assert_eq!(peer.state(0).1, Quality::Uncertain(Reason::Configuration));
}

#[test]
fn every_pair_of_units_is_judged_at_a_pointer() {
    let pairs = unit_pairs();
    let address = |topic: String| json!({"topic": topic, "pointer": "/v", "unit": "/u"});
    let tags: Vec<_> = pairs
        .iter()
        .enumerate()
        .map(|(index, pair)| (pair.tag, address(format!("u/{index}"))))
        .collect();
    let mut peer = Peer::new(&tags);
    for (index, pair) in pairs.iter().enumerate() {
        peer.publish(
            &format!("u/{index}"),
            json!({"v": 1.5, "u": pair.source}).to_string().as_bytes(),
        );
        assert_eq!(peer.state(index), expected(1.5, pair.may_be_good), "{pair:?}");
    }
}

#[test]
fn a_unit_that_is_promised_and_missing_makes_a_value_uncertain() {
    let address = json!({"topic": "u/1", "pointer": "/v", "unit": "/u"});
    let mut peer = Peer::new(&[("MW", address)]);
    let uncertain = Quality::Uncertain(Reason::Configuration);
    for (document, quality) in [
        (json!({"v": 1.0, "u": "MW"}), Quality::Good),
        (json!({"v": 1.0}), uncertain),
        (json!({"v": 1.0, "u": 5}), uncertain),
        (json!({"v": 1.0, "u": null}), Quality::Good),
        (json!({"v": 1.0, "u": "kW"}), Quality::Bad(Reason::Configuration)),
        // What contradicted does so still.
        (json!({"v": 1.0, "u": 5}), Quality::Bad(Reason::Configuration)),
        (json!({"v": 1.0, "u": "MW"}), Quality::Good),
    ] {
        peer.publish("u/1", document.to_string().as_bytes());
        assert_eq!(peer.state(0).1, quality, "{document}");
    }
}
