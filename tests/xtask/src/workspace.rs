//! Paths of the workspace: root, target folder, plugins, built programs.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX, EXE_SUFFIX};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use serde::Deserialize;

use crate::process;

/// Cargo profile of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Profile {
    /// Development profile: quick to build, checks on.
    Dev,
    /// Optimised profile for releases.
    Release,
}

impl Profile {
    /// Returns the profile's name for `cargo build --profile`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Dev => "dev",
            Self::Release => "release",
        }
    }

    /// Returns the profile's folder under the target folder.
    fn folder(self) -> &'static str {
        match self {
            Self::Dev => "debug",
            Self::Release => "release",
        }
    }
}

/// Workspace as described by `cargo metadata`.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Workspace {
    /// Root folder of the repository.
    pub(crate) root: PathBuf,
    /// Target folder of Cargo.
    pub(crate) target: PathBuf,
    /// Packages under `plugins/` that make a loadable library for users.
    pub(crate) plugins: Vec<String>,
}

#[derive(Deserialize)]
struct Metadata {
    workspace_root: PathBuf,
    target_directory: PathBuf,
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    manifest_path: PathBuf,
    targets: Vec<Target>,
    #[serde(default)]
    metadata: serde_json::Value,
}

#[derive(Deserialize)]
struct Target {
    crate_types: Vec<String>,
}

impl Workspace {
    /// Asks cargo about the workspace that holds the working directory.
    pub(crate) fn find() -> Result<Self> {
        let mut command = process::cargo();
        command.args(["metadata", "--no-deps", "--format-version", "1"]);
        let output = process::quiet_output(&mut command)?;
        if !output.status.success() {
            let message = String::from_utf8_lossy(&output.stderr);
            bail!("cargo metadata failed: {}", message.trim());
        }
        Self::parse(&output.stdout)
    }

    fn parse(metadata: &[u8]) -> Result<Self> {
        let metadata: Metadata = serde_json::from_slice(metadata)
            .context("cannot read the output of `cargo metadata`")?;
        let plugins_folder = metadata.workspace_root.join("plugins");
        let plugins = metadata.packages.into_iter().filter(|package| {
            let mut targets = package.targets.iter();
            package.manifest_path.starts_with(&plugins_folder)
                && package.metadata["busbar"]["test"] != true
                && targets.any(|target| target.crate_types.iter().any(|kind| kind == "cdylib"))
        });
        Ok(Self {
            plugins: plugins.map(|package| package.name).collect(),
            root: metadata.workspace_root,
            target: metadata.target_directory,
        })
    }

    /// Returns the path of a file of the repository.
    pub(crate) fn path(&self, relative: impl AsRef<Path>) -> PathBuf {
        self.root.join(relative)
    }

    /// Returns the folder of development tools, in Cargo's target folder, which CI keeps.
    pub(crate) fn tools(&self) -> PathBuf {
        self.target.join("tools")
    }

    /// Returns the path of a program of the workspace, once built.
    pub(crate) fn program(&self, profile: Profile, name: &str) -> PathBuf {
        self.target.join(profile.folder()).join(format!("{name}{EXE_SUFFIX}"))
    }

    /// Returns the path of a plugin's library, once built.
    pub(crate) fn library(&self, profile: Profile, package: &str) -> PathBuf {
        let name = package.replace('-', "_");
        self.target.join(profile.folder()).join(format!("{DLL_PREFIX}{name}{DLL_SUFFIX}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plugins_are_the_loadable_libraries_under_plugins() {
        let metadata = r#"{
            "workspace_root": "/repo", "target_directory": "/elsewhere", "packages": [
            {"name": "sdk", "manifest_path": "/repo/plugins/sdk/Cargo.toml",
             "targets": [{"crate_types": ["lib"]}]},
            {"name": "an-overlay", "manifest_path": "/repo/plugins/an-overlay/Cargo.toml",
             "targets": [{"crate_types": ["cdylib", "rlib"]}, {"crate_types": ["bin"]}]},
            {"name": "faults", "manifest_path": "/repo/plugins/faults/Cargo.toml",
             "targets": [{"crate_types": ["cdylib"]}], "metadata": {"busbar": {"test": true}}},
            {"name": "embed", "manifest_path": "/repo/host/embed/Cargo.toml",
             "targets": [{"crate_types": ["cdylib"]}]}]}"#;
        let workspace = Workspace::parse(metadata.as_bytes()).unwrap();
        assert_eq!(workspace.plugins, ["an-overlay"]);
        assert_eq!(
            workspace.library(Profile::Dev, "an-overlay"),
            Path::new("/elsewhere/debug").join(format!("{DLL_PREFIX}an_overlay{DLL_SUFFIX}"))
        );
        assert_eq!(workspace.path("config"), Path::new("/repo/config"));
    }

    #[test]
    fn this_workspace_has_its_plugins() {
        let workspace = Workspace::find().unwrap();
        assert!(workspace.path("tests/xtask/Cargo.toml").is_file());
        for plugin in ["modbus_adapter", "power_overlay", "weighted_collapse"] {
            assert!(workspace.plugins.iter().any(|name| name == plugin));
        }
    }
}
