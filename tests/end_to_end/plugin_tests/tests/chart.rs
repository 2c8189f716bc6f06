//! Chart of a fleet's gases in the scene: brushes and picks lead to transformers and back, and a
//! replay of faults frames each transformer with its verdict.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::{Duration, Instant};

use busbar_chart::{Action, AxisView, Brush, Layout, MAX_STROKED_RECORDS};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{ChartStats, RendererOptions, Stats, Viewer};
use dga::{Concentration, Gas, Sample, Zone, triangle_1};
use e2e::Scene;
use fleet::{
    Row, TRANSFORMERS, TransformerFault, equipment, histories, monitored, one_by_one, place,
};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use time::{Date, Month};

const SIZE: [u32; 2] = [480, 270];
/// Number of seeded samples, each with a fault.
const FAULTS: usize = 117;
const H2_AXIS: usize = 0;
/// Longest time until many samples are read and judged, on a busy machine.
const MAX_READING: Duration = Duration::from_secs(90);
/// Concentration of H2 above table 2 of IEEE C57.104-2019, ppm.
const MUCH_H2: f32 = 200.0;

fn day() -> Date {
    Date::from_calendar_date(2026, Month::June, 30).expect("a day")
}

fn nanos(day: Date) -> i64 {
    let since = day - Date::from_calendar_date(1970, Month::January, 1).expect("a day");
    since.whole_seconds() * 1_000_000_000
}

/// Returns a scene of the fleet alone, each transformer as a breaker of the demo.
fn scene(rows: &[Row], follow: bool) -> Scene {
    let mut scene = Scene::without_tags();
    std::fs::write(scene.path("samples.csv"), fleet::csv(rows)).expect("it can be written");
    let file = scene.path("samples.csv");
    let nodes = (0..TRANSFORMERS).map(|transformer| {
        let [x, z] = place(transformer);
        let transform = json!({ "translation": [x, 0.0, z] });
        json!({ "id": equipment(transformer), "model": "transformer", "transform": transform })
    });
    let config = &mut scene.config;
    config["models"]["transformer"]["theta"] = json!(0.9);
    config["scene"] = nodes.collect();
    config["plugins"]["gases"] = json!({
        "plugin": "gas_analysis", "settings": { "fleet": { "file": file } }
    });
    config["chart"] = json!({
        "instance": "gases", "position": [-33, 12.5, 52], "size": [66, 17, 26], "follow": follow
    });
    config["cameras"] = json!({ "chart": { "eye": [0, 15, 122], "target": [0, 14, 52] } });
    config["camera"] = json!({ "start": "chart" });
    config["graphics"] = json!({ "samples": 1, "quality": "low" });
    config["window"] = json!({ "size": SIZE });
    scene
}

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    fn open(config: &Path) -> Self {
        let scene = LoadedScene::load(config, &|_, _, _| {}).expect("the scene loads");
        let options = RendererOptions { samples: 1, validation: true, ..Default::default() };
        let viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        let mut view = Self { viewer, seconds: 0.0 };
        view.frame();
        view
    }

    fn frame(&mut self) {
        self.seconds += 0.1;
        let input = self.viewer.headless_input(self.seconds);
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn act(&mut self, action: Action) {
        self.viewer.apply_chart_command(&busbar_viewer::ChartCommand::Apply(action));
        self.frame();
    }

    fn stats(&self) -> Stats {
        self.viewer.stats()
    }

    fn chart(&self) -> ChartStats {
        self.stats().chart.expect("there is a chart")
    }
}

fn last_of(rows: &[Row], transformer: usize) -> &Row {
    rows.iter().filter(|row| row.transformer == transformer).max_by_key(|row| row.day).expect("one")
}

#[test]
fn a_brush_means_the_transformers_that_a_plain_filter_means() {
    let rows = histories(3, day());
    let mut view = View::open(&scene(&rows, false).write());
    view.act(Action::SetPlayhead(Some(nanos(day()))));
    assert_eq!(view.chart().records, rows.len());
    assert!(view.chart().brushed.is_empty());
    let is_much = |row: &Row| row.ppm[0].is_some_and(|ppm| ppm.round() as f32 >= MUCH_H2);
    let brush =
        Brush::Ranges { axis: H2_AXIS, ranges: vec![[MUCH_H2, f32::MAX]], with_missing: false };
    view.act(Action::AddBrush { brush, alone: true });
    let chart = view.chart();
    let plain: BTreeSet<String> = (0..TRANSFORMERS)
        .filter(|&transformer| is_much(last_of(&rows, transformer)))
        .map(equipment)
        .collect();
    assert!((2..TRANSFORMERS).contains(&plain.len()), "{plain:?}");
    assert_eq!(chart.brushed.iter().cloned().collect::<BTreeSet<_>>(), plain);
    assert_eq!(chart.meant, rows.iter().filter(|row| is_much(row)).count());
    // What is brushed has an outline, and the rest has none: the picture differs there alone.
    let brushed = view.viewer.read_picture().expect("a picture");
    view.act(Action::ClearBrushes);
    assert_ne!(brushed, view.viewer.read_picture().expect("a picture"));
    for layout in [Layout::Focus, Layout::Time] {
        view.act(Action::SetLayout(layout));
        assert!(view.stats().validation_messages.is_empty(), "{layout:?}");
    }
}

