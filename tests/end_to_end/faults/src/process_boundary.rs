//! Costs of the process boundary: round trip of a call, samples a second, restart time of a killed
//! plugin, and frame times beside a plugin that keeps dying.

use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result, ensure};
use busbar_plugin_host::{LoadRules, OverlayBinding, SceneClock, SourcePolicy, TelemetryTag};
use busbar_plugin_process::{
    Isolation, Plugin, PluginCatalog, PluginOptions, RestartPolicy, RunningOverlay,
    RunningTelemetry,
};
use busbar_scene_loader::LoadedScene;
use busbar_tags::{Sample, TagHandle};
use busbar_types::ValueKind;
use busbar_viewer::{RendererOptions, Viewer};
use e2e::faulty_plugins::FaultyPluginScene;
use report_writer::Series;
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;
use serde_json::json;

/// Number of tags of the samples, and of bindings of the overlay.
const TAGS: u32 = 14;
const CALLS: usize = 5_000;
const FLOOD: Duration = Duration::from_secs(3);
/// Time between two reads of samples, as of frames.
const FRAME: Duration = Duration::from_millis(16);
/// Duration of the frame-time measurement beside a storm.
const STORM: Duration = Duration::from_secs(10);
const STORM_PICTURE: [u32; 2] = [320, 180];
/// Longest wait for a plugin.
const MAX_WAIT: Duration = Duration::from_secs(30);

/// Costs of one mode.
#[derive(Debug, Serialize)]
pub(crate) struct Mode {
    pub(crate) isolation: &'static str,
    /// Milliseconds of a call with a picture of 14 lines.
    pub(crate) round_trip_millis: Series,
    pub(crate) samples_per_second: f64,
}

/// Costs of the process boundary, measured without other load.
#[derive(Debug, Serialize)]
pub(crate) struct BoundaryCosts {
    pub(crate) modes: Vec<Mode>,
    /// Milliseconds from SIGKILL to the first good sample, without back-off and quarantine.
    pub(crate) away_millis: Series,
    /// Milliseconds between frames while one plugin dies again and again.
    pub(crate) storm_gap_millis: Series,
    pub(crate) storm_deaths: u64,
}

/// Measures all costs, with a number of kills.
pub(crate) fn measure(kills: usize) -> Result<BoundaryCosts> {
    let trouble = FaultyPluginScene::with_plugin("trouble.steady");
    let mut modes = Vec::new();
    let mut away_millis = Series::default();
    for (isolation, name) in [(Isolation::None, "none"), (Isolation::Process, "process")] {
        let directories = [trouble.path("plugins")];
        let catalog = PluginCatalog::discover(&directories, &LoadRules::default(), isolation);
        let create = |id: &str| {
            let policy =
                RestartPolicy { first_delay: Duration::ZERO, max_deaths: 0, ..Default::default() };
            let options = PluginOptions { isolation, policy, ..PluginOptions::default() };
            catalog.create(id, id, &json!({}), &options)
        };
        modes.push(Mode {
            isolation: name,
            round_trip_millis: round_trips(&create("trouble.echo")?)?,
            samples_per_second: samples_per_second(&create("trouble.flood")?)?,
        });
        if isolation == Isolation::Process {
            away_millis = kill_times(&create("trouble.steady")?, kills)?;
        }
    }
    let (storm_gap_millis, storm_deaths) = storm_gaps()?;
    Ok(BoundaryCosts { modes, away_millis, storm_gap_millis, storm_deaths })
}

