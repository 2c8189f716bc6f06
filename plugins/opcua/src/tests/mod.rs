//! The plugin end to end, through the SDK's sink, against real servers.

mod asyncua;
mod conditions;
mod hostile;
mod peer;
#[cfg(target_os = "linux")]
mod proxied;
mod secured;

use std::time::{Duration, UNIX_EPOCH};

use busbar_link::Reconnect;
use busbar_plugin_sdk::testing::{Recorder, Recording, host, tag_spec};
use busbar_plugin_sdk::{
    LinkState, Plugin, Quality, Reason, Sample, TagSpec, Telemetry, Value, ValueKind,
};
use serde_json::{Value as Json, json};

use crate::{OpcUa, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(20);

/// Delays that the settings would not allow.
const QUICK: Reconnect =
    Reconnect { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// A running plugin, and what it published.
struct Running {
    plugin: OpcUa,
    recorder: Recorder,
}

/// Starts a plugin; `settings` are added to quick ones.
fn start(port: u16, settings: &Json, tags: Vec<TagSpec>) -> Running {
    start_with(port, settings, QUICK, tags)
}

fn start_with(port: u16, settings: &Json, delays: Reconnect, tags: Vec<TagSpec>) -> Running {
    let url = format!("opc.tcp://127.0.0.1:{port}/test");
    let mut all = json!({"url": url, "publishing_millis": 50});
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = OpcUa::create(settings, host()).unwrap();
    plugin.config.reconnect = delays;
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
            self.last_links()
        );
    }

    /// Waits for a sample, were it overtaken since.
    #[track_caller]
    fn wait_for_any(&self, tag: u32, wanted: impl Fn(&Sample) -> bool) {
        let has = |seen: &Recording| seen.samples.iter().any(|s| s.tag == tag && wanted(s));
        let latest = || self.recorder.latest(tag);
        assert!(self.recorder.wait_until(PATIENCE, has), "tag {tag}: {:?}", latest());
    }

    /// Waits for a link report.
    #[track_caller]
    fn wait_for_link(&self, state: LinkState, message: &str) {
        let said = |seen: &Recording| {
            seen.links.iter().any(|(found, said)| *found == state && said.contains(message))
        };
        let arrived = self.recorder.wait_until(PATIENCE, said);
        assert!(arrived, "{state:?} {message}: {:?}", self.last_links());
    }

    /// The last reports of the link, for messages.
    fn last_links(&self) -> Vec<(LinkState, String)> {
        let links = self.recorder.recording().links;
        links.into_iter().rev().take(4).collect()
    }

    fn has_good_samples(&self) -> bool {
        self.recorder.recording().samples.iter().any(|s| s.quality.is_good())
    }
}

/// A tag by its node's name in the server's own namespace.
fn tag(tag: u32, kind: ValueKind, node: &str) -> TagSpec {
    tag_spec(tag, &format!("tag{tag}"), kind, json!({"node": format!("ns=2;s={node}")}))
}

/// A node of the server, by the same name.
fn node(name: &str, kind: &str, value: &Json) -> Json {
    json!({"id": format!("ns=2;s={name}"), "type": kind, "value": value})
}
