//! Fuzzing of recordings: any bytes are samples or a named fault. No panic occurs, no value is
//! infinite or NaN, and no sample without a value is good.

use busbar_plugin_sdk::testing::tag_spec;
use busbar_plugin_sdk::{Quality, TagSpec, Value, ValueKind};
use replay::Settings;
use replay::probe::{Bytes, play};
use serde_json::json;

/// Returns a configuration that fits data of its type, with rates or without.
fn cfg(data: u8) -> String {
    let kind = ["ASCII", "BINARY", "BINARY32", "FLOAT32"][usize::from(data & 3)];
    let rates = if data & 4 == 0 { "0\n0,9" } else { "2\n4800,3\n1200,9" };
    let (year, more, named) = match data >> 3 & 3 {
        0 => ("", "", ""),
        1 => (",1999", ",600,5,P", ",,"),
        _ => (",2013", ",600,5,P", ",,"),
    };
    format!(
        "a,b{year}\n4,2A,2D\n1,IA,A,,A,0.5,0,0,-32767,32767{more}\n2,UA,A,,V,1,0,5,0,99998{more}\n\
         1,D1{named},0\n2,D2{named},0\n50\n{rates}\n01/02/2024,10:00:00.0\n01/02/2024,10:00:00.0\n\
         {kind}\n1\n0,0\n0,0\n"
    )
}

fn comtrade_tags() -> [TagSpec; 4] {
    [
        tag_spec(0, "I", ValueKind::F64, json!({ "channel": 1 })),
        tag_spec(1, "U", ValueKind::I64, json!({ "channel": 1 })),
        tag_spec(2, "D", ValueKind::Bool, json!({ "channel": 1 })),
        tag_spec(3, "Q", ValueKind::DoublePoint, json!({ "off": 1, "on": 1 })),
    ]
}

/// Runs one input. Its first byte selects the form of the rest, and its reader.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    let form = if kind & 4 == 0 { "wide" } else { "long" };
    let time = ["rfc3339", "unix_seconds", "unix_millis", "seconds"][usize::from(kind >> 3 & 3)];
    let updates = if kind & 0x40 == 0 { 0 } else { 20 };
    let settings = json!({
        "file": "/a.csv",
        "format": if kind & 3 == 3 { "csv" } else { "comtrade" },
        "max_updates_per_second": updates,
        "csv": { "form": form, "time": 1, "name": 2, "value": 3, "time_format": time }
    });
    let settings: Settings = serde_json::from_value(settings).expect("these settings are good");
    let (bytes, tags) = match kind & 3 {
        0 => (Bytes::Comtrade(rest.to_vec(), rest.to_vec()), comtrade_tags().to_vec()),
        1 => {
            (Bytes::Comtrade(cfg(kind >> 2).into_bytes(), rest.to_vec()), comtrade_tags().to_vec())
        }
        2 => (Bytes::Cff(rest.to_vec()), comtrade_tags().to_vec()),
        _ => {
            let address =
                if form == "long" { json!({ "name": "a" }) } else { json!({ "column": 2 }) };
            let kinds = [
                ValueKind::F64,
                ValueKind::I64,
                ValueKind::Bool,
                ValueKind::DoublePoint,
                ValueKind::Text,
            ];
            let tags =
                (0..).zip(kinds).map(|(tag, kind)| tag_spec(tag, "a", kind, address.clone()));
            (Bytes::Csv(rest.to_vec()), tags.collect())
        }
    };
    let played = play(settings, &tags, bytes, |batch| {
        for sample in batch {
            assert!((sample.tag as usize) < tags.len());
            match sample.value {
                Some(Value::F64(value)) => assert!(value.is_finite()),
                Some(_) => {}
                None => assert!(matches!(sample.quality, Quality::Bad(_))),
            }
        }
    });
    played.is_ok()
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("replay", fuzz_one);
}
