//! `paper`: the report that reproduces the paper's table and figures.

use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::stage;
use crate::workspace::{Profile, Workspace};

/// Plugin whose collapses are measured.
const PLUGIN: &str = "weighted_collapse";
/// Output folder of the report.
const FOLDER: &str = "target/paper";

/// Command-line options of `paper`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Measure less: fewer frames, moves and points.
    #[arg(long)]
    quick: bool,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::Picture)?;
    stage::build_packages(workspace, Profile::Release, ["paper", PLUGIN])?;

    let folder = workspace.path(FOLDER);
    let plugins = folder.join("plugins");
    stage::replace_libraries(&plugins, &[workspace.library(Profile::Release, PLUGIN)])?;
    let mut report = Command::new(workspace.program(Profile::Release, "paper"));
    report.arg(&folder).arg("--plugins").arg(&plugins);
    if arguments.quick {
        report.arg("--quick");
    }
    process::run(&mut report)
}
