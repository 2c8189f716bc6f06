//! The plugin end to end, through the SDK's sink, against Mosquitto.

mod broker;
mod connection;
mod plain;
mod proxied;
mod sparkplug;
mod tls;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_link::Reconnect;
use busbar_plugin_sdk::testing::{Recorder, Recording, host, tag_spec};
use busbar_plugin_sdk::{
    DoublePoint, LinkState, Plugin, Quality, Reason, Sample, TagSpec, Telemetry, Value, ValueKind,
};
use serde_json::{Value as Json, json};

use self::broker::{Broker, Client};
use crate::{Mqtt, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(15);

/// Delays that the settings would not allow.
const QUICK: Reconnect =
    Reconnect { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// A running plugin, and what it published.
struct Running {
    plugin: Mqtt,
    recorder: Recorder,
}

/// Starts a plugin; `settings` are added to its host and port.
fn start(port: u16, settings: &Json, tags: Vec<TagSpec>) -> Running {
    let running = start_only(port, settings, tags);
    running.wait_for_link(LinkState::Up, "connected");
    running
}

fn start_only(port: u16, settings: &Json, tags: Vec<TagSpec>) -> Running {
    let mut all = json!({"host": "127.0.0.1", "port": port});
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = Mqtt::create(settings, host()).unwrap();
    plugin.config.reconnect = QUICK;
    let recorder = Recorder::new();
    plugin.start(tags, recorder.sink()).unwrap();
    Running { plugin, recorder }
}

impl Running {
    #[track_caller]
    fn wait_for(&self, tag: u32, value: Value) {
        self.wait("value", tag, |sample| sample.value == Some(value) && sample.quality.is_good());
    }

    #[track_caller]
    fn wait_for_quality(&self, tag: u32, quality: Quality) {
        self.wait("quality", tag, |sample| sample.quality == quality);
    }

    #[track_caller]
    fn wait_for_bad(&self, tag: u32, reason: Reason) {
        self.wait_for_quality(tag, Quality::Bad(reason));
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
        let arrived = self.recorder.wait_until(PATIENCE, said);
        assert!(arrived, "{state:?} {message}: {:?}", self.recorder.recording().links);
    }

    fn has_good_samples(&self) -> bool {
        self.recorder.recording().samples.iter().any(|sample| sample.quality.is_good())
    }
}

/// A tag of this number and address.
fn tag(number: u32, kind: ValueKind, address: Json) -> TagSpec {
    tag_spec(number, &format!("tag{number}"), kind, address)
}

fn time(millis: u64) -> Option<SystemTime> {
    Some(UNIX_EPOCH + Duration::from_millis(millis))
}
