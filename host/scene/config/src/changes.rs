//! Differences between two configurations.

use std::collections::BTreeMap;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};

use serde_json::Value;

use crate::{BindingConfig, Config, NotificationConfig, OverlayConfig, RecordsConfig};

/// Limit of names that are listed for one section; further ones are counted.
const MAX_NAMED: usize = 6;

/// Hashes of text parts that are not kept. Equal hashes mean equal parts, but for one text in
/// 2^64.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fingerprints {
    scene: u64,
    equipment: u64,
}

impl Fingerprints {
    /// Hashes the parts of a document.
    pub(crate) fn from_document(document: &Value) -> Self {
        Self {
            scene: fingerprint(&[&document["scene"], &document["templates"]]),
            equipment: fingerprint(&[&document["equipment"]]),
        }
    }
}

fn fingerprint(values: &[&Value]) -> u64 {
    let mut hasher = DefaultHasher::new();
    values.hash(&mut hasher);
    hasher.finish()
}

/// A part of a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Directories, signature and supervision of plugins.
    PluginRules,
    /// Section of plugin instances.
    Plugins,
    /// Section of the models.
    Models,
    /// Sections of nodes and templates.
    Scene,
    /// Section of equipment names.
    Equipment,
    /// Section of the tags.
    Tags,
    /// Section of the bindings.
    Bindings,
    /// Section of the alarms.
    Alarms,
    /// Section of alarm handling.
    AlarmHandling,
    /// Section of plugins that tell of alarms.
    Notifications,
    /// Section of the overlays.
    Overlays,
    /// Section of plugins with records.
    Records,
    /// Section of the chart.
    Chart,
    /// Section of the cameras.
    Cameras,
    /// Section of the view.
    View,
    /// Section of the cache.
    Cache,
    /// Section of the log file.
    Log,
    /// Numbers that are served.
    Metrics,
}

impl Section {
    /// Returns the name of the section in the text.
    pub fn name(self) -> &'static str {
        match self {
            Self::PluginRules => "rules for plugins",
            Self::Plugins => "plugins",
            Self::Models => "models",
            Self::Scene => "scene",
            Self::Equipment => "equipment",
            Self::Tags => "tags",
            Self::Bindings => "bindings",
            Self::Alarms => "alarms",
            Self::AlarmHandling => "alarm_handling",
            Self::Notifications => "notifications",
            Self::Overlays => "overlays",
            Self::Records => "records",
            Self::Chart => "chart",
            Self::Cameras => "cameras",
            Self::View => "view",
            Self::Cache => "cache",
            Self::Log => "log",
            Self::Metrics => "metrics",
        }
    }
}

/// Kinds of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// The item is new.
    Added,
    /// The item was removed.
    Removed,
    /// The item was changed.
    Changed,
}

/// One thing that is otherwise.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Section of the item.
    pub section: Section,
    /// Name or id of the item; none where the section has no names.
    pub name: Option<String>,
    /// Kind of the change.
    pub kind: ChangeKind,
}

/// Differences by section and name. The position of a value in the text is no difference.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    all: Vec<Change>,
}

