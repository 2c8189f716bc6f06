//! Alarms as configured, on the tags and nodes of a scene.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use busbar_alarms::{
    AlarmSet, AlarmSource, AlarmSpec, AlarmTemplate, Condition, TagCondition, VerdictCondition,
};
use busbar_config::{
    AlarmConfig, AlarmOriginConfig, ConditionConfig, Config, TagConditionConfig,
    VerdictSeverityConfig, join_pointer,
};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::{TagHandle, TagSet};
use busbar_types::Severity;

use crate::bindings;
use crate::diagnostics::DiagnosticsCollector;
use crate::loaded_scene::LoadedAlarms;
use crate::models::ImportedModels;

/// Alarms in the order of their ids, which is that of their handles.
pub(crate) fn resolve(
    config: &Config,
    tags: &TagSet,
    graph: Option<&SceneGraph>,
    imported: &ImportedModels,
    nodes_of_tags: &HashMap<TagHandle, NodeIndex>,
    faults: &mut DiagnosticsCollector<'_>,
) -> LoadedAlarms {
    // Ids are the keys of a sorted map: their rank is their handle.
    let handles: HashMap<&str, TagHandle> =
        config.tags.keys().zip(0..).map(|(id, rank)| (id.as_str(), TagHandle(rank))).collect();
    let (mut specs, mut nodes, mut templates) = (Vec::new(), Vec::new(), Vec::new());
    for (id, alarm) in &config.alarms {
        let mut spec = spec(id, alarm, &handles);
        if alarm.equipment.is_none() {
            match AlarmTemplate::new(spec) {
                Ok(template) => {
                    templates.push(template);
                    continue;
                }
                Err(own) => spec = *own,
            }
        }
        let of_tag = match &spec.source {
            AlarmSource::Tag { trigger, .. } => nodes_of_tags.get(&trigger.tag).copied(),
            AlarmSource::Verdict { .. } | AlarmSource::Mirrored => None,
        };
        nodes.push(match (&alarm.equipment, graph) {
            (Some(equipment), Some(graph)) => {
                let pointer = match &spec.source {
                    AlarmSource::Verdict { .. } => join_pointer(&alarm.pointer, "verdict"),
                    AlarmSource::Tag { .. } | AlarmSource::Mirrored => alarm.pointer.clone(),
                };
                let pointer = join_pointer(&pointer, "equipment");
                bindings::find(config, graph, imported, equipment, &pointer, faults)
            }
            _ => of_tag,
        });
        specs.push(spec);
    }
    let sources = config.alarm_handling.sources.iter();
    for (source, graph) in sources.filter_map(|source| Some((source, graph?))) {
        let rules = join_pointer(&source.pointer, "equipment");
        for (start, equipment) in &source.equipment {
            bindings::find(
                config,
                graph,
                imported,
                equipment,
                &join_pointer(&rules, start),
                faults,
            );
        }
    }
    // Templates are checked as if each were one alarm.
    let all = specs.iter().chain(templates.iter().map(AlarmTemplate::spec)).cloned().collect();
    let set = AlarmSet::new(all, tags).and_then(|_| AlarmSet::new(specs, tags));
    let set = set.unwrap_or_else(|found| {
        for fault in found {
            let alarm = config.alarms.get(&fault.id);
            let pointer = alarm.map_or("/alarms", |alarm| alarm.pointer.as_str());
            faults.add(pointer, fault.cause, fault.remedy);
        }
        AlarmSet::default()
    });
    LoadedAlarms { set: Arc::new(set), templates: templates.into(), nodes: nodes.into() }
}

fn spec(id: &str, alarm: &AlarmConfig, handles: &HashMap<&str, TagHandle>) -> AlarmSpec {
    let tag_condition = |condition_config: &TagConditionConfig| TagCondition {
        // The rules ensure that the tag is there.
        tag: handles.get(condition_config.tag.as_str()).copied().unwrap_or(TagHandle(u32::MAX)),
        condition: condition(&condition_config.condition),
    };
    AlarmSpec {
        id: id.to_owned(),
        message: alarm.message.clone(),
        consequence: alarm.consequence.clone(),
        response: alarm.response.clone(),
        equipment: alarm.equipment.clone(),
        priority: alarm.priority,
        latched: alarm.latched,
        group: alarm.group.clone(),
        source: match &alarm.origin {
            AlarmOriginConfig::Mirrored => AlarmSource::Mirrored,
            AlarmOriginConfig::Verdict {
                overlay,
                severity,
                on_delay_seconds,
                off_delay_seconds,
                suppressed_by,
            } => AlarmSource::Verdict {
                trigger: VerdictCondition {
                    overlay: overlay.clone(),
                    equipment: alarm.equipment.clone().unwrap_or_default(),
                    severity: match severity {
                        VerdictSeverityConfig::Warning => Severity::Warning,
                        VerdictSeverityConfig::Alarm => Severity::Alarm,
                    },
                },
                on_delay: Duration::from_secs_f64(*on_delay_seconds),
                off_delay: Duration::from_secs_f64(*off_delay_seconds),
                suppressed_by: suppressed_by.as_ref().map(tag_condition),
            },
            AlarmOriginConfig::Tag {
                trigger: of,
                on_delay_seconds,
                off_delay_seconds,
                suppressed_by,
            } => AlarmSource::Tag {
                trigger: tag_condition(of),
                on_delay: Duration::from_secs_f64(*on_delay_seconds),
                off_delay: Duration::from_secs_f64(*off_delay_seconds),
                suppressed_by: suppressed_by.as_ref().map(tag_condition),
            },
        },
    }
}

fn condition(condition: &ConditionConfig) -> Condition {
    match condition {
        &ConditionConfig::Limit { limit, at, deadband } => Condition::Limit { limit, at, deadband },
        ConditionConfig::Equals(value) => Condition::Equals(value.clone()),
        ConditionConfig::Differs(value) => Condition::Differs(value.clone()),
        ConditionConfig::BadQuality => Condition::BadQuality,
    }
}
