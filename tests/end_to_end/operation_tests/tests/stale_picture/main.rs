//! End-to-end test that nothing stale or bad looks good. Seeded sequences of values, qualities,
//! times and faults are played. An oracle derives from the sent samples alone which tags cannot be
//! good, and each picture is checked against it. `BUSBAR_STALE_SEQUENCES` sets the number of
//! sequences; `BUSBAR_PICTURES` names a folder for a few of the pictures.

mod expected_state;
mod picture_reader;
mod script;

use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{Picture, RendererOptions, Viewer};
use e2e::Scene;
use e2e::glb::{self, WeldedMesh};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use crate::expected_state::{Claim, ExpectedState, FRESHNESS_MILLIS, Times};
use crate::picture_reader::{PictureReader, ShownState};
use crate::script::{Random, SEQUENCE_MILLIS, SHOWN, SHOWN_MILLIS, Script};

const SIZE: [u32; 2] = [1280, 720];
/// Pixels to a metre where the equipment stands.
const SCALE: f64 = 100.0;
const EYE_METRES: f64 = 100.0;
/// Columns and rows of labelled gauges, and of lamps below them.
const GAUGES: [usize; 2] = [3, 3];
const LAMPS: [usize; 2] = [26, 4];
const GAUGE_COUNT: usize = GAUGES[0] * GAUGES[1];
const LAMP_COUNT: usize = LAMPS[0] * LAMPS[1];
/// Sequences in a test; `cargo xtask soak --stale-pictures` has 100,000.
const SEQUENCES: usize = 600;
/// Most sequences of each tag before all processes are started anew.
const MAX_ROUND: u64 = 40;
const SEQUENCES_VARIABLE: &str = "BUSBAR_STALE_SEQUENCES";
/// Lead time from now until the first sample, by which all processes run.
const LEAD: Duration = Duration::from_secs(5);
/// Part of [`LEAD`] that must be left once the first frame is drawn.
const SETTLED: Duration = Duration::from_millis(500);
/// Margin before the end of each initial value, in which the reference picture is taken,
/// nanoseconds.
const SHOWN_MARGIN: i64 = 150_000_000;
/// Largest share of frames claimed good that may be shown late, because overlays answer from a
/// process of their own.
const MAX_LATE_SHARE: f64 = 0.1;
/// Plugins that are stopped and killed: mostly the source of the values, otherwise those that show
/// them.
const PLUGINS: [&str; 4] = ["source", "source", "values", "energised"];
/// Rounds that may come to nothing, because others keep the machine busy.
const MAX_SLOW: u32 = 8;
/// Longest stop of a plugin, milliseconds; shorter than the time after which a stopped plugin is
/// killed.
const MAX_STOP: u64 = 450;

/// To the left of a gauge there is less room than to its right, where its label is, metres.
const ASIDE: f64 = 0.73;

/// Row by row from the upper left, metres.
fn places([columns, rows]: [usize; 2], top: f64, height: f64) -> Vec<[f64; 3]> {
    let width = f64::from(SIZE[0]) / SCALE;
    let place = |column: usize, row: usize| {
        let x = (column as f64 + 0.5) / columns as f64 * width - width / 2.0;
        [x, top - (row as f64 + 0.5) / rows as f64 * height, 0.0]
    };
    (0..rows).flat_map(|row| (0..columns).map(move |column| place(column, row))).collect()
}

fn cube() -> WeldedMesh {
    let corner = |i: u32| [0, 1, 2].map(|axis| ((i >> axis & 1) as f32) - 0.5);
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    WeldedMesh {
        positions: (0..8).map(corner).collect(),
        triangles: faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
    }
}

