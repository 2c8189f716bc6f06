//! Rules for alarms beyond the schema: tags, overlays and equipment exist, conditions are of one
//! kind and fit their tags, limits are in order.

use std::collections::BTreeMap;

use busbar_types::{DoublePoint, Text};
use serde_json::Value;

use crate::item_names::{check_name_key, check_reference, item_pointer, named};
use crate::placement_rules::Equipment;
use crate::report::Report;
use crate::{join_pointer, suggestions};

/// The kinds of a condition.
const KINDS: [&str; 7] =
    ["high_high", "high", "low", "low_low", "equals", "differs", "bad_quality"];
/// Limits from the lowest up.
const LIMITS: [&str; 4] = ["low_low", "low", "high", "high_high"];

/// Reports every fault of meaning.
pub(crate) fn check(document: &Value, equipment: &Equipment<'_>, report: &mut Report<'_>) {
    // The limits of each tag: where each is, and its pointer.
    let mut limits: BTreeMap<&str, [Vec<(f64, String)>; LIMITS.len()]> = BTreeMap::new();
    for (name, alarm) in named(document, "alarms") {
        let pointer = item_pointer("alarms", name);
        check_name_key(name, &pointer, "alarm", report);
        if let Some(id) = alarm["equipment"].as_str() {
            check_equipment(id, equipment, &join_pointer(&pointer, "equipment"), report);
        }
        let suppression = &alarm["suppressed_by"];
        if alarm["mirrored"] == true {
            check_mirrored(alarm, &pointer, report);
            continue;
        }
        if suppression.is_object() {
            check_condition(
                document,
                suppression,
                &join_pointer(&pointer, "suppressed_by"),
                report,
            );
        }
        if alarm["verdict"].is_object() {
            check_verdict(document, alarm, &pointer, equipment, report);
            continue;
        }
        for key in ["tag", "condition"].into_iter().filter(|key| alarm[key].is_null()) {
            report.error(
                &pointer,
                format!("the alarm has no {key}"),
                format!(
                    "add \"{key}\", or a \"verdict\" of an overlay, or \"mirrored\": true where \
                     the host decides"
                ),
            );
        }
        check_condition(document, alarm, &pointer, report);
        let Some(tag) = alarm["tag"].as_str() else { continue };
        for (limit, index) in LIMITS.iter().zip(0..) {
            if let Some(at) = alarm["condition"][limit].as_f64() {
                let pointer = join_pointer(&join_pointer(&pointer, "condition"), limit);
                limits.entry(tag).or_default()[index].push((at, pointer));
            }
        }
    }
    check_ids(document, report);
    for (tag, limits) in limits {
        check_order(tag, &limits, report);
    }
}

/// Checks an alarm of an overlay's verdict: the overlay is one that runs, and nothing else decides.
fn check_verdict(
    document: &Value,
    alarm: &Value,
    pointer: &str,
    equipment: &Equipment<'_>,
    report: &mut Report<'_>,
) {
    for key in ["tag", "condition", "equipment"].into_iter().filter(|key| !alarm[key].is_null()) {
        let remedy = match key {
            "equipment" => "write it in \"verdict\"",
            _ => "remove it, or \"verdict\"",
        };
        report.key_error(
            &join_pointer(pointer, key),
            format!("the alarm rests on a verdict: \"{key}\" would decide nothing"),
            remedy,
        );
    }
    let (verdict, pointer) = (&alarm["verdict"], join_pointer(pointer, "verdict"));
    if let Some(id) = verdict["equipment"].as_str() {
        check_equipment(id, equipment, &join_pointer(&pointer, "equipment"), report);
    }
    let Some(instance) = verdict["instance"].as_str() else { return };
    let overlays = || {
        let overlays = document["overlays"].as_array();
        overlays.into_iter().flatten().filter_map(Value::as_str)
    };
    if overlays().any(|overlay| overlay == instance) {
        return;
    }
    report.error_with(&join_pointer(&pointer, "instance"), || {
        let shown = suggestions::shown(instance);
        let is_plugin = document["plugins"].get(instance).is_some();
        let cause = match is_plugin {
            true => format!("'{shown}' is not among the overlays, so that it judges nothing"),
            false => format!("there is no overlay '{shown}'"),
        };
        let add = || "add it to \"overlays\"".to_owned();
        (cause, suggestions::remedy(instance, overlays(), add))
    });
}

/// Reports an id that an alarm of another one's verdicts may have, on some equipment.
fn check_ids(document: &Value, report: &mut Report<'_>) {
    let is_template =
        |alarm: &Value| alarm["verdict"].is_object() && alarm["verdict"]["equipment"].is_null();
    for (name, _) in named(document, "alarms") {
        let mut starts = name.match_indices(':').map(|(end, _)| &name[..end]);
        if let Some(template) = starts.find(|start| is_template(&document["alarms"][*start])) {
            let template = suggestions::shown(template);
            report.key_error(
                &item_pointer("alarms", name),
                format!("an alarm of '{template}' on a piece of equipment may have this id"),
                "give it another id",
            );
        }
    }
}

