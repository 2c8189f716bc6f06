//! Python environments of the peers: those of tests, and those of comparisons.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::process;
use crate::workspace::Workspace;

/// Python environment: its folder, and the file of its requirements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Environment {
    folder: &'static str,
    requirements: &'static str,
}

/// Environment of peers that tests talk to.
pub(crate) const TESTS: Environment =
    Environment { folder: "target/venv", requirements: "tests/end_to_end/peers/requirements.txt" };
/// Environment of peers that the bench compares with.
pub(crate) const BENCH: Environment = Environment {
    folder: "target/bench-venv",
    requirements: "tests/end_to_end/peers/bench_requirements.txt",
};

/// Environment of calculations that those of plugins are compared with.
pub(crate) const REFERENCES: Environment = Environment {
    folder: "target/references-venv",
    requirements: "tests/end_to_end/peers/references_requirements.txt",
};

/// Environment of viewers that frames are compared with.
pub(crate) const RENDER: Environment = Environment {
    folder: "target/render-venv",
    requirements: "tests/end_to_end/peers/render_requirements.txt",
};

/// Prepares the Python environment with the peers' requirements; returns its interpreter, or
/// nothing if there are no peers.
pub(crate) fn ensure_environment(
    workspace: &Workspace,
    environment: Environment,
) -> Result<Option<PathBuf>> {
    let Environment { folder, requirements: name } = environment;
    let requirements = workspace.path(name);
    let wanted = match fs::read(&requirements) {
        Ok(wanted) => wanted,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error).with_context(|| format!("cannot read {name}")),
    };
    let folder = workspace.path(folder);
    let python = folder.join("bin/python");
    if !is_current(&folder, &wanted) || !process::succeeds(Command::new(&python).arg("--version")) {
        make(&folder, &python, &requirements).with_context(|| {
            format!(
                "cannot make the Python environment {}: is the package index reachable?",
                folder.display()
            )
        })?;
        fs::write(stamp(&folder), &wanted).context("cannot note what was installed")?;
    }
    Ok(Some(python))
}

/// Returns the path of the copy of the requirements, which is written once all of them are
/// installed.
fn stamp(folder: &Path) -> PathBuf {
    folder.join("installed-requirements.txt")
}

fn is_current(folder: &Path, wanted: &[u8]) -> bool {
    fs::read(stamp(folder)).is_ok_and(|installed| installed == wanted)
}

fn make(folder: &Path, python: &Path, requirements: &Path) -> Result<()> {
    let mut venv = Command::new("python3");
    process::run(venv.args(["-m", "venv", "--clear"]).arg(folder))?;
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--disable-pip-version-check"]);
    process::run(pip.arg("--requirement").arg(requirements))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_requirements_make_the_environment_stale() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_current(folder.path(), b"a==1\n"));
        fs::write(stamp(folder.path()), "a==1\n").unwrap();
        assert!(is_current(folder.path(), b"a==1\n"));
        assert!(!is_current(folder.path(), b"a==2\n"));
    }
}
