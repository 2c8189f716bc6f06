//! Recordings as independent packages read and write them: comtrade reads what our
//! writer writes, comtraderecord writes what we read.

use std::process::{Command, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

use super::*;
use crate::comtrade::{DataType, Revision};

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../..");
/// Start of the recording, 2024-02-29T13:14:15.25Z, seconds.
const START: f64 = 1_709_212_455.25;
/// Number that the peer returns for a missing value in FLOAT32, which it does not know.
const PEERS_MISSING: f64 = -1e35;

/// Runs a script of a peer; `None`, said aloud, where the peer is not there. Where
/// peers are required that is a failure.
fn run(script: &str, import: &str, argument: &Path) -> Option<serde_json::Value> {
    let python = std::env::var_os("BUSBAR_PYTHON")
        .map_or_else(|| Path::new(ROOT).join("target/venv/bin/python"), PathBuf::from);
    let script = Path::new(ROOT).join("tests/end_to_end/peers").join(script);
    let output = Command::new(&python).arg(script).arg(argument).output();
    if let Ok(output) = &output
        && output.status.success()
    {
        return Some(serde_json::from_slice(&output.stdout).unwrap());
    }
    let mut probe = Command::new(&python);
    let is_there = probe.args(["-c", import]).stderr(Stdio::null()).status();
    if is_there.is_ok_and(|status| status.success()) {
        panic!("{}", String::from_utf8_lossy(&output.unwrap().stderr));
    }
    let remedy = format!(
        "'{import}' fails by {}: install tests/end_to_end/peers/requirements.txt and set BUSBAR_PYTHON",
        python.display()
    );
    let required = |name| std::env::var_os(name).is_some();
    assert!(!required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "{remedy}");
    eprintln!("SKIPPED: {remedy}");
    None
}

fn numbers(value: &serde_json::Value) -> Vec<Option<f64>> {
    value.as_array().unwrap().iter().map(serde_json::Value::as_f64).collect()
}

fn seconds(sample: &Sample) -> f64 {
    let nanos = sample.source_time.unwrap().duration_since(UNIX_EPOCH).unwrap().as_nanos();
    nanos as f64 / 1e9
}

/// All that the plugin publishes is what the peer reads.
fn compare(recipe: Recipe, file: &Path) {
    let Some(read) = run("comtrade_read.py", "import comtrade", file) else { return };
    let running = start(file, json!({"times": "original"}), all_tags());
    let samples = running.played();
    assert_eq!(samples.len() as u64, recipe.samples * 20, "{recipe:?}");
    let ahead = if recipe.revision == Revision::Of2013 { 3600.0 } else { 0.0 };
    for (channel, skew) in [(0, 0.0), (1, 125.5e-6)] {
        let ours = of_tag(&samples, channel);
        let (theirs, times) = (numbers(&read["analog"][channel as usize]), numbers(&read["time"]));
        assert_eq!((ours.len(), times.len()), (theirs.len(), theirs.len()));
        for ((ours, theirs), time) in ours.iter().zip(theirs).zip(times) {
            let expected = theirs.filter(|value| *value > PEERS_MISSING);
            let value = ours.value.as_ref().map(|value| match value {
                Value::F64(value) => *value,
                other => panic!("{other:?}"),
            });
            assert_eq!(value, expected, "{recipe:?}, channel {channel}");
            assert_eq!(value.is_some(), ours.quality == Quality::Good);
            let expected = START - ahead + time.unwrap() + skew;
            assert!(
                (seconds(ours) - expected).abs() < 1e-6,
                "{recipe:?}: {} {expected}",
                seconds(ours)
            );
        }
    }
    for channel in 0..18 {
        let ours = of_tag(&samples, channel + 2);
        let ours: Vec<_> = ours.iter().flat_map(|sample| sample.value.clone()).collect();
        let theirs = numbers(&read["status"][channel as usize]);
        let theirs: Vec<_> = theirs.iter().map(|state| Value::Bool(*state == Some(1.0))).collect();
        assert_eq!(ours, theirs, "{recipe:?}, digital channel {channel}");
    }
}

const TYPES: [DataType; 4] =
    [DataType::Ascii, DataType::Binary, DataType::Binary32, DataType::Float32];

#[test]
fn the_peer_reads_the_same_from_all_types_and_revisions() {
    for revision in [Revision::Of1991, Revision::Of1999, Revision::Of2013] {
        for data in TYPES {
            for has_timestamps in [false, true] {
                let recipe = Recipe { has_timestamps, ..Recipe::new(revision, data) };
                let (_folder, cfg) = written(recipe);
                compare(recipe, &cfg);
            }
        }
    }
}

#[test]
fn the_peer_reads_the_same_from_nanoseconds_and_single_files() {
    for data in TYPES {
        let recipe =
            Recipe { has_timestamps: true, is_nano: true, ..Recipe::new(Revision::Of2013, data) };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("fault.cff");
        std::fs::write(&file, recipe.cff()).unwrap();
        compare(recipe, &file);
    }
}

#[test]
fn what_the_other_peer_writes_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let import = "import importlib.util, numpy; importlib.util.find_spec('comtraderecord').origin";
    let Some(written) = run("comtrade_write.py", import, folder.path()) else { return };
    let channel = |tag| tag_spec(tag, "A", ValueKind::F64, json!({"channel": tag + 1}));
    let running = start(&folder.path().join("peer.cfg"), json!({}), vec![channel(0), channel(1)]);
    let samples = running.played();
    assert!(samples.iter().all(|s| s.source_time.unwrap() <= SystemTime::now()));
    for tag in [0, 1] {
        let values = numbers(&written[tag as usize]);
        let ours = of_tag(&samples, tag);
        assert_eq!(ours.len(), values.len());
        for (sample, value) in ours.iter().zip(values) {
            let Some(Value::F64(found)) = sample.value else { panic!("{sample:?}") };
            // It cuts 200,000 steps of the range off, not round.
            let step = if tag == 0 { 1200.0 } else { 200.0 } / 199_000.0;
            assert!((found - value.unwrap()).abs() <= step, "{found} {value:?}");
        }
    }
}
