//! `border [KILLS]` measures what the border between processes costs: the round
//! trip of a call, samples a second, and how long a killed plugin is away.
//! `busbar` must be built beside it; use `--release`.
#![allow(clippy::print_stdout, reason = "the table is this program's output")]

use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_host::{LoadRules, OverlayBinding, TelemetryTag};
use busbar_plugin_process::{
    Isolation, Plugin, PluginCatalog, PluginOptions, RestartPolicy, RunningOverlay,
    RunningTelemetry,
};
use busbar_tags::{TagHandle, ValueKind};
use e2e::trouble::Trouble;
use rustix::process::{Pid, Signal, kill_process};

/// Tags that samples are for, and bindings of the overlay.
const TAGS: u32 = 14;
const CALLS: usize = 5_000;
const FLOOD: Duration = Duration::from_secs(3);
/// How often samples are taken, as frames do.
const FRAME: Duration = Duration::from_millis(16);
const DEFAULT_KILLS: usize = 100;

fn main() {
    let kills = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(DEFAULT_KILLS);
    let trouble = Trouble::with("trouble.steady");
    for isolation in [Isolation::None, Isolation::Process] {
        let catalog =
            PluginCatalog::discover(&[trouble.path("plugins")], &LoadRules::default(), isolation);
        let create = |id: &str| {
            let policy =
                RestartPolicy { first_delay: Duration::ZERO, max_deaths: 0, ..Default::default() };
            let options = PluginOptions { isolation, policy, ..PluginOptions::default() };
            catalog.create(id, id, &serde_json::json!({}), &options).expect("it can be made")
        };
        println!("isolation {isolation:?}");
        report("  round trip of a call, ms", &mut round_trips(&create("trouble.echo")));
        let per_second = samples_per_second(&create("trouble.flood"));
        println!("  samples a second: {:.2} million", per_second / 1e6);
        if isolation == Isolation::Process {
            let plugin = create("trouble.steady");
            let before = descriptors();
            let mut away = kill_times(&plugin, kills);
            report("  from SIGKILL to correct data, ms", &mut away);
            println!("  descriptors before and after: {before}, {}", descriptors());
        }
    }
}

/// Milliseconds that working out a picture of current values takes.
fn round_trips(plugin: &Plugin) -> Vec<f64> {
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
    let mut overlay = RunningOverlay::configure(plugin, bindings.collect()).expect("it takes them");
    let mut millis = Vec::with_capacity(CALLS);
    for _ in 0..CALLS {
        let start = Instant::now();
        let picture = overlay.draw(|_| None, SystemTime::now(), Duration::from_secs(1));
        millis.push(start.elapsed().as_secs_f64() * 1e3);
        assert_eq!(picture.expect("it draws").lines.len(), TAGS as usize);
    }
    millis
}

fn tags() -> Vec<TelemetryTag> {
    let tag = |tag| TelemetryTag {
        tag: TagHandle(tag),
        kind: ValueKind::F64,
        freshness: Duration::from_secs(3),
        id: format!("tag {tag}"),
        address_json: "{}".into(),
    };
    (0..TAGS).map(tag).collect()
}

/// Checked samples that reach the host.
fn samples_per_second(plugin: &Plugin) -> f64 {
    let telemetry = RunningTelemetry::start(plugin, &tags()).expect("it starts");
    let (start, mut count) = (Instant::now(), 0);
    while start.elapsed() < FLOOD {
        count += telemetry.drain().len();
        std::thread::sleep(FRAME);
    }
    count as f64 / start.elapsed().as_secs_f64()
}

/// Milliseconds from the death of a plugin to its next good sample, without
/// delay or quarantine.
fn kill_times(plugin: &Plugin, kills: usize) -> Vec<f64> {
    let telemetry = RunningTelemetry::start(plugin, &tags()).expect("it starts");
    let wait_for_good = || {
        while !telemetry.drain().iter().any(|sample| sample.quality.is_good()) {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    wait_for_good();
    let mut millis = Vec::with_capacity(kills);
    for _ in 0..kills {
        let pid = plugin.status().pid.and_then(|pid| Pid::from_raw(pid as i32));
        let start = Instant::now();
        kill_process(pid.expect("it has a process"), Signal::KILL).expect("it runs");
        while telemetry.drain().iter().all(|sample| sample.quality.is_good()) {
            std::thread::sleep(Duration::from_micros(200));
        }
        wait_for_good();
        millis.push(start.elapsed().as_secs_f64() * 1e3);
    }
    millis
}

/// Descriptors that this process has open.
fn descriptors() -> usize {
    std::fs::read_dir("/proc/self/fd").map_or(0, Iterator::count)
}

fn report(what: &str, millis: &mut [f64]) {
    millis.sort_by(f64::total_cmp);
    let at = |share: f64| millis[((millis.len() - 1) as f64 * share).round() as usize];
    println!("{what}: p50 {:.3}, p99 {:.3}, longest {:.3}", at(0.5), at(0.99), at(1.0));
}
