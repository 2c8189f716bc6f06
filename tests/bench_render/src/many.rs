//! Many stations of the same models: by how much a frame grows with what is there.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use busbar_geometry::Bounds;
use document::Series;
use glam::Vec3;
use serde::Serialize;
use serde_json::json;
use substation::Station;

use crate::camera::{Camera, orbit, stride, walk};
use crate::drawer::{Drawer, Recipe};
use crate::scenes::{Scenes, write_models};

/// Stations stand in rows of so many.
const ROW: usize = 10;
pub(crate) const STATIONS: usize = ROW * ROW;
/// Stations that have 10,000 pieces of equipment together.
pub(crate) const SOME_STATIONS: usize = 12;
/// Between two stations, metres.
const GAP: f32 = 20.0;
const POSES: usize = 6;
/// From frame to frame where an operator walks, metres: fast, at 60 frames a second.
pub(crate) const STRIDE_METRES: f32 = 0.2;
/// Frames of a walk.
const STRIDES: usize = 30;
/// Frames before the counted ones: levels of detail are resolved on the way.
const WARM_UP_ROUNDS: usize = 2;
/// Pixels of error that theta may show.
pub(crate) const MAX_ERROR_PX: f64 = 0.5;

/// So many stations, seen from somewhere.
#[derive(Debug, Serialize)]
pub(crate) struct Many {
    pub(crate) stations: usize,
    pub(crate) view: &'static str,
    pub(crate) triangles: u64,
    pub(crate) millis: Series,
    pub(crate) cpu_millis: Series,
    pub(crate) peak_bytes: u64,
}

/// Measures one station, some and all, from above all of them and from within one, in leaps
/// and as one walks.
pub(crate) fn measure(
    scenes: &Scenes,
    ours: &Recipe,
    (core, rounds): (&str, usize),
    folder: &Path,
    pictures: &Path,
) -> Result<Vec<Many>> {
    write_models(folder)?;
    let all = Bounds {
        min: scenes.bounds.min,
        max: scenes.bounds.max + step(scenes.bounds) * (ROW - 1) as f32,
    };
    let birds = orbit(all, POSES, 1.0);
    let strides = stride(scenes.bounds, STRIDES, STRIDE_METRES);
    let views = [("bird", birds), ("within", walk(scenes.bounds, POSES)), ("walking", strides)];
    let mut found = Vec::new();
    for stations in [1, SOME_STATIONS, STATIONS] {
        let path = configuration(stations, scenes.bounds, folder)?;
        // What the processor takes is asked for of some alone.
        let count = if stations == SOME_STATIONS { views.len() } else { views.len() - 1 };
        for (view, cameras) in &views[..count] {
            let mut drawer = Drawer::start(ours, core, &path, 1)?;
            drawer
                .picture(cameras[1], &pictures.join(format!("stations_{stations}_{view}.png")))?;
            found.push(measure_view(&mut drawer, cameras, rounds, stations, view)?);
        }
    }
    Ok(found)
}

fn measure_view(
    drawer: &mut Drawer,
    cameras: &[Camera],
    rounds: usize,
    stations: usize,
    view: &'static str,
) -> Result<Many> {
    for _ in 0..WARM_UP_ROUNDS {
        drawer.frames(cameras)?;
    }
    let (mut millis, mut cpu_millis, mut triangles) = (Vec::new(), Vec::new(), 0);
    for _ in 0..rounds {
        let answer = drawer.frames(cameras)?;
        millis.extend(answer.millis);
        cpu_millis.extend(answer.cpu_millis);
        triangles = answer.triangles;
    }
    Ok(Many {
        stations,
        view,
        triangles,
        millis: Series::of(millis),
        cpu_millis: Series::of(cpu_millis),
        peak_bytes: drawer.peak_bytes()?,
    })
}

/// From one station to the next, in x and z.
fn step(station: Bounds) -> Vec3 {
    let size = station.max - station.min;
    Vec3::new(size.x + GAP, 0.0, size.z + GAP)
}

/// Writes a scene of so many stations.
fn configuration(stations: usize, bounds: Bounds, folder: &Path) -> Result<PathBuf> {
    let mut scene = Station::generate(crate::scenes::SEED)?.configuration();
    let bays = scene["scene"].take();
    let place = |number: usize| {
        let Vec3 { x, z, .. } = step(bounds);
        let [x, z] = [x * (number % ROW) as f32, z * (number / ROW) as f32];
        json!({
            "id": format!("S{number} "),
            "transform": { "translation": [x, 0, z] },
            "template": "station",
        })
    };
    scene["templates"] = json!({ "station": bays });
    scene["scene"] = (0..stations).map(place).collect();
    scene["overlays"] = json!([]);
    scene["plugins"].as_object_mut().context("no plugins")?.remove("values");
    scene["view"] = json!({ "samples": 1 });
    scene["cameras"] = json!({});
    for model in scene["models"].as_object_mut().context("no models")?.values_mut() {
        model["optimizer"] = json!("optimizer");
        model["theta"] = json!({ "max_error_px": MAX_ERROR_PX });
    }
    let path = folder.join(format!("stations_{stations}.json"));
    fs::write(&path, scene.to_string())?;
    Ok(path)
}
