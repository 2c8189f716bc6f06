//! The plugin end to end, through the SDK's sink, against Mosquitto.

mod broker;
mod connection;
mod plain;
mod proxied;
mod sparkplug;
mod tls;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_link::ReconnectBounds;
use busbar_plugin_sdk::testing::{RunningPlugin, host, tag_spec};
use busbar_plugin_sdk::{
    DoublePoint, LinkState, Plugin, Quality, Reason, Sample, SampleFlags, TagSpec, Telemetry, Text,
    Value, ValueKind,
};
use serde_json::{Value as Json, json};

use self::broker::{Broker, Client};
use crate::{Mqtt, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(15);

/// Delays that the settings would not allow.
const QUICK: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// Running plugin and the record of its samples.
type Running = RunningPlugin<Mqtt>;

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
    RunningPlugin::start(plugin, tags, PATIENCE)
}

/// Creates a tag of this number and address.
fn tag(number: u32, kind: ValueKind, address: Json) -> TagSpec {
    tag_spec(number, &format!("tag{number}"), kind, address)
}

fn time(millis: u64) -> Option<SystemTime> {
    Some(UNIX_EPOCH + Duration::from_millis(millis))
}
