//! Equipment ids within one mesh: from the file through the optimiser to
//! picking, selection and tints, at every theta.

mod common;

use std::collections::BTreeSet;
use std::fs;

use busbar_gltf_export::write_glb;
use busbar_gltf_import::{ImportLimits, import_bytes, import_file};
use busbar_scene::Model;
use common::{
    PIECES, assert_every_theta_keeps_features, ground_box, id_of, merged_yard, name_of, pixel_of,
    pixel_of_ground, scene_of, show_at, viewer_of,
};
use e2e::peer::Peer;
use e2e::{Scene, Stats, busbar, finish, picture};
use image::RgbImage;
use serde_json::{Value, json};

const SIZE: [u32; 2] = [480, 270];

/// Asserts that each triangle of the yard belongs to the piece at its place.
fn assert_triangles_lie_in_their_pieces(model: &Model) {
    let [mesh] = model.meshes.as_slice() else { panic!("not one mesh") };
    for &triangle in &mesh.triangles {
        let corners = mesh.corner_positions(triangle).map(|p| mesh.positions[p as usize]);
        let name = mesh.feature(triangle).map(|f| model.features[0][f as usize].as_str());
        let Some(name) = name else {
            assert!(corners.iter().all(|c| c.y <= ground_box().1.y), "{corners:?} is no ground");
            continue;
        };
        let piece = (0..PIECES).find(|&piece| name_of(piece) == name).expect("a known piece");
        let (left, right) = (piece as f32, piece as f32 + 1.0);
        assert!(corners.iter().all(|c| (left..=right).contains(&c.x)), "{name}: {corners:?}");
    }
}

#[test]
fn every_triangle_keeps_its_feature_at_every_theta() {
    let file = write_glb(&merged_yard()).expect("it can be written");
    let model = import_bytes(&file, None, &ImportLimits::default()).expect("it is valid").model;
    assert_eq!(model.features[0].len(), PIECES);
    assert_triangles_lie_in_their_pieces(&model);
    // Walls that two pieces share are there twice.
    let alone = merged_yard().meshes[0].positions.len();
    assert_eq!(model.meshes[0].positions.len(), alone);
    assert_every_theta_keeps_features(&model, 64);
}

#[test]
fn an_optimised_file_keeps_its_features() {
    let scene = scene_of(&merged_yard(), SIZE);
    for theta in ["0", "0.7", "0.95"] {
        let mut command = busbar();
        command.arg("optimize").arg(scene.path("model.glb")).args(["--theta", theta]);
        command.args(["--plugin", "quadric_collapse"]);
        command.arg("--plugin-directory");
        command.arg(scene.path("plugins")).arg("--out").arg(scene.path("out.glb"));
        finish(&mut command).expect_code(0);
        let limits = ImportLimits::default();
        let model = import_file(&scene.path("out.glb"), &limits).expect("it is valid").model;
        let names: BTreeSet<_> = model.features[0].iter().cloned().collect();
        assert_eq!(names, (0..PIECES).map(name_of).collect(), "at theta {theta}");
        assert_triangles_lie_in_their_pieces(&model);
    }
}

/// Renders the scene; returns the picture and the output.
fn render(scene: &Scene, more: &[&str]) -> (RgbImage, String, Stats) {
    let (out, stats) = (scene.path("picture.png"), scene.path("stats.json"));
    let mut command = busbar();
    command.arg("render").arg(scene.write()).arg("--out").arg(&out).arg("--stats").arg(&stats);
    let output = finish(command.arg("--validation").args(more)).expect_code(0);
    let stats = Stats::read(&stats);
    assert_eq!(stats.0["validation_messages"], json!([]));
    (picture::load(&out), output.stdout.trim().to_owned(), stats)
}

#[test]
fn a_pick_names_the_piece_at_every_theta() {
    let scene = scene_of(&merged_yard(), SIZE);
    let pixels: Vec<_> = (0..PIECES).map(|piece| pixel_of(piece, SIZE)).collect();
    let mut viewer = viewer_of(&scene, SIZE);
    let full = show_at(&mut viewer, 0.0);
    for (theta, share) in [(0.0, 1.0), (0.7, 0.35), (0.9, 0.15), (0.3, 0.75)] {
        let triangles = show_at(&mut viewer, theta);
        assert!(triangles as f64 <= full as f64 * share, "{triangles} of {full} at {theta}");
        let picked = viewer.pick_many(&pixels).expect("they are in the picture");
        let expected: Vec<_> = (0..PIECES).map(|piece| Some(id_of(piece))).collect();
        assert_eq!(picked, expected, "at theta {theta}");
        let [x, y] = pixels[5];
        assert_eq!(viewer.pick([x, y]).expect("it is in the picture"), Some(id_of(5)));
        let theta = theta.to_string();
        let pixel = format!("{x},{y}");
        let (_, said, stats) = render(&scene, &["--pick", &pixel, "--theta", &theta]);
        assert_eq!((said, &stats.0["picked"]), (id_of(5), &json!(id_of(5))));
    }
    let ground = viewer.pick_many(&[pixel_of_ground(SIZE)]);
    assert_eq!(ground.expect("it is in the picture"), [Some("yard/body".to_owned())]);
    assert!(viewer.pick_many(&[[SIZE[0], 0]]).is_err(), "outside the picture");
    assert!(viewer.stats().validation_messages.is_empty());
}

/// Reach of an outline with its smoothing beyond the equipment, pixels.
const OUTLINE_REACH: u32 = 5;

