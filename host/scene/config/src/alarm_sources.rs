//! Plugins with the alarms of other systems, as written.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::alarm_rules::check_equipment;
use crate::join_pointer;
use crate::limits::{
    MAX_NAME_BYTES, MAX_SOURCE_RULES, MAX_SOURCE_SEVERITY, MAX_STALE_AFTER_SECONDS,
};
use crate::placement_rules::Equipment;
use crate::report::Report;

/// Source of another system's alarms, with the equipment that they concern.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "AlarmSource")]
pub(crate) struct RawAlarmSource {
    /// Name of the plugin instance that has them.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES), extend("examples" = ["plc"]))]
    #[schemars(extend("x-busbar-formerly" = ["plugin"]))]
    instance: String,
    /// Equipment ids by the names of alarm sources, or by prefixes of them; the longest match
    /// counts. Without a match the source itself is an equipment id or an alias.
    #[serde(default)]
    #[schemars(extend("maxProperties" = MAX_SOURCE_RULES))]
    #[schemars(extend("examples" = [{"S12D1T1.": "=S12D1T1-TA1"}]))]
    equipment: BTreeMap<String, String>,
    /// The least severities of priorities.
    #[serde(default)]
    severities: RawSeverities,
    /// Silence of the source after which its alarms are stale, in seconds.
    #[serde(default = "default_stale_after")]
    #[schemars(range(min = 1, max = MAX_STALE_AFTER_SECONDS), extend("examples" = [15]))]
    stale_after_seconds: u32,
}

/// Severity thresholds of the priorities, 1 to 1000; an alarm below all of them has low priority.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Severities")]
struct RawSeverities {
    /// Least severity of critical priority.
    #[schemars(range(min = 1, max = MAX_SOURCE_SEVERITY), extend("examples" = [801]))]
    critical: u16,
    /// Least severity of high priority.
    #[schemars(range(min = 1, max = MAX_SOURCE_SEVERITY), extend("examples" = [601]))]
    high: u16,
    /// Least severity of medium priority.
    #[schemars(range(min = 1, max = MAX_SOURCE_SEVERITY), extend("examples" = [401]))]
    medium: u16,
}

/// Source of another system's alarms, with the equipment that they concern.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlarmSourceConfig {
    /// Name of the plugin instance.
    pub plugin: String,
    /// Equipment id by how a source of alarms begins.
    pub equipment: BTreeMap<String, String>,
    /// The least severities of critical, high and medium priority.
    pub severities: [u16; 3],
    /// Silence after which alarms are stale, in seconds.
    pub stale_after_seconds: u32,
    /// JSON pointer of the source.
    pub pointer: String,
}

fn default_stale_after() -> u32 {
    15
}

impl Default for RawSeverities {
    fn default() -> Self {
        Self { critical: 801, high: 601, medium: 401 }
    }
}

impl RawAlarmSource {
    pub(crate) fn resolve((index, raw): (usize, Self)) -> AlarmSourceConfig {
        let RawSeverities { critical, high, medium } = raw.severities;
        AlarmSourceConfig {
            plugin: raw.instance,
            equipment: raw.equipment,
            severities: [critical, high, medium],
            stale_after_seconds: raw.stale_after_seconds,
            pointer: pointer_of(index),
        }
    }
}

impl AlarmSourceConfig {
    /// Returns the equipment id that a rule gives for the name of an alarm source.
    pub fn equipment_of(&self, source: &str) -> Option<&str> {
        let fits = self.equipment.iter().filter(|(start, _)| source.starts_with(start.as_str()));
        fits.max_by_key(|(start, _)| start.len()).map(|(_, equipment)| equipment.as_str())
    }
}

fn pointer_of(index: usize) -> String {
    join_pointer("/alarm_sources", index)
}

/// Iterates over the sources, with their pointers.
pub(crate) fn sources(document: &Value) -> impl Iterator<Item = (String, &Value)> {
    let sources = document["alarm_sources"].as_array().into_iter().flatten();
    sources.enumerate().map(|(index, source)| (pointer_of(index), source))
}

/// Reports equipment that is not in the scene, and severities out of order.
pub(crate) fn check(document: &Value, equipment: &Equipment<'_>, report: &mut Report<'_>) {
    let mut named: Vec<&str> = Vec::new();
    for (pointer, source) in sources(document) {
        if let Some(name) = source["instance"].as_str() {
            if named.contains(&name) {
                let pointer = join_pointer(&pointer, "instance");
                report.error(&pointer, "its alarms are shown already", "remove one of them");
            }
            named.push(name);
        }
        for (start, id) in source["equipment"].as_object().into_iter().flatten() {
            let pointer = join_pointer(&join_pointer(&pointer, "equipment"), start);
            if let Some(id) = id.as_str() {
                check_equipment(id, equipment, &pointer, report);
            }
        }
        let usual = RawSeverities::default();
        let of = |key: &str, usual: u16| source["severities"][key].as_u64().unwrap_or(usual.into());
        let [critical, high, medium] =
            [("critical", usual.critical), ("high", usual.high), ("medium", usual.medium)]
                .map(|(key, usual)| of(key, usual));
        if !(medium < high && high < critical) {
            report.error(
                &join_pointer(&pointer, "severities"),
                format!(
                    "critical, {critical}, high, {high}, and medium, {medium}, are out of order"
                ),
                "make critical greater than high, and high greater than medium",
            );
        }
    }
}