/// Returns H2 and CH4 as rounded in the file, ppm.
fn two_gases(row: &Row) -> [f32; 2] {
    [0, 1].map(|gas| {
        let ppm = row.ppm[gas].expect("it was measured");
        format!("{ppm:.1}").parse().expect("a number")
    })
}

#[test]
fn what_changed_while_the_plugin_was_dead_shows_once_it_is_back() {
    let rows = histories(3, day());
    let scene = scene(&rows, false);
    let mut view = View::open(&scene.write());
    let mut until = |what: &str, is_so: &dyn Fn(&Stats) -> bool| {
        let begun = Instant::now();
        loop {
            view.frame();
            let stats = view.stats();
            if is_so(&stats) {
                return stats;
            }
            assert!(begun.elapsed() < MAX_READING, "no {what}: {:?}", stats.chart);
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    let has = |stats: &Stats, count: usize| {
        stats.chart.as_ref().is_some_and(|chart| chart.records == count)
    };
    let stats = until("records", &|stats| has(stats, rows.len()));
    let pid = stats.plugins.iter().find(|plugin| plugin.name == "gases").and_then(|one| one.pid);
    // What it counts begins anew with it, and may come to the same number.
    let fewer = &rows[..rows.len() - 1];
    kill_process(Pid::from_raw(pid.expect("a process") as i32).expect("one"), Signal::KILL)
        .expect("it runs");
    std::fs::write(scene.path("samples.csv"), fleet::csv(fewer)).expect("it can be written");
    until("other records", &|stats| has(stats, fewer.len()));
}

#[test]
fn a_dense_chart_counts_on_the_device_what_a_plain_filter_counts() {
    let rows = monitored(5, 2500, day());
    let mut view = View::open(&scene(&rows, false).write());
    let begun = Instant::now();
    while view.chart().records == 0 {
        assert!(begun.elapsed() < MAX_READING, "{:?}", view.chart().fault);
        view.frame();
    }
    assert!(rows.len() > MAX_STROKED_RECORDS && view.chart().records == rows.len());
    let unbrushed = view.viewer.read_picture().expect("a picture");
    let brush =
        Brush::Ranges { axis: H2_AXIS, ranges: vec![[MUCH_H2, f32::MAX]], with_missing: false };
    view.act(Action::AddBrush { brush, alone: true });
    let is_much = |row: &&Row| two_gases(row)[0] >= MUCH_H2;
    let much = rows.iter().filter(is_much).count();
    assert!((100..rows.len() / 2).contains(&much), "{much}");
    assert_eq!((view.chart().meant, view.chart().is_counting), (much, false));
    let plain: BTreeSet<String> = (0..TRANSFORMERS)
        .filter(|&transformer| is_much(&last_of(&rows, transformer)))
        .map(equipment)
        .collect();
    assert_eq!(view.chart().brushed.iter().cloned().collect::<BTreeSet<_>>(), plain);
    assert_ne!(view.viewer.read_picture().expect("a picture"), unbrushed);
    // And by the angle of lines, at an instant before the last samples.
    view.act(Action::AddBrush {
        brush: Brush::Rise { axes: [0, 1], range: [-0.15, 1.0] },
        alone: true,
    });
    let instant = rows[2300].day;
    view.act(Action::SetPlayhead(Some(nanos(instant))));
    let scale =
        AxisView { axis: 0, is_hidden: false, is_flipped: false, log: true, low: 0.1, high: 1e5 };
    let rises = |row: &&Row| {
        let [h2, ch4] = two_gases(row).map(|ppm| scale.position(ppm).expect("a place"));
        (-0.15..=1.0).contains(&(ch4 - h2))
    };
    let known = |row: &&Row| row.day < instant || (row.day == instant && row.second == 0);
    let both = rows.iter().filter(known).filter(is_much).filter(rises).count();
    assert!(both > 0 && both < much, "{both} of {much}");
    assert_eq!(view.chart().meant, both);
    for layout in [Layout::Focus, Layout::Time] {
        view.act(Action::SetLayout(layout));
        assert_eq!(view.chart().meant, both, "{layout:?}");
    }
    assert_eq!(view.stats().validation_messages, [""; 0]);
}

#[test]
fn old_samples_do_not_speak_for_their_transformer() {
    let rows = histories(3, day());
    let mut view = View::open(&scene(&rows, false).write());
    view.act(Action::SetPlayhead(Some(nanos(day()))));
    let states = view.chart().states;
    assert_eq!(states.len(), TRANSFORMERS);
    // The last one was not sampled for three half years.
    let unknown: Vec<_> = states.iter().filter(|(_, state)| state.is_none()).collect();
    assert_eq!(unknown.len(), 1);
    assert_eq!(*unknown[0].0, equipment(TRANSFORMERS - 1));
}

#[test]
fn each_of_117_faults_frames_its_transformer_with_verdict_and_evidence() {
    let faults = one_by_one(7, FAULTS, day());
    let rows: Vec<Row> = faults.iter().map(|(_, row)| row.clone()).collect();
    let mut view = View::open(&scene(&rows, true).write());
    view.act(Action::SetPlayhead(Some(nanos(rows[0].day) - 1)));
    assert!(view.chart().states.is_empty(), "nothing is known yet");
    let mut seen = BTreeSet::new();
    for (number, (fault, row)) in faults.iter().enumerate() {
        view.act(Action::SetPlayhead(Some(nanos(row.day))));
        let (stats, chart) = (view.stats(), view.chart());
        let id = equipment(row.transformer);
        let place = format!("sample {number}, {fault:?} on {id}");
        assert_eq!(stats.selected, [id.as_str()], "{place}");
        assert_eq!(chart.explained.as_deref(), Some(id.as_str()), "{place}");
        let verdict = chart.verdict.expect("a verdict");
        let named = words(*fault).iter().any(|words| verdict.contains(words));
        assert!(named, "{place}: {verdict}");
        let zone = zone_of(row);
        seen.insert(zone);
        let triangle = chart.evidence.iter().find(|one| one.method == "Duval triangle 1");
        let triangle = triangle.expect("triangle 1 is among the evidence");
        assert_eq!(triangle.result, zone.name(), "{place}");
        assert!(chart.evidence.len() >= 7 && triangle.agrees == Some(true), "{place}");
        assert!(is_framed(&stats, row.transformer), "{place}: {:?}", stats.camera);
        assert!(chart.states[&id].as_ref().is_some_and(|state| state.contains("status 3")));
    }
    let named: Vec<&str> = seen.iter().map(|zone| zone.name()).collect();
    assert_eq!(seen.len(), TransformerFault::ALL.len(), "every class was among them: {named:?}");
}

/// Returns the phrases of which a verdict on the fault must contain one.
fn words(fault: TransformerFault) -> &'static [&'static str] {
    match fault {
        TransformerFault::None => &["typical"],
        TransformerFault::Pd => &["partial discharges"],
        TransformerFault::D1 | TransformerFault::D2 => &["discharges of"],
        // Only triangle 1 knows both at once.
        TransformerFault::Dt => &["discharges", "overheating"],
        TransformerFault::T1 | TransformerFault::T2 | TransformerFault::T3 => &["overheating"],
    }
}

/// Returns the zone by the method itself, from the values in the file.
fn zone_of(row: &Row) -> Zone {
    let five = [Gas::H2, Gas::Ch4, Gas::C2h6, Gas::C2h4, Gas::C2h2];
    let sample = five.into_iter().zip(row.ppm).fold(Sample::new(), |sample, (gas, ppm)| {
        let ppm = format!("{:.1}", ppm.expect("it was measured")).parse().expect("a number");
        sample.with(gas, Concentration::measured(ppm).expect("a concentration"))
    });
    triangle_1::zone(&sample)
}

/// Reports whether a transformer's middle is well within the camera's view.
fn is_framed(stats: &Stats, transformer: usize) -> bool {
    let [x, z] = place(transformer).map(|metres| metres as f32);
    let eye = stats.camera.eye.map(|metres| metres as f32);
    let direction = stats.camera.direction;
    let to = [x - eye[0], 3.0 - eye[1], z - eye[2]];
    let length = to.iter().map(|part| part * part).sum::<f32>().sqrt();
    let ahead: f32 = to.iter().zip(direction).map(|(a, b)| a * b).sum();
    ahead / length > 0.95 && length < 60.0
}
