//! Files that are missing, wrong, or made to do harm.

use busbar_plugin_sdk::Error;

use super::*;
use crate::comtrade::{DataType, Revision};
use crate::probe::{Bytes, play};

/// Files that are corrupted, by kind.
const CORRUPTED: u64 = 1500;
/// Samples that no recording here has.
const MAX_SAMPLES: usize = 200_000;

#[test]
fn what_cannot_be_opened_is_said_and_tried_again() {
    let (folder, cfg) = written(Recipe::new(Revision::Of1999, DataType::Binary));
    let dat = folder.path().join("fault.dat");
    let data = std::fs::read(&dat).unwrap();
    std::fs::remove_file(&dat).unwrap();
    let running = start(&cfg, json!({}), all_tags());
    running.wait_for_link(LinkState::Down, "fault.dat': there is no such file: is the path right?");
    let bad = Sample::bad(0, Reason::Communication);
    assert!(running.recorder.wait_until(PATIENCE, |seen| seen.latest(0).as_ref() == Some(&bad)));
    std::fs::write(&dat, data).unwrap();
    running.wait_for_link(LinkState::Up, "REPLAY");
    running.wait_for_link(LinkState::Down, "the recording has ended");
}

#[test]
fn every_fault_names_its_file_and_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let recipe = Recipe::new(Revision::Of1999, DataType::Ascii);
    std::fs::write(path("bad.cfg"), recipe.cfg().replace("0.5", "half")).unwrap();
    std::fs::write(path("bad.dat"), recipe.dat()).unwrap();
    std::fs::write(
        path("bad.cff"),
        "--- file type: CFG ---\na,b,2013\n--- file type: DAT ASCII ---\n",
    )
    .unwrap();
    std::fs::write(path("bad.csv"), "zeit,a\n").unwrap();
    std::fs::create_dir(path("folder.cfg")).unwrap();
    for (name, part) in [
        ("absent.cfg", "absent.cfg': there is no such file"),
        ("folder.cfg", "folder.cfg': it is no file"),
        ("bad.cfg", "line 3: analogue channel 1 ('IA'): multiplier a: 'half' is no number"),
        ("bad.cff", "bad.cff': configuration, line 1: the number of channels is missing"),
        ("bad.csv", "bad.csv': line 1: csv.time: there is no column 'time'"),
    ] {
        let is_csv = name.ends_with("csv");
        let address = if is_csv { json!({"column": "a"}) } else { json!({"channel": "IA"}) };
        let tags = vec![tag_spec(0, "IA", ValueKind::F64, address)];
        let running = start(&path(name), json!({}), tags.clone());
        running.wait_for_link(LinkState::Down, part);
        // It may be whole when the scene is shown; a channel's own line is its tag's fault.
        let is_of_tag = name == "bad.cfg";
        let fault = create(&path(name), json!({})).check(&tags).unwrap_err();
        assert!(fault.message().contains(part), "{fault}");
        assert_eq!(fault == Error::settings(fault.message()), is_of_tag, "{name}: {fault:?}");
        assert_eq!(fault == Error::failed(fault.message()), !is_of_tag, "{name}: {fault:?}");
    }
}

#[test]
fn addresses_that_do_not_fit_the_file_are_named() {
    let (_folder, cfg) = written(Recipe::new(Revision::Of1991, DataType::Ascii));
    let check = |kind, address: serde_json::Value, settings| -> Error {
        create(&cfg, settings).check(&[tag_spec(0, "T", kind, address)]).unwrap_err()
    };
    for (kind, address, part) in [
        (
            ValueKind::F64,
            json!({"channel": "IB"}),
            "there is no analogue channel 'IB'; there are 'IA', 'UA'",
        ),
        (ValueKind::F64, json!({"channel": 3}), "there is no analogue channel 3: there are 2"),
        (
            ValueKind::Bool,
            json!({"channel": "IA"}),
            "there is no digital channel 'IA'; there are 'D1'",
        ),
        (
            ValueKind::F64,
            json!({"channel": 1, "values": "primary"}),
            "does not say whether its values are primary or secondary",
        ),
    ] {
        let error = check(kind, address, json!({}));
        assert!(error.message().contains("tag 'T'") && error.message().contains(part), "{error}");
    }
    let tags = vec![tag_spec(0, "T", ValueKind::F64, json!({"channel": "IB"}))];
    let running = start(&cfg, json!({}), tags);
    running.wait_for_link(LinkState::Down, "there is no analogue channel 'IB'");
    let bad = Sample::bad(0, Reason::Configuration);
    assert!(running.recorder.wait_until(PATIENCE, |seen| seen.latest(0).as_ref() == Some(&bad)));
}

#[test]
fn a_recording_that_was_cut_short_is_played_as_far_as_it_goes() {
    for data in [DataType::Ascii, DataType::Binary, DataType::Float32] {
        let recipe = Recipe::new(Revision::Of1999, data);
        let (folder, cfg) = written(recipe);
        let mut dat = recipe.dat();
        dat.truncate(dat.len() / 2);
        std::fs::write(folder.path().join("fault.dat"), &dat).unwrap();
        let samples = start(&cfg, json!({}), all_tags()).played();
        let count = of_tag(&samples, 0).len();
        assert!((400..=600).contains(&count), "{data:?}: {count}");
    }
}

