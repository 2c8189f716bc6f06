//! Fuzzing of the IEC 61850 client: any MMS bytes of a server are answers, reports or a named
//! fault. Values are of their tags' kinds, and only attributes of the named report control block
//! are ever written.

use busbar_plugin_sdk::testing::{Recorder, tag_spec};
use busbar_plugin_sdk::{Sample, TagSpec, ValueKind};
use iec61850::probe::{AssociatedProbe, ClientProbe};
use serde_json::json;

/// Tags of each kind.
const TAGS: [(ValueKind, &str, &str); 4] = [
    (ValueKind::F64, "MMXU1.TotW", "MX"),
    (ValueKind::DoublePoint, "XCBR1.Pos", "ST"),
    (ValueKind::Bool, "GGIO1.Ind1", "ST"),
    (ValueKind::I64, "GGIO1.IntIn1", "ST"),
];
const BLOCK: &str = "IED1LD0/LLN0$BR$brcbA01";
const ATTRIBUTES: [&str; 6] = ["OptFlds", "TrgOps", "IntgPd", "EntryID", "RptEna", "GI"];
/// Number of bytes of a message's length.
const LENGTH_BYTES: usize = 2;

/// Runs one input. An odd first byte means messages, each behind its length, to a client with an
/// association. An even one means the bytes of a connection, in pieces of that many.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&form, rest)) = bytes.split_first() else { return false };
    let recorder = Recorder::new();
    let settings = json!({
        "host": "127.0.0.1", "reports": [{"rcb": BLOCK, "integrity_seconds": 5}]
    });
    let settings = serde_json::from_value(settings).expect("these settings are good");
    let client = ClientProbe::new(settings, &tags(), recorder.sink());
    let client = client.expect("the addresses are good");
    let is_taken =
        if form % 2 == 1 { take_messages(client, rest) } else { take_bytes(client, form, rest) };
    recorder.recording().samples.iter().for_each(check_sample);
    is_taken
}

fn take_messages(client: ClientProbe, mut rest: &[u8]) -> bool {
    let mut probe = AssociatedProbe::new(client).expect("both ends speak the protocol");
    let mut is_taken = true;
    while let Some((length, after)) = rest.split_first_chunk::<LENGTH_BYTES>() {
        let length = usize::from(u16::from_be_bytes(*length)).min(after.len());
        let (message, after) = after.split_at(length);
        is_taken = probe.receive(message).is_ok();
        rest = if is_taken { after } else { &[] };
    }
    for name in probe.writes() {
        let attribute = name.strip_prefix(BLOCK).and_then(|rest| rest.strip_prefix('$'));
        assert!(attribute.is_some_and(|name| ATTRIBUTES.contains(&name)), "it writes {name}");
    }
    is_taken
}

fn take_bytes(mut client: ClientProbe, piece: u8, rest: &[u8]) -> bool {
    client.take_output();
    for piece in rest.chunks(usize::from(piece).max(1)) {
        if client.receive(piece).is_err() {
            return false;
        }
        client.take_output();
    }
    true
}

fn tags() -> Vec<TagSpec> {
    let tag = |(index, (kind, reference, fc)): (u32, &(ValueKind, &str, &str))| {
        let address = json!({"reference": format!("IED1LD0/{reference}"), "fc": fc});
        tag_spec(index, reference, *kind, address)
    };
    (0..).zip(&TAGS).map(tag).collect()
}

/// Checks that a value is of its tag's kind.
fn check_sample(sample: &Sample) {
    let Some(value) = &sample.value else { return assert!(!sample.quality.is_good()) };
    assert_eq!(value.kind(), TAGS[sample.tag as usize].0);
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("iec61850", fuzz_one);
}
