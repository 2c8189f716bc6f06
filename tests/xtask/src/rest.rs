//! `rest`: processor time, wake-ups and writes to disk of a viewer with nothing to do.

mod process_tree;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use serde::Serialize;

use crate::packages::{self, Purpose};
use crate::process::{self, Process};
use crate::simulator;
use crate::stage;
use crate::station::Station;
use crate::viewer;
use crate::workspace::{Profile, Workspace};
use crate::x_server::XServer;
use process_tree::{ProcessTree, TreeUsage};

/// Folder of the scenes and of the figures.
const FOLDER: &str = "target/rest";
/// Screen of the display in memory, pixels.
const SCREEN: &str = "1600x900";
/// Time from a viewer's start, or from what then happens to it, to the measurement: detail has
/// settled and values have come or gone stale.
const SETTLE_TIME: Duration = Duration::from_secs(12);
const MAX_SECONDS: u64 = 24 * 3600;
/// Scene whose tags are made constant, and the one with a chart and no tag.
const DEMO: &str = "config/demo.json";
const CHART: &str = "config/dga.json";

/// Command-line options of `rest`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Measure only these situations.
    #[arg(long, value_enum)]
    only: Vec<Situation>,
    /// Seconds of each measurement.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=MAX_SECONDS))]
    seconds: u64,
    /// Cargo profile to measure.
    #[arg(long, value_enum, default_value = "release")]
    profile: Profile,
    /// Use programs and plugins as they were built and staged last.
    #[arg(long)]
    no_build: bool,
}

/// Situation of a viewer at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Situation {
    /// Demo in a window, whose tags come twice a second and never change.
    ConstantTags,
    /// Chart of gases in a window, without a single tag.
    Chart,
    /// Demo in a window, whose device has gone: all values are stale.
    Halted,
    /// Demo in a window that is unmapped, as an iconified one is.
    Minimised,
    /// Demo as a web page that nobody looks at.
    Serve,
    /// Generated station in a window, whose points change.
    Station,
}

