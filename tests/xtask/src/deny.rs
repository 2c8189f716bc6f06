//! `deny`: licences, sources and duplicates of dependencies, checked by cargo-deny.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::process;
use crate::workspace::Workspace;

/// Version requirement of cargo-deny.
const CARGO_DENY: &str = "cargo-deny@^0.20";
/// Rules that cargo-deny checks.
const RULES: &str = ".config/deny.toml";
/// Checks that need no database of advisories.
const CHECKS: [&str; 3] = ["licenses", "bans", "sources"];
/// Environment variable that turns skipped steps into failures.
const REQUIRE: &str = "BUSBAR_REQUIRE_PEERS";

/// Runs the command; cargo-deny must be there or be installable.
pub(crate) fn run(workspace: &Workspace) -> Result<()> {
    let deny = install(workspace)?;
    check(workspace, &deny)
}

/// Checks in CI. Without cargo-deny the step is skipped with a message, unless
/// `BUSBAR_REQUIRE_PEERS` is `1`.
pub(crate) fn check_or_skip(workspace: &Workspace) -> Result<()> {
    match install(workspace) {
        Ok(deny) => check(workspace, &deny),
        Err(error) if env::var_os(REQUIRE).is_none_or(|value| value != "1") => {
            println!("SKIPPED: cargo-deny cannot be installed: {error:#}");
            Ok(())
        }
        Err(error) => Err(error),
    }
}

/// Returns the path of cargo-deny, which is installed below the target folder where it is missing.
/// Built without optimization, it compiles sooner and still checks in seconds.
fn install(workspace: &Workspace) -> Result<PathBuf> {
    let tools = workspace.tools();
    let deny = tools.join("bin/cargo-deny");
    if !process::succeeds(Command::new(&deny).arg("--version")) {
        let mut command = process::cargo();
        command.args(["install", "--locked", "--debug", "--root"]).arg(&tools).arg(CARGO_DENY);
        process::run(&mut command).context("cannot install cargo-deny from crates.io")?;
    }
    Ok(deny)
}

fn check(workspace: &Workspace, deny: &Path) -> Result<()> {
    let mut command = Command::new(deny);
    command.arg("--manifest-path").arg(workspace.path("Cargo.toml"));
    command.arg("--config").arg(workspace.path(RULES)).arg("check").args(CHECKS);
    process::run(&mut command).with_context(|| format!("dependencies break {RULES}"))
}
