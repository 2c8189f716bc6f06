//! The state of the view as the panels show it.

use std::collections::HashMap;

use busbar_plugin_host::{Instance, LinkReport, LinkState, Severity};
use busbar_tags::{Snapshot, TagHandle, Value};
use busbar_ui::{LinkLamp, PluginRow, TagRow};

use crate::LoadedScene;
use crate::labels::mark;

/// Tags in the order of their ids.
pub(crate) fn tags(scene: &LoadedScene, snapshot: &Snapshot) -> Vec<TagRow> {
    let mut nodes: HashMap<TagHandle, &str> = HashMap::new();
    for binding in &scene.bindings {
        nodes.entry(binding.tag).or_insert(&scene.graph.node(binding.node).id);
    }
    let row = |(index, (spec, state)): (usize, (&busbar_tags::TagSpec, &busbar_tags::TagState))| {
        let limits = scene.config.tags.get(&spec.id).map(|tag| tag.limits).unwrap_or_default();
        let number = state.value.and_then(Value::as_number);
        let outside = number.is_some_and(|number| !limits.contains(number));
        let severity = if outside { Severity::Warning } else { Severity::Normal };
        TagRow {
            id: spec.id.clone(),
            name: spec.name.clone(),
            value: state.value.map_or_else(|| "–".into(), value_text),
            unit: spec.unit.clone(),
            mark: mark(state.quality, severity),
            age: state.age,
            node: nodes.get(&TagHandle(index as u32)).map(|id| (*id).to_owned()),
        }
    };
    scene.tags.iter().zip(snapshot.states()).enumerate().map(row).collect()
}

/// A plugin with its link, and what went wrong with it last.
pub(crate) fn plugin(
    instance: &Instance,
    link: Option<LinkReport>,
    fault: Option<&str>,
) -> PluginRow {
    let info = instance.info();
    let (mut lamp, mut message) = link.map_or((LinkLamp::None, String::new()), |link| {
        let lamp = match link.state {
            LinkState::Idle => LinkLamp::None,
            LinkState::Connecting => LinkLamp::Waiting,
            LinkState::Up => LinkLamp::Up,
            LinkState::Down => LinkLamp::Down,
        };
        let mut message = link.message;
        for (count, what) in [(link.dropped, "dropped"), (link.rejected, "rejected")] {
            if count > 0 {
                message += &format!(" ({count} samples {what})");
            }
        }
        (lamp, message)
    });
    if let Some(fault) = fault {
        (lamp, message) = (LinkLamp::Down, fault.to_owned());
    }
    PluginRow {
        name: instance.name().to_owned(),
        plugin: format!("{} {}", info.id, info.version),
        lamp,
        message,
    }
}

fn value_text(value: Value) -> String {
    match value {
        Value::F64(value) if value.abs() >= 1e7 => format!("{value:.3e}"),
        Value::F64(value) if value.abs() >= 1000.0 => format!("{value:.1}"),
        Value::F64(value) => format!("{value:.2}"),
        Value::I64(value) => value.to_string(),
        Value::Bool(value) => (if value { "on" } else { "off" }).into(),
        Value::DoublePoint(value) => value.to_string(),
    }
}
