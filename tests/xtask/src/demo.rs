//! `demo`: from a fresh machine to the demo scene with live values.

use std::env;
use std::fs;
use std::process::Command;

use anyhow::{Context, Result};

use crate::packages::{self, Purpose};
use crate::process;
use crate::simulator;
use crate::stage;
use crate::summary;
use crate::workspace::{Profile, Workspace};

/// The scene shown.
pub(crate) const SCENE: &str = "config/demo.json";
/// How the demo's pictures are made: values need time to arrive.
pub(crate) const PICTURE_OPTIONS: [&str; 4] = ["--seconds", "3", "--size", "1280x720"];

/// Options of `demo`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Make a picture even where there is a display.
    #[arg(long)]
    picture: bool,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let window = !arguments.picture && has_display();
    packages::ensure(if window { Purpose::Window } else { Purpose::Picture })?;
    stage::build(workspace, Profile::Release)?;
    stage::stage(workspace, Profile::Release)?;
    let _simulator = simulator::start(workspace)?;
    if window { show_window(workspace) } else { make_picture(workspace) }
}

fn has_display() -> bool {
    let is_set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// `busbar`, to be run from the repository's root.
pub(crate) fn busbar(workspace: &Workspace) -> Command {
    let mut command = Command::new(workspace.program(Profile::Release, "busbar"));
    command.current_dir(&workspace.root);
    command
}

fn show_window(workspace: &Workspace) -> Result<()> {
    process::run(busbar(workspace).args(["view", SCENE]))
        .context("the view ended early; `cargo xtask demo --picture` needs no display")
}

fn make_picture(workspace: &Workspace) -> Result<()> {
    let folder = workspace.path("target/demo");
    fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let (picture, stats) = (folder.join("demo.png"), folder.join("demo.json"));
    let mut command = busbar(workspace);
    command.args(["render", SCENE]).args(PICTURE_OPTIONS);
    command.arg("--out").arg(&picture);
    process::run(command.arg("--stats").arg(&stats))?;

    let text = fs::read_to_string(&stats)
        .with_context(|| format!("cannot read the statistics {}", stats.display()))?;
    println!("\n{}", summary::format(&text)?);
    println!("picture    {}", picture.display());
    Ok(())
}
