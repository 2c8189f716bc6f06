//! The plugin end to end, through the SDK's sink, against real servers.

mod asyncua;
mod conditions;
mod hostile;
pub(crate) mod peer;
#[cfg(target_os = "linux")]
mod proxied;
mod scripted;
mod scripted_server;
mod secured;

use std::time::{Duration, UNIX_EPOCH};

use busbar_link::ReconnectBounds;
use busbar_plugin_sdk::testing::{Recording, RunningPlugin, host, tag_spec};
use busbar_plugin_sdk::{
    Alarms, LinkState, Plugin, Quality, Reason, TagSpec, Telemetry, Value, ValueKind,
};
use serde_json::{Value as Json, json};

use crate::{OpcUa, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(20);

/// Delays that the settings would not allow.
const QUICK: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// Running plugin and the record of its samples.
type Running = RunningPlugin<OpcUa>;

/// Starts a plugin; `settings` are added to quick ones.
fn start(port: u16, settings: &Json, tags: Vec<TagSpec>) -> Running {
    start_with(port, settings, QUICK, tags)
}

fn start_with(port: u16, settings: &Json, delays: ReconnectBounds, tags: Vec<TagSpec>) -> Running {
    let url = format!("opc.tcp://127.0.0.1:{port}/test");
    let mut all = json!({"url": url, "publishing_seconds": 0.05});
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = OpcUa::create(settings, host()).unwrap();
    plugin.config.reconnect = delays;
    RunningPlugin::start(plugin, tags, PATIENCE)
}

/// Creates a tag by its node's name in the server's own namespace.
fn tag(tag: u32, kind: ValueKind, node: &str) -> TagSpec {
    tag_spec(tag, &format!("tag{tag}"), kind, json!({"node": format!("ns=2;s={node}")}))
}

/// Creates a node of the server with this name.
fn node(name: &str, kind: &str, value: &Json) -> Json {
    json!({"id": format!("ns=2;s={name}"), "type": kind, "value": value})
}
