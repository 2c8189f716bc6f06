//! `traffic`: the way of values, from a plugin to the picture, measured, and the adapters
//! beside the peers' own clients.

use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::python;
use crate::stage;
use crate::workspace::{Profile, Workspace};

const PACKAGE: &str = "traffic";
/// Plugins that produce and show the values.
const PLUGINS: [&str; 4] = ["sample_generator", "power_overlay", "modbus_adapter", "iec104"];
/// Scripts of the peers.
const PEERS: &str = "tests/end_to_end/peers";
/// Program whose processes run plugins.
const HOST: &str = "busbar";
/// Output folder of the report.
const FOLDER: &str = "target/traffic";

/// Command-line options of `traffic`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Measure a tenth of everything, and judge nothing.
    #[arg(long)]
    quick: bool,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::Picture)?;
    let packages = PLUGINS.into_iter().chain([PACKAGE, HOST]);
    stage::build_packages(workspace, Profile::Release, packages)?;
    stage::models(workspace)?;
    let mut command = command(workspace, arguments);
    if let Some(python) = python::ensure_environment(workspace, python::TESTS)? {
        command.arg("--python").arg(python).arg("--peers").arg(workspace.path(PEERS));
    }
    process::run(&mut command)
}

fn command(workspace: &Workspace, arguments: &Arguments) -> Command {
    let mut command = Command::new(workspace.program(Profile::Release, PACKAGE));
    for plugin in PLUGINS {
        command.arg("--library").arg(workspace.library(Profile::Release, plugin));
    }
    command.arg("--models").arg(workspace.path(stage::MODELS));
    command.arg("--out").arg(workspace.path(FOLDER));
    if arguments.quick {
        command.arg("--quick");
    }
    command
}
