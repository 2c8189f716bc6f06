//! Scene that faults are injected into, and its plugins' libraries.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use e2e::glb::{self, WeldedMesh};
use fault_injector::{Fault, LIBRARY_STEM, PLUGIN_ID, armed_fault_path, fault_time_path};
use serde_json::{Map, Value, json};
use tempfile::TempDir;

use crate::injection::Role;

/// Number of plugins in each role: enough for the faults that strike only once in a scene's life.
const COUNTS: [(Role, usize); 3] =
    [(Role::Telemetry, 16), (Role::Overlay, 12), (Role::Optimizer, 20)];
/// Name of the healthy plugin, which must not be affected.
pub(crate) const HEALTHY: &str = "healthy";
/// Tags of each telemetry plugin.
pub(crate) const TAGS: usize = 2;
/// Freshness limit of a faulty plugin's values, milliseconds.
pub(crate) const FRESHNESS_MILLIS: u64 = 400;
/// Freshness limit of the healthy plugin, milliseconds: longer than delays of a loaded machine.
const HEALTHY_FRESHNESS_MILLIS: u64 = 2000;
/// Deadline of a call, milliseconds; a hang takes no longer.
const CALL_MILLIS: u64 = 1000;
/// Number of quads along a side of the models.
const SIDE: usize = 4;

/// Scene folder with a configuration, a model, and a copy of the library for each plugin.
pub(crate) struct FaultScene {
    folder: TempDir,
    /// Installed copies of the faulty plugin.
    pub(crate) plugins: Vec<Installed>,
}

/// Installed copy of the library.
#[derive(Clone, Debug)]
pub(crate) struct Installed {
    pub(crate) name: String,
    pub(crate) role: Role,
    library: PathBuf,
}

impl FaultScene {
    /// Creates the folder with copies of the library.
    pub(crate) fn new(library: &Path) -> Result<Self> {
        let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
        let plugin_folder = folder.path().join("plugins");
        fs::create_dir(&plugin_folder)?;
        let install = |name: &str| -> Result<PathBuf> {
            let copy = plugin_folder.join(format!("{LIBRARY_STEM}_{name}.so"));
            fs::copy(library, &copy)
                .with_context(|| format!("cannot copy {}", library.display()))?;
            Ok(copy)
        };
        let mut plugins = Vec::new();
        for (role, count) in COUNTS {
            for index in 0..count {
                let name = format!("{role:?}{index:02}").to_lowercase();
                let library = install(&name)?;
                plugins.push(Installed { name, role, library });
            }
        }
        install(HEALTHY)?;
        fs::write(folder.path().join("sheet.glb"), glb::write(&sheet()))?;
        let site = Self { folder, plugins };
        fs::write(site.config(), site.configuration().to_string())?;
        Ok(site)
    }

    /// Returns the path of the configuration file.
    pub(crate) fn config(&self) -> PathBuf {
        self.folder.path().join("scene.json")
    }

    fn configuration(&self) -> Value {
        let (mut plugins, mut tags) = (Map::new(), Map::new());
        let (mut models, mut nodes, mut overlays) = (Map::new(), Vec::new(), Vec::new());
        let mut add = |name: &str| {
            let id = format!("{PLUGIN_ID}_{name}");
            plugins.insert(name.to_owned(), json!({ "plugin": id, "network": false }));
        };
        add(HEALTHY);
        let mut serve = |name: &str, freshness: u64| {
            for index in 0..TAGS {
                let source = json!({ "instance": name, "address": {} });
                let tag = json!({ "type": "f64", "source": source, "freshness_seconds": freshness as f64 / 1_000.0 });
                tags.insert(tag_of(name, index), tag);
            }
        };
        serve(HEALTHY, HEALTHY_FRESHNESS_MILLIS);
        for Installed { name, role, .. } in &self.plugins {
            add(name);
            match role {
                Role::Telemetry => serve(name, FRESHNESS_MILLIS),
                Role::Overlay => overlays.push(name.clone()),
                Role::Optimizer => {
                    models.insert(name.clone(), json!({ "file": "sheet.glb", "optimizer": name }));
                    nodes.push(json!({ "id": format!("={name}"), "model": name }));
                }
            }
        }
        let node = nodes[0]["id"].clone();
        json!({
            "version": 1,
            "plugin_directories": ["plugins"],
            "plugins": plugins,
            "supervision": {
                "restart_seconds": 0, "max_deaths": 0,
                "call_seconds": CALL_MILLIS as f64 / 1_000.0, "optimize_seconds": CALL_MILLIS as f64 / 1_000.0
            },
            "cache": { "max_megabytes": 0 },
            "models": models,
            "scene": nodes,
            "tags": tags,
            "bindings": [{ "tag": tag_of(HEALTHY, 0), "node": node }],
            "overlays": overlays,
            "window": { "size": [64, 64] },
            "graphics": { "samples": 1 }
        })
    }
}

/// Returns the id of a plugin's tag by its index.
pub(crate) fn tag_of(plugin: &str, index: usize) -> String {
    format!("{plugin}.{index}")
}

impl Installed {
    /// Arms a fault for the plugin's next process, in place of an older one.
    pub(crate) fn arm(&self, fault: Fault) -> Result<()> {
        self.disarm()?;
        let fuse = armed_fault_path(&self.library);
        // Whole or not at all: the plugin may be looking.
        let draft = fuse.with_extension("draft");
        fs::write(&draft, serde_json::to_vec(&fault)?)?;
        fs::rename(&draft, &fuse).context("cannot lay a fault ready")
    }

    /// Returns the instant of the fault's strike, nanoseconds since 1970.
    pub(crate) fn struck(&self) -> Option<u128> {
        fs::read_to_string(fault_time_path(&self.library)).ok()?.parse().ok()
    }

    /// Disarms the fault, and removes its trace.
    pub(crate) fn disarm(&self) -> Result<()> {
        for path in [armed_fault_path(&self.library), fault_time_path(&self.library)] {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(error).with_context(|| format!("cannot remove {}", path.display()));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Builds a flat sheet of triangles.
fn sheet() -> WeldedMesh {
    let index = |x: usize, y: usize| y * (SIDE + 1) + x;
    let mut mesh = WeldedMesh::default();
    for y in 0..=SIDE {
        mesh.positions.extend((0..=SIDE).map(|x| [x as f32, y as f32, 0.0]));
    }
    for y in 0..SIDE {
        for x in 0..SIDE {
            let [a, b] = [index(x, y), index(x + 1, y)];
            let [c, d] = [index(x, y + 1), index(x + 1, y + 1)];
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}
