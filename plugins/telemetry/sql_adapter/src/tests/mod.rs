//! The plugin end to end, through the SDK's sink, against real databases.

mod cluster;
mod faults;
mod hostile;
mod listen;
mod matrix;
mod sqlite;
mod sqlite_faults;
mod tls;
mod values;

use std::time::Duration;

use busbar_plugin_sdk::testing::{Recorder, RunningPlugin, host, tag_spec};
use busbar_plugin_sdk::{
    DoublePoint, LinkState, Plugin, Quality, Reason, Sample, SampleFlags, TagSpec, Telemetry, Text,
    Value, ValueKind,
};
use serde_json::json;

use crate::{Settings, SqlAdapter};

/// Long enough for a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(40);

/// A running plugin, and what it published.
type Running = RunningPlugin<SqlAdapter>;

fn start(settings: serde_json::Value, tags: Vec<TagSpec>) -> Running {
    let plugin = create(settings);
    RunningPlugin::start(plugin, tags, PATIENCE)
}

fn create(mut settings: serde_json::Value) -> SqlAdapter {
    let quick = json!({"min_seconds": 1, "max_seconds": 1});
    settings.as_object_mut().unwrap().entry("reconnect").or_insert(quick);
    let settings: Settings = serde_json::from_value(settings).unwrap();
    SqlAdapter::create(settings, host()).unwrap()
}

/// A tag named by the key of a query.
fn key(tag: u32, query: &str, key: &str, kind: ValueKind) -> TagSpec {
    tag_spec(tag, &format!("tag{tag}"), kind, json!({"query": query, "key": key}))
}

/// A tag named by the column of a query.
fn column(tag: u32, query: &str, column: &str, kind: ValueKind) -> TagSpec {
    tag_spec(tag, &format!("tag{tag}"), kind, json!({"query": query, "column": column}))
}

fn text(text: &str) -> Value {
    Value::Text(Text::cut(text))
}

/// A query that is asked often.
fn query(name: &str, sql: &str) -> serde_json::Value {
    json!({"name": name, "sql": sql, "poll_seconds": 0.1})
}

/// Reports whether a peer is there. Where peers are required its absence is a failure.
#[allow(clippy::print_stderr)]
fn available(is_there: bool, remedy: &str) -> bool {
    let required = |name| std::env::var_os(name).is_some();
    assert!(is_there || !(required("CI") || required("BUSBAR_REQUIRE_PEERS")), "{remedy}");
    if !is_there {
        eprintln!("SKIPPED: {remedy}");
    }
    is_there
}
