//! The plugin end to end, through the SDK's sink, with files on disk.

mod exported;
mod hostile;
mod matrix;
mod peer;
mod playing;
mod recordings;

use std::path::{Path, PathBuf};
use std::time::Duration;

use busbar_plugin_sdk::testing::{Recorder, Recording, host, tag_spec};
use busbar_plugin_sdk::{
    LinkState, Plugin, Quality, Reason, Sample, TagSpec, Telemetry, Text, Value, ValueKind,
};
use serde_json::json;
use tempfile::TempDir;

use crate::comtrade::writer::Recipe;
use crate::{Replay, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(30);

/// A running plugin, and what it published.
struct Running {
    _plugin: Replay,
    recorder: Recorder,
}

/// Starts a plugin; `settings` are added to quick ones.
fn start(file: &Path, settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
    let mut plugin = create(file, settings);
    let recorder = Recorder::new();
    plugin.start(tags, recorder.sink()).unwrap();
    Running { _plugin: plugin, recorder }
}

fn create(file: &Path, settings: serde_json::Value) -> Replay {
    let mut all =
        json!({"file": file, "speed": "as_fast_as_possible", "max_updates_per_second": 0});
    let (Some(all_fields), Some(fields)) = (all.as_object_mut(), settings.as_object()) else {
        panic!("settings are an object");
    };
    all_fields.extend(fields.clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    Replay::create(settings, host()).unwrap()
}

impl Running {
    /// Waits for a link report.
    #[track_caller]
    fn wait_for_link(&self, state: LinkState, message: &str) {
        let said = |seen: &Recording| {
            seen.links.iter().any(|(found, said)| *found == state && said.contains(message))
        };
        let links = || self.recorder.recording().links;
        assert!(self.recorder.wait_until(PATIENCE, said), "{state:?} {message}: {:?}", links());
    }

    /// Waits for the end, and returns what each tag was.
    #[track_caller]
    fn played(&self) -> Vec<Sample> {
        self.wait_for_link(LinkState::Down, "the recording has ended");
        let is_over = |sample: &Sample| sample.quality == Quality::Bad(Reason::Communication);
        let all_over = |seen: &Recording| seen.samples.back().is_some_and(is_over);
        assert!(self.recorder.wait_until(PATIENCE, all_over));
        let samples = self.recorder.recording().samples;
        let is_before = |sample: &&Sample| sample.quality != Quality::Bad(Reason::NotConnected);
        samples.iter().filter(is_before).take_while(|sample| !is_over(sample)).cloned().collect()
    }
}

/// A folder with a recording; the path of its configuration.
fn written(recipe: Recipe) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let cfg = folder.path().join("fault.cfg");
    std::fs::write(&cfg, recipe.cfg()).unwrap();
    std::fs::write(folder.path().join("fault.dat"), recipe.dat()).unwrap();
    (folder, cfg)
}

/// IA, UA, and D1 to D18, in this order from tag 0 on.
fn all_tags() -> Vec<TagSpec> {
    let channel = |tag: u32, id: String, kind| tag_spec(tag, &id, kind, json!({"channel": id}));
    let analogs = ["IA", "UA"].map(|id| (id.to_owned(), ValueKind::F64));
    let digitals = (1..=18).map(|number| (format!("D{number}"), ValueKind::Bool));
    let all = analogs.into_iter().chain(digitals);
    (0..).zip(all).map(|(tag, (id, kind))| channel(tag, id, kind)).collect()
}

fn of_tag(samples: &[Sample], tag: u32) -> Vec<Sample> {
    samples.iter().filter(|sample| sample.tag == tag).cloned().collect()
}
