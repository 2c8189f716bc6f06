//! A scene in national coordinates: the picture, and what is picked, is that at the origin.

#[allow(dead_code, reason = "other tests use the rest")]
mod common;

use common::{id_of, merged_yard, pixel_of, scene_of};
use e2e::picture;
use e2e::{Scene, Stats, busbar, finish};
use glam::{DMat4, DVec3};
use image::RgbImage;
use serde_json::{Value, json};

const SIZE: [u32; 2] = [640, 240];
/// Greatest share of pixels that may differ at edges, where a hundredth of a pixel shows.
const MAX_EDGE_SHARE: f64 = 2e-3;
/// Difference of a channel up to which pixels are equal.
const SAME: u8 = 12;

/// Middles of far scenes, metres.
const FAR: [DVec3; 5] = [
    DVec3::new(900.0, 20.0, -400.0),
    DVec3::new(31_000.5, 0.25, 12_000.0),
    DVec3::new(2_600_000.0, 450.0, -1_200_000.0),
    DVec3::new(-3_512_345.678, 89.25, 5_401_234.5),
    DVec3::new(6_000_000.0, -120.0, 6_000_000.0),
];

/// Ways in which a model comes to stand far away.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// Placement in the configuration.
    Placement,
    /// Transform of a node in its file.
    Node,
    /// Transform of a node in its file, which the placement undoes.
    Undone,
}

/// The yard at a place, seen as it is at the origin.
fn scene_at(place: DVec3, way: Way, theta: &Value) -> Scene {
    let mut model = merged_yard();
    let translation = match way {
        Way::Placement => place,
        Way::Node => DVec3::ZERO,
        Way::Undone => -place,
    };
    if !matches!(way, Way::Placement) {
        model.nodes[0].parent_from_node = DMat4::from_translation(place);
    }
    let mut scene = scene_of(&model, SIZE);
    scene.config["scene"] = json!([{ "id": "yard", "model": "merged", "theta": theta,
        "transform": { "translation": translation.to_array() } }]);
    let seen = if matches!(way, Way::Undone) { DVec3::ZERO } else { place };
    let camera = &mut scene.config["cameras"]["front"];
    for point in ["eye", "target"] {
        for (axis, offset) in seen.to_array().into_iter().enumerate() {
            let coordinate = &mut camera[point][axis];
            *coordinate = json!(coordinate.as_f64().expect("it is a number") + offset);
        }
    }
    scene
}

/// Picture, id of the picked piece, and coordinates of the eye.
fn render(scene: &Scene) -> (RgbImage, String, [f64; 3]) {
    let [x, y] = pixel_of(3, SIZE);
    let mut command = busbar();
    command.env("BUSBAR_DEVICE", "llvmpipe");
    command.arg("render").arg(scene.write()).arg("--out").arg(scene.path("picture.png"));
    command.args(["--pick", &format!("{x},{y}")]);
    let output = finish(command.arg("--stats").arg(scene.path("stats.json"))).expect_code(0);
    let stats = Stats::read(&scene.path("stats.json"));
    let eye =
        [0, 1, 2].map(|axis| stats.0["camera"]["eye"][axis].as_f64().expect("it is a number"));
    (picture::load(&scene.path("picture.png")), output.stdout.trim().to_owned(), eye)
}

/// Share of pixels that differ.
fn edge_share(a: &RgbImage, b: &RgbImage) -> f64 {
    let differs = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| {
        a.0.iter().zip(&b.0).any(|(a, b)| a.abs_diff(*b) > SAME)
    };
    let count = a.pixels().zip(b.pixels()).filter(|pair| differs(*pair)).count();
    count as f64 / f64::from(a.width() * a.height())
}

#[test]
fn a_far_scene_is_drawn_as_at_the_origin() {
    // By groups of pieces too, where distant ones are drawn as one mesh.
    for theta in [json!(0), json!({ "max_error_px": 0.5 })] {
        let near = render(&scene_at(DVec3::ZERO, Way::Placement, &theta));
        assert_eq!(near.1, id_of(3));
        for place in FAR {
            for way in [Way::Placement, Way::Node, Way::Undone] {
                let far = render(&scene_at(place, way, &theta));
                let share = edge_share(&near.0, &far.0);
                assert!(share <= MAX_EDGE_SHARE, "{place} {way:?} {theta}: {share}");
                assert_eq!(far.1, near.1, "{place} {way:?}");
                let seen = if matches!(way, Way::Undone) { DVec3::ZERO } else { place };
                let apart = DVec3::from(far.2) - DVec3::from(near.2) - seen;
                assert!(apart.length() < 1e-2, "{place} {way:?}: {apart}");
            }
        }
    }
}
