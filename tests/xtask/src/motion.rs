//! `motion`: frames while dragging, time to a whole picture, time from a key to its panel.

use std::ffi::OsStr;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use serde_json::Value;

use crate::packages::{self, Purpose};
use crate::process::{self, Process};
use crate::simulator;
use crate::stage;
use crate::station::Station;
use crate::viewer;
use crate::workspace::{Profile, Workspace};
use crate::x_server::XServer;

/// Folder of the figures.
const FOLDER: &str = "target/motion";
/// Screen of the display in memory, pixels.
const SCREEN: &str = "1600x900";
/// Time from a viewer's start to the measurement: detail has settled and values have come.
const SETTLE_TIME: Duration = Duration::from_secs(10);
const DEMO: &str = "config/demo.json";
/// Program that drags, presses keys and measures, of a package of the same name.
const PROGRAM: &str = "motion";
/// Accepted times at most, milliseconds.
const MAX_WHOLE_MILLIS: f64 = 150.0;
const MAX_KEY_MILLIS: [f64; 2] = [50.0, 120.0];

/// Command-line options of `motion`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Measure only these scenes.
    #[arg(long, value_enum)]
    only: Vec<Scene>,
    /// Cargo profile to measure.
    #[arg(long, value_enum, default_value = "release")]
    profile: Profile,
    /// Use programs and plugins as they were built and staged last.
    #[arg(long)]
    no_build: bool,
}

/// Scene whose window is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Scene {
    /// Demo with its simulator.
    Demo,
    /// Generated station, whose points change.
    Station,
}

impl Scene {
    /// Returns the least number of frames a second that is accepted while dragging.
    fn min_frames(self) -> f64 {
        match self {
            Self::Demo => 25.0,
            Self::Station => 20.0,
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Returns the figures of a window, as the measuring program prints them, that miss their bars.
fn misses(figures: &Value, scene: Scene) -> Vec<&'static str> {
    let figure = |pointer: &str| figures.pointer(pointer).and_then(Value::as_f64);
    let is_at_most = |pointer, most: f64| figure(pointer).is_some_and(|millis| millis <= most);
    let frames = figure("/dragging_frames_per_second");
    let all = [
        ("frames", frames.is_some_and(|frames| frames >= scene.min_frames())),
        ("whole picture", is_at_most("/whole_picture_millis/p50", MAX_WHOLE_MILLIS)),
        ("key to panel, median", is_at_most("/key_to_panel_millis/p50", MAX_KEY_MILLIS[0])),
        ("key to panel, p99", is_at_most("/key_to_panel_millis/p99", MAX_KEY_MILLIS[1])),
    ];
    all.into_iter().filter_map(|(name, is_met)| (!is_met).then_some(name)).collect()
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let profile = arguments.profile;
    if !arguments.no_build {
        packages::ensure(Purpose::Tests)?;
        stage::build(workspace, profile)?;
        stage::stage(workspace, profile)?;
        let mut build = process::cargo();
        build.current_dir(&workspace.root).args(["build", "--package", PROGRAM]);
        process::run(build.args(["--profile", profile.name()]))?;
    }
    std::fs::create_dir_all(workspace.path(FOLDER))?;
    let mut missed = Vec::new();
    for &scene in Scene::value_variants() {
        if !arguments.only.is_empty() && !arguments.only.contains(&scene) {
            continue;
        }
        let figures = measure(workspace, profile, scene)?;
        let text = serde_json::to_string_pretty(&figures)?;
        println!("{} ({})\n{text}", scene.name(), profile.name());
        std::fs::write(workspace.path(FOLDER).join(format!("{}.json", scene.name())), &text)?;
        let misses = misses(&figures, scene).into_iter();
        missed.extend(misses.map(|figure| format!("{}: {figure}", scene.name())));
    }
    if !missed.is_empty() {
        bail!("bars that are missed: {}", missed.join(", "));
    }
    Ok(())
}

fn measure(workspace: &Workspace, profile: Profile, scene: Scene) -> Result<Value> {
    let display = XServer::start(SCREEN)?;
    let (file, _simulator) = prepare(workspace, profile, scene)?;
    let address = free_address()?.to_string();
    let arguments: &[&OsStr] =
        &["view".as_ref(), file.as_ref(), "--metrics".as_ref(), address.as_ref()];
    let is_ready = |line: &str| line == "ready";
    let _viewer = viewer::start(workspace, profile, &display.display, arguments, is_ready)?;
    process::sleep(SETTLE_TIME)?;
    let mut program = Command::new(workspace.program(profile, PROGRAM));
    program.env("DISPLAY", &display.display).args(["--metrics", &address]);
    let output = process::quiet_output(&mut program)?;
    if !output.status.success() {
        bail!("the measurement failed: {}", String::from_utf8_lossy(&output.stderr));
    }
    serde_json::from_slice(&output.stdout).context("the measurement printed no figures")
}

fn prepare(workspace: &Workspace, profile: Profile, scene: Scene) -> Result<(PathBuf, Process)> {
    let file = match scene {
        Scene::Demo => workspace.path(DEMO),
        Scene::Station => Station::generate(workspace, profile)?.live(),
    };
    let simulator = match scene {
        Scene::Demo => simulator::start_demo(workspace, profile, &file)?,
        Scene::Station => simulator::start_station(workspace, profile, &file, None)?,
    };
    Ok((file, simulator))
}

/// Returns a local address that nothing listens at.
fn free_address() -> Result<SocketAddr> {
    let listener = TcpListener::bind("127.0.0.1:0").context("no free port")?;
    Ok(listener.local_addr()?)
}
