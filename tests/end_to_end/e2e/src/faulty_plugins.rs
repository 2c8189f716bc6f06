//! Faulty plugins in C for the tests of isolation, several in one library.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::{finish, workspace_path};

/// Name of the library's file.
const LIBRARY: &str = "libtrouble.so";

/// Folder with the library in its plugin directory, and a configuration of one node without a
/// model, three tags and one plugin.
pub struct FaultyPluginScene {
    folder: TempDir,
    /// Configuration; after a change call [`FaultyPluginScene::write`].
    pub config: Value,
}

/// Compiles the library into a folder.
///
/// # Panics
/// When there is no compiler.
pub fn compile(folder: &Path) {
    let mut gcc = Command::new("gcc");
    gcc.args(["-shared", "-fPIC", "-O2", "-pthread", "-Wall", "-Wextra", "-Werror", "-I"]);
    gcc.arg(workspace_path("plugins/sdk/abi/include"));
    gcc.arg(workspace_path("tests/end_to_end/e2e/trouble/trouble.c"));
    finish(gcc.arg("-o").arg(folder.join(LIBRARY))).expect_code(0);
}

impl FaultyPluginScene {
    /// Compiles the library; the configuration uses this plugin, as `trouble`.
    ///
    /// # Panics
    /// When there is no compiler.
    pub fn with_plugin(plugin: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let plugins = folder.path().join("plugins");
        std::fs::create_dir(&plugins).expect("it can be written");
        compile(&plugins);
        let is_overlay = ["trouble.echo", "trouble.slow", "trouble.socket"].contains(&plugin);
        let mut config = json!({
            "version": 1,
            "plugin_directories": ["plugins"],
            "plugins": { "trouble": { "plugin": plugin } },
            "scene": [{ "id": "=N1" }],
            "window": { "size": [64, 64] },
            "graphics": { "samples": 1 }
        });
        let source = if is_overlay {
            config["overlays"] = json!(["trouble"]);
            config["plugins"]["source"] = json!({ "plugin": "trouble.steady" });
            "source"
        } else {
            "trouble"
        };
        for id in ["A", "B", "C"] {
            config["tags"][id] =
                json!({ "type": "f64", "source": { "instance": source, "address": {} } });
        }
        config["bindings"] = json!([{ "tag": "A", "node": "=N1" }]);
        Self { folder, config }
    }

    /// Returns the path of the library.
    pub fn library(&self) -> PathBuf {
        self.path("plugins").join(LIBRARY)
    }

    /// Returns a path in the scene's folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes the configuration; returns its path.
    ///
    /// # Panics
    /// When it cannot be written.
    pub fn write(&self) -> PathBuf {
        let path = self.path("scene.json");
        std::fs::write(&path, self.config.to_string()).expect("the folder can be written");
        path
    }
}
