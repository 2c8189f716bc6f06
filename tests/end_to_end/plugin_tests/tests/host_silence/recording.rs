//! Replay of a recording: verdicts follow the recording's time and its qualities, and alarms say
//! that they are of a recording.

use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{RendererOptions, Stats, Viewer};
use e2e::Scene;
use serde_json::json;

const SIZE: [u32; 2] = [64, 48];
/// Seconds of the recording in a second.
const SPEED: f64 = 40.0;
/// Seconds of the recording from one row to the next.
const ROW_SECONDS: f64 = 60.0;
/// Travel time of the switch, seconds of the recording.
const TRAVEL_SECONDS: f64 = 20.0;
/// Time after which a verdict must be that of the present inputs: the age at which the host calls
/// a picture late, and some frames.
const LAG: Duration = Duration::from_millis(900);
const PATIENCE: Duration = Duration::from_secs(60);
const FRAME: Duration = Duration::from_millis(10);

/// Temperature with its quality, and position of the switch, row by row.
const ROWS: [(&str, &str, &str); 8] = [
    ("60", "good", "1"),
    ("95", "good", "1"),
    ("95", "bad", "1"),
    ("60", "good", "0"),
    ("60", "uncertain", "2"),
    ("97", "good", "3"),
    ("61", "good", "0"),
    ("61", "good", "2"),
];

/// Inputs of a frame as the host's tags have them.
type Inputs = Vec<Input>;

/// Value and quality of a tag.
type Input = (String, &'static str);

pub(crate) fn replay() {
    let mut scene = Scene::demo(1);
    ["condition", "switch_position", "replay"].iter().for_each(|plugin| scene.add_plugin(plugin));
    let mut csv = "time,oil,quality,position\n".to_owned();
    for (row, (oil, quality, position)) in ROWS.iter().enumerate() {
        csv += &format!("{},{oil},{quality},{position}\n", row as f64 * ROW_SECONDS);
    }
    std::fs::write(scene.path("recording.csv"), csv).expect("the folder can be written");
    configure(&mut scene);
    let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {});
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let options = RendererOptions { samples: 1, ..RendererOptions::default() };
    let mut viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
    let started = Instant::now();
    let mut inputs: (Inputs, Instant) = (Vec::new(), started);
    let (mut seen, mut recorded_alarms) = (Vec::<String>::new(), 0);
    // The last row is over when its verdicts were seen for a while.
    while started.elapsed() < PATIENCE {
        let input = viewer.headless_input(started.elapsed().as_secs_f64());
        viewer.frame(input).expect("a frame is drawn");
        let stats = viewer.stats();
        let now = inputs_of(&stats);
        if inputs.0 != now {
            inputs = (now, Instant::now());
        }
        let held = inputs.1.elapsed();
        let [oil, position] = [verdict(&stats, "condition"), verdict(&stats, "switch_position")];
        if held > LAG {
            check_oil(&inputs.0[0], &oil);
            check_position(&inputs.0[1], &position);
            let state = format!("{:?}: {oil} {position}", inputs.0);
            if seen.last() != Some(&state) {
                assert!(stats.scene_time.is_some(), "its time is the recording's");
                seen.push(state);
            }
        }
        for alarm in &stats.alarms {
            recorded_alarms += usize::from(alarm.origin.contains(&"recorded"));
            assert!(alarm.origin.contains(&"recorded"), "{alarm:?} looks live");
        }
        if seen.len() >= ROWS.len() && held > LAG * 2 {
            break;
        }
        std::thread::sleep(FRAME);
    }
    assert!(seen.len() >= ROWS.len(), "rows were missed: {seen:#?}");
    assert!(recorded_alarms > 0, "no alarm came");
    let travels =
        seen.iter().any(|state| state.ends_with("abnormal") && state.contains("travelling"));
    assert!(travels, "a switch travels too long by the recording's clock: {seen:#?}");
}

fn configure(scene: &mut Scene) {
    let quantity = json!({
        "name": "Oil", "role": "oil", "unit": "°C", "attention": 80.0, "alarm": 90.0,
    });
    let source = |address: serde_json::Value| json!({ "instance": "player", "address": address });
    let directories = scene.config["plugin_directories"].clone();
    scene.config = json!({
        "version": 1,
        "plugin_directories": directories,
        "plugins": {
            "player": { "plugin": "replay", "network": false, "settings": {
                "file": "${folder}/recording.csv", "speed": SPEED,
                "csv": { "time_format": "seconds" },
            }},
            "condition": { "plugin": "condition", "roles": ["oil"], "settings": {
                "equipment": ["=C1"], "quantities": [quantity],
            }},
            "switch_position": { "plugin": "switch_position", "roles": ["position"], "settings": {
                "switches": [{ "equipment": "=S1", "travel_seconds": TRAVEL_SECONDS }],
            }},
        },
        "models": { "breaker": { "file": "models/breaker.glb" } },
        "scene": [{ "id": "=C1", "model": "breaker" }, { "id": "=S1" }],
        "tags": {
            "Oil": { "type": "f64", "unit": "°C", "freshness_seconds": 600,
                     "source": source(json!({ "column": "oil", "quality": "quality" })) },
            "Position": { "type": "double_point", "freshness_seconds": 600,
                          "source": source(json!({ "column": "position" })) },
        },
        "bindings": [
            { "tag": "Oil", "node": "=C1", "role": "oil" },
            { "tag": "Position", "node": "=S1", "role": "position" },
        ],
        "overlays": ["condition", "switch_position"],
        "alarms": {
            "oil": { "verdict": { "instance": "condition", "equipment": "=C1" }, "message": "hot" },
            "switch": { "verdict": { "instance": "switch_position" }, "message": "switch" },
        },
        "graphics": { "samples": 1, "quality": "low" },
        "window": { "size": SIZE },
    });
}

/// Value and quality of both tags.
fn inputs_of(stats: &Stats) -> Inputs {
    let of = |id: &str| {
        let tag = stats.tags.iter().find(|tag| tag.id == id).expect("it is configured");
        (tag.value.to_string(), tag.quality)
    };
    vec![of("Oil"), of("Position")]
}

fn is_good((_, quality): &Input) -> bool {
    *quality == "good"
}

fn check_oil(input: &Input, verdict: &str) {
    let is_hot = input.0.contains("95") || input.0.contains("97");
    let expected = match (is_good(input), is_hot) {
        (false, _) => "unknown",
        (true, true) => "abnormal",
        (true, false) => "normal",
    };
    assert_eq!(verdict, expected, "at {input:?}");
}

/// Checks a position that has held for [`LAG`]: longer than the travel time in the recording.
fn check_position(input: &Input, verdict: &str) {
    // Both ends at once are no position, and surely a contradiction.
    let is_contradiction = input.0.contains("invalid");
    let expected = match is_good(input) {
        false if is_contradiction => "abnormal",
        false => "unknown",
        true if input.0.contains("open") || input.0.contains("closed") => "normal",
        true => "abnormal",
    };
    assert_eq!(verdict, expected, "at {input:?}");
}

fn verdict(stats: &Stats, overlay: &str) -> String {
    let found = stats.verdicts.iter().find(|of| of.overlay == overlay);
    found.map_or_else(|| "unknown".to_owned(), |of| of.verdict.to_owned())
}
