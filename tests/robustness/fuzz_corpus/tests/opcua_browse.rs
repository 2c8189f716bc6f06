//! Fuzzing of OPC UA browsing: any address space gives a point list without a fault, whose
//! addresses the plugin takes, or a named reason. No panic leaves the plugin.

use busbar_plugin_sdk::testing::{host, tag_spec};
use busbar_plugin_sdk::{Plugin, Telemetry};
use busbar_point_import::PointList;
use opcua::probe::browse;
use opcua::{OpcUa, Settings};
use serde_json::json;

fn settings() -> Settings {
    let settings = json!({
        "url": "opc.tcp://127.0.0.1:1/test", "connect_timeout_seconds": 0.5,
        "silence_seconds": 0.5,
    });
    serde_json::from_value(settings).expect("these settings are good")
}

/// Runs one input. Its first two bytes are the number of those after them that arrive during the
/// request for endpoints.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((length, rest)) = bytes.split_first_chunk() else { return false };
    let length = usize::from(u16::from_le_bytes(*length)).min(rest.len());
    let (first, second) = rest.split_at(length);
    let list = match browse(settings(), [first, second]) {
        Ok(list) => list,
        Err(why) => {
            assert!(!why.is_empty() && why.len() < 4096, "{why}");
            return false;
        }
    };
    let parsed = PointList::parse(&list);
    let is_empty = list.iter().filter(|byte| **byte == b'\n').count() == 1;
    assert!(is_empty || parsed.faults.is_empty(), "{:?}", parsed.faults);
    let tags: Vec<_> = (0..)
        .zip(&parsed.points)
        .map(|(tag, point)| tag_spec(tag, &point.tag, point.value_type, point.address.clone()))
        .collect();
    let plugin = OpcUa::create(settings(), host()).expect("these settings are good");
    plugin.check(&tags).expect("what was listed can be served");
    !tags.is_empty()
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("opcua_browse", fuzz_one);
}