/// Reports equipment that is not in the scene; `pointer` is where it is named.
pub(crate) fn check_equipment(
    id: &str,
    equipment: &Equipment<'_>,
    pointer: &str,
    report: &mut Report<'_>,
) {
    let placement = id.split_once('/').map_or(id, |(placement, _)| placement);
    if equipment.contains_key(placement) {
        return;
    }
    report.error_with(pointer, || {
        let cause = format!("no scene node has the id '{}'", suggestions::shown(placement));
        let add = || "add a node with that id to the scene".to_owned();
        (cause, suggestions::remedy(placement, equipment.keys().map(AsRef::as_ref), add))
    });
}

/// Checks that a mirrored alarm has no keys that decide on its states.
fn check_mirrored(alarm: &Value, pointer: &str, report: &mut Report<'_>) {
    let keys =
        ["tag", "condition", "verdict", "suppressed_by", "on_delay_seconds", "off_delay_seconds"];
    for key in keys.into_iter().filter(|key| !alarm[key].is_null()) {
        report.key_error(
            &join_pointer(pointer, key),
            format!("the alarm is mirrored: \"{key}\" would decide nothing"),
            "remove it, or \"mirrored\"",
        );
    }
}

/// A tag and what must hold of it.
fn check_condition(
    document: &Value,
    tag_condition: &Value,
    pointer: &str,
    report: &mut Report<'_>,
) {
    check_reference(
        &tag_condition["tag"],
        document["tags"].as_object(),
        pointer,
        "tag",
        "tag",
        report,
    );
    let condition = &tag_condition["condition"];
    let Some(members) = condition.as_object() else { return };
    let pointer = join_pointer(pointer, "condition");
    let is_kind = |key: &&str| members.contains_key(*key) && condition[*key] != false;
    let kinds: Vec<&str> = KINDS.into_iter().filter(is_kind).collect();
    let [kind] = kinds[..] else {
        let cause = match kinds.is_empty() {
            true => "the condition does not say what must hold".to_owned(),
            false => format!("the condition is of several kinds: {}", kinds.join(", ")),
        };
        report.error(&pointer, cause, format!("write one of {}", KINDS.join(", ")));
        return;
    };
    let is_limit = LIMITS.contains(&kind);
    if !is_limit && members.contains_key("deadband") {
        report.key_error(
            &join_pointer(&pointer, "deadband"),
            format!("a deadband has no meaning for \"{kind}\""),
            "remove it",
        );
    }
    let tag = tag_condition["tag"].as_str().unwrap_or_default();
    let Some(value_type) = document["tags"][tag]["type"].as_str() else { return };
    let at = join_pointer(&pointer, kind);
    if is_limit && !matches!(value_type, "f64" | "i64") {
        report.error(
            &at,
            format!("a tag of type '{value_type}' has no limits"),
            "compare with \"equals\" or \"differs\"",
        );
    }
    if matches!(kind, "equals" | "differs") {
        let wanted = match value_type {
            "bool" if !condition[kind].is_boolean() => "write true or false",
            "i64" if !condition[kind].is_i64() => "write a whole number",
            "double_point"
                if condition[kind].as_str().and_then(DoublePoint::from_name).is_none() =>
            {
                "write \"intermediate\", \"off\", \"on\" or \"bad_state\""
            }
            "text" if condition[kind].as_str().is_none_or(|text| Text::new(text).is_none()) => {
                "write a text of at most 255 bytes, without control characters"
            }
            "f64" => "write a limit: a measurement hardly equals anything",
            _ => return,
        };
        let cause = format!("a tag of type '{value_type}' is never {}", condition[kind]);
        report.error(&at, cause, wanted);
    }
}

/// Checks that each limit of a tag is beyond those before it.
fn check_order(tag: &str, limits: &[Vec<(f64, String)>; LIMITS.len()], report: &mut Report<'_>) {
    for (upper, index) in limits.iter().zip(0..) {
        for (at, pointer) in upper {
            let below = limits[..index]
                .iter()
                .zip(LIMITS)
                .flat_map(|(limits, name)| limits.iter().map(move |(below, _)| (*below, name)));
            let Some((below, name)) = below.into_iter().find(|(below, _)| below >= at) else {
                continue;
            };
            report.error(
                pointer,
                format!(
                    "{}, {at}, is not above {name}, {below}, of the same tag '{}'",
                    LIMITS[index],
                    suggestions::shown(tag)
                ),
                "order them low_low, low, high, high_high",
            );
        }
    }
}
