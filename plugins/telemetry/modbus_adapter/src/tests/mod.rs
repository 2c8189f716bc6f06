//! The adapter end to end, through the SDK's sink, against real sockets.

mod hostile;
mod hostile_line;
mod late;
mod libmodbus;
pub(crate) mod line;
mod peer;
#[cfg(target_os = "linux")]
mod proxied;
mod pymodbus;
mod serial;
pub(crate) mod server;
mod simulator;
mod stamps;
mod tls;
mod types;

use std::time::Duration;

use busbar_link::ReconnectBounds;
use busbar_plugin_sdk::testing::{Recorder, Recording, RunningPlugin, host, tag_spec};
use busbar_plugin_sdk::{LinkState, Plugin, Quality, Reason, TagSpec, Telemetry, Value, ValueKind};
use serde_json::json;

use crate::{ModbusAdapter, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(10);

/// Running adapter that polls fast, and the record of its samples.
pub(crate) type Running = RunningPlugin<ModbusAdapter>;

/// Delays that the settings would not allow.
const QUICK: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(100), max: Duration::from_millis(400) };

/// Starts an adapter of a local server; `settings` are added to fast ones.
pub(crate) fn start(port: u16, settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
    let mut all = json!({"host": "127.0.0.1", "port": port});
    add(&mut all, settings);
    start_with(all, QUICK, tags)
}

/// Starts an adapter that polls fast.
fn start_with(settings: serde_json::Value, delays: ReconnectBounds, tags: Vec<TagSpec>) -> Running {
    let mut all = json!({"poll_seconds": 0.05});
    add(&mut all, settings);
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
    adapter.config.reconnect = delays;
    RunningPlugin::start(adapter, tags, PATIENCE)
}

fn add(all: &mut serde_json::Value, settings: serde_json::Value) {
    let (Some(all), serde_json::Value::Object(settings)) = (all.as_object_mut(), settings) else {
        panic!("settings are an object");
    };
    all.extend(settings);
}

pub(crate) fn holding(tag: u32, register: u16) -> TagSpec {
    let address = json!({"table": "holding", "register": register, "type": "u16"});
    tag_spec(tag, &format!("tag{tag}"), ValueKind::F64, address)
}

/// Reports whether this process has a thread of an adapter for this port.
#[cfg(target_os = "linux")]
fn has_thread(port: u16) -> bool {
    let name = format!("modbus:{port}");
    std::fs::read_dir("/proc/self/task")
        .unwrap()
        .filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok())
        .any(|comm| comm.trim() == name)
}