impl Situation {
    /// Returns the greatest processor time that is accepted, percent of one core.
    fn bar(self) -> f64 {
        match self {
            Self::ConstantTags | Self::Chart | Self::Halted => 2.0,
            Self::Minimised | Self::Serve => 1.0,
            Self::Station => 12.0,
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Figures of one situation.
#[derive(Serialize)]
struct Figures {
    situation: String,
    profile: &'static str,
    seconds: f64,
    /// Greatest accepted processor time, percent of one core.
    bar_percent: f64,
    #[serde(flatten)]
    usage: TreeUsage,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let profile = arguments.profile;
    if !arguments.no_build {
        packages::ensure(Purpose::Tests)?;
        stage::build(workspace, profile)?;
        stage::stage(workspace, profile)?;
    }
    let display = XServer::start(SCREEN)?;
    let bench = RestBench { workspace, profile, display: &display.display };
    let mut all = Vec::new();
    for &situation in Situation::value_variants() {
        if arguments.only.is_empty() || arguments.only.contains(&situation) {
            all.push(bench.measure(situation, Duration::from_secs(arguments.seconds))?);
        }
    }
    let file = workspace.path(FOLDER).join("figures.json");
    fs::write(&file, serde_json::to_vec_pretty(&all)?).context("cannot write the figures")?;
    println!("\n{}", table(&all));
    println!("figures    {}", file.display());
    let over: Vec<&str> = all
        .iter()
        .filter(|figures| figures.usage.cpu_percent > figures.bar_percent)
        .map(|figures| figures.situation.as_str())
        .collect();
    if !over.is_empty() {
        bail!("over the bar: {}", over.join(", "));
    }
    Ok(())
}

/// Formats the figures, a line each, with the processes that used most.
fn table(all: &[Figures]) -> String {
    let mut text = format!(
        "{:<14} {:>8} {:>6} {:>9} {:>12}  processes\n",
        "situation", "% of core", "bar", "wake-ups", "KiB written"
    );
    for Figures { situation, bar_percent, usage, .. } in all {
        let parts: Vec<String> = usage
            .processes
            .iter()
            .map(|part| format!("{} {:.2}", part.name, part.cpu_percent))
            .collect();
        text += &format!(
            "{situation:<14} {:>8.2} {bar_percent:>6.1} {:>7.0}/s {:>12.1}  {}\n",
            usage.cpu_percent,
            usage.wakeups_per_second,
            usage.written_bytes as f64 / 1024.0,
            parts.join(", ")
        );
    }
    text
}

/// Programs and display of the measurements.
struct RestBench<'a> {
    workspace: &'a Workspace,
    profile: Profile,
    display: &'a str,
}

impl RestBench<'_> {
    fn measure(&self, situation: Situation, period: Duration) -> Result<Figures> {
        println!("\n{}", situation.name());
        let (scene, mut simulator) = self.prepare(situation)?;
        let viewer = self.start_viewer(situation, &scene)?;
        process::sleep(SETTLE_TIME)?;
        match situation {
            Situation::Halted => simulator = None,
            Situation::Minimised => self.xdotool(&["windowunmap"])?,
            Situation::ConstantTags | Situation::Chart => {}
            Situation::Serve | Situation::Station => {}
        }
        if matches!(situation, Situation::Halted | Situation::Minimised) {
            process::sleep(SETTLE_TIME)?;
        }
        let (before, start) = (ProcessTree::read(viewer.id())?, Instant::now());
        process::sleep(period)?;
        let (after, elapsed) = (ProcessTree::read(viewer.id())?, start.elapsed());
        drop(simulator);
        Ok(Figures {
            situation: situation.name(),
            profile: self.profile.name(),
            seconds: elapsed.as_secs_f64(),
            bar_percent: situation.bar(),
            usage: after.usage_since(&before, elapsed),
        })
    }

    /// Makes the scene of a situation, and starts its devices.
    fn prepare(&self, situation: Situation) -> Result<(PathBuf, Option<Process>)> {
        let Self { workspace, profile, .. } = *self;
        match situation {
            Situation::Chart => Ok((workspace.path(CHART), None)),
            Situation::Station => {
                let station = Station::generate(workspace, profile)?;
                let live = station.live();
                let simulator = simulator::start_station(workspace, profile, &live, None)?;
                Ok((live, Some(simulator)))
            }
            _ => {
                let scene = self.constant_scene()?;
                let simulator = simulator::start_demo(workspace, profile, &scene)?;
                Ok((scene, Some(simulator)))
            }
        }
    }

    /// Writes the demo with constant tags, beside links to its plugins and models.
    fn constant_scene(&self) -> Result<PathBuf> {
        let folder = self.workspace.path(FOLDER);
        fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        stage::link_plugins(self.workspace, &folder)?;
        let models = folder.join("models");
        if !models.exists() {
            std::os::unix::fs::symlink(self.workspace.path(stage::MODELS), &models)
                .with_context(|| format!("cannot make {}", models.display()))?;
        }
        let text = fs::read(self.workspace.path(DEMO)).context("cannot read the demo")?;
        let mut config: serde_json::Value = serde_json::from_slice(&text)?;
        let tags = config["tags"].as_object_mut().context("the demo has no tags")?;
        for tag in tags.values_mut() {
            if let Some(signal) = tag["simulate"].as_object_mut() {
                let base = signal.get("base").cloned();
                signal.clear();
                signal.insert("shape".into(), "constant".into());
                signal.extend(base.map(|base| ("base".into(), base)));
            }
        }
        let path = folder.join("constant.json");
        fs::write(&path, serde_json::to_vec_pretty(&config)?).context("cannot write the scene")?;
        Ok(path)
    }

    fn start_viewer(&self, situation: Situation, scene: &Path) -> Result<Process> {
        let is_served = situation == Situation::Serve;
        let arguments: &[&OsStr] = match is_served {
            true => {
                &["serve".as_ref(), scene.as_ref(), "--listen".as_ref(), "127.0.0.1:0".as_ref()]
            }
            false => &["view".as_ref(), scene.as_ref()],
        };
        let is_ready = |line: &str| line == "ready" || is_served && line.starts_with("http");
        viewer::start(self.workspace, self.profile, self.display, arguments, is_ready)
    }

    /// Does something to the window.
    fn xdotool(&self, words: &[&str]) -> Result<()> {
        let mut command = Command::new("xdotool");
        command.env("DISPLAY", self.display).args(["search", "--name", "^Busbar"]).args(words);
        process::run(&mut command)
    }
}
