//! The state of the view as the panels show it.

use busbar_overlay_picture::OverlayLine;
use busbar_plugin_host::{LinkReport, LinkState};
use busbar_plugin_process::{PluginState, PluginStatus};
use busbar_site::PluginHealth;
use busbar_tags::{Snapshot, TagHandle};
use busbar_types::{Origin, Severity, Value};
use busbar_ui::{Age, LinkIndicator, PluginRow, TagRow, TagRows};

use crate::tag_filter::TagFilter;
use busbar_scene_loader::LoadedScene;
use busbar_scene_overlays::mark;

/// Tags as rows, made one by one as they are looked at.
pub(crate) struct TagListRows<'a> {
    scene: &'a LoadedScene,
    snapshot: Snapshot<'a>,
    list: &'a TagFilter,
    /// The greatest severity that overlays give to each tag.
    severities: Vec<Severity>,
}

impl<'a> TagListRows<'a> {
    pub(crate) fn new(
        scene: &'a LoadedScene,
        snapshot: Snapshot<'a>,
        list: &'a TagFilter,
        lines: impl Iterator<Item = (&'a OverlayLine, bool)>,
    ) -> Self {
        let mut severities = vec![Severity::Normal; scene.tags.specs().len()];
        // What a late overlay said of a value counts no longer.
        for (line, _) in lines.filter(|(_, is_late)| !is_late) {
            if let Some(severity) = severities.get_mut(line.tag.0 as usize) {
                *severity = (*severity).max(line.severity);
            }
        }
        Self { scene, snapshot, list, severities }
    }

    /// The row of a tag.
    pub(crate) fn of_tag(&self, tag: TagHandle) -> TagRow {
        let (Some(spec), Some(state)) = (self.scene.tags.spec(tag), self.snapshot.state(tag))
        else {
            return TagRow::default();
        };
        let limits = self.scene.config.tags.get(&spec.id).map(|tag| tag.limits).unwrap_or_default();
        let number = state.value.as_ref().and_then(Value::as_number);
        let outside = number.is_some_and(|number| !limits.contains(number));
        let severity = if outside { Severity::Warning } else { Severity::Normal };
        let of_overlays = self.severities.get(tag.0 as usize).copied().unwrap_or_default();
        TagRow {
            id: spec.id.clone(),
            name: spec.name.clone(),
            value: state.value.as_ref().map_or_else(|| "–".into(), value_text),
            unit: spec.unit.clone(),
            mark: mark(state.quality, severity.max(of_overlays)),
            age: state.age.map(Age::from),
            node: self.scene.node_of(tag),
            origin: state.origin,
        }
    }
}

impl TagRows for TagListRows<'_> {
    fn len(&self) -> usize {
        self.list.len(self.total())
    }

    fn total(&self) -> usize {
        self.scene.tags.specs().len()
    }

    fn is_truncated(&self) -> bool {
        self.list.is_truncated()
    }

    fn row(&self, index: usize) -> TagRow {
        self.of_tag(TagHandle(self.list.tag(index)))
    }
}

/// Returns the row of a plugin instance.
pub(crate) fn plugin(health: PluginHealth<'_>) -> PluginRow {
    let PluginHealth { plugin, link, fault } = health;
    let (info, status) = (plugin.info(), plugin.status());
    let origin = link.as_ref().map_or(Origin::LIVE, |link| link.origin);
    let (link_indicator, message) = match (fault, link) {
        (Some(fault), _) => (LinkIndicator::Down, fault.to_owned()),
        (None, Some(link)) => link_state(link),
        (None, None) => (LinkIndicator::None, String::new()),
    };
    let can_start =
        matches!(status.state, PluginState::Restarting { .. } | PluginState::Quarantined);
    PluginRow {
        name: plugin.name().to_owned(),
        plugin: format!("{} {}", info.id, info.version),
        link_indicator,
        // How its process ended says it all.
        message: if can_start { String::new() } else { message },
        process: process(&status),
        can_start,
        origin,
    }
}

/// Describes a plugin's process: `restarting in 2 s · 1 death: killed by SIGSEGV`.
fn process(status: &PluginStatus) -> String {
    let mut words = match status.state {
        PluginState::Restarting { after } => format!("restarting in {:.1} s", after.as_secs_f64()),
        ref state => state.name().to_owned(),
    };
    if let Some(bytes) = status.memory_bytes {
        words += &format!(" · {} MB", bytes / 1_000_000);
    }
    let deaths = match status.deaths {
        0 => return words,
        1 => "1 death".to_owned(),
        count => format!("{count} deaths"),
    };
    words + &format!(" · {deaths}: {}", status.last_death.as_deref().unwrap_or("unknown"))
}

/// A link that says it is up but brought nothing for longer than any of its
/// tags stays fresh is down.
fn link_state(link: LinkReport) -> (LinkIndicator, String) {
    let mut message = link.message;
    for (count, what) in [(link.dropped, "dropped"), (link.rejected, "rejected")] {
        if count > 0 {
            message += &format!(" ({count} samples {what})");
        }
    }
    for remark in link.clock.remarks() {
        message += &format!(" \u{b7} {remark}");
    }
    match (link.state, link.silent_for) {
        (LinkState::Up, Some(silence)) if silence > link.longest_freshness => {
            (LinkIndicator::Down, format!("no data for {} s; {message}", silence.as_secs()))
        }
        (LinkState::Up, _) => (LinkIndicator::Up, message),
        (LinkState::Idle | LinkState::Connecting, _) => (LinkIndicator::Waiting, message),
        (LinkState::Down, _) => (LinkIndicator::Down, message),
    }
}

pub(crate) fn value_text(value: &Value) -> String {
    match value {
        Value::F64(value) if value.abs() >= 1e7 => format!("{value:.3e}"),
        Value::F64(value) if value.abs() >= 1000.0 => format!("{value:.1}"),
        Value::F64(value) => format!("{value:.2}"),
        Value::I64(value) => value.to_string(),
        Value::Bool(value) => (if *value { "on" } else { "off" }).into(),
        Value::DoublePoint(value) => value.to_string(),
        // Nothing at all would look like a value that is missing.
        Value::Text(value) if value.as_str().is_empty() => "(empty)".into(),
        Value::Text(value) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_plugin_process_state_is_described_in_words() {
        let check = |status: PluginStatus, words| assert_eq!(process(&status), words);
        check(PluginStatus::default(), "in process");
        let running = PluginStatus {
            state: PluginState::Running,
            memory_bytes: Some(12_300_000),
            ..PluginStatus::default()
        };
        check(running.clone(), "running · 12 MB");
        let died = PluginStatus {
            state: PluginState::Restarting { after: Duration::from_millis(1520) },
            memory_bytes: None,
            deaths: 2,
            last_death: Some("killed by SIGSEGV".into()),
            ..running
        };
        check(died, "restarting in 1.5 s · 2 deaths: killed by SIGSEGV");
    }

    #[test]
    fn a_silent_link_is_shown_as_down() {
        let limit = Duration::from_secs(3);
        let report = |silent_for| LinkReport {
            state: LinkState::Up,
            silent_for,
            longest_freshness: limit,
            ..LinkReport::default()
        };
        assert_eq!(link_state(report(Some(limit))).0, LinkIndicator::Up);
        let (link_indicator, message) = link_state(report(Some(limit * 4)));
        assert_eq!(link_indicator, LinkIndicator::Down);
        assert!(message.starts_with("no data for 12 s"), "{message}");
    }
}