/// Gauges with labels and lamps that switches light; the ids of their tags.
fn scene() -> (Scene, Vec<String>) {
    let mut scene = Scene::demo(1);
    let library = "libsample_generator.so";
    std::fs::copy(
        e2e::built(e2e::built_folder().join(library)),
        scene.path("plugins").join(library),
    )
    .expect("a copy");
    std::fs::write(scene.path("cube.glb"), glb::write(&cube())).expect("it can be written");
    let mut gauges = places(GAUGES, 3.6, 5.4);
    gauges.iter_mut().for_each(|[x, ..]| *x -= ASIDE);
    let lamps = places(LAMPS, -2.0, 1.5);
    let ids = |letter: &str, count: usize| {
        (0..count).map(move |i| format!("{letter}{i}")).collect::<Vec<_>>()
    };
    let (gauge_ids, lamp_ids) = (ids("G", gauges.len()), ids("L", lamps.len()));
    let box_at = |id: &String, at: &[f64; 3], size: f64| {
        json!({ "id": format!("={id}"), "model": "cube",
            "transform": { "translation": at, "scale": [size, size, 0.1] } })
    };
    // Their labels would be in the way.
    let switch = |id: &String| json!({ "id": format!("=SW{id}"), "transform": { "translation": [0, 500, 0] } });
    let mut nodes: Vec<Value> = Vec::new();
    nodes.extend(gauge_ids.iter().zip(&gauges).map(|(id, at)| box_at(id, at, 0.5)));
    nodes.extend(lamp_ids.iter().zip(&lamps).map(|(id, at)| box_at(id, at, 0.3)));
    nodes.extend(lamp_ids.iter().map(switch));
    let mut connectivity = vec![json!({ "id": "bus", "level": "220 kV" })];
    connectivity.extend(
        lamp_ids
            .iter()
            .map(|id| json!({ "id": id, "level": "220 kV", "equipment": [format!("={id}")] })),
    );
    let branch = |id: &String| json!({ "equipment": format!("=SW{id}"), "between": ["bus", id], "switch": true });
    let branches: Vec<Value> = lamp_ids.iter().map(branch).collect();
    let tag = |kind: &str, freshness: u64| {
        json!({ "type": kind, "freshness_seconds": freshness as f64 / 1_000.0,
            "source": { "instance": "source", "address": {} } })
    };
    let mut tags = json!({ "sent": tag("i64", 600_000), "first": tag("i64", 600_000) });
    let mut bindings = Vec::new();
    for (number, id) in gauge_ids.iter().enumerate() {
        tags[id] = tag("f64", FRESHNESS_MILLIS);
        tags[id]["limits"] = json!({ "high": 100 });
        let role = if number % 2 == 0 { "alarm" } else { "value" };
        bindings.push(json!({ "tag": id, "node": format!("={id}"), "role": role }));
    }
    for id in &lamp_ids {
        tags[id] = tag("double_point", FRESHNESS_MILLIS);
        bindings.push(json!({ "tag": id, "node": format!("=SW{id}"), "role": "position" }));
    }
    let fov = 2.0 * (f64::from(SIZE[1]) / SCALE / 2.0 / EYE_METRES).atan();
    scene.config = json!({
        "version": 1,
        "plugin_directories": ["plugins"],
        "plugins": {
            "source": { "plugin": "sample_generator",
                "settings": { "script": scene.path("script.json") } },
            "values": { "plugin": "power_overlay" },
            "energised": { "plugin": "energisation", "settings": {
                "levels": [{ "name": "220 kV", "color": "#2040ff" }],
                "nodes": connectivity,
                "branches": branches,
                "sources": [{ "node": "bus" }],
            }},
        },
        "models": { "cube": { "file": "cube.glb" } },
        "scene": nodes,
        "tags": tags,
        "bindings": bindings,
        "overlays": ["values", "energised"],
        "cameras": { "front": { "eye": [0, 0, EYE_METRES], "target": [0, 0, 0],
            "fov_degrees": fov.to_degrees() } },
        "graphics": { "samples": 1 },
        "window": { "size": SIZE },
        "camera": { "start": "front" },
    });
    (scene, gauge_ids.into_iter().chain(lamp_ids).collect())
}

fn now() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).expect("it is after 1970");
    since.as_nanos() as i64
}

/// Stops, starts and kills plugins now and then.
struct Troublemaker {
    random: Random,
    next: i64,
    stopped: Option<Pid>,
    kills: u32,
    stops: u32,
}

