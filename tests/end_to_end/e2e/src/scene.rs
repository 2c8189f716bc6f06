//! Test scenes: configurations in folders of their own.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::{Stats, built, built_folder, busbar, workspace_path};

/// Plugins that the demo names, and one more optimiser.
const PLUGINS: [&str; 7] = [
    "energisation",
    "gas_analysis",
    "modbus_adapter",
    "power_overlay",
    "quadric_collapse",
    "switch_position",
    "weighted_collapse",
];
/// Poll period of the tests: several polls within a second.
const POLL: Duration = Duration::from_millis(100);

/// Number of yards in [`Scene::yards`].
pub const YARDS: usize = 3;
/// Number of rows of breakers in each yard.
const YARD_ROWS: usize = 4;
const YARD_COLUMNS: usize = 5;

/// Configuration made from `config/demo.json`, in a temporary folder with its plugins and models.
pub struct Scene {
    folder: TempDir,
    /// Configuration; after a change call [`Scene::write`].
    pub config: Value,
}

impl Scene {
    /// Creates the demo scene with its device at this port.
    ///
    /// # Panics
    /// When the plugins or models are not built.
    pub fn demo(port: u16) -> Self {
        let text = fs::read(workspace_path("config/demo.json")).expect("the demo is there");
        let mut config: Value = serde_json::from_slice(&text).expect("the demo is JSON");
        let settings = &mut config["plugins"]["bay"]["settings"];
        settings["port"] = port.into();
        settings["poll_seconds"] = POLL.as_secs_f64().into();
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        fs::create_dir(folder.path().join("plugins")).expect("it can be written");
        let scene = Self { folder, config };
        PLUGINS.iter().for_each(|plugin| scene.add_plugin(plugin));
        let models = built(workspace_path("config/models").join("transformer.glb"));
        let models = models.parent().expect("it is in a folder");
        symlink(models, scene.path("models")).expect("it can be written");
        scene
    }

    /// Creates yards of breakers, 60 m apart along x; their detail follows half a pixel of error.
    pub fn yards() -> Self {
        let mut scene = Self::without_tags();
        let mut breaker = scene.config["models"]["breaker"].take();
        breaker["theta"] = json!({ "max_error_px": 0.5 });
        scene.config["models"] = json!({ "breaker": breaker });
        let place = |x: usize, z: usize| json!({ "translation": [6 * x, 0, 6 * z] });
        let breaker = |yard: usize, number: usize| {
            json!({
                "id": format!("=Y{yard}Q{number}"),
                "model": "breaker",
                "transform": place(number % YARD_COLUMNS, number / YARD_COLUMNS),
            })
        };
        let yard = |number: usize| {
            let breakers: Value =
                (0..YARD_ROWS * YARD_COLUMNS).map(|i| breaker(number, i)).collect();
            let transform = json!({
                "translation": [60 * number, 0, 0],
                "rotation_degrees": [0, 30 * number, 0],
            });
            json!({ "id": format!("=Y{number}"), "transform": transform, "children": breakers })
        };
        scene.config["scene"] = (0..YARDS).map(yard).collect();
        scene
    }

    /// Creates a scene of the demo's equipment without tags, labels and the plugins for them.
    pub fn without_tags() -> Self {
        let mut scene = Self::demo(1);
        let config = scene.config.as_object_mut().expect("the demo is an object");
        for key in ["tags", "bindings", "overlays"] {
            config.remove(key);
        }
        let optimizer = config["plugins"]["optimizer"].take();
        config.insert("plugins".into(), json!({ "optimizer": optimizer }));
        scene
    }

    /// Copies a plugin's library into the scene's plugin directory.
    ///
    /// # Panics
    /// When the plugin is not built.
    pub fn add_plugin(&self, plugin: &str) {
        let library = built(built_folder().join(library_name(plugin)));
        let lent = self.library(plugin);
        if lent.exists() {
            // A copy onto a link of itself would leave nothing.
            return;
        }
        // No link: libraries outside of their directory are refused.
        let linked = fs::hard_link(&library, &lent);
        linked.or_else(|_| fs::copy(&library, &lent).map(drop)).expect("a copy");
    }

    /// Returns the command that renders a small picture after so many seconds, and statistics for
    /// [`Scene::stats`].
    pub fn rendering(&self, seconds: f64) -> Command {
        let mut command = busbar();
        command.arg("render").arg(self.write()).args(["--size", "320x180"]);
        command.arg("--out").arg(self.path("picture.png"));
        command.arg("--stats").arg(self.path("stats.json"));
        command.args(["--seconds", &seconds.to_string()]);
        command
    }

    /// Reads the statistics that a rendering left.
    pub fn stats(&self) -> Stats {
        Stats::read(&self.path("stats.json"))
    }

    /// Returns a path in the scene's folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the path of a plugin's library in the scene's plugin directory.
    pub fn library(&self, plugin: &str) -> PathBuf {
        self.path("plugins").join(library_name(plugin))
    }

    /// Writes the configuration; returns its path.
    pub fn write(&self) -> PathBuf {
        self.write_text(&serde_json::to_string_pretty(&self.config).expect("values are JSON"))
    }

    /// Writes this text as the configuration; returns its path.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn write_text(&self, text: &str) -> PathBuf {
        let path = self.path("scene.json");
        fs::write(&path, text).expect("the folder can be written");
        path
    }
}

fn library_name(plugin: &str) -> String {
    format!("lib{plugin}.{}", std::env::consts::DLL_EXTENSION)
}
