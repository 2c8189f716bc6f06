//! `bench-render`: frames beside other viewers on the same rasteriser.

use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::python;
use crate::stage;
use crate::workspace::{Profile, Workspace};
use crate::x_server::XServer;

const PACKAGE: &str = "bench_render";
/// Optimisers that scenes name.
const PLUGINS: [&str; 2] = ["weighted_collapse", "quadric_collapse"];
/// Program whose start is measured.
const HOST: &str = "busbar";
/// Output folder of the report.
const FOLDER: &str = "target/bench_render";
/// Scripts of the peers.
const SCRIPTS: &str = "tests/end_to_end/peers";
/// Size of the virtual display for the peers, pixels.
const SCREEN: &str = "1280x720";

/// Command-line options of `bench-render`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Run only these sections: frames, screen_error, start, many.
    #[arg(long)]
    only: Vec<String>,
    /// Rounds; medians are over the frames of these.
    #[arg(long)]
    rounds: Option<usize>,
    /// The core that everyone stays on; 1 if none is given.
    #[arg(long)]
    core: Option<String>,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::RenderBench)?;
    let packages = PLUGINS.into_iter().chain([PACKAGE, HOST]);
    stage::build_packages(workspace, Profile::Release, packages)?;
    let plugins = workspace.path(FOLDER).join("plugins");
    let libraries = PLUGINS.map(|plugin| workspace.library(Profile::Release, plugin));
    stage::replace_libraries(&plugins, &libraries)?;
    let python = python::ensure_environment(workspace, python::RENDER).unwrap_or_else(|error| {
        println!("No Python peers: {error:#}");
        None
    });
    let server = XServer::start(SCREEN)?;
    let mut command = Command::new(workspace.program(Profile::Release, PACKAGE));
    command.env("DISPLAY", &server.display);
    command.arg("--out").arg(workspace.path(FOLDER)).arg("--plugins").arg(plugins);
    command.arg("--busbar").arg(workspace.program(Profile::Release, HOST));
    command.arg("--scripts").arg(workspace.path(SCRIPTS));
    if let Some(python) = python {
        command.arg("--python").arg(python);
    }
    for section in &arguments.only {
        command.args(["--only", section]);
    }
    if let Some(rounds) = arguments.rounds {
        command.args(["--rounds", &rounds.to_string()]);
    }
    if let Some(core) = &arguments.core {
        command.args(["--core", core]);
    }
    process::run(&mut command)
}
