//! A scenario: what happens when to simulated devices.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use busbar_types::{FaultKind, ValueKind};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::config::Config;
use crate::limits::*;
use crate::report::Report;
use crate::schema::CompiledSchema;
use crate::{Diagnostic, TagConfig, join_pointer, resolve, structure, suggestions, syntax};

pub(crate) static FORM: LazyLock<CompiledSchema> =
    LazyLock::new(CompiledSchema::from_type::<RawScenario>);

/// A timeline of events for simulated devices.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Busbar scenario")]
struct RawScenario {
    /// Version of this format: 1.
    #[serde(rename = "version")]
    #[schemars(extend("const" = 1), extend("examples" = [1]))]
    _version: u32,
    /// Description of the scenario, for people.
    #[serde(default)]
    #[schemars(length(max = MAX_ALARM_TEXT), extend("examples" = ["A breaker trips"]))]
    description: String,
    /// Events, in any order.
    #[schemars(length(max = MAX_SCENARIO_EVENTS))]
    #[schemars(extend("examples" = [[{ "at_seconds": 5, "tag": "Q1.Position", "value": 1 }]]))]
    events: Vec<RawEvent>,
}

/// Event of a tag, or of the link of a plugin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ScenarioEvent")]
struct RawEvent {
    /// Seconds since the start of the devices.
    #[schemars(range(min = 0.0, max = MAX_SCENARIO_SECONDS), extend("examples" = [5]))]
    #[schemars(extend("x-busbar-formerly" = ["at"]))]
    at_seconds: f64,
    /// The tag; with `value` or `release`.
    #[serde(default)]
    #[schemars(with = "String", extend("examples" = ["T1.Load"]))]
    tag: Option<String>,
    /// The value that it goes to and keeps, in the tag's unit; of a bool 0 or 1, of a
    /// double_point 0 intermediate, 1 off, 2 on, 3 bad state.
    #[serde(default)]
    #[schemars(with = "f64", extend("examples" = [120]))]
    value: Option<f64>,
    /// Duration of the ramp to the value, seconds; a bool or double_point jumps.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = MAX_SCENARIO_SECONDS), extend("examples" = [10]))]
    #[schemars(extend("x-busbar-formerly" = ["over"]))]
    over_seconds: f64,
    /// Releases the tag to its own movement.
    #[serde(rename = "release", default)]
    _release: bool,
    /// The plugin instance whose link fails; with `link` and `for_seconds`.
    #[serde(default)]
    #[schemars(with = "String", extend("examples" = ["bay"]))]
    #[schemars(extend("x-busbar-formerly" = ["plugin"]))]
    instance: Option<String>,
    /// Kind of the link fault.
    #[serde(default)]
    #[schemars(with = "FaultKind", extend("examples" = ["link-loss"]))]
    link: Option<FaultKind>,
    /// Duration of the fault, seconds.
    #[serde(default)]
    #[schemars(with = "f64", range(min = 0.001, max = MAX_SCENARIO_SECONDS), extend("examples" = [20]))]
    #[schemars(extend("x-busbar-formerly" = ["for"]))]
    for_seconds: Option<f64>,
}

/// Scenario for the devices of a configuration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenarioConfig {
    /// Description of the scenario, for people.
    pub description: String,
    /// Events of tags that a device has, in the order of time.
    pub events: Vec<ScenarioEventConfig>,
    /// Faults of links, in the order of time.
    pub link_faults: Vec<LinkFaultConfig>,
    /// Faults of the text that do not stop it.
    pub warnings: Vec<Diagnostic>,
}

/// Event of a simulated tag.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioEventConfig {
    /// Seconds since the start.
    pub at_seconds: f64,
    /// Id of the tag.
    pub tag: String,
    /// The value that it goes to, in the tag's unit, and the seconds that this takes; none
    /// where it moves by itself again.
    pub value: Option<(f64, f64)>,
}

/// A time in which a link fails.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkFaultConfig {
    /// Seconds since the start.
    pub at_seconds: f64,
    /// Duration of the fault, seconds.
    pub for_seconds: f64,
    /// Name of the plugin instance.
    pub plugin: String,
    /// Kind of the link fault.
    pub kind: FaultKind,
}

/// Reads a scenario for the devices of a configuration.
///
/// # Errors
/// Every fault of the text, as [`crate::parse`] tells those of a configuration.
pub fn parse_scenario(text: &str, config: &Config) -> Result<ScenarioConfig, Vec<Diagnostic>> {
    let mut document = syntax::read(text)?;
    let names = FORM.former_names.rename(&mut document.value);
    document.positions.add_former(names.renamed.iter().cloned());
    let mut report = Report::new(&document.positions);
    report.add_renamed(&names);
    report.extend(document.duplicate_keys);
    report.count_more(document.more_duplicate_keys);
    structure::check(&document.value, &FORM, &mut report);
    let events = document.value["events"].as_array();
    for (index, event) in events.into_iter().flatten().enumerate() {
        let pointer = format!("/events/{index}");
        check_event(event, &pointer, config, &mut report);
    }
    if report.has_errors() {
        return Err(report.into_diagnostics());
    }
    match resolve::deserialize::<RawScenario>(document.value) {
        Ok(raw) => {
            let warnings = report.into_diagnostics();
            Ok(ScenarioConfig { warnings, ..resolved(raw) })
        }
        Err(fault) => {
            report.error(&fault.pointer, fault.cause, fault.remedy);
            Err(report.into_diagnostics())
        }
    }
}