fn round_trips(plugin: &Plugin) -> Result<Series> {
    let bindings = (0..TAGS).map(|tag| OverlayBinding {
        tag: TagHandle(tag),
        node: tag,
        kind: ValueKind::F64,
        limit_low: None,
        limit_high: None,
        tag_id: format!("tag {tag}"),
        tag_name: format!("tag {tag}"),
        unit: "kV".into(),
        node_id: format!("=N{tag}"),
        role: "value".into(),
    });
    let mut overlay = RunningOverlay::configure(plugin, bindings.collect())?;
    let mut millis = Vec::with_capacity(CALLS);
    for _ in 0..CALLS {
        let start = Instant::now();
        let picture =
            overlay.draw(|_| None, SceneClock::live(SystemTime::now()), Duration::from_secs(1))?;
        millis.push(start.elapsed().as_secs_f64() * 1e3);
        ensure!(picture.lines.len() == TAGS as usize, "{} lines", picture.lines.len());
    }
    Ok(Series::from_values(millis))
}

fn tags() -> Vec<TelemetryTag> {
    let tag = |tag| TelemetryTag {
        tag: TagHandle(tag),
        kind: ValueKind::F64,
        freshness: Duration::from_secs(3),
        id: format!("tag {tag}"),
        address_json: "{}".into(),
        unit: String::new(),
    };
    (0..TAGS).map(tag).collect()
}

/// Measures the checked samples a second that reach the host.
fn samples_per_second(plugin: &Plugin) -> Result<f64> {
    let telemetry = RunningTelemetry::start(plugin, &tags(), SourcePolicy::default())?;
    let (start, mut count) = (Instant::now(), 0_u64);
    while start.elapsed() < FLOOD {
        telemetry.drain(&mut |_: &Sample| count += 1);
        std::thread::sleep(FRAME);
    }
    Ok(count as f64 / start.elapsed().as_secs_f64())
}

fn kill_times(plugin: &Plugin, kills: usize) -> Result<Series> {
    let telemetry = RunningTelemetry::start(plugin, &tags(), SourcePolicy::default())?;
    wait_for_sample(&telemetry, true)?;
    let mut millis = Vec::with_capacity(kills);
    for _ in 0..kills {
        let pid = plugin.status().pid.and_then(|pid| Pid::from_raw(pid as i32));
        let start = Instant::now();
        kill_process(pid.context("the plugin has no process")?, Signal::KILL)?;
        wait_for_sample(&telemetry, false)?;
        wait_for_sample(&telemetry, true)?;
        millis.push(start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(Series::from_values(millis))
}

/// Waits for a sample of the given quality. Later samples of the same batch are skipped, so that
/// times are rather too long than too short.
fn wait_for_sample(telemetry: &RunningTelemetry, good: bool) -> Result<()> {
    let (start, mut came) = (Instant::now(), false);
    loop {
        telemetry.drain(&mut |sample: &Sample| came |= sample.quality.is_good() == good);
        if came {
            return Ok(());
        }
        ensure!(start.elapsed() < MAX_WAIT, "no sample within {MAX_WAIT:?}");
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// Measures milliseconds between frames beside a plugin that dies of a segmentation fault over and
/// over; returns the number of deaths too.
fn storm_gaps() -> Result<(Series, u64)> {
    let mut trouble = FaultyPluginScene::with_plugin("trouble.segfault");
    trouble.config["supervision"] = json!({ "restart_seconds": 0, "max_deaths": 0 });
    let scene = LoadedScene::load(&trouble.write(), &|_, _, _| ())?;
    let options = RendererOptions { samples: 1, ..Default::default() };
    let mut viewer = Viewer::new_headless(scene, options, STORM_PICTURE)?;
    viewer.set_settles(false);
    let (start, mut millis, mut last) = (Instant::now(), Vec::new(), None::<Instant>);
    while start.elapsed() < STORM {
        let input = viewer.headless_input(start.elapsed().as_secs_f64());
        viewer.frame(input)?;
        let now = Instant::now();
        if let Some(last) = last.replace(now) {
            millis.push((now - last).as_secs_f64() * 1e3);
        }
        std::thread::sleep(FRAME.saturating_sub(last.map_or(FRAME, |last| last.elapsed())));
    }
    let deaths = viewer.stats().plugins.iter().map(|plugin| plugin.deaths).sum();
    Ok((Series::from_values(millis), deaths))
}
