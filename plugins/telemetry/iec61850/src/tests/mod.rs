//! The plugin end to end, through the SDK's sink, against libiec61850 in a process of its
//! own, an independent implementation.

mod hostile;
pub(crate) mod peer;
#[cfg(target_os = "linux")]
mod proxied;
mod reports;
mod restarts;
mod tls;
mod values;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_link::ReconnectBounds;
use busbar_plugin_sdk::testing::{Recorder, Recording, RunningPlugin, host, tag_spec};
use busbar_plugin_sdk::{
    DoublePoint, LinkState, Plugin, Quality, Reason, Sample, SampleFlags, TagSpec, Telemetry, Text,
    Value, ValueKind,
};
use peer_process::Peer;
use serde_json::json;

use crate::{Iec61850, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(15);

/// Delays that the settings would not allow.
const QUICK: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// Instant 2026-01-02 03:04:05.678 UTC, in milliseconds.
const TIME_MILLIS: u64 = 1_767_323_045_678;

/// A running plugin, and what it published.
type Running = RunningPlugin<Iec61850>;

/// Starts a plugin; `settings` are added to quick ones.
fn start(port: u16, settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
    start_with(port, settings, QUICK, tags)
}

fn start_with(
    port: u16,
    settings: serde_json::Value,
    delays: ReconnectBounds,
    tags: Vec<TagSpec>,
) -> Running {
    let mut all = json!({"host": "127.0.0.1", "port": port, "poll_seconds": 0.1});
    let (Some(all_fields), Some(fields)) = (all.as_object_mut(), settings.as_object()) else {
        panic!("settings are an object");
    };
    all_fields.extend(fields.clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = Iec61850::create(settings, host()).unwrap();
    plugin.config.as_mut().unwrap().reconnect = delays;
    RunningPlugin::start(plugin, tags, PATIENCE)
}

/// A tag of the peer's IED.
fn tag(number: u32, kind: ValueKind, reference: &str, fc: &str) -> TagSpec {
    let address = json!({"reference": format!("IED1LD0/{reference}"), "fc": fc});
    tag_spec(number, &format!("tag{number}"), kind, address)
}

fn at(millis: u64) -> Option<SystemTime> {
    Some(UNIX_EPOCH + Duration::from_millis(millis))
}
