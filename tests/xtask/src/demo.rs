//! `demo`: from a fresh machine to the station with live values.

use std::env;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use crate::packages::{self, Purpose};
use crate::process;
use crate::simulator;
use crate::stage;
use crate::station::Station;
use crate::summary;
use crate::workspace::{Profile, Workspace};

/// Render options of the picture; the seconds let values arrive.
const PICTURE_OPTIONS: [&str; 4] = ["--seconds", "4", "--size", "1280x720"];
/// Render options of a scenario's picture; the seconds let all of its events happen.
const SCENARIO_OPTIONS: [&str; 4] = ["--seconds", "36", "--size", "1280x720"];

/// Command-line options of `demo`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Make a picture even where there is a display.
    #[arg(long)]
    picture: bool,
    /// Let something happen: breaker_trip, overload, transformer_heating, sf6_leak, isolation or
    /// link_loss
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let window = !arguments.picture && has_display();
    packages::ensure(if window { Purpose::Window } else { Purpose::Picture })?;
    stage::build(workspace, Profile::Release)?;
    stage::stage(workspace, Profile::Release)?;
    let station = Station::generate(workspace, Profile::Release)?;
    let scenario = arguments.scenario.as_deref().map(|name| station.scenario(name)).transpose()?;
    let live = station.live();
    let scenario = scenario.as_deref();
    let _simulator = simulator::start_station(workspace, Profile::Release, &live, scenario)?;
    if window {
        show_window(workspace, &live)
    } else {
        make_picture(workspace, &live, scenario.is_some())
    }
}

fn has_display() -> bool {
    let is_set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// Returns the command `busbar`, to be run from the repository's root.
pub(crate) fn busbar(workspace: &Workspace) -> Command {
    let mut command = Command::new(workspace.program(Profile::Release, "busbar"));
    command.current_dir(&workspace.root);
    command
}

fn show_window(workspace: &Workspace, scene: &Path) -> Result<()> {
    process::run(busbar(workspace).arg("view").arg(scene))
        .context("the view ended early; `cargo xtask demo --picture` needs no display")
}

fn make_picture(workspace: &Workspace, scene: &Path, in_scenario: bool) -> Result<()> {
    let folder = workspace.path("target/demo");
    fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let (picture, stats) = (folder.join("demo.png"), folder.join("demo.json"));
    let mut command = busbar(workspace);
    let options = if in_scenario { SCENARIO_OPTIONS } else { PICTURE_OPTIONS };
    command.arg("render").arg(scene).args(options);
    command.arg("--out").arg(&picture);
    process::run(command.arg("--stats").arg(&stats))?;

    let text = fs::read_to_string(&stats)
        .with_context(|| format!("cannot read the statistics {}", stats.display()))?;
    println!("\n{}", summary::format(&text)?);
    println!("picture    {}", picture.display());
    Ok(())
}
