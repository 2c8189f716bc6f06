//! Configuration of the station with the fleet and its chart.

use serde_json::{Value, json};
use substation::Station;

use crate::{TRANSFORMERS, equipment, place};

/// Folder of models and samples, beside the configuration.
pub const FOLDER: &str = "models";
/// File name of the samples in it.
pub const SAMPLES: &str = "samples.csv";

/// Returns the configuration of the fleet; with `follow`, the camera moves to faults by itself.
pub fn configuration(station: &Station, follow: bool) -> Value {
    let mut config = station.configuration();
    if let Some(models) = config["models"].as_object_mut() {
        for model in models.values_mut() {
            let file = model["file"].as_str().unwrap_or_default();
            model["file"] = json!(format!("{FOLDER}/{file}"));
        }
    }
    let samples = format!("${{folder}}/{FOLDER}/{SAMPLES}");
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
        "instance": "gases",
        "position": [-33.0, 12.5, 52.0],
        "size": [66.0, 17.0, 26.0],
        "follow": follow
    });
    config["cameras"]["chart"] =
        json!({ "eye": [0, 27, 118], "target": [0, 13, 54], "fov_degrees": 44 });
    config["cameras"]["chart_aslant"] =
        json!({ "eye": [52, 34, 128], "target": [2, 15, 62], "fov_degrees": 44 });
    config["cameras"]["chart_above"] =
        json!({ "eye": [0, 62, 116], "target": [0, 19, 63], "fov_degrees": 40 });
    config["camera"]["start"] = json!("chart");
    config
}

/// Formats the configuration as text with one placement a line: readable, and a third of its
/// indented size.
pub fn text(station: &Station, follow: bool) -> String {
    let config = configuration(station, follow);
    let mut text = String::from("{\n");
    let members: Vec<_> = config.as_object().into_iter().flatten().collect();
    for (at, (name, member)) in members.iter().enumerate() {
        let comma = if at + 1 < members.len() { "," } else { "" };
        match member {
            Value::Array(all) if all.len() > 1 => {
                let rows: Vec<String> = all.iter().map(|one| format!("    {one}")).collect();
                text += &format!("  \"{name}\": [\n{}\n  ]{comma}\n", rows.join(",\n"));
            }
            Value::Object(all) if all.len() > 1 => {
                let row = |(key, one): (&String, &Value)| format!("    \"{key}\": {one}");
                let rows: Vec<String> = all.iter().map(row).collect();
                text += &format!("  \"{name}\": {{\n{}\n  }}{comma}\n", rows.join(",\n"));
            }
            other => text += &format!("  \"{name}\": {other}{comma}\n"),
        }
    }
    text + "}\n"
}
