//! Fuzzing of the MQTT adapter: any bytes of a broker are samples of known tags, of their kinds and
//! with representable times, or ignored. No panic occurs, and no memory is used beyond a message.

use std::time::UNIX_EPOCH;

use busbar_plugin_sdk::testing::{Recorder, tag_spec};
use busbar_plugin_sdk::{TagSpec, ValueKind};
use mqtt::probe::ClientProbe;
use serde_json::{Value, json};

const KINDS: [ValueKind; 5] =
    [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint, ValueKind::Text];
/// Topics of the edge node and its device, in turn, then plain topics.
const TOPICS: [&str; 8] = [
    "spBv1.0/g/NBIRTH/e",
    "spBv1.0/g/DBIRTH/e/d",
    "spBv1.0/g/NDATA/e",
    "spBv1.0/g/DDATA/e/d",
    "spBv1.0/g/NDEATH/e",
    "spBv1.0/g/DDEATH/e/d",
    "s/json",
    "s/text",
];
/// Bits of the byte before a message.
const RETAINED: u8 = 0x80;
/// Greatest number of messages in one input.
const MAX_MESSAGES: usize = 64;

/// Runs one input. With the lowest bit of its first byte set, the rest are bytes of a broker, of
/// MQTT 5 with the next bit, in pieces of the length in the others. Else it is messages, each with
/// a byte for its topic, two for its length, and its payload.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    let (tags, recorder) = (tags(), Recorder::new());
    let settings = serde_json::from_value(json!({
        "host": "127.0.0.1",
        "max_payload_bytes": 4096,
        "subscriptions": ["s/#"],
        "availability": [{ "topic": "s/text", "covers": "s/json" }],
        "qualities": { "ok": "good" },
        "sparkplug": { "request_rebirth": true },
    }));
    let settings = settings.expect("these settings are good");
    let mut probe =
        ClientProbe::new(settings, &tags, recorder.sink()).expect("the addresses are good");
    if kind & 1 == 1 {
        let went_on = probe.bytes(rest, usize::from(kind >> 2), kind & 2 != 0);
        check(&recorder, &tags);
        return went_on;
    }
    let mut rest = rest;
    for _ in 0..MAX_MESSAGES {
        let [topic, low, high, after @ ..] = rest else { break };
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(after.len());
        let (payload, left) = after.split_at(length);
        let name = TOPICS[usize::from(topic & !RETAINED) % TOPICS.len()];
        probe.message(name, payload, topic & RETAINED != 0);
        rest = left;
    }
    check(&recorder, &tags);
    let samples = recorder.recording().samples;
    samples.iter().any(|sample| sample.value.is_some())
}

/// Checks that samples are of existing tags and of their kinds, and that none without a value is
/// good.
fn check(recorder: &Recorder, tags: &[TagSpec]) {
    for sample in recorder.recording().samples {
        let tag = tags.get(sample.tag as usize).expect("it is of a known tag");
        match sample.value {
            None => assert!(!sample.quality.is_good()),
            Some(value) => assert_eq!(value.kind(), tag.kind),
        }
        assert!(sample.source_time.is_none_or(|time| time >= UNIX_EPOCH));
    }
}

/// Returns tags of all kinds, of the edge node, of its device, and of two topics.
fn tags() -> Vec<TagSpec> {
    let metric = |name: &str| json!({ "group": "g", "edge_node": "e", "metric": name });
    let places: [Value; 4] = [
        metric("a"),
        json!({ "group": "g", "edge_node": "e", "device": "d", "metric": "b" }),
        json!({ "topic": "s/json", "pointer": "/v", "time": "/t", "quality": "/q" }),
        json!({ "topic": "s/text" }),
    ];
    let all = places.iter().flat_map(|place| KINDS.map(|kind| (kind, place)));
    (0..).zip(all).map(|(tag, (kind, place))| tag_spec(tag, "t", kind, place.clone())).collect()
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("mqtt", fuzz_one);
}
