//! Fuzzing of the OPC UA client: any bytes of a server are a session or a named fault. No panic
//! leaves the plugin, values are of the tags' own kinds, and no good value follows the end.

use busbar_plugin_sdk::testing::{Recorder, tag_spec};
use busbar_plugin_sdk::{Quality, Reason, ValueKind};
use opcua::probe::converse;
use serde_json::json;

/// Tags of the server that the kept inputs were recorded from, of kinds in turn.
const NODES: [(&str, ValueKind); 5] = [
    ("A", ValueKind::F64),
    ("B", ValueKind::I64),
    ("C", ValueKind::Bool),
    ("D", ValueKind::DoublePoint),
    ("E", ValueKind::F64),
];

/// Runs one input. Its first two bytes are the number of those after them that arrive during the
/// request for endpoints.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((length, rest)) = bytes.split_first_chunk() else { return false };
    let length = usize::from(u16::from_le_bytes(*length)).min(rest.len());
    let (first, second) = rest.split_at(length);
    let settings = json!({
        "url": "opc.tcp://127.0.0.1:1/test", "publishing_seconds": 0.05,
        "connect_timeout_seconds": 0.5, "silence_seconds": 0.5,
    });
    let settings = serde_json::from_value(settings).expect("these settings are good");
    let tags: Vec<_> = (0..)
        .zip(NODES)
        .map(|(tag, (name, kind))| {
            let mut address = json!({ "node": format!("nsu=urn:busbar:test;s={name}") });
            if name == "E" {
                address["index"] = json!(1);
            }
            tag_spec(tag, name, kind, address)
        })
        .collect();
    let recorder = Recorder::new();
    let said = converse(settings, &tags, &recorder.sink(), [first, second])
        .expect("settings and addresses are good");
    assert!(!said.is_empty() && said.len() < 4096, "{said}");
    let samples = recorder.recording().samples;
    let mut has_value = false;
    for sample in &samples {
        let (_, kind) = NODES[sample.tag as usize];
        match &sample.value {
            None => assert!(!sample.quality.is_good(), "{sample:?}"),
            Some(value) => {
                has_value = true;
                assert_eq!(value.kind(), kind, "{sample:?}");
            }
        }
    }
    for tag in 0..NODES.len() as u32 {
        let last = samples.iter().rev().find(|sample| sample.tag == tag);
        let quality = last.map(|sample| sample.quality);
        assert_eq!(quality, Some(Quality::Bad(Reason::Communication)), "tag {tag}: {said}");
    }
    has_value
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("opcua", fuzz_one);
}