impl Troublemaker {
    fn step(&mut self, viewer: &Viewer, oracle: &mut ExpectedState) {
        let now = now();
        if now < self.next {
            return;
        }
        let millis = |millis: u64| millis as i64 * 1_000_000;
        oracle.note_disturbance(now);
        if let Some(pid) = self.stopped.take() {
            // It may be gone.
            let _ = kill_process(pid, Signal::CONT);
            self.next = now + millis(500 + self.random.below(2_000));
            return;
        }
        let stats = viewer.stats();
        let name = PLUGINS[self.random.below(PLUGINS.len() as u64) as usize];
        let source = stats.plugins.iter().find(|plugin| plugin.name == name);
        let source = source.expect("it is configured");
        self.next = now + millis(2_000 + self.random.below(3_000));
        match source.pid.and_then(|pid| Pid::from_raw(pid as i32)) {
            // Left alone after too many deaths.
            None => viewer.start_plugin(name),
            Some(pid) if self.random.one_in(4) => {
                self.kills += 1;
                let _ = kill_process(pid, Signal::KILL);
            }
            Some(pid) => {
                self.stops += 1;
                let _ = kill_process(pid, Signal::STOP);
                self.stopped = Some(pid);
                self.next = now + millis(self.random.below(MAX_STOP));
            }
        }
    }
}

/// Counts of sequences, faults and frames over a test.
#[derive(Debug, Default)]
struct Counts {
    sequences: usize,
    stops: u32,
    kills: u32,
    frames: usize,
    not_good: usize,
    good: usize,
    late: usize,
}

struct Test {
    viewer: Viewer,
    start: Instant,
}

