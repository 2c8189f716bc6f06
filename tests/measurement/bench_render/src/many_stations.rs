//! Many stations of the same models: growth of the frame time with the size of the scene.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use busbar_geometry::Bounds;
use glam::Vec3;
use report_writer::Series;
use serde::Serialize;
use serde_json::json;
use substation::Station;

use crate::camera::{Camera, orbit, stride, walk};
use crate::renderer_process::{RendererCommand, RendererProcess};
use crate::scenes::{Scenes, write_models};
use crate::screen_error::PictureSimilarity;

/// Number of stations in a row.
const ROW: usize = 10;
pub(crate) const STATIONS: usize = ROW * ROW;
/// Number of stations that have 10,000 pieces of equipment together.
pub(crate) const SOME_STATIONS: usize = 12;
/// Gap between two stations, metres.
const GAP: f32 = 20.0;
const POSES: usize = 6;
/// Step of a walking operator from frame to frame, metres: fast, at 60 frames a second.
pub(crate) const STRIDE_METRES: f32 = 0.2;
/// Number of frames of a walk.
const STRIDES: usize = 30;
/// Number of rounds before the counted ones: levels of detail are resolved on the way.
const WARM_UP_ROUNDS: usize = 2;
/// View from above all stations, however many there are.
pub(crate) const BIRD: &str = "bird";
/// View from above one station that fills the picture as all of them do from [`BIRD`].
pub(crate) const FILLING: &str = "filling";
/// View on foot; its bar on processor time is judged for some stations alone.
const WALKING: &str = "walking";
/// View from within one station, in leaps.
const WITHIN: &str = "within";
/// Greatest screen error of theta, pixels.
pub(crate) const MAX_ERROR_PX: f64 = 0.5;

/// Results of one view of a number of stations.
#[derive(Debug, Serialize)]
pub(crate) struct ManyStations {
    pub(crate) stations: usize,
    pub(crate) view: &'static str,
    pub(crate) triangles: u64,
    pub(crate) millis: Series,
    pub(crate) cpu_millis: Series,
    pub(crate) hide_millis: Series,
    pub(crate) peak_bytes: u64,
    /// Share of pixels of the second pose that differ from the first pixel.
    pub(crate) covered_share: f64,
    /// Similarity to full detail, for all stations seen from within.
    pub(crate) likeness: Option<PictureSimilarity>,
}

/// Measures one station, some and all: from above all of them, and from within one, in leaps and on
/// foot. A single station is also measured filling the picture.
pub(crate) fn measure(
    scenes: &Scenes,
    ours: &RendererCommand,
    (core, rounds): (&str, usize),
    folder: &Path,
    pictures: &Path,
) -> Result<Vec<ManyStations>> {
    write_models(folder)?;
    let all = Bounds {
        min: scenes.bounds.min,
        max: scenes.bounds.max + step(scenes.bounds) * (ROW - 1) as f32,
    };
    let birds = orbit(all, POSES, 1.0);
    let strides = stride(scenes.bounds, STRIDES, STRIDE_METRES);
    let views = [
        (BIRD, birds),
        (WITHIN, walk(scenes.bounds, POSES)),
        (WALKING, strides),
        (FILLING, orbit(scenes.bounds, POSES, 1.0)),
    ];
    let followed = json!({ "max_error_px": MAX_ERROR_PX });
    let mut found = Vec::new();
    for stations in [1, SOME_STATIONS, STATIONS] {
        let path = configuration((stations, "followed", &followed), scenes.bounds, folder)?;
        let is_asked = |view: &str| match view {
            WALKING => stations == SOME_STATIONS,
            FILLING => stations == 1,
            _ => true,
        };
        for (view, cameras) in views.iter().filter(|(view, _)| is_asked(view)) {
            let mut process = RendererProcess::start(ours, core, &path, 1)?;
            let stem = format!("stations_{stations}_{view}");
            let picture = pictures.join(format!("{stem}.png"));
            process.picture(cameras[1], &picture)?;
            let mut many = measure_view(&mut process, cameras, rounds, stations, view)?;
            many.covered_share = covered_share(&picture)?;
            if (stations, *view) == (STATIONS, WITHIN) {
                let full = configuration((stations, "full", &json!(0.0)), scenes.bounds, folder)?;
                let mut detail = RendererProcess::start(ours, core, &full, 1)?;
                let processes = [&mut detail, &mut process];
                many.likeness =
                    Some(PictureSimilarity::compare(processes, cameras, &stem, pictures)?);
            }
            found.push(many);
        }
    }
    Ok(found)
}

fn measure_view(
    process: &mut RendererProcess,
    cameras: &[Camera],
    rounds: usize,
    stations: usize,
    view: &'static str,
) -> Result<ManyStations> {
    for _ in 0..WARM_UP_ROUNDS {
        process.frames(cameras)?;
    }
    let [mut millis, mut cpu_millis, mut hide_millis] = [const { Vec::new() }; 3];
    let mut triangles = 0;
    for _ in 0..rounds {
        let answer = process.frames(cameras)?;
        millis.extend(answer.millis);
        cpu_millis.extend(answer.cpu_millis);
        hide_millis.extend(answer.hide_millis);
        triangles = answer.triangles;
    }
    Ok(ManyStations {
        stations,
        view,
        triangles,
        millis: Series::from_values(millis),
        cpu_millis: Series::from_values(cpu_millis),
        hide_millis: Series::from_values(hide_millis),
        peak_bytes: process.peak_bytes()?,
        covered_share: 0.0,
        likeness: None,
    })
}

/// Returns the share of a picture's pixels that differ from the first one, which shows the
/// background.
fn covered_share(picture: &Path) -> Result<f64> {
    let picture = image::open(picture)?.into_rgba8();
    let background = picture.get_pixel(0, 0);
    let covered = picture.pixels().filter(|pixel| *pixel != background).count();
    Ok(covered as f64 / picture.pixels().len() as f64)
}

/// Returns the distance from one station to the next, in x and z.
fn step(station: Bounds) -> Vec3 {
    let size = station.max - station.min;
    Vec3::new(size.x + GAP, 0.0, size.z + GAP)
}

/// Writes a scene of so many stations with a named theta.
fn configuration(
    (stations, name, theta): (usize, &str, &serde_json::Value),
    bounds: Bounds,
    folder: &Path,
) -> Result<PathBuf> {
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
    scene["graphics"] = json!({ "samples": 1 });
    scene["cameras"] = json!({});
    for model in scene["models"].as_object_mut().context("no models")?.values_mut() {
        model["optimizer"] = json!("optimizer");
        model["theta"] = theta.clone();
    }
    let path = folder.join(format!("stations_{stations}_{name}.json"));
    fs::write(&path, scene.to_string())?;
    Ok(path)
}
