//! Start-up time from a process's start to its first picture, and its memory.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use report_writer::Series;
use serde::Serialize;
use serde_json::json;

use crate::camera::Camera;
use crate::renderer_process::{SIZE, peak_bytes};

/// Sampling period of the memory measurement.
const POLL: Duration = Duration::from_millis(2);
/// Longest time of one start.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Optimizer of the sequence that Busbar starts with.
const OPTIMIZER: &str = "weighted_collapse";
/// Number of samples a pixel.
const SAMPLES: u32 = 1;

/// Start-up time and memory of one renderer.
#[derive(Debug, Serialize)]
pub(crate) struct Startup {
    pub(crate) who: &'static str,
    pub(crate) seconds: Series,
    /// Greatest memory of the process and its children, bytes.
    pub(crate) peak_bytes: u64,
}

/// Names in the tables.
pub(crate) const EMPTY_CACHE: &str = "busbar, sequence built as well";
pub(crate) const FULL_CACHE: &str = "busbar, sequence from the cache";
pub(crate) const F3D: &str = "F3D";

/// Starts all programs in alternating rounds; their pictures go to a folder.
pub(crate) fn measure(
    glb: &Path,
    camera: Camera,
    (core, rounds): (&str, usize),
    busbar: &Path,
    pictures: &Path,
) -> Result<Vec<Startup>> {
    let folder = glb.parent().context("a file without a folder")?;
    let scene = folder.join("start.json");
    fs::write(&scene, json!({
        "version": 1,
        "plugin_directories": ["plugins"],
        "plugins": { "optimizer": { "plugin": OPTIMIZER } },
        "cache": { "directory": "cache" },
        "models": { "paper": { "file": glb.file_name().map(|name| name.to_string_lossy()), "optimizer": "optimizer" } },
        "scene": [{ "id": "paper", "model": "paper" }],
        "cameras": { "start": camera },
        "camera": { "start": "start" },
        "graphics": { "samples": SAMPLES },
        "window": { "size": SIZE },
    }).to_string())?;
    let mut all: Vec<(Startup, Vec<f64>)> = Vec::new();
    let ours = |picture: &str| {
        let mut command = on_core(core, busbar);
        command.arg("render").arg(&scene).arg("--out").arg(pictures.join(picture));
        command
    };
    for round in 0..rounds {
        // It may be left from the round before.
        let _ = fs::remove_dir_all(folder.join("cache"));
        let runs = [
            (EMPTY_CACHE, ours("start_empty_cache.png")),
            (FULL_CACHE, ours("start_full_cache.png")),
            (F3D, f3d(glb, camera, core, &pictures.join("start_f3d.png"))),
        ];
        for (index, (who, mut command)) in runs.into_iter().enumerate() {
            let (seconds, peak) = run(&mut command).with_context(|| who.to_owned())?;
            if round == 0 {
                all.push((Startup { who, seconds: Series::default(), peak_bytes: 0 }, Vec::new()));
            }
            let (start, series) = &mut all[index];
            start.peak_bytes = start.peak_bytes.max(peak);
            series.push(seconds);
        }
    }
    let summed = |(start, series)| Startup { seconds: Series::from_values(series), ..start };
    Ok(all.into_iter().map(summed).collect())
}

fn on_core(core: &str, program: &Path) -> Command {
    let mut command = Command::new("taskset");
    command.args(["--cpu-list", core]).arg(program);
    command
}

fn f3d(glb: &Path, camera: Camera, core: &str, picture: &Path) -> Command {
    let point = |[x, y, z]: [f32; 3]| format!("{x},{y},{z}");
    let mut command = on_core(core, Path::new("f3d"));
    command.arg(glb).arg("--quiet").arg("--dry-run").arg("--output").arg(picture);
    command.arg(format!("--resolution={},{}", SIZE[0], SIZE[1]));
    command.arg(format!("--camera-position={}", point(camera.eye)));
    command.arg(format!("--camera-focal-point={}", point(camera.target)));
    command.arg(format!("--camera-view-angle={}", camera.fov_degrees));
    command.arg("--camera-view-up=0,1,0");
    command
}

/// Runs a command to its end; returns its seconds and its peak memory, bytes.
fn run(command: &mut Command) -> Result<(f64, u64)> {
    let started = Instant::now();
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    let mut peak = 0;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        peak = peak.max(bytes_of_all(child.id()));
        if started.elapsed() > MAX_WAIT {
            child.kill()?;
        }
        thread::sleep(POLL);
    };
    let seconds = started.elapsed().as_secs_f64();
    ensure!(status.success(), "ended with {status}");
    Ok((seconds, peak))
}

/// Returns the sum of the peak memories of a process and its living children, bytes.
fn bytes_of_all(process: u32) -> u64 {
    let children = fs::read_to_string(format!("/proc/{process}/task/{process}/children"));
    let children = children.unwrap_or_default();
    let of_children = children.split_whitespace().filter_map(|id| id.parse().ok());
    peak_bytes(process).unwrap_or(0) + of_children.map(bytes_of_all).sum::<u64>()
}