impl Changes {
    /// Compares two valid configurations.
    pub fn between(before: &Config, after: &Config) -> Self {
        let mut changes = Self::default();
        let rules = |c: &Config| {
            let paths: Vec<String> = c.plugin_directories.iter().map(|d| d.path.clone()).collect();
            (paths, c.supervision, c.signature.as_ref().map(|s| s.public_key.clone()))
        };
        changes.compare(Section::PluginRules, rules(before) == rules(after));
        changes.compare_named(Section::Plugins, &before.plugins, &after.plugins);
        changes.compare_named(Section::Models, &before.models, &after.models);
        let (was, is) = (before.fingerprints, after.fingerprints);
        changes.compare(Section::Scene, was.scene == is.scene);
        changes.compare(Section::Equipment, was.equipment == is.equipment);
        changes.compare_named(Section::Tags, &before.tags, &after.tags);
        let bindings =
            before.bindings.iter().map(of_binding).eq(after.bindings.iter().map(of_binding));
        changes.compare(Section::Bindings, bindings);
        changes.compare_named(Section::Alarms, &before.alarms, &after.alarms);
        changes.compare(Section::AlarmHandling, before.alarm_handling == after.alarm_handling);
        let name = |entry: &NotificationConfig| entry.plugin.clone();
        let told = before.notifications.iter().map(name).eq(after.notifications.iter().map(name));
        changes.compare(Section::Notifications, told);
        let name = |overlay: &OverlayConfig| overlay.plugin.clone();
        let overlays = before.overlays.iter().map(name).eq(after.overlays.iter().map(name));
        changes.compare(Section::Overlays, overlays);
        let name = |records: &RecordsConfig| records.plugin.clone();
        let records = before.records.iter().map(name).eq(after.records.iter().map(name));
        changes.compare(Section::Records, records);
        changes.compare(Section::Chart, before.chart == after.chart);
        changes.compare_named(Section::Cameras, &before.cameras, &after.cameras);
        changes.compare(Section::View, before.view == after.view);
        changes.compare(Section::Cache, before.cache == after.cache);
        changes.compare(Section::Log, before.log == after.log);
        changes.compare(Section::Metrics, before.metrics == after.metrics);
        changes
    }

    /// Counts models whose file has other content among what changed.
    pub fn add_models(&mut self, names: impl IntoIterator<Item = String>) {
        let (section, kind) = (Section::Models, ChangeKind::Changed);
        for name in names {
            let named = |of: &Change| of.section == section && of.name.as_ref() == Some(&name);
            if !self.all.iter().any(named) {
                self.all.push(Change { section, name: Some(name), kind });
            }
        }
        self.all.sort_by_key(|change| change.section);
    }

    /// Iterates over all changes.
    pub fn iter(&self) -> impl Iterator<Item = &Change> {
        self.all.iter()
    }

    /// Reports whether the configurations are equal.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Reports whether anything of a section changed.
    pub fn affect(&self, section: Section) -> bool {
        self.all.iter().any(|change| change.section == section)
    }

    fn compare(&mut self, section: Section, is_same: bool) {
        if !is_same {
            self.all.push(Change { section, name: None, kind: ChangeKind::Changed });
        }
    }

    fn compare_named<T: PartialEq>(
        &mut self,
        section: Section,
        before: &BTreeMap<String, T>,
        after: &BTreeMap<String, T>,
    ) {
        let mut note = |name: &String, kind| {
            self.all.push(Change { section, name: Some(name.clone()), kind });
        };
        for (name, was) in before {
            match after.get(name) {
                None => note(name, ChangeKind::Removed),
                Some(is) if is != was => note(name, ChangeKind::Changed),
                Some(_) => {}
            }
        }
        after.keys().filter(|name| !before.contains_key(*name)).for_each(|name| {
            note(name, ChangeKind::Added);
        });
    }
}

fn of_binding(binding: &BindingConfig) -> (&str, &str, &str) {
    (&binding.tag, &binding.node, &binding.role)
}

/// Lists the changes, such as `tags: T1.TopOil changed; view changed`.
impl fmt::Display for Changes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.all.is_empty() {
            return f.write_str("nothing changed");
        }
        for (index, of_section) in self.all.chunk_by(|a, b| a.section == b.section).enumerate() {
            let section = of_section[0].section.name();
            f.write_str(if index == 0 { "" } else { "; " })?;
            if of_section[0].name.is_none() {
                write!(f, "{section} changed")?;
                continue;
            }
            write!(f, "{section}: ")?;
            for (index, change) in of_section.iter().take(MAX_NAMED).enumerate() {
                let name = change.name.as_deref().unwrap_or_default();
                let kind = match change.kind {
                    ChangeKind::Added => "added",
                    ChangeKind::Removed => "removed",
                    ChangeKind::Changed => "changed",
                };
                write!(f, "{}{name} {kind}", if index == 0 { "" } else { ", " })?;
            }
            if of_section.len() > MAX_NAMED {
                write!(f, " and {} more", of_section.len() - MAX_NAMED)?;
            }
        }
        Ok(())
    }
}
