//! The station with the fleet and its chart, as a configuration.

use std::path::Path;

use serde_json::{Value, json};
use substation::Station;

use crate::{TRANSFORMERS, equipment, place};

/// The configuration, whose samples are in `samples`, an absolute path; `follow` says whether
/// the camera goes to faults by itself.
pub fn configuration(station: &Station, samples: &Path, follow: bool) -> Value {
    let mut config = station.configuration();
    config["plugins"]["gases"] = json!({
        "plugin": "gas_analysis",
        "settings": { "fleet": { "file": samples } }
    });
    if let Some(scene) = config["scene"].as_array_mut() {
        scene.extend((2..TRANSFORMERS).map(|transformer| {
            let [x, z] = place(transformer);
            let id = equipment(transformer);
            let bay = id.trim_end_matches("-TA1");
            json!({ "id": bay, "children": [
                { "id": id, "model": "transformer", "transform": { "translation": [x, 0.0, z] } },
                {
                    "id": format!("{bay}-UP1"), "model": "oil_pit",
                    "transform": { "translation": [x, 0.0, z] }
                }
            ] })
        }));
    }
    config["chart"] = json!({
        "plugin": "gases",
        "position": [-33.0, 12.5, 52.0],
        "size": [66.0, 17.0, 26.0],
        "follow": follow
    });
    config["cameras"]["chart"] =
        json!({ "eye": [0, 27, 118], "target": [0, 13, 54], "fov_degrees": 44 });
    config["cameras"]["chart_aslant"] =
        json!({ "eye": [52, 34, 128], "target": [2, 15, 62], "fov_degrees": 44 });
    config["view"]["camera"] = json!("chart");
    config
}
