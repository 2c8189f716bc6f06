//! Generated station: its files and its scenarios.

use std::fs;
use std::path::PathBuf;

use anyhow::{Result, bail};

use crate::process;
use crate::stage;
use crate::workspace::{Profile, Workspace};

/// Output folder of the generated station.
const FOLDER: &str = "target/substation";

/// Files of the generated station.
pub(crate) struct Station {
    folder: PathBuf,
}

impl Station {
    /// Generates the station by a program of a profile, and lends it the staged plugins.
    pub(crate) fn generate(workspace: &Workspace, profile: Profile) -> Result<Self> {
        let folder = workspace.path(FOLDER);
        let mut generate = process::cargo();
        generate.args(["run", "--profile", profile.name(), "-p", "substation", "--"]).arg(&folder);
        process::run(generate.current_dir(&workspace.root))?;
        stage::link_plugins(workspace, &folder)?;
        Ok(Self { folder })
    }

    /// Returns the path of the configuration without tags.
    pub(crate) fn scene(&self) -> PathBuf {
        self.folder.join("station.json")
    }

    /// Returns the path of the configuration with all points.
    pub(crate) fn live(&self) -> PathBuf {
        self.folder.join("live.json")
    }

    /// Returns the path of a scenario.
    ///
    /// # Errors
    /// When no scenario has that name; the message lists them.
    pub(crate) fn scenario(&self, name: &str) -> Result<PathBuf> {
        let folder = self.folder.join("scenarios");
        let file = folder.join(format!("{name}.json"));
        if file.is_file() {
            return Ok(file);
        }
        let mut known: Vec<String> = fs::read_dir(&folder)?
            .filter_map(|entry| entry.ok()?.path().file_stem()?.to_str().map(str::to_owned))
            .collect();
        known.sort();
        bail!("there is no scenario '{name}': name one of {}", known.join(", "))
    }
}