/// Returns a function that reports whether a pixel shows the equipment, and whether one within an
/// outline's reach does.
fn mask_of(scene: &Scene, id: &str) -> impl Fn(u32, u32) -> [bool; 2] + use<> {
    let pixels: Vec<_> = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect();
    let picked = viewer_of(scene, SIZE).pick_many(&pixels).expect("they are in the picture");
    let shows: Vec<bool> = picked.iter().map(|p| p.as_deref() == Some(id)).collect();
    let at = move |x: u32, y: u32| x < SIZE[0] && y < SIZE[1] && shows[(y * SIZE[0] + x) as usize];
    move |x, y| {
        let from = |middle: u32| middle.saturating_sub(OUTLINE_REACH)..=middle + OUTLINE_REACH;
        let near = from(y).any(|y| from(x).any(|x| at(x, y)));
        [at(x, y), near]
    }
}

#[test]
fn selection_colours_the_piece_alone() {
    let scene = scene_of(&merged_yard(), SIZE);
    let [x, y] = pixel_of(3, SIZE);
    let (plain, ..) = render(&scene, &[]);
    let (selected, ..) = render(&scene, &["--pick", &format!("{x},{y}")]);
    let mask = mask_of(&scene, &id_of(3));
    let mut coloured = 0;
    for (x, y, before) in plain.enumerate_pixels() {
        let [inside, near] = mask(x, y);
        let changed = before != selected.get_pixel(x, y);
        assert!(near || !changed, "{x}, {y} is not of the piece, but has another colour");
        assert!(!inside || changed, "{x}, {y} is of the piece, but has its colour still");
        coloured += usize::from(changed);
    }
    assert!(coloured > 500, "{coloured} pixels");
}

#[test]
fn an_alarm_on_a_piece_colours_it_alone() {
    // Buchholz has come.
    let values = json!({"holding": {"0": vec![0; 20], "100": vec![0; 7]}, "discrete": {"0": [0, 0, 0, 0, 1,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]}});
    let Some(peer) = Peer::start(&values) else { return };
    let mut scene = scene_of(&merged_yard(), SIZE);
    let demo = Scene::demo(peer.port).config;
    let tag = "T1.Buchholz";
    for key in ["plugins", "overlays"] {
        scene.config[key] = demo[key].clone();
    }
    scene.config["tags"] = json!({ tag: demo["tags"][tag] });
    scene.config["bindings"] = json!([{ "tag": tag, "node": id_of(6), "role": "alarm" }]);
    let (shown, _, stats) = render(&scene, &["--seconds", "2"]);
    assert_eq!(stats.tag(tag).value, Value::Bool(true));
    // Alarms are crossed: between the marks little of the tint is seen.
    let is_red = |piece| {
        let [x, y] = pixel_of(piece, SIZE);
        let mut around = (x - 4..=x + 4).flat_map(|x| (y - 4..=y + 4).map(move |y| (x, y)));
        around.any(|(x, y)| {
            let [r, g, b] = shown.get_pixel(x, y).0.map(u32::from);
            2 * r > 3 * g && 2 * r > 3 * b
        })
    };
    let red: Vec<_> = (0..PIECES).filter(|&piece| is_red(piece)).collect();
    assert_eq!(red, [6]);
}

/// Draws deterministic pixels (Steele, Lea, Flood, "SplitMix", OOPSLA 2014).
fn random_pixels(count: u64, size: [u32; 2]) -> Vec<[u32; 2]> {
    let word = |i: u64| {
        let mut z = i.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    let below = |word: u64, limit: u32| (((word >> 32) * u64::from(limit)) >> 32) as u32;
    (1..=count).map(|i| [below(word(2 * i), size[0]), below(word(2 * i + 1), size[1])]).collect()
}

#[test]
#[ignore = "a million triangles: some minutes"]
#[allow(clippy::print_stdout)]
fn the_papers_substation_keeps_every_id_at_every_theta() {
    let station = substation::Station::generate(1).expect("it closes");
    let flat = station.flatten().expect("its shells are apart");
    let file = write_glb(&flat.model).expect("it can be written");
    let model = import_bytes(&file, None, &ImportLimits::default()).expect("it is valid").model;
    let (mesh, names) = (&model.meshes[0], &model.features[0]);
    for run in &flat.runs {
        for &triangle in &mesh.triangles[run.first_triangle..][..run.triangle_count] {
            let feature = mesh.feature(triangle).expect("each triangle has a feature");
            assert_eq!(names[feature as usize], run.equipment);
        }
    }
    assert_every_theta_keeps_features(&model, 16);

    let size = [1280, 720];
    let mut scene = scene_of(&Model::default(), size);
    fs::write(scene.path("model.glb"), &file).expect("the folder can be written");
    scene.config["cameras"] = station.configuration()["cameras"].clone();
    scene.config["camera"]["start"] = json!("overview");
    let known: BTreeSet<_> = names.iter().map(|name| format!("yard/{name}")).collect();
    let pixels = random_pixels(10_000, size);
    for plugin in ["weighted_collapse", "quadric_collapse"] {
        scene.config["plugins"]["optimizer"] = json!({ "plugin": plugin });
        let mut viewer = viewer_of(&scene, size);
        let mut picked_at = |theta| {
            show_at(&mut viewer, theta);
            viewer.pick_many(&pixels).expect("they are in the picture")
        };
        let before = picked_at(0.0);
        for theta in [0.7, 0.85] {
            let after = picked_at(theta);
            let picked = || before.iter().chain(&after).flatten();
            assert!(picked().all(|id| known.contains(id)));
            assert!(picked().collect::<BTreeSet<_>>().len() > 100, "few pieces are seen");
            let changed = before.iter().zip(&after).filter(|(a, b)| a != b).count();
            let count = pixels.len();
            println!("{plugin}: {changed} of {count} picks differ from theta 0 at {theta}");
        }
        assert_eq!(picked_at(0.0), before, "nothing is lost");
    }
}
