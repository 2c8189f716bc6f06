//! Nodes placed, tags specified, bindings resolved.

use std::collections::HashMap;
use std::time::Duration;

use busbar_config::{Config, join_pointer};
use busbar_scene::{ModelIndex, NodeIndex, Placement, PolicyIndex, SceneGraph, Transform};
use busbar_tags::{Scale, TagHandle, TagSet, TagSpec, TagSpecError};

use crate::diagnostics::DiagnosticsCollector;
use crate::loaded_scene::Binding;
use crate::models::{ImportedModels, ModelSource};

/// Names listed when a node does not exist.
const MAX_SUGGESTIONS: usize = 12;

/// The scene graph; `None` with a fault when it cannot be.
pub(crate) fn place(
    config: &Config,
    imported: &ImportedModels,
    faults: &mut DiagnosticsCollector<'_>,
) -> Option<SceneGraph> {
    let model_index = |name: &String| {
        config.models.keys().position(|key| key == name).map(|i| ModelIndex(i as u32))
    };
    // Own policies are counted in the order of their placements.
    let placements = config.scene.iter().scan(0, |next_policy, node| {
        let theta = node.theta.as_ref().map(|_| PolicyIndex(*next_policy));
        *next_policy += u32::from(theta.is_some());
        Some(Placement {
            id: node.id,
            parent: node.parent,
            transform: Transform {
                translation: node.transform.translation.into(),
                rotation_degrees: node.transform.rotation_degrees.into(),
                scale: node.transform.scale.into(),
            },
            model: node.model.as_ref().and_then(model_index),
            theta,
        })
    });
    let parts = imported.models.iter().map(ModelSource::parts).collect();
    SceneGraph::from_parts(placements, parts)
        .map_err(|error| {
            faults.add("/scene", error.to_string(), error.remedy());
        })
        .ok()
}

/// Tags in the order of their ids, which is the order of their handles; without the
/// derived ones' expressions where one of them cannot be.
pub(crate) fn tags(config: &Config, faults: &mut DiagnosticsCollector<'_>) -> TagSet {
    TagSet::new(tag_specs(config)).unwrap_or_else(|found| {
        for TagSpecError { id, cause, remedy } in found {
            let pointer = config.tags.get(&id).map_or("/tags", |tag| tag.pointer.as_str());
            faults.add(&join_pointer(pointer, "expression"), cause, remedy);
        }
        let plain = |spec| TagSpec { expression: None, ..spec };
        TagSet::new(tag_specs(config).into_iter().map(plain).collect()).unwrap_or_default()
    })
}

/// Returns the configured tags in the order of their ids, which is the order of their handles.
pub fn tag_specs(config: &Config) -> Vec<TagSpec> {
    config
        .tags
        .iter()
        .map(|(id, tag)| {
            let band = &tag.range;
            let range = (band.low.is_some() || band.high.is_some()).then(|| {
                band.low.unwrap_or(f64::NEG_INFINITY)..=band.high.unwrap_or(f64::INFINITY)
            });
            TagSpec {
                id: id.clone(),
                name: tag.name.clone(),
                kind: tag.value_type,
                unit: tag.unit.clone(),
                range,
                freshness: Duration::from_millis(tag.freshness_millis),
                scale: tag.scale.map(|[factor, offset]| Scale { factor, offset }),
                dead_band: tag.dead_band,
                expression: tag.expression().map(str::to_owned),
            }
        })
        .collect()
}

/// Bindings to nodes that exist.
pub(crate) fn resolve(
    config: &Config,
    graph: Option<&SceneGraph>,
    imported: &ImportedModels,
    faults: &mut DiagnosticsCollector<'_>,
) -> Vec<Binding> {
    let Some(graph) = graph else {
        return Vec::new();
    };
    // Ids are the keys of a sorted map: their rank is their handle.
    let handles: HashMap<&str, TagHandle> =
        config.tags.keys().zip(0..).map(|(id, rank)| (id.as_str(), TagHandle(rank))).collect();
    let mut resolved = Vec::with_capacity(config.bindings.len());
    for binding in &config.bindings {
        let Some(&tag) = handles.get(binding.tag.as_str()) else {
            continue;
        };
        let pointer = join_pointer(&binding.pointer, "node");
        if let Some(node) = find(config, graph, imported, &binding.node, &pointer, faults) {
            resolved.push(Binding { tag, node, role: binding.role.clone() });
        }
    }
    resolved
}

/// The node of an equipment id that stands at a pointer; a fault where there is none.
pub(crate) fn find(
    config: &Config,
    graph: &SceneGraph,
    imported: &ImportedModels,
    id: &str,
    pointer: &str,
    faults: &mut DiagnosticsCollector<'_>,
) -> Option<NodeIndex> {
    let found = graph.find(id);
    if found.is_none() && !model_failed(config, imported, id) {
        faults.add(pointer, format!("no node '{id}' in the scene"), suggest(graph, id));
    }
    found
}

/// Reports whether the node belongs to a model whose import failed; that fault is reported already.
fn model_failed(config: &Config, imported: &ImportedModels, node: &str) -> bool {
    let placement = node.split('/').next().unwrap_or(node);
    let model = config.scene.iter().find(|n| n.id == placement).and_then(|n| n.model);
    let index = model.and_then(|name| config.models.keys().position(|key| *key == name));
    index.is_some_and(|index| matches!(imported.models[index], ModelSource::Failed))
}

fn suggest(graph: &SceneGraph, node: &str) -> String {
    let placement = node.split('/').next().unwrap_or(node);
    let prefix = format!("{placement}/");
    let part = |id: String| Some(id.strip_prefix(&prefix)?.to_owned());
    let parts: Vec<_> = graph.nodes().filter_map(|node| part(node.id())).collect();
    if parts.is_empty() {
        return "name a node of the scene, or `node/part` for a part of its model".into();
    }
    let mut shown = parts[..parts.len().min(MAX_SUGGESTIONS)].join("', '");
    if parts.len() > MAX_SUGGESTIONS {
        shown += &format!("' and {} more", parts.len() - MAX_SUGGESTIONS);
    } else {
        shown.push('\'');
    }
    format!("'{placement}' has the parts '{shown}")
}
