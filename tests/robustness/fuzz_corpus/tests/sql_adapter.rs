//! Fuzzing of the SQL adapter: any bytes of a database are samples of known tags, of their kinds,
//! finite and with representable times, or a named fault.

use std::time::UNIX_EPOCH;

use busbar_plugin_sdk::testing::{Recorder, tag_spec};
use busbar_plugin_sdk::{Sample, SampleFlags, TagSpec, Value, ValueKind};
use serde_json::json;
use sql_adapter::Settings;
use sql_adapter::probe::{CellInput, answer, notify, watch};

const MAX_COLUMNS: usize = 8;
const MAX_ROWS: usize = 64;
const KINDS: [ValueKind; 5] =
    [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint, ValueKind::Text];
const NAMES: [&str; 8] = ["key", "value", "quality", "time", "a", "b", "a", ""];
/// Type numbers of PostgreSQL: bool, int8, int2, int4, text, oid, float4, float8, numeric,
/// timestamptz, timestamp, json, unknown, and none.
const OIDS: [u32; 14] = [16, 20, 21, 23, 25, 26, 700, 701, 1700, 1184, 1114, 114, 705, 1];

/// Runs one input. Its first byte selects the form of the rest: a payload, rows of one of both
/// databases, or messages of a server.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    let is_keyed = kind & 4 == 0;
    match kind & 3 {
        0 => {
            let Ok(payload) = std::str::from_utf8(rest) else { return false };
            let (tags, recorder) = (tags(true), Recorder::new());
            let taken = notify(settings(true), &tags, payload, recorder.sink());
            assert_eq!(taken, Ok(()));
            let samples: Vec<_> = recorder.recording().samples.into();
            check(&samples, &tags);
            !samples.is_empty()
        }
        1 => read(true, is_keyed, rest),
        2 => read(false, is_keyed, rest),
        _ => {
            let is_encrypted = kind & 4 == 0;
            let whole = watch([rest], is_encrypted);
            let cut = watch(rest.chunks(1 + usize::from(kind >> 3)), is_encrypted);
            assert_eq!(whole, cut, "however it is cut");
            whole.is_ok()
        }
    }
}

/// Reads columns, then cells row by row: a type, a length, and so many bytes.
fn read(is_postgres: bool, is_keyed: bool, bytes: &[u8]) -> bool {
    let Some((&count, mut rest)) = bytes.split_first() else { return false };
    let count = 1 + usize::from(count) % MAX_COLUMNS;
    let Some((columns, cells)) = rest.split_at_checked(count) else { return false };
    let columns: Vec<_> =
        columns.iter().map(|column| NAMES[usize::from(*column) % NAMES.len()]).collect();
    rest = cells;
    let mut cells = Vec::new();
    while let [of, length, after @ ..] = rest {
        let (value, left) = after.split_at(after.len().min(usize::from(*length)));
        cells.push(given(is_postgres, *of, value));
        rest = left;
    }
    let rows: Vec<_> = cells.chunks(count).take(MAX_ROWS).map(<[_]>::to_vec).collect();
    let tags = tags(is_keyed);
    match answer(settings(is_postgres), &tags, &columns, &rows) {
        Ok(samples) => {
            check(&samples, &tags);
            assert!(samples.iter().map(|sample| sample.tag).eq(0..tags.len() as u32));
            true
        }
        Err(error) => {
            assert!(!error.message().is_empty());
            false
        }
    }
}

fn given(is_postgres: bool, of: u8, value: &[u8]) -> CellInput<'_> {
    if is_postgres {
        return match OIDS.get(usize::from(of)) {
            Some(oid) => CellInput::Postgres(*oid, value),
            None => CellInput::Null,
        };
    }
    let mut number = [0; 8];
    let length = value.len().min(number.len());
    number[..length].copy_from_slice(&value[..length]);
    match of % 4 {
        0 => CellInput::Integer(i64::from_le_bytes(number)),
        1 => CellInput::Real(f64::from_le_bytes(number)),
        2 => std::str::from_utf8(value).map_or(CellInput::Null, CellInput::Text),
        _ => CellInput::Null,
    }
}

fn check(samples: &[Sample], tags: &[TagSpec]) {
    for sample in samples {
        let tag = tags.get(sample.tag as usize).expect("it is of a known tag");
        match &sample.value {
            None => assert!(!sample.quality.is_good()),
            Some(value) => assert_eq!(value.kind(), tag.kind),
        }
        if let Some(Value::F64(value)) = &sample.value {
            assert!(value.is_finite());
        }
        assert!(sample.source_time.is_none_or(|time| time >= UNIX_EPOCH));
        // A time that cannot be used is none; the host doubts the value then.
        if sample.flags.contains(SampleFlags::TIME_UNUSABLE) {
            assert_eq!(sample.source_time, None);
        }
    }
}

/// Returns tags of all kinds, plain and with names of states, of one query.
fn tags(is_keyed: bool) -> Vec<TagSpec> {
    let states = [
        json!({}),
        json!({}),
        json!({ "open": false, "1": true }),
        json!({ "open": "off", "2": "on" }),
        json!({}),
    ];
    let tags = KINDS.into_iter().zip(states).flat_map(|(kind, states)| {
        let mut address = json!({ "query": "q" });
        if is_keyed {
            address["key"] = json!("a");
        } else {
            address["column"] = json!("a");
            address["quality"] = json!("quality");
            address["time"] = json!("time");
        }
        let plain = (kind, address.clone());
        address["states"] = states;
        [plain, (kind, address)]
    });
    (0..).zip(tags).map(|(tag, (kind, address))| tag_spec(tag, "t", kind, address)).collect()
}

fn settings(is_postgres: bool) -> Settings {
    let mut settings =
        json!({ "queries": [{ "name": "q", "sql": "SELECT 1", "poll_seconds": 1 }] });
    if is_postgres {
        settings["postgres"] = json!({ "host": "/run", "database": "d", "user": "u" });
    } else {
        settings["sqlite"] = json!({ "path": "/a.db" });
    }
    serde_json::from_value(settings).expect("these settings are good")
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("sql_adapter", fuzz_one);
}
