//! Scenes of three sizes, as configurations with their model.

use std::path::{Path, PathBuf};

use busbar_geometry::WeldError;
use busbar_gltf_export::{ExportError, write_glb};
use serde_json::{Value, json};
use thiserror::Error;

use crate::equipment_model::equipment_model;

/// Pieces of equipment in a row, and the distance between pieces, metres.
const ROW: usize = 6;
const DISTANCE: f64 = 4.0;
/// Tags of each piece of equipment, set by the host.
const TAGS_PER_PIECE: usize = 3;
/// Time for which a value counts as fresh: longer than a measurement.
const FRESHNESS_SECONDS: u32 = 3600;
/// Role in which tags are bound: a value to be shown.
const ROLE: &str = "value";

/// Size of a generated scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneSize {
    /// One bay: 3 pieces of equipment.
    Bay,
    /// Switchyard with 18 pieces of equipment.
    Yard,
    /// Substation with 60 pieces of equipment, a million triangles.
    Substation,
}

impl SceneSize {
    /// Every size, the smallest first.
    pub const ALL: [Self; 3] = [Self::Bay, Self::Yard, Self::Substation];

    /// Name of the size in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bay => "bay",
            Self::Yard => "yard",
            Self::Substation => "substation",
        }
    }

    fn pieces(self) -> usize {
        match self {
            Self::Bay => 3,
            Self::Yard => 18,
            Self::Substation => 60,
        }
    }
}

/// Error that keeps a scene from being written.
#[derive(Debug, Error)]
pub enum GenerateError {
    /// The folder cannot be written.
    #[error("cannot write '{}': {error}; name a folder that may be written by TMPDIR", path.display())]
    Write {
        /// File that could not be written.
        path: PathBuf,
        /// Error of the system.
        error: std::io::Error,
    },
    /// The model contradicts itself, a fault of Busbar.
    #[error(transparent)]
    Model(#[from] ExportError),
    /// The model cannot be welded, a fault of Busbar.
    #[error(transparent)]
    Weld(#[from] WeldError),
    /// The configuration cannot be written as JSON, a fault of Busbar.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

/// Plugins of a generated scene.
#[derive(Clone, Debug, Default)]
pub struct ScenePlugins {
    /// Folders of plugin libraries.
    pub directories: Vec<PathBuf>,
    /// Plugin that gives the model its levels of detail; without it there is one.
    pub optimizer: Option<String>,
    /// Plugin that shows the tags' values at the equipment; without it nothing does.
    pub overlay: Option<String>,
}

/// Writes a scene into a folder; returns its configuration file.
///
/// # Errors
/// [`GenerateError`] names the file that cannot be written.
pub fn write_scene(
    folder: &Path,
    size: SceneSize,
    plugins: &ScenePlugins,
) -> Result<PathBuf, GenerateError> {
    let write = |name: String, bytes: &[u8]| {
        let path = folder.join(name);
        let written = std::fs::write(&path, bytes);
        written.map(|()| path.clone()).map_err(|error| GenerateError::Write { path, error })
    };
    write("equipment.glb".to_owned(), &write_glb(&equipment_model()?)?)?;
    let text = serde_json::to_vec_pretty(&configuration(size, plugins))?;
    write(format!("{}.json", size.name()), &text)
}

fn configuration(size: SceneSize, plugins: &ScenePlugins) -> Value {
    let pieces = 0..size.pieces();
    let place = |number: usize| {
        let [column, row] = [number % ROW, number / ROW].map(|at| at as f64 * DISTANCE);
        json!({ "translation": [column, 0.0, -row] })
    };
    let scene: Value = pieces
        .clone()
        .map(|number| json!({ "id": piece_id(number), "model": "equipment", "transform": place(number) }))
        .collect();
    let mut tags = serde_json::Map::new();
    let mut bindings = Vec::new();
    for (number, tag) in pieces.flat_map(|number| (0..TAGS_PER_PIECE).map(move |tag| (number, tag)))
    {
        let id = format!("{}.{tag}", piece_id(number));
        bindings.push(json!({ "tag": id, "node": piece_id(number), "role": ROLE }));
        tags.insert(
            id,
            json!({
                "type": "f64",
                "unit": "kV",
                "set_by_host": true,
                "freshness_seconds": FRESHNESS_SECONDS,
            }),
        );
    }
    let mut config = json!({
        "version": 1,
        "models": { "equipment": { "file": "equipment.glb" } },
        "scene": scene,
        "tags": tags,
        "plugin_directories": plugins.directories,
        "cache": { "directory": format!("cache_{}", size.name()) },
        "plugins": {},
    });
    if let Some(optimizer) = &plugins.optimizer {
        config["plugins"]["optimizer"] = json!({ "plugin": optimizer });
        config["models"]["equipment"]["optimizer"] = json!("optimizer");
    }
    if let Some(overlay) = &plugins.overlay {
        config["plugins"]["values"] = json!({ "plugin": overlay });
        config["overlays"] = json!(["values"]);
        config["bindings"] = json!(bindings);
    }
    config
}

/// Id of a piece of equipment (IEC 81346: a bay's switching device).
fn piece_id(number: usize) -> String {
    format!("=S1Q{number}")
}
