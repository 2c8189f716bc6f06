//! Points and proposals as a configuration.

use std::collections::BTreeMap;

use busbar_types::ValueKind;
use serde_json::{Map, Value, json};

use crate::catalogue::Catalogue;
use crate::fault::ListFault;
use crate::matching::{Candidate, Proposal, TagName, propose};
use crate::point::Point;

/// Name of the only model and of its camera.
const MODEL: &str = "model";
const CAMERA: &str = "overview";
/// Vertical field of view of the camera, degrees.
pub const FOV_DEGREES: f32 = 40.0;

/// An instance of a plugin.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginInstance {
    /// Name that the scene uses.
    pub name: String,
    /// Id of the plugin.
    pub plugin: String,
    /// Settings, handed to it as they are.
    pub settings: Map<String, Value>,
}

/// Parts of the scene besides points.
#[derive(Clone, Debug, Default)]
pub struct SceneParts {
    /// Equipment id of the model's place.
    pub id: String,
    /// Path of the model as the configuration has it.
    pub model: String,
    /// Directories of plugins as the configuration has them.
    pub plugin_directories: Vec<String>,
    /// Plugins that bring the tags.
    pub plugins: Vec<PluginInstance>,
    /// Ids of overlay plugins.
    pub overlays: Vec<String>,
    /// Id of the plugin that simplifies the model.
    pub optimizer: Option<String>,
    /// Position and target of the camera, metres.
    pub camera: Option<[[f32; 3]; 2]>,
}

/// Assigns each point to the plugin that reads it. Reports faults for instances that were not
/// asked for, and for points without instance where there are several.
pub fn assign_plugins(points: &mut Vec<Point>, plugins: &[PluginInstance]) -> Vec<ListFault> {
    let names: Vec<&str> = plugins.iter().map(|plugin| plugin.name.as_str()).collect();
    let known = names.join("', '");
    let mut faults = Vec::new();
    points.retain_mut(|point| {
        let cause = match (point.plugin.as_str(), names.as_slice()) {
            ("", [only]) => {
                point.plugin = (*only).to_owned();
                return true;
            }
            ("", _) => "the row names no plugin, and there are several".to_owned(),
            (name, names) if names.contains(&name) => return true,
            (name, _) => format!("there is no plugin '{name}'"),
        };
        let remedy = format!("name one of '{known}', or add --plugin NAME=PLUGIN_ID");
        faults.push(ListFault::new(point.line, "plugin", cause, remedy));
        false
    });
    faults
}

/// The node of each point: that which the list names, or the one proposed. A node that
/// the list names and the model has not is a fault, and its point is taken out.
pub fn place(points: &mut Vec<Point>, model: &Catalogue) -> (Vec<Proposal>, Vec<ListFault>) {
    let mut faults = Vec::new();
    points.retain(|point| {
        let node = point.node.as_str();
        if node.is_empty() || model.named(node).is_some() {
            return true;
        }
        let (cause, remedy) = if model.is_shared_name(node) {
            let cause = format!("several nodes of the model are called '{node}'");
            (cause, "write the id that the scene gives it, ID/NAME".to_owned())
        } else {
            let example =
                model.example().map_or(String::new(), |node| format!(", such as '{node}'"));
            let remedy = format!("name a node or feature of the model{example}, or leave it empty");
            (format!("the model has no node '{node}'"), remedy)
        };
        faults.push(ListFault::new(point.line, "node", cause, remedy));
        false
    });
    let names: Vec<_> = points.iter().map(name_of).collect();
    let mut proposals = propose(&names, model);
    for (point, proposal) in points.iter().zip(&mut proposals) {
        if let Some(node) = model.named(&point.node) {
            let reason = "the list says so".to_owned();
            let node = node.to_owned();
            *proposal = Proposal {
                node: Some(node.clone()),
                candidates: vec![Candidate {
                    node,
                    confidence: 1.0,
                    reason: reason.clone(),
                    is_possible: true,
                }],
                reason,
            };
        }
    }
    (proposals, faults)
}

fn name_of(point: &Point) -> TagName<'_> {
    TagName {
        id: &point.tag,
        description: &point.description,
        unit: &point.unit,
        is_position: point.value_type == ValueKind::DoublePoint,
        is_state: !point.value_type.is_quantity(),
    }
}

/// Builds the configuration as JSON.
pub fn scene(parts: &SceneParts, points: &[Point], proposals: &[Proposal]) -> Value {
    let mut plugins: BTreeMap<String, Value> = BTreeMap::new();
    for plugin in &parts.plugins {
        let instance = json!({ "plugin": plugin.plugin, "settings": plugin.settings });
        plugins.insert(plugin.name.clone(), instance);
    }
    for id in parts.overlays.iter().chain(&parts.optimizer) {
        plugins.insert(id.clone(), json!({ "plugin": id }));
    }
    let mut model = json!({ "file": parts.model });
    if let Some(optimizer) = &parts.optimizer {
        model["optimizer"] = json!(optimizer);
    }
    let bound = points.iter().zip(proposals).filter_map(|(point, proposal)| {
        let node = proposal.node.as_ref()?;
        Some(json!({ "tag": point.tag, "node": node, "role": role(point) }))
    });
    let mut scene = json!({
        "version": 1,
        "plugin_directories": parts.plugin_directories,
        "plugins": plugins,
        "models": { MODEL: model },
        "scene": [{ "id": parts.id, "model": MODEL }],
        "tags": tags_of(points),
        "bindings": bound.collect::<Vec<_>>(),
        "overlays": parts.overlays,
    });
    if let Some([eye, target]) = parts.camera {
        let camera = json!({ "eye": eye, "target": target, "fov_degrees": FOV_DEGREES });
        scene["cameras"] = json!({ CAMERA: camera });
        scene["camera"] = json!({ "start": CAMERA });
    }
    scene
}

/// Points as tags of a configuration, `{"tags": {...}}`, without a scene.
pub fn tags(points: &[Point]) -> Value {
    json!({ "tags": tags_of(points) })
}

fn tags_of(points: &[Point]) -> Map<String, Value> {
    points.iter().map(|point| (point.tag.clone(), tag(point))).collect()
}

fn tag(point: &Point) -> Value {
    let mut tag = json!({
        "type": point.value_type.name(),
        "source": { "instance": point.plugin, "address": point.address },
    });
    if !point.description.is_empty() {
        tag["name"] = json!(point.description);
    }
    if !point.unit.is_empty() && point.value_type != ValueKind::Text {
        tag["unit"] = json!(point.unit);
    }
    for (key, [low, high]) in [("range", point.range), ("limits", point.limits)] {
        if low.is_some() || high.is_some() {
            tag[key] = json!({ "low": low, "high": high });
        }
    }
    if let Some(millis) = point.freshness_millis {
        tag["freshness_seconds"] = json!(millis as f64 / 1_000.0);
    }
    if let Some([factor, offset]) = point.scale {
        tag["scale"] = json!({ "factor": factor, "offset": offset });
    }
    tag
}

fn role(point: &Point) -> &str {
    match (point.role.as_str(), point.value_type) {
        ("", ValueKind::DoublePoint) => "position",
        ("", _) => "value",
        (role, _) => role,
    }
}
