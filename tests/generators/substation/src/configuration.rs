//! Busbar configuration of the station.

use serde_json::{Map, Value, json};

use crate::models::moving_parts;
use crate::{Placement, Station};

/// Folder of the models, beside the configuration.
const MODEL_FOLDER: &str = "station";

/// Least number of triangles of a reducible model; houses, walls and roads have fewer.
const MIN_REDUCED_TRIANGLES: usize = 1000;

impl Station {
    /// Returns the configuration that places the models: bays, devices in them, poles as instances.
    /// It has no tags yet.
    pub fn configuration(&self) -> Value {
        let models: Map<String, Value> = self
            .catalogue
            .iter()
            .map(|(name, entry)| {
                let file = format!("{MODEL_FOLDER}/{name}.glb");
                let meshes = entry.model.meshes.iter();
                let triangles: usize = meshes.map(|mesh| mesh.triangles.len()).sum();
                let mut configured = if triangles >= MIN_REDUCED_TRIANGLES {
                    json!({ "file": file, "optimizer": "optimizer", "theta": theta() })
                } else {
                    json!({ "file": file })
                };
                if let Some(parts) = moving_parts(name) {
                    configured["moving_parts"] = parts;
                }
                (name.to_owned(), configured)
            })
            .collect();
        json!({
            "version": 1,
            "plugin_directories": ["plugins"],
            "plugins": {
                "optimizer": { "plugin": "quadric_collapse" },
                "values": { "plugin": "power_overlay" }
            },
            "models": models,
            "scene": bays(&self.placements),
            "overlays": ["values"],
            "cameras": {
                "overview": { "eye": [92, 44, -124], "target": [2, 0, -26], "fov_degrees": 42 },
                "bay": { "eye": [20.5, 7.5, -73.5], "target": [5, 4.6, -50], "fov_degrees": 50 },
                "transformer": {
                    "eye": [-33.6, 10.2, -14],
                    "target": [-27.6, 4.2, 0],
                    "fov_degrees": 52
                }
            },
            "camera": { "start": "overview" },
            "window": { "size": [1280, 720] }
        })
    }
}

/// Returns the thetas of the models: full detail of near equipment, less of far equipment.
fn theta() -> Value {
    json!({
        "distance": [
            { "beyond": 0, "theta": 0 },
            { "beyond": 35, "theta": 0.5 },
            { "beyond": 80, "theta": 0.7 },
            { "beyond": 160, "theta": 0.85 }
        ]
    })
}

/// Groups runs of equal keys, in order of first use.
fn grouped<'p, K: PartialEq>(
    placements: impl IntoIterator<Item = &'p Placement>,
    key: impl Fn(&'p Placement) -> K,
) -> Vec<(K, Vec<&'p Placement>)> {
    let mut groups: Vec<(K, Vec<&Placement>)> = Vec::new();
    for placement in placements {
        let own = key(placement);
        match groups.iter_mut().find(|(known, _)| *known == own) {
            Some((_, members)) => members.push(placement),
            None => groups.push((own, vec![placement])),
        }
    }
    groups
}

fn bays(placements: &[Placement]) -> Vec<Value> {
    grouped(placements, |p| p.bay.as_str())
        .into_iter()
        .map(|(bay, members)| {
            let devices: Vec<Value> = grouped(members, Placement::device_id)
                .into_iter()
                .map(|(id, poles)| device(&id, &poles))
                .collect();
            json!({ "id": bay, "children": devices })
        })
        .collect()
}

/// Returns one node, or a group with one node and its instances for the phases.
fn device(id: &str, poles: &[&Placement]) -> Value {
    let Some((first, others)) = poles.split_first() else { return json!({ "id": id }) };
    let mut node = placed(first);
    node["model"] = json!(first.model);
    if first.phase.is_none() {
        return node;
    }
    node["instances"] = others.iter().map(|pole| placed(pole)).collect();
    json!({ "id": id, "children": [node] })
}

fn placed(placement: &Placement) -> Value {
    let [x, y, z] = placement.translation.to_array().map(f64::from);
    // Tenths of a millimetre: what is below is no place but noise.
    let metres = [x, y, z].map(|v| (v * 1e4).round() / 1e4);
    json!({
        "id": placement.id(),
        "transform": {
            "translation": metres,
            "rotation_degrees": [0.0, placement.yaw_degrees, 0.0]
        }
    })
}