impl Test {
    fn draw(&mut self) -> (Picture, Times) {
        let began = now();
        let input = self.viewer.headless_input(self.start.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
        let ended = now();
        (self.viewer.read_picture().expect("it is drawn"), Times { began, ended })
    }

    /// Draws until a picture begins after `from`; none where it ends after `until`.
    fn draw_between(&mut self, from: i64, until: i64) -> Option<Picture> {
        loop {
            let (picture, times) = self.draw();
            if times.began >= from {
                return Some(picture).filter(|_| times.ended <= until);
            }
        }
    }

    /// Returns a count by which the plugin reports its own progress.
    fn progress(&self, id: &str) -> Option<usize> {
        let tags = self.viewer.stats().tags;
        let tag = tags.into_iter().find(|tag| tag.id == id)?;
        tag.value.as_u64().map(|count| count as usize)
    }
}

/// Plays sequences of each tag, checks the pictures and adds up the counts. None where the machine
/// was too slow for the reference pictures.
fn read_round(seed: u64, sequences: u64, counts: &mut Counts) -> Option<()> {
    let pictures = std::env::var_os("BUSBAR_PICTURES").map(PathBuf::from);
    let (scene, ids) = scene();
    let script = Script::new(ids.len(), sequences, &mut Random(seed));
    let start_millis = now() as u64 / 1_000_000 + LEAD.as_millis() as u64;
    let text = script.to_json(&ids, start_millis).to_string();
    std::fs::write(scene.path("script.json"), text).expect("it can be written");
    let mut oracle = ExpectedState::new(script, start_millis);

    let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {});
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let options = RendererOptions { samples: 1, ..Default::default() };
    let mut viewer = Viewer::new_headless(loaded, options, SIZE).expect("there is a device");
    viewer.set_settles(false);
    let mut test = Test { viewer, start: Instant::now() };
    let first = start_millis as i64 * 1_000_000;
    let (unknown, times) = test.draw();
    if times.ended + SETTLED.as_nanos() as i64 > first {
        return None;
    }
    let reader = PictureReader::new(&mut test.viewer, SIZE);
    let shown = [1, 2].map(|count| first + count * (SHOWN_MILLIS * 1_000_000) as i64);
    let looks = shown.map(|until| test.draw_between(until - SHOWN_MARGIN, until));
    let [Some(off), Some(on)] = looks else { return None };
    let lamps = || ids.iter().filter(|id| id.starts_with('L')).map(|id| format!("={id}"));
    let pairs = [[&off, &on], [&off, &unknown], [&on, &unknown]];
    if lamps().any(|lamp| pairs.iter().any(|[a, b]| reader.looks_as(a, b, &lamp))) {
        return None;
    }
    let looks = [off, on];
    let first = shown[SHOWN.len() - 1];
    let last = first + (sequences * SEQUENCE_MILLIS) as i64 * 1_000_000;
    let mut trouble = Troublemaker {
        random: Random(seed + 1),
        next: first + 1_000_000_000,
        stopped: None,
        kills: 0,
        stops: 0,
    };
    while now() < last + 1_000_000_000 {
        trouble.step(&test.viewer, &mut oracle);
        let (picture, times) = test.draw();
        if let (Some(first), Some(sent)) = (test.progress("first"), test.progress("sent")) {
            oracle.note_progress(first, sent, times);
        }
        counts.frames += 1;
        if let Some(folder) = pictures.as_ref().filter(|_| counts.frames % 40 == 1) {
            save(&picture, &folder.join(format!("stale_{}.png", counts.frames)));
        }
        for (tag, id) in ids.iter().enumerate() {
            let claim = oracle.claim(tag, times);
            let equipment = format!("={id}");
            if claim == Claim::Nothing {
                continue;
            }
            let seen = reader.see(&picture, &looks, &equipment, id.starts_with('L'));
            match claim {
                Claim::NotGood => {
                    counts.not_good += 1;
                    assert!(
                        seen == ShownState::NotGood,
                        "{id} is not good and is seen as {seen:?}, in {times:?}: see {}; \
                         seed {seed}, {counts:?}, after {:#?}",
                        keep(&picture).display(),
                        oracle.last_sent(tag, times)
                    );
                }
                Claim::Good(value) => {
                    counts.good += 1;
                    counts.late += usize::from(seen != ShownState::Good(value));
                }
                Claim::Nothing => {}
            }
        }
    }
    counts.sequences += sequences as usize * ids.len();
    (counts.stops, counts.kills) = (counts.stops + trouble.stops, counts.kills + trouble.kills);
    Some(())
}

#[test]
fn nothing_that_is_not_good_looks_good() {
    let wanted = std::env::var(SEQUENCES_VARIABLE).map_or(SEQUENCES, |wanted| {
        wanted.parse().unwrap_or_else(|_| panic!("{SEQUENCES_VARIABLE} is no number: {wanted}"))
    });
    let mut counts = Counts::default();
    let mut slow = 0;
    for seed in 1.. {
        let left = (wanted - counts.sequences).div_ceil(GAUGE_COUNT + LAMP_COUNT) as u64;
        if read_round(seed, left.min(MAX_ROUND), &mut counts).is_none() {
            slow += 1;
            assert!(slow <= MAX_SLOW, "the machine is too slow to see what is known: {counts:?}");
        }
        println!("{counts:?}");
        if counts.sequences >= wanted {
            break;
        }
    }
    assert!(counts.stops + counts.kills > 0, "{counts:?}");
    assert!(counts.not_good > wanted && counts.good > wanted, "{counts:?}");
    let late = counts.late as f64 / counts.good as f64;
    assert!(late <= MAX_LATE_SHARE, "{late:.3} of what is good does not look so: {counts:?}");
}

fn save(picture: &Picture, path: &std::path::Path) {
    let Picture { width, height, rgba8 } = picture.clone();
    let image = image::RgbaImage::from_raw(width, height, rgba8).expect("as many pixels");
    image.save(path).expect("it can be written");
}

/// Keeps the picture of a failure.
fn keep(picture: &Picture) -> PathBuf {
    let folder = e2e::workspace_path("target/stale-failures");
    std::fs::create_dir_all(&folder).expect("it can be made");
    let path = folder.join("stale.png");
    save(picture, &path);
    path
}
