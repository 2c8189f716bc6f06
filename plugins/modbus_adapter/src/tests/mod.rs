//! The adapter end to end, through the SDK's sink, against real sockets.

mod hostile;
mod peer;
mod pymodbus;
pub(crate) mod server;
mod simulator;

use std::time::Duration;

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Plugin, Quality, Reason, TagSpec, Telemetry, Value, ValueKind};
use serde_json::json;

use crate::{ModbusAdapter, Settings};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(10);

/// An adapter that polls fast, and what it published.
struct Running {
    adapter: ModbusAdapter,
    recorder: Recorder,
}

/// Starts an adapter; `settings` are added to fast ones.
fn start(port: u16, settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
    let mut all = json!({
        "host": "127.0.0.1", "port": port, "poll_millis": 50,
        "reconnect": {"min_millis": 100, "max_millis": 400}
    });
    let (Some(all_fields), Some(fields)) = (all.as_object_mut(), settings.as_object()) else {
        panic!("settings are an object");
    };
    all_fields.extend(fields.clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
    let recorder = Recorder::new();
    adapter.start(tags, recorder.sink()).unwrap();
    Running { adapter, recorder }
}

impl Running {
    fn wait_for(&self, tag: u32, value: Value) {
        self.wait("value", tag, |sample| sample.value == Some(value) && sample.quality.is_good());
    }

    fn wait_for_bad(&self, tag: u32, reason: Reason) {
        self.wait("quality", tag, |sample| sample.quality == Quality::Bad(reason));
    }

    fn wait(&self, what: &str, tag: u32, wanted: impl Fn(&busbar_plugin_sdk::Sample) -> bool) {
        let arrived =
            self.recorder.wait_until(PATIENCE, |seen| seen.latest(tag).is_some_and(|s| wanted(&s)));
        assert!(
            arrived,
            "{what} of tag {tag}: {:?}; links {:?}",
            self.recorder.latest(tag),
            self.recorder.recording().links
        );
    }

    fn has_good_samples(&self) -> bool {
        let recording = self.recorder.recording();
        recording.samples.iter().any(|s| s.quality.is_good())
    }
}

pub(crate) fn holding(tag: u32, register: u16) -> TagSpec {
    let address = json!({"table": "holding", "register": register, "type": "u16"});
    tag_spec(tag, &format!("tag{tag}"), ValueKind::F64, address)
}

/// Whether a thread of an adapter on this port lives in this process.
#[cfg(target_os = "linux")]
fn has_thread(port: u16) -> bool {
    let name = format!("modbus:{port}");
    std::fs::read_dir("/proc/self/task")
        .unwrap()
        .filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok())
        .any(|comm| comm.trim() == name)
}
