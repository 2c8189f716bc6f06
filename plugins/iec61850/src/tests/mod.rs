//! The plugin end to end, through the SDK's sink, against libiec61850 in a process of its
//! own, an independent implementation.

mod hostile;
mod peer;
#[cfg(target_os = "linux")]
mod proxied;
mod reports;
mod restarts;
mod tls;
mod values;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_link::Reconnect;
use busbar_plugin_sdk::testing::{Recorder, Recording, host, tag_spec};
use busbar_plugin_sdk::{
    DoublePoint, LinkState, Plugin, Quality, Reason, Sample, TagSpec, Telemetry, Value, ValueKind,
};
use peer_process::Peer;
use serde_json::json;

use crate::{Iec61850, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(15);

/// Delays that the settings would not allow.
const QUICK: Reconnect =
    Reconnect { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// 2026-01-02 03:04:05.678 UTC.
const TIME_MILLIS: u64 = 1_767_323_045_678;

/// A running plugin, and what it published.
struct Running {
    _plugin: Iec61850,
    recorder: Recorder,
}

/// Starts a plugin; `settings` are added to quick ones.
fn start(port: u16, settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
    start_with(port, settings, QUICK, tags)
}

fn start_with(
    port: u16,
    settings: serde_json::Value,
    delays: Reconnect,
    tags: Vec<TagSpec>,
) -> Running {
    let mut all = json!({"host": "127.0.0.1", "port": port, "poll_millis": 100});
    let (Some(all_fields), Some(fields)) = (all.as_object_mut(), settings.as_object()) else {
        panic!("settings are an object");
    };
    all_fields.extend(fields.clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = Iec61850::create(settings, host()).unwrap();
    plugin.config.as_mut().unwrap().reconnect = delays;
    let recorder = Recorder::new();
    plugin.start(tags, recorder.sink()).unwrap();
    Running { _plugin: plugin, recorder }
}

impl Running {
    #[track_caller]
    fn wait_for(&self, tag: u32, value: Value) {
        self.wait("value", tag, |sample| sample.value == Some(value) && sample.quality.is_good());
    }

    #[track_caller]
    fn wait_for_bad(&self, tag: u32, reason: Reason) {
        self.wait("quality", tag, |sample| sample.quality == Quality::Bad(reason));
    }

    #[track_caller]
    fn wait(&self, what: &str, tag: u32, wanted: impl Fn(&Sample) -> bool) {
        let arrived =
            self.recorder.wait_until(PATIENCE, |seen| seen.latest(tag).is_some_and(|s| wanted(&s)));
        assert!(
            arrived,
            "{what} of tag {tag}: {:?}; links {:?}",
            self.recorder.latest(tag),
            self.recorder.recording().links
        );
    }

    /// Waits for a link report.
    #[track_caller]
    fn wait_for_link(&self, state: LinkState, message: &str) {
        let said = |seen: &Recording| {
            seen.links.iter().any(|(found, said)| *found == state && said.contains(message))
        };
        let links = || self.recorder.recording().links;
        assert!(self.recorder.wait_until(PATIENCE, said), "{state:?} {message}: {:?}", links());
    }

    fn has_good_samples(&self) -> bool {
        self.recorder.recording().samples.iter().any(|s| s.quality.is_good())
    }

    /// The samples with a value of a tag, in order.
    fn samples(&self, tag: u32) -> Vec<Sample> {
        let samples = self.recorder.recording().samples;
        samples.into_iter().filter(|s| s.tag == tag && s.value.is_some()).collect()
    }
}

/// A tag of the peer's IED.
fn tag(number: u32, kind: ValueKind, reference: &str, fc: &str) -> TagSpec {
    let address = json!({"reference": format!("IED1LD0/{reference}"), "fc": fc});
    tag_spec(number, &format!("tag{number}"), kind, address)
}

fn at(millis: u64) -> Option<SystemTime> {
    Some(UNIX_EPOCH + Duration::from_millis(millis))
}