/// Tags of all kinds that fit the recipes.
fn some_tags() -> Vec<TagSpec> {
    let mut tags = all_tags();
    tags.truncate(4);
    tags.push(tag_spec(4, "Q", ValueKind::DoublePoint, json!({"off": 3, "on": 4})));
    tags.push(tag_spec(5, "N", ValueKind::I64, json!({"channel": 1})));
    tags
}

/// Plays corrupted bytes: samples are of known tags, and numbers are finite.
fn survives(tags: &[TagSpec], bytes: Bytes, csv: serde_json::Value) -> bool {
    let settings =
        json!({"file": "/a.csv", "format": "comtrade", "max_updates_per_second": 0, "csv": csv});
    let mut settings = settings;
    if let Bytes::Csv(_) = bytes {
        settings["format"] = json!("csv");
    }
    let mut count = 0;
    let played = play(serde_json::from_value(settings).unwrap(), tags, bytes, |batch| {
        count += batch.len();
        for sample in batch {
            assert!((sample.tag as usize) < tags.len());
            if let Some(Value::F64(value)) = sample.value {
                assert!(value.is_finite());
            } else if sample.value.is_none() {
                assert!(!sample.quality.is_good());
            }
        }
    });
    assert!(count <= MAX_SAMPLES, "{count} samples");
    played.is_ok()
}

/// Changes some bytes, cuts, repeats, or puts numbers in that are hard to bear.
fn corrupt(bytes: &[u8], random: &mut fastrand::Rng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..random.usize(1..4) {
        let at = random.usize(..=bytes.len());
        match random.u8(..6) {
            0 => bytes.truncate(at),
            1 => {
                let hard = [
                    "99999999999",
                    "-1",
                    "1e308",
                    "NaN",
                    ",",
                    "\n",
                    "\"",
                    "0",
                    "--- file type:",
                    "4294967295",
                ];
                let text = hard[random.usize(..hard.len())];
                bytes.splice(at..at, text.bytes());
            }
            2 => {
                let end = (at + random.usize(..40)).min(bytes.len());
                bytes.drain(at..end);
            }
            3 => {
                let end = (at + random.usize(..40)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            _ => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = random.u8(..);
                }
            }
        }
    }
    bytes
}

#[test]
fn spoiled_recordings_neither_panic_nor_lie() {
    let mut random = fastrand::Rng::with_seed(7);
    let tags = some_tags();
    let (mut played, mut refused) = (0, 0);
    let kinds = [DataType::Ascii, DataType::Binary, DataType::Binary32, DataType::Float32];
    for number in 0..CORRUPTED {
        let revision = [Revision::Of1991, Revision::Of1999, Revision::Of2013][random.usize(..3)];
        let data = kinds[random.usize(..4)];
        let has_timestamps = random.bool();
        let recipe = Recipe { samples: 40, has_timestamps, ..Recipe::new(revision, data) };
        let bytes = match number % 3 {
            0 => Bytes::Comtrade(corrupt(recipe.cfg().as_bytes(), &mut random), recipe.dat()),
            1 => Bytes::Comtrade(recipe.cfg().into_bytes(), corrupt(&recipe.dat(), &mut random)),
            _ => Bytes::Cff(corrupt(&recipe.cff(), &mut random)),
        };
        if survives(&tags, bytes, json!({})) { played += 1 } else { refused += 1 }
    }
    // Some must get through and some must not, or nothing was tested.
    assert!(
        played > CORRUPTED / 4 && refused > CORRUPTED / 20,
        "{played} played, {refused} refused"
    );
}

#[test]
fn spoiled_tables_neither_panic_nor_lie() {
    let mut random = fastrand::Rng::with_seed(11);
    let wide = "time,a,b,q\n0,1.5,true,good\n0.5,,false,bad\n1,\"-2\",1,192\n1.5,9e9,0,uncertain\n";
    let long = "time,name,value\n0,a,1\n0,b,true\n1,a,\n2,\"b\",0\n";
    let tag = |tag, kind, key: &str, name: &str| tag_spec(tag, name, kind, json!({key: name}));
    let (mut played, mut refused) = (0, 0);
    for number in 0..CORRUPTED {
        let is_long = number % 2 == 0;
        let (text, key) = if is_long { (long, "name") } else { (wide, "column") };
        let tags = [tag(0, ValueKind::F64, key, "a"), tag(1, ValueKind::Bool, key, "b")];
        let mut csv =
            json!({"time_format": "seconds", "form": if is_long { "long" } else { "wide" }});
        if !is_long {
            csv["quality"] = json!("q");
        }
        let bytes = Bytes::Csv(corrupt(text.as_bytes(), &mut random));
        if survives(&tags, bytes, csv) { played += 1 } else { refused += 1 }
    }
    assert!(
        played > CORRUPTED / 4 && refused > CORRUPTED / 20,
        "{played} played, {refused} refused"
    );
}
