//! `sites`: one viewer's plugin on a broker that carries a hundred stations, measured.

use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::stage;
use crate::workspace::{Profile, Workspace};

const PACKAGE: &str = "sites";
const PLUGIN: &str = "mqtt";
/// Program whose processes run plugins.
const HOST: &str = "busbar";
/// Output file of the figures.
const FIGURES: &str = "target/sites.json";

/// Command-line options of `sites`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Payload format to measure alone: sparkplug, json or text.
    #[arg(long)]
    only: Option<String>,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    stage::build_packages(workspace, Profile::Release, [PLUGIN, PACKAGE, HOST])?;
    let mut command = Command::new(workspace.program(Profile::Release, PACKAGE));
    command.arg("--library").arg(workspace.library(Profile::Release, PLUGIN));
    command.arg("--out").arg(workspace.path(FIGURES));
    if let Some(only) = &arguments.only {
        command.args(["--only", only]);
    }
    process::run(&mut command)
}
