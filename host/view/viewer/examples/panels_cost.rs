//! `panels_cost PLUGIN_DIRECTORY [SECONDS]` shows 5,400 points that change each second at
//! 900 pieces of equipment, with panels and a faceplate, then 1,000 alarms at once, and
//! prints what tags, overlays and alarms take of a frame, and beside that its panels. The
//! directory must have `sample_generator` and `power_overlay`.
#![allow(clippy::print_stdout, reason = "the table is this program's output")]

use std::path::Path;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{FrameStageMillis, RendererOptions, Viewer};
use serde_json::{Map, Value, json};

type AnyError = Box<dyn std::error::Error>;

const SIZE: [u32; 2] = [1280, 720];
const POINTS: usize = 5_400;
const PIECES: usize = 900;
const BURST: usize = 1_000;
/// Warm-up time until every value has arrived once.
const SETTLING: Duration = Duration::from_secs(4);
const FRAME: Duration = Duration::from_micros(16_667);
const DEFAULT_SECONDS: u64 = 10;

fn main() -> Result<(), AnyError> {
    let mut arguments = std::env::args().skip(1);
    let plugins = arguments.next().ok_or("usage: panels_cost PLUGIN_DIRECTORY [SECONDS]")?;
    let seconds = arguments.next().map_or(Ok(DEFAULT_SECONDS), |seconds| seconds.parse())?;
    let calm = Duration::from_secs(seconds);
    let folder = std::env::temp_dir().join(format!("busbar_panels_cost_{}", std::process::id()));
    std::fs::create_dir(&folder)?;
    let measured = measure(&folder, Path::new(&plugins), calm);
    std::fs::remove_dir_all(&folder)?;
    measured
}

fn measure(folder: &Path, plugins: &Path, calm: Duration) -> Result<(), AnyError> {
    let path = folder.join("scene.json");
    let config = configuration(&plugins.canonicalize()?, SETTLING + calm);
    std::fs::write(&path, config.to_string())?;
    let scene = LoadedScene::load(&path, &|_, _, _| ())?;
    let options = RendererOptions { samples: 1, ..RendererOptions::default() };
    let mut viewer = Viewer::new_headless(scene, options, SIZE)?;
    viewer.set_settles(false);
    viewer.set_panels_shown(true);
    viewer.select_equipment("=Q0-QA1");
    let (start, mut frames, mut bursts) = (Instant::now(), Vec::new(), Vec::new());
    let mut is_late = false;
    while start.elapsed() < SETTLING + calm + SETTLING && bursts.is_empty() {
        let began = Instant::now();
        let known = viewer.tags().counts().good;
        viewer.frame(viewer.headless_input(start.elapsed().as_secs_f64()))?;
        let has_burst = viewer.tags().counts().good > known && start.elapsed() > SETTLING;
        match has_burst {
            true => bursts.push(viewer.stage_millis()),
            false if start.elapsed() > SETTLING => frames.push(viewer.stage_millis()),
            false => {}
        }
        if has_burst {
            let shown = viewer.stats().alarms.len();
            is_late = shown < BURST;
            println!("{shown} alarms are shown in the frame in which they came");
        }
        std::thread::sleep(FRAME.saturating_sub(began.elapsed()));
    }
    println!("{POINTS} points a second, {} frames; milliseconds of CPU", frames.len());
    println!("{:<22} {:>8} {:>8} {:>8} {:>10}", "", "p50", "p99", "max", "burst");
    let of = |name: &str, part: &dyn Fn(&FrameStageMillis) -> f64| {
        let mut millis: Vec<f64> = frames.iter().map(part).collect();
        millis.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * millis.len().saturating_sub(1) as f64).round() as usize;
            millis.get(rank).copied().unwrap_or(f64::NAN)
        };
        let burst = bursts.first().map_or(f64::NAN, part);
        let (p50, p99, max) = (at(0.5), at(0.99), at(1.0));
        println!("{name:<22} {p50:>8.3} {p99:>8.3} {max:>8.3} {burst:>10.3}");
    };
    of("tags", &|part| part.tags);
    of("alarms", &|part| part.alarms);
    of("overlays", &|part| part.overlays);
    of("these together", &|part| part.tags + part.alarms + part.overlays);
    of("panels", &|part| part.panels);
    if bursts.is_empty() || is_late {
        return Err("the burst did not come, or its alarms were late".into());
    }
    Ok(())
}

/// Configuration of equipment without models, so that drawing is not measured.
fn configuration(plugins: &Path, until_burst: Duration) -> Value {
    let (mut tags, mut alarms) = (Map::new(), Map::new());
    let mut bindings = Vec::new();
    let device = |number: usize| format!("=Q{}-QA{}", number / 10, number % 10 + 1);
    let mut add = |id: String, plugin: &str, address: usize, node: String| {
        let source = json!({ "instance": plugin, "address": address });
        let tag = json!({
            "type": "f64", "unit": "A", "limits": { "high": 120 },
            "freshness_seconds": 600, "source": source
        });
        tags.insert(id.clone(), tag);
        bindings.push(json!({ "tag": id, "node": node }));
    };
    for point in 0..POINTS {
        add(format!("P{point:04}"), "points", point, device(point % PIECES));
    }
    for point in 0..BURST {
        add(format!("S{point:04}"), "burst", point, device(point % PIECES));
        let condition = json!({ "low": 50, "deadband": 1 });
        let alarm = json!({
            "tag": format!("S{point:04}"), "condition": condition, "priority": "high",
            "message": format!("Pressure low {point}")
        });
        alarms.insert(format!("A{point:04}"), alarm);
    }
    let bays: Vec<Value> = (0..PIECES / 10)
        .map(|bay| {
            let devices: Vec<Value> = (0..10)
                .map(|number| {
                    let translation = [number as f64 * 4.0, 0.0, bay as f64 * 6.0];
                    let transform = json!({ "translation": translation });
                    json!({ "id": device(bay * 10 + number), "transform": transform })
                })
                .collect();
            json!({ "id": format!("=Q{bay}"), "children": devices })
        })
        .collect();
    let burst = json!({
        "updates_per_second": 1e9, "updates": BURST,
        "delay_seconds": 1, "batch_seconds": until_burst.as_secs_f64().clamp(0.001, 10.0)
    });
    json!({
        "version": 1,
        "plugin_directories": [plugins],
        "plugins": {
            "points": {
                "plugin": "sample_generator",
                "settings": { "updates_per_second": POINTS }
            },
            "burst": { "plugin": "sample_generator", "settings": burst },
            "values": { "plugin": "power_overlay" }
        },
        "scene": bays,
        "tags": tags,
        "bindings": bindings,
        "alarms": alarms,
        "overlays": ["values"],
        "cameras": { "all": { "eye": [20, 120, -160], "target": [20, 0, 250] } },
        "camera": { "start": "all" },
        "window": { "size": SIZE },
        "graphics": { "samples": 1 }
    })
}
