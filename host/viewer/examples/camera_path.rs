//! `camera_path CONFIG [FRAMES]` flies through a scene and back, without
//! waiting for meshes at new cursors as a window does not, and prints the
//! frame times: with the configured policies, with all in full detail, and
//! with waiting.
#![allow(clippy::print_stdout, reason = "the table is this program's output")]

use std::path::Path;
use std::time::Instant;

use busbar_viewer::{LoadedScene, RendererOptions, Viewer};

type AnyError = Box<dyn std::error::Error>;

const SIZE: [u32; 2] = [640, 360];
const DEFAULT_FRAMES: u32 = 300;
/// Frames before the path that are not counted.
const WARM_UP_FRAMES: u32 = 3;

fn main() -> Result<(), AnyError> {
    let mut arguments = std::env::args().skip(1);
    let config = arguments.next().ok_or("usage: camera_path CONFIG [FRAMES]")?;
    let frames = arguments.next().map_or(Ok(DEFAULT_FRAMES), |frames| frames.parse())?;
    println!(
        "{:<22} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9}",
        "", "p50 ms", "p99 ms", "max ms", "resolved", "waited", "triangles"
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
    let options = RendererOptions { samples: 1, validation: false };
    let mut viewer = Viewer::headless(scene, options, SIZE)?;
    viewer.set_settles(false);
    prepare(&mut viewer);
    let (mut millis, mut waited, mut triangles) = (Vec::new(), 0, 0);
    for frame in 0..frames + WARM_UP_FRAMES {
        let (eye, target) = place(frame.saturating_sub(WARM_UP_FRAMES) as f32 / frames as f32);
        viewer.look_from(eye, target);
        let input = viewer.headless_input(f64::from(frame) / 60.0);
        let start = Instant::now();
        viewer.frame(input)?;
        let spent = start.elapsed().as_secs_f64() * 1e3;
        if frame >= WARM_UP_FRAMES {
            let stats = viewer.stats();
            millis.push(spent);
            waited += u32::from(stats.waiting > 0);
            triangles += stats.triangles / u64::from(frames);
        }
    }
    millis.sort_by(f64::total_cmp);
    let at = |share: f64| millis[(share * (millis.len() - 1) as f64).round() as usize];
    let resolved = viewer.stats().resolved;
    println!(
        "{name:<22} {:>8.1} {:>8.1} {:>8.1} {resolved:>9} {waited:>9} {triangles:>9}",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    Ok(())
}

/// Eye and target after a share of the path, metres: from far outside the
/// station into a bay of it, and back the same way.
fn place(share: f32) -> ([f32; 3], [f32; 3]) {
    let (far, near, target) = ([180.0, 80.0, -240.0], [20.5, 7.5, -73.5], [5.0, 4.6, -50.0]);
    let left = (2.0 * share - 1.0).abs();
    (std::array::from_fn(|axis| near[axis] + (far[axis] - near[axis]) * left), target)
}
