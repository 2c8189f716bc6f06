//! Trends that are kept across restarts.

use std::path::{Path, PathBuf};

use busbar_plugin_sdk::testing::{Drawing, draw_at};
use serde_json::json;

use super::leak_tests::{DAY, month};
use super::tests::{bindings, good, overlay, verdict};
use super::*;

fn with_file(file: &Path, more: &serde_json::Value) -> Sf6Density {
    let mut settings = json!({ "state_file": file });
    for (name, value) in more.as_object().expect("settings") {
        settings[name] = value.clone();
    }
    overlay(&settings)
}

/// File that an instance left behind after a month of a loss of 5 % a year.
fn kept() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("trends.json");
    month(&mut with_file(&file, &json!({})), 5.0, |_| 20.0);
    (folder, file)
}

/// First drawing of another instance, so many days after the month began.
fn restart(overlay: &mut Sf6Density, days: f64, pressure: f64) -> Drawing {
    let nanos = (days * DAY as f64) as i64;
    draw_at(overlay, Some(bindings()), &[good(pressure), good(20.0)], nanos).expect("it draws")
}

fn is_told(drawing: &Drawing) -> bool {
    verdict(drawing).reason.contains("5.0 %/a lost")
}

#[test]
fn a_trend_goes_on_after_a_restart() {
    let (folder, file) = kept();
    let drawing = restart(&mut with_file(&file, &json!({})), 31.0, 6.97);
    assert!(is_told(&drawing), "{drawing:?}");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
    // Days that nobody saw are days without points.
    let drawing = restart(&mut with_file(&file, &json!({})), 38.0, 6.97);
    assert!(is_told(&drawing), "{drawing:?}");
    // A longer absence leaves no points in the window.
    let mut later = with_file(&file, &json!({}));
    restart(&mut later, 100.0, 6.9);
    let drawing = restart(&mut later, 101.0, 6.9);
    assert_eq!(verdict(&drawing).verdict, Verdict::Normal, "{drawing:?}");
}

#[test]
fn a_trend_of_other_parameters_or_of_the_future_is_not_taken() {
    for (more, days) in [
        (json!({ "trend_days": 29.17 }), 31.0),
        (json!({ "filling": 7.1 }), 31.0),
        (json!({}), 30.0),
        (json!({}), -5.0),
    ] {
        let (_folder, file) = kept();
        let drawing = restart(&mut with_file(&file, &more), days, 6.97);
        assert!(!drawing.verdicts[0].reason.contains("lost"), "{more} {days}: {drawing:?}");
    }
    let (_folder, file) = kept();
    let mut other = bindings();
    other[1].tag_id = "another sensor".into();
    let values = [6.97, 20.0].map(good);
    let mut overlay = with_file(&file, &json!({}));
    let drawing = draw_at(&mut overlay, Some(other), &values, 31 * DAY).expect("it draws");
    assert!(!is_told(&drawing), "{drawing:?}");
}

#[test]
fn edits_of_what_does_not_concern_it_keep_the_trend() {
    let (_folder, file) = kept();
    let more = json!({ "alarm": 6.3, "leak_limit": 0.4, "equipment": ["=Q1-QA1", "=Q9"] });
    assert!(is_told(&restart(&mut with_file(&file, &more), 31.0, 6.97)));
}

#[test]
fn a_damaged_file_is_not_used_and_is_replaced() {
    let (_folder, file) = kept();
    let text = std::fs::read_to_string(&file).expect("a file");
    let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let edited = |path: &str, new: serde_json::Value| {
        let mut value = value.clone();
        *value.pointer_mut(path).expect(path) = new;
        value.to_string()
    };
    let trend = "/trends/=Q1-QA1";
    let first = value.pointer(&format!("{trend}/buckets/0")).expect("a bucket").clone();
    let damaged = [
        text[..text.len() / 2].to_owned(),
        edited("/version", json!(2)),
        edited(&format!("{trend}/buckets/1"), first),
        edited(&format!("{trend}/buckets/0/1"), json!(-1.0)),
        edited(&format!("{trend}/buckets/0/2"), json!(1e9)),
        edited(&format!("{trend}/buckets/0/0"), json!(i64::MAX)),
        edited(&format!("{trend}/buckets/0/0"), json!(i64::MIN + 1)),
        edited(&format!("{trend}/buckets/0/0"), json!(i64::MIN)),
        edited(&format!("{trend}/open/0"), json!(i64::MIN)),
        edited(&format!("{trend}/open/1"), json!([])),
        edited(&format!("{trend}/open/1"), json!(vec![[50.0, 20.0]; 1_000])),
        edited(
            &format!("{trend}/buckets"),
            json!((0..1_000).map(|at| (at, 50.0, 20.0)).collect::<Vec<_>>()),
        ),
    ];
    for damaged in damaged {
        std::fs::write(&file, &damaged).expect("it is written");
        let drawing = restart(&mut with_file(&file, &json!({})), 31.0, 6.97);
        assert!(!is_told(&drawing), "{}", &damaged[..damaged.len().min(200)]);
        let replaced = std::fs::read_to_string(&file).expect("a file");
        assert!(replaced.starts_with("{\"version\":1") && replaced != damaged);
    }
}

#[test]
fn times_at_the_ends_of_the_clock_are_no_trouble() {
    let (_folder, file) = kept();
    for nanos in [i64::MIN, -1, 0, i64::MAX] {
        let mut overlay = with_file(&file, &json!({}));
        let values = [6.97, 20.0].map(good);
        draw_at(&mut overlay, Some(bindings()), &values, nanos).expect("it draws");
    }
}

#[test]
fn a_trial_writes_nothing() {
    let (_folder, file) = kept();
    let before = std::fs::read(&file).expect("a file");
    let mut trial = with_file(&file, &json!({}));
    trial.configure(bindings()).expect("it is configured");
    drop(trial);
    assert_eq!(std::fs::read(&file).expect("a file"), before);
    let settings = json!({ "state_file": "trends.json" });
    let settings = serde_json::from_value(super::tests::settings(&settings)).expect("settings");
    let fault = Sf6Density::create(settings, busbar_plugin_sdk::testing::host());
    assert!(fault.is_err_and(|fault| fault.to_string().contains("no absolute path")));
}
