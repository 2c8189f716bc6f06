//! Frame times at equal triangles, in alternating rounds.

use std::path::Path;

use anyhow::Result;
use report_writer::Series;
use serde::Serialize;

use crate::camera::{Camera, orbit};
use crate::renderer_process::{RendererCommand, RendererProcess};
use crate::scenes::{Level, Scenes};

/// Number of cameras around the scene.
const POSES: usize = 8;
/// Number of samples a pixel; not all peers have more that are the same.
const SAMPLES: u32 = 1;
/// Number of frames before the counted ones: caches fill, shaders are compiled.
const WARM_UP: usize = 3;

/// Frame times of one renderer at one level.
#[derive(Debug, Serialize)]
pub(crate) struct LevelFrames {
    pub(crate) who: &'static str,
    pub(crate) share: f64,
    pub(crate) triangles: u64,
    pub(crate) samples: u32,
    pub(crate) millis: Series,
    pub(crate) peak_bytes: u64,
}

/// Measures all renderers on all levels; pictures of each go to the folder.
pub(crate) fn measure(
    scenes: &Scenes,
    renderers: &[RendererCommand],
    (core, rounds): (&str, usize),
    folder: &Path,
) -> Result<Vec<LevelFrames>> {
    let cameras = orbit(scenes.bounds, POSES, 1.0);
    let mut found = Vec::new();
    for level in &scenes.levels {
        let mut processes = Vec::new();
        for renderer in renderers {
            // A peer that cannot is told of and left out.
            match begin(renderer, level, &cameras, core, folder) {
                Ok(process) => processes.push((process, Vec::new())),
                Err(error) => println!("{}: {error:#}", renderer.name),
            }
        }
        for _ in 0..rounds {
            for (process, millis) in &mut processes {
                millis.extend(process.frames(&cameras)?.millis);
            }
        }
        for (process, millis) in processes {
            found.push(LevelFrames {
                who: process.name,
                share: level.share,
                triangles: level.triangles,
                samples: SAMPLES,
                millis: Series::from_values(millis),
                peak_bytes: process.peak_bytes()?,
            });
        }
    }
    Ok(found)
}

/// Starts a renderer, warmed up to draw a level.
fn begin(
    renderer: &RendererCommand,
    level: &Level,
    cameras: &[Camera],
    core: &str,
    folder: &Path,
) -> Result<RendererProcess> {
    let mut process = RendererProcess::start(renderer, core, &level.glb, SAMPLES)?;
    let words: Vec<&str> =
        renderer.name.split([' ', ',']).filter(|word| !word.is_empty()).collect();
    let file = format!("{}_{:.0}.png", words.join("_").to_lowercase(), level.share * 100.0);
    process.picture(cameras[1], &folder.join(file))?;
    process.frames(&cameras[..WARM_UP])?;
    Ok(process)
}