fn check_event(event: &Value, pointer: &str, config: &Config, report: &mut Report<'_>) {
    let (subject, others) = match (event["tag"].as_str(), event["instance"].as_str()) {
        (Some(tag), None) => {
            check_tag_event(event, tag, pointer, config, report);
            ("tag", &["link", "for_seconds"][..])
        }
        (None, Some(instance)) => {
            check_link_fault(event, instance, pointer, config, report);
            ("instance", &["value", "over_seconds", "release"][..])
        }
        _ => {
            let remedy = "name either a \"tag\" or an \"instance\"";
            return report.error(pointer, "it happens to nothing, or to two things", remedy);
        }
    };
    for key in others.iter().filter(|key| !event[**key].is_null()) {
        report.error(
            &join_pointer(pointer, key),
            format!("'{key}' has no meaning beside '{subject}'"),
            "remove it, or make it an event of its own",
        );
    }
}

fn check_tag_event(
    event: &Value,
    id: &str,
    pointer: &str,
    config: &Config,
    report: &mut Report<'_>,
) {
    let at = |key: &str| join_pointer(pointer, key);
    let Some(tag) = config.tags.get(id) else {
        let known = config.tags.keys().map(String::as_str);
        let otherwise = || "name a tag of the configuration".to_owned();
        let remedy = suggestions::remedy(id, known, otherwise);
        return report.error(&at("tag"), format!("no tag '{}'", suggestions::shown(id)), remedy);
    };
    if tag.source().is_none() {
        let cause = format!("no device has the tag '{id}': it is derived");
        report.error(&at("tag"), cause, "name the tags that it is derived from");
    }
    if event["value"].is_number() == (event["release"] == true) {
        return report.error(
            pointer,
            "it says not, or twice, what the tag does",
            "write either a \"value\" or \"release\": true",
        );
    }
    if let Some(value) = event["value"].as_f64() {
        check_value(value, event["over_seconds"].as_f64(), tag, &at, report);
    }
}

fn check_value(
    value: f64,
    over: Option<f64>,
    tag: &TagConfig,
    at: &impl Fn(&str) -> String,
    report: &mut Report<'_>,
) {
    let most = match tag.value_type {
        ValueKind::F64 | ValueKind::I64 => {
            let (low, high) = (tag.range.low, tag.range.high);
            if low.is_some_and(|low| value < low) || high.is_some_and(|high| value > high) {
                let cause = format!("{value} lies outside the range of the tag");
                report.error(&at("value"), cause, "write a value that the tag can have");
            }
            return;
        }
        ValueKind::Bool => 1.0,
        ValueKind::DoublePoint => 3.0,
        ValueKind::Text => f64::from(u32::MAX),
    };
    if !(0.0..=most).contains(&value) || value.fract() != 0.0 {
        let cause = format!("the tag is never {value}");
        report.error(&at("value"), cause, format!("write a whole number from 0 to {most}"));
    }
    if over.is_some_and(|over| over > 0.0) {
        report.error(
            &at("over_seconds"),
            "a state or a text has no way to another",
            "remove it: they jump",
        );
    }
}

fn check_link_fault(
    event: &Value,
    instance: &str,
    pointer: &str,
    config: &Config,
    report: &mut Report<'_>,
) {
    let sources: BTreeSet<&str> =
        config.tags.values().filter_map(|tag| Some(tag.source()?.plugin.as_str())).collect();
    if !sources.contains(instance) {
        let otherwise = || "name the source of a tag".to_owned();
        let remedy = suggestions::remedy(instance, sources.iter().copied(), otherwise);
        let cause = format!("no tag has a source '{}'", suggestions::shown(instance));
        report.error(&join_pointer(pointer, "instance"), cause, remedy);
    }
    for key in ["link", "for_seconds"].into_iter().filter(|&key| event[key].is_null()) {
        report.error(
            pointer,
            format!("the key '{key}' is missing"),
            "write how the link fails, and for how long: \"link\": \"link-loss\", \"for_seconds\": 20",
        );
    }
}

fn resolved(raw: RawScenario) -> ScenarioConfig {
    let mut scenario = ScenarioConfig { description: raw.description, ..ScenarioConfig::default() };
    let mut events = raw.events;
    // Stable: what happens at once keeps the order of the text.
    events.sort_by(|a, b| a.at_seconds.total_cmp(&b.at_seconds));
    for event in events {
        let RawEvent { at_seconds, tag, value, over_seconds, instance, link, for_seconds, .. } =
            event;
        if let Some(tag) = tag {
            let value = value.map(|value| (value, over_seconds));
            scenario.events.push(ScenarioEventConfig { at_seconds, tag, value });
        } else if let (Some(plugin), Some(kind), Some(for_seconds)) = (instance, link, for_seconds)
        {
            let fault = LinkFaultConfig { at_seconds, for_seconds, plugin, kind };
            scenario.link_faults.push(fault);
        }
    }
    scenario
}
