//! The plugin end to end, through the SDK's sink, against real sockets.

mod c104;
mod hat;
mod hostile;
pub(crate) mod peer;
#[cfg(target_os = "linux")]
mod proxied;
mod server;
mod simulator;
mod tls;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_link::ReconnectBounds;
use busbar_plugin_sdk::testing::{Recorder, Recording, RunningPlugin, host, tag_spec};
use busbar_plugin_sdk::{
    DoublePoint, LinkState, Plugin, Quality, Reason, Sample, SampleFlags, TagSpec, Telemetry,
    Value, ValueKind,
};
use serde_json::json;

use crate::{Iec104, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(10);

/// Delays that the settings would not allow.
const QUICK: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// A running plugin, and what it published.
type Running = RunningPlugin<Iec104>;

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
    let mut all = json!({"host": "127.0.0.1", "port": port});
    let (Some(all_fields), Some(fields)) = (all.as_object_mut(), settings.as_object()) else {
        panic!("settings are an object");
    };
    all_fields.extend(fields.clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut plugin = Iec104::create(settings, host()).unwrap();
    plugin.config.reconnect = delays;
    RunningPlugin::start(plugin, tags, PATIENCE)
}

/// A tag named by its object address.
fn tag(ioa: u32, kind: ValueKind) -> TagSpec {
    tag_spec(ioa, &format!("tag{ioa}"), kind, json!({"ioa": ioa}))
}

/// Reports whether a thread of a plugin on this port lives in this process.
#[cfg(target_os = "linux")]
fn has_thread(port: u16) -> bool {
    let name = format!("iec104:{port}");
    std::fs::read_dir("/proc/self/task")
        .unwrap()
        .filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok())
        .any(|comm| comm.trim() == name)
}
