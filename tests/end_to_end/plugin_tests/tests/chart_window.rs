//! Chart in a window: a brush marks transformers in the scene, and a click on a transformer marks
//! its line.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{ChartAxisStats, RendererOptions, Viewer};
use e2e::display::{Display, LEFT_BUTTON};
use e2e::window::Window;
use e2e::{Scene, built, busbar, finish, picture, workspace_path};
use fleet::{Row, TRANSFORMERS, equipment, histories};
use image::RgbImage;
use serde_json::json;
use time::OffsetDateTime;

const SIZE: [u32; 2] = [1280, 720];
/// Concentration of H2 above table 2 of IEEE C57.104-2019, ppm.
const MUCH_H2: f32 = 200.0;
/// Width of a transformer's outline, pixels.
const OUTLINE: i32 = 3;
/// Blue of selected items in a chart.
const SELECTION: [u8; 3] = [30, 90, 170];

/// Returns a scene of the fleet alone, its chart above it.
fn scene(rows: &[Row]) -> Scene {
    let mut scene = Scene::without_tags();
    std::fs::write(scene.path("samples.csv"), fleet::csv(rows)).expect("it can be written");
    // In three rows of four, none before another, and none behind the chart or its panel.
    let nodes = (0..TRANSFORMERS).map(|transformer| {
        let [x, z] = [-24 + 15 * (transformer as i32 % 4), 62 + 16 * (transformer as i32 / 4)];
        let transform = json!({ "translation": [x, 0, z] });
        json!({ "id": equipment(transformer), "model": "transformer", "transform": transform })
    });
    let config = &mut scene.config;
    config["models"]["transformer"]["theta"] = json!(0.95);
    config["scene"] = nodes.collect();
    config["plugins"]["gases"] = json!({
        "plugin": "gas_analysis", "settings": { "fleet": { "file": "${folder}/samples.csv" } }
    });
    config["chart"] =
        json!({ "instance": "gases", "position": [-33, 13.5, 52], "size": [66, 17, 26] });
    config["cameras"] = json!({ "chart": { "eye": [14, 60, 132], "target": [14, 0, 58] } });
    config["camera"] = json!({ "start": "chart", "transition_seconds": 0 });
    config["graphics"] = json!({ "samples": 1, "quality": "low" });
    config["window"] = json!({ "size": SIZE });
    scene
}

/// Screen positions of axes and transformers.
struct ScreenPositions {
    axes: Vec<ChartAxisStats>,
    /// Pixels of each transformer.
    pixels: BTreeMap<String, Vec<[i32; 2]>>,
}

impl ScreenPositions {
    /// Measures the positions by a view of the same size without a window.
    fn measure(config: &Path) -> Self {
        let scene = LoadedScene::load(config, &|_, _, _| {}).expect("the scene loads");
        let options = RendererOptions { samples: 1, ..Default::default() };
        let mut viewer = Viewer::new_headless(scene, options, SIZE).expect("there is a device");
        viewer.set_panels_shown(true);
        for frame in 0..3 {
            let input = viewer.headless_input(f64::from(frame));
            viewer.frame(input).expect("a frame is drawn");
        }
        let axes = viewer.stats().chart.expect("there is a chart").axes;
        let all: Vec<[u32; 2]> = (0..SIZE[1])
            .step_by(2)
            .flat_map(|y| (0..SIZE[0]).step_by(2).map(move |x| [x, y]))
            .collect();
        let ids = viewer.pick_many(&all).expect("ids are drawn");
        let mut pixels: BTreeMap<String, Vec<[i32; 2]>> = BTreeMap::new();
        for (pixel, id) in all.iter().zip(ids) {
            let id = id.map(|id| id.split('/').next().unwrap_or_default().to_owned());
            if let Some(id) = id.filter(|id| id.ends_with("-TA1")) {
                pixels.entry(id).or_default().push(pixel.map(|at| at as i32));
            }
        }
        Self { axes, pixels }
    }

    /// Returns the screen position of a value on an axis.
    fn on_axis(&self, name: &str, value: f32) -> [i32; 2] {
        let axis = self.axes.iter().find(|axis| axis.name == name).expect("it is shown");
        let scale = |value: f32| if axis.log { value.ln() } else { value };
        let [low, high] = axis.ends.map(scale);
        let share = (scale(value) - low) / (high - low);
        [0, 1].map(|i| (axis.foot[i] + share * (axis.head[i] - axis.foot[i])).round() as i32)
    }
}

/// Opens a window in which the samples were read.
fn open(scene: Scene, display: Display) -> Window {
    let window = Window::open(scene, display, 30);
    // They are read beside the first frames.
    window.display.xdotool("sleep 4");
    window
}

fn rows() -> Vec<Row> {
    histories(3, OffsetDateTime::now_utc().date())
}

