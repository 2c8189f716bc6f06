//! Frame times at equal triangles, in alternating rounds.

use std::path::Path;

use anyhow::Result;
use document::Series;
use serde::Serialize;

use crate::camera::{Camera, orbit};
use crate::drawer::{Drawer, Recipe};
use crate::scenes::{Level, Scenes};

/// Number of cameras around the scene.
const POSES: usize = 8;
/// Number of samples a pixel; not all peers have more that are the same.
const SAMPLES: u32 = 1;
/// Number of frames before the counted ones: caches fill, shaders are compiled.
const WARM_UP: usize = 3;

/// Frame times of one renderer at one level.
#[derive(Debug, Serialize)]
pub(crate) struct Frames {
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
    recipes: &[Recipe],
    (core, rounds): (&str, usize),
    folder: &Path,
) -> Result<Vec<Frames>> {
    let cameras = orbit(scenes.bounds, POSES, 1.0);
    let mut found = Vec::new();
    for level in &scenes.levels {
        let mut drawers = Vec::new();
        for recipe in recipes {
            // A peer that cannot is told of and left out.
            match begin(recipe, level, &cameras, core, folder) {
                Ok(drawer) => drawers.push((drawer, Vec::new())),
                Err(error) => println!("{}: {error:#}", recipe.name),
            }
        }
        for _ in 0..rounds {
            for (drawer, millis) in &mut drawers {
                millis.extend(drawer.frames(&cameras)?.millis);
            }
        }
        for (drawer, millis) in drawers {
            found.push(Frames {
                who: drawer.name,
                share: level.share,
                triangles: level.triangles,
                samples: SAMPLES,
                millis: Series::from_values(millis),
                peak_bytes: drawer.peak_bytes()?,
            });
        }
    }
    Ok(found)
}

/// Starts a renderer, warmed up to draw a level.
fn begin(
    recipe: &Recipe,
    level: &Level,
    cameras: &[Camera],
    core: &str,
    folder: &Path,
) -> Result<Drawer> {
    let mut drawer = Drawer::start(recipe, core, &level.glb, SAMPLES)?;
    let words: Vec<&str> = recipe.name.split([' ', ',']).filter(|word| !word.is_empty()).collect();
    let file = format!("{}_{:.0}.png", words.join("_").to_lowercase(), level.share * 100.0);
    drawer.picture(cameras[1], &folder.join(file))?;
    drawer.frames(&cameras[..WARM_UP])?;
    Ok(drawer)
}
