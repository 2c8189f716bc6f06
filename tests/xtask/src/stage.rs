//! Build and staging of plugins and models for the demo scene.

use std::collections::HashSet;
use std::env::consts::DLL_EXTENSION;
use std::ffi::OsString;
use std::fs::{self, File, Permissions};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use tempfile::NamedTempFile;

use crate::process;
use crate::workspace::{Profile, Workspace};

/// Programs that the demo runs, beside the plugins.
const PROGRAMS: [&str; 3] = ["busbar", MODEL_MAKER, FLEET_MAKER];
const MODEL_MAKER: &str = "demo_model";
/// Program that makes the station and the gas histories that `config/dga.json` opens.
const FLEET_MAKER: &str = "fleet";
/// Folder of the demo scene's models.
pub(crate) const MODELS: &str = "config/models";
/// File mode of plugins, which are not loaded from files that others may write to.
const LIBRARY_MODE: u32 = 0o755;

/// Command-line options of `stage`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Cargo profile to build with.
    #[arg(long, value_enum, default_value = "dev")]
    profile: Profile,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    build(workspace, arguments.profile)?;
    stage(workspace, arguments.profile)
}

/// Builds the programs and plugins of the demo.
pub(crate) fn build(workspace: &Workspace, profile: Profile) -> Result<()> {
    let plugins = workspace.plugins.iter().map(String::as_str);
    build_packages(workspace, profile, PROGRAMS.into_iter().chain(plugins))
}

/// Builds packages of the workspace.
pub(crate) fn build_packages<'a>(
    workspace: &Workspace,
    profile: Profile,
    packages: impl IntoIterator<Item = &'a str>,
) -> Result<()> {
    let mut command = process::cargo();
    command.args(["build", "--profile", profile.name()]);
    for package in packages {
        command.args(["--package", package]);
    }
    process::run(command.current_dir(&workspace.root))
}

/// Fills `config/plugins` and `config/models` from what was built.
pub(crate) fn stage(workspace: &Workspace, profile: Profile) -> Result<()> {
    let plugins = workspace.plugins.iter();
    let libraries: Vec<_> = plugins.map(|name| workspace.library(profile, name)).collect();
    let folder = workspace.path("config/plugins");
    replace_libraries(&folder, &libraries)?;
    println!("{} plugins in {}", libraries.len(), folder.display());
    make_models(workspace, profile)
}

/// Lends the staged plugins to a configuration in another folder.
pub(crate) fn link_plugins(workspace: &Workspace, folder: &Path) -> Result<()> {
    let plugins = folder.join("plugins");
    if plugins.exists() {
        return Ok(());
    }
    std::os::unix::fs::symlink(workspace.path("config/plugins"), &plugins)
        .with_context(|| format!("cannot make {}", plugins.display()))
}

/// Makes the models of the demo.
pub(crate) fn models(workspace: &Workspace) -> Result<()> {
    build_packages(workspace, Profile::Release, [MODEL_MAKER, FLEET_MAKER])?;
    make_models(workspace, Profile::Release)
}

fn make_models(workspace: &Workspace, profile: Profile) -> Result<()> {
    let mut command = Command::new(workspace.program(profile, MODEL_MAKER));
    process::run(command.arg(workspace.path(MODELS)))?;
    let mut command = Command::new(workspace.program(profile, FLEET_MAKER));
    process::run(command.arg(workspace.path("config")))
}

/// Makes `libraries` the only libraries in `folder`. Each appears whole or not
/// at all: a running viewer may be loading them.
pub(crate) fn replace_libraries(folder: &Path, libraries: &[PathBuf]) -> Result<()> {
    fs::create_dir_all(folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let mut staged = HashSet::new();
    for library in libraries {
        let name = library.file_name().context("a library without a name")?;
        copy_whole(library, &folder.join(name)).with_context(|| {
            let (from, to) = (library.display(), folder.display());
            format!("cannot copy {from} to {to}: was it built, and may you write there?")
        })?;
        staged.insert(name.to_owned());
    }
    remove_stale(folder, &staged)
        .with_context(|| format!("cannot remove old plugins from {}", folder.display()))
}

/// Copies a file, which appears whole or not at all.
pub(crate) fn copy_whole(from: &Path, to: &Path) -> io::Result<()> {
    let folder = to.parent().unwrap_or(Path::new("."));
    let mut copy = NamedTempFile::new_in(folder)?;
    io::copy(&mut File::open(from)?, &mut copy)?;
    fs::set_permissions(copy.path(), Permissions::from_mode(LIBRARY_MODE))?;
    copy.persist(to)?;
    Ok(())
}

fn remove_stale(folder: &Path, staged: &HashSet<OsString>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let is_library = path.extension().is_some_and(|e| e == DLL_EXTENSION);
        if is_library && !path.file_name().is_some_and(|name| staged.contains(name)) {
            fs::remove_file(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn library(name: &str) -> String {
        format!("lib{name}.{DLL_EXTENSION}")
    }

    #[test]
    fn the_built_libraries_replace_the_old_ones() {
        let folder = tempfile::tempdir().unwrap();
        let (built, plugins) = (folder.path().join("target"), folder.path().join("plugins"));
        for folder in [&built, &plugins] {
            fs::create_dir(folder).unwrap();
        }
        fs::write(built.join(library("new")), "new").unwrap();
        fs::write(plugins.join(library("new")), "old and longer").unwrap();
        fs::write(plugins.join(library("stale")), "stale").unwrap();
        fs::write(plugins.join("notes.txt"), "kept").unwrap();

        replace_libraries(&plugins, &[built.join(library("new"))]).unwrap();

        let mut names: Vec<_> = fs::read_dir(&plugins)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, [library("new"), "notes.txt".to_owned()]);
        let new = plugins.join(library("new"));
        assert_eq!(fs::read_to_string(&new).unwrap(), "new");
        let mode = fs::metadata(&new).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, LIBRARY_MODE);
    }

    #[test]
    fn a_library_that_was_not_built_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join(library("missing"));
        let error = replace_libraries(folder.path(), &[missing]).unwrap_err();
        assert!(error.to_string().contains("libmissing"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
