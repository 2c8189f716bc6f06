//! `camera_path CONFIG [FRAMES]` flies through a scene and back, without
//! waiting for meshes at new cursors as a window does not, and prints the
//! frame times: with all in full detail, with the configured policies, and with
//! these and waiting. `moving` are the frames in which cursors waited or moved,
//! `resolve` is the CPU time that a frame spent on meshes at new cursors.
#![allow(clippy::print_stdout, reason = "the table is this program's output")]

use std::path::Path;
use std::time::Instant;

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{RendererOptions, Viewer};

type AnyError = Box<dyn std::error::Error>;

const SIZE: [u32; 2] = [320, 180];
const DEFAULT_FRAMES: u32 = 300;
/// Frames before the path that are not counted.
const WARM_UP_FRAMES: u32 = 3;

fn main() -> Result<(), AnyError> {
    let mut arguments = std::env::args().skip(1);
    let config = arguments.next().ok_or("usage: camera_path CONFIG [FRAMES]")?;
    let frames = arguments.next().map_or(Ok(DEFAULT_FRAMES), |frames| frames.parse())?;
    println!(
        "{:<18} {:>8} {:>7} {:>7} {:>7} {:>11} {:>11} {:>11} {:>9}",
        "milliseconds",
        "p50",
        "p99",
        "max",
        "moving",
        "moving p50",
        "moving max",
        "resolve max",
        "triangles"
    );
    fly(&config, frames, "full detail", |viewer| viewer.set_theta_scale(0.0))?;
    fly(&config, frames, "policies", |_| {})?;
    fly(&config, frames, "policies, waiting", |viewer| viewer.set_settles(true))
}

/// Flies once and prints a line.
fn fly(
    config: &str,
    frames: u32,
    name: &str,
    prepare: impl FnOnce(&mut Viewer),
) -> Result<(), AnyError> {
    let scene = LoadedScene::load(Path::new(config), &|_, _, _| {})?;
    let options = RendererOptions { samples: 1, ..Default::default() };
    let mut viewer = Viewer::new_headless(scene, options, SIZE)?;
    viewer.set_settles(false);
    prepare(&mut viewer);
    let (mut millis, mut moving, mut resolve_max) = (Vec::new(), Vec::new(), 0.0_f64);
    let (mut triangles, mut resolved) = (0, 0);
    for frame in 0..frames + WARM_UP_FRAMES {
        let (eye, target) = place(frame.saturating_sub(WARM_UP_FRAMES) as f32 / frames as f32);
        viewer.look_from(eye, target);
        let input = viewer.headless_input(f64::from(frame) / 60.0);
        let start = Instant::now();
        viewer.frame(input)?;
        let spent = start.elapsed().as_secs_f64() * 1e3;
        let stats = viewer.stats();
        if frame >= WARM_UP_FRAMES {
            millis.push(spent);
            if stats.waiting > 0 || stats.resolved > resolved {
                moving.push(spent);
            }
            resolve_max = resolve_max.max(stats.resolve_ms);
            triangles += stats.triangles / u64::from(frames);
        }
        resolved = stats.resolved;
    }
    println!(
        "{name:<18} {:>8.1} {:>7.1} {:>7.1} {:>7} {:>11.1} {:>11.1} {resolve_max:>11.2} \
         {triangles:>9}",
        at(&mut millis, 0.5),
        at(&mut millis, 0.99),
        at(&mut millis, 1.0),
        moving.len(),
        at(&mut moving, 0.5),
        at(&mut moving, 1.0),
    );
    Ok(())
}

/// The value below which a share of the others lies; 0 of none.
fn at(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (share * values.len().saturating_sub(1) as f64).round() as usize;
    values.get(rank).copied().unwrap_or(0.0)
}

/// Eye and target after a share of the path, metres: from far outside the
/// station into a bay of it, and back the same way.
fn place(share: f32) -> ([f32; 3], [f32; 3]) {
    let (far, near, target) = ([180.0, 80.0, -240.0], [20.5, 7.5, -73.5], [5.0, 4.6, -50.0]);
    let left = (2.0 * share - 1.0).abs();
    (std::array::from_fn(|axis| near[axis] + (far[axis] - near[axis]) * left), target)
}