/// Returns the transformers whose last sample has so much H2, by the rows of the file alone.
fn with_much_h2(rows: &[Row]) -> BTreeSet<String> {
    let last = |transformer| {
        let own = rows.iter().filter(|row| row.transformer == transformer);
        own.max_by_key(|row| row.day).expect("it was sampled")
    };
    let is_much = |row: &Row| row.ppm[0].is_some_and(|ppm| ppm as f32 >= MUCH_H2);
    (0..TRANSFORMERS).filter(|&one| is_much(last(one))).map(equipment).collect()
}

/// Counts the differing pixels at and around these.
fn changes(before: &RgbImage, after: &RgbImage, pixels: &[[i32; 2]]) -> usize {
    let around = |[x, y]: [i32; 2]| {
        let reach = -OUTLINE..=OUTLINE;
        reach.clone().flat_map(move |dy| reach.clone().map(move |dx| [x + dx, y + dy]))
    };
    let near: BTreeSet<[i32; 2]> = pixels.iter().copied().flat_map(around).collect();
    let differs = |[x, y]: &[i32; 2]| {
        let pixel = |of: &RgbImage| of.get_pixel_checked(*x as u32, *y as u32).copied();
        pixel(before) != pixel(after)
    };
    near.iter().filter(|pixel| differs(pixel)).count()
}

#[test]
fn a_brush_on_an_axis_marks_exactly_the_right_transformers() {
    let Some(display) = Display::start(SIZE) else { return };
    let rows = rows();
    let scene = scene(&rows);
    let places = ScreenPositions::measure(&scene.write());
    let window = open(scene, display);
    // What is under the pointer has a name over the scene.
    window.display.xdotool("mousemove 640 700");
    let calm = window.screenshot("chart_calm");
    // From the value to the axis' upper end, and beyond it.
    let [x, head] = places.on_axis("H2", 1e5);
    let from = places.on_axis("H2", MUCH_H2);
    // A hand is over an axis before it presses.
    window.display.xdotool(&format!("mousemove {} {} sleep 1", from[0], from[1]));
    window.display.drag(LEFT_BUTTON, from, [x, head]);
    window.display.xdotool("sleep 1 mousemove 640 700");
    let brushed = window.screenshot("chart_brushed");
    let stats = window.close().0;
    let plain = with_much_h2(&rows);
    assert!((2..TRANSFORMERS - 1).contains(&plain.len()), "{plain:?}");
    let told: BTreeSet<String> =
        serde_json::from_value(stats["chart"]["brushed"].clone()).expect("ids");
    assert_eq!(told, plain, "as told");
    let marked: BTreeSet<String> = places
        .pixels
        .iter()
        .filter(|(_, pixels)| changes(&calm, &brushed, pixels) > pixels.len() / 4)
        .map(|(id, _)| id.clone())
        .collect();
    assert_eq!(marked, plain, "as seen");
}

#[test]
fn the_committed_configuration_of_the_fleet_is_whole() {
    let station = built(workspace_path("config/models/samples.csv"));
    assert!(station.with_file_name("station").is_dir());
    let check = finish(busbar().arg("check").arg(workspace_path("config/dga.json")));
    let output = check.expect_code(0);
    assert!(output.stdout.contains("no errors"), "{}", output.stdout);
}

#[test]
fn a_click_on_a_transformer_marks_its_line() {
    let Some(display) = Display::start(SIZE) else { return };
    let scene = scene(&rows());
    let places = ScreenPositions::measure(&scene.write());
    let window = open(scene, display);
    let calm = window.screenshot("chart_unpicked");
    // A normal one, whose line has the colour of the selection alone.
    let id = equipment(6);
    let pixels = &places.pixels[&id];
    let at = pixels[pixels.len() / 2];
    // A frame between each, however slow they are.
    window.display.xdotool(&format!("mousemove {} {} sleep 1", at[0], at[1]));
    window.display.click_button(LEFT_BUTTON, at);
    window.display.xdotool("sleep 1 mousemove 640 700");
    let picked = window.screenshot("chart_picked");
    let blue = |picture: &RgbImage| {
        let near = |(a, b): (&u8, &u8)| a.abs_diff(*b) < 40;
        picture.pixels().filter(|pixel| pixel.0.iter().zip(&SELECTION).all(near)).count()
    };
    let stats = window.close().0;
    assert!(stats["selected"][0].as_str().is_some_and(|picked| picked.starts_with(&id)), "{stats}");
    assert_eq!(stats["chart"]["explained"], json!(id));
    let [before, after] = [&calm, &picked].map(blue);
    assert!(before < 20 && after > 300, "{before} and {after} pixels of a selected line");
    assert!(picture::difference(&calm, &picked).is_some());
}
