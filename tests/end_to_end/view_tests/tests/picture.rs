//! Pictures without a display: silent under validation, repeatable, and equal to the golden ones.

use busbar_geometry::CollapseStacks;
use busbar_scene_loader::{LoadedModel, LoadedScene};
use e2e::picture::{self, assert_golden};
use e2e::{Output, Scene, Stats, busbar, finish};
use serde_json::json;

/// Renders and checks the success; writes `picture.png` and `stats.json`.
#[track_caller]
fn render(scene: &Scene, more: &[&str]) -> (Output, Stats) {
    let mut command = busbar();
    // Golden pictures are the software rasteriser's, also where there is a GPU.
    command.env("BUSBAR_DEVICE", "llvmpipe");
    command.arg("render").arg(scene.write()).arg("--out").arg(scene.path("picture.png"));
    command.arg("--stats").arg(scene.path("stats.json")).args(more);
    let output = finish(&mut command).expect_code(0);
    (output, Stats::read(&scene.path("stats.json")))
}

#[test]
fn validation_is_silent() {
    // With labels, so that all passes run.
    let scene = Scene::demo(1);
    let cases: [&[&str]; 6] = [
        &[],
        &["--theta", "0.7"],
        &["--wireframe"],
        &["--size", "320x180"],
        &["--size", "333x77", "--camera", "transformer"],
        &["--pick", "640,360"],
    ];
    for case in cases {
        let (output, stats) = render(&scene, &[case, &["--validation"]].concat());
        assert_eq!(stats.0["validation_messages"], serde_json::json!([]), "{case:?}");
        assert!(!output.stderr.contains("validation"), "{case:?}: {}", output.stderr);
        let size = match case {
            ["--size", size, ..] => size,
            _ => "1280x720",
        };
        let picture = picture::load(&scene.path("picture.png"));
        assert_eq!(format!("{}x{}", picture.width(), picture.height()), size);
    }
}

#[test]
fn a_pick_names_the_equipment() {
    let scene = Scene::without_tags();
    let at = |pixel: &str| {
        let size = ["--size", "640x360", "--camera", "transformer"];
        let (output, stats) = render(&scene, &[&size, ["--pick", pixel].as_slice()].concat());
        (output.stdout.trim().to_owned(), stats.0["picked"].clone())
    };
    let (said, picked) = at("320,200");
    assert!(said.starts_with("=S12D1T1-TA1/"), "{said}");
    assert_eq!(picked, said.as_str());
    assert_eq!(at("2,2"), ("nothing".to_owned(), serde_json::Value::Null));
}

#[test]
fn theta_takes_triangles_away() {
    let scene = Scene::without_tags();
    let counts = ["0", "0.3", "0.7", "1"].map(|theta| {
        let (_, stats) = render(&scene, &["--size", "160x90", "--theta", theta]);
        assert_eq!(stats.0["theta"]["breaker"].as_f64(), theta.parse().ok());
        [stats.count("vertices"), stats.count("triangles"), stats.count("triangles_full")]
    });
    let [vertices, triangles, full] = counts[0];
    assert_eq!(triangles, full);
    for pair in counts.windows(2) {
        assert!(pair[1][0] < pair[0][0] && pair[1][1] < pair[0][1], "{counts:?}");
        assert_eq!(pair[1][2], full, "{counts:?}");
    }
    // Theta is a share of each model's vertices, whatever meshes the model shows several times.
    let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
    let surviving = |stacks: &CollapseStacks, theta| {
        u64::from(stacks.surviving(stacks.cursor_for_theta(theta)))
    };
    let optimized = |model: &&LoadedModel| model.stacks.iter().any(|one| one.collapse_count() > 0);
    for model in loaded.models.iter().filter(optimized) {
        let sum = |theta| model.stacks.iter().map(|stacks| surviving(stacks, theta)).sum::<u64>();
        let left = sum(0.3) as f64 / sum(0.0) as f64;
        assert!((left - 0.7).abs() < 0.01, "theta 0.3 leaves {left} of {}", model.name);
    }
    let drawn = loaded.graph.instances().map(|instance| {
        let model = &loaded.models[instance.model.0 as usize];
        surviving(&model.stacks[instance.mesh as usize], 0.3)
    });
    assert_eq!(drawn.sum::<u64>(), counts[1][0], "theta 0.3 leaves others of {vertices}");
}

#[test]
fn one_scene_gives_one_picture() {
    let scene = Scene::without_tags();
    let picture = || {
        render(&scene, &["--size", "640x360"]);
        picture::load(&scene.path("picture.png"))
    };
    assert_eq!(picture::difference(&picture(), &picture()), None);
}

#[test]
fn pictures_are_the_golden_ones() {
    let scene = Scene::without_tags();
    let cases: [(&str, &[&str]); 3] =
        [("bay", &[]), ("bay_theta70", &["--theta", "0.7"]), ("bay_wireframe", &["--wireframe"])];
    for (name, more) in cases {
        render(&scene, &[&["--size", "640x360"], more].concat());
        assert_golden(name, &scene.path("picture.png"));
    }
}

#[test]
fn pictures_at_high_quality_are_the_golden_ones() {
    let mut scene = Scene::without_tags();
    let graphics = &mut scene.config["graphics"];
    graphics["quality"] = "high".into();
    graphics["ground"] = true.into();
    render(&scene, &["--size", "640x360", "--validation"]);
    assert_golden("bay_high", &scene.path("picture.png"));
    scene.config["camera"]["section"] = json!({ "normal": [0, 0, 1], "distance": 0 });
    let cut = ["--camera", "transformer", "--pick", "336,110"];
    let (_, stats) = render(&scene, &[&["--size", "640x360", "--validation"], &cut[..]].concat());
    assert_eq!(stats.0["validation_messages"], json!([]));
    for stage in ["shadows", "scene", "occlusion", "outline"] {
        assert!(stats.0["gpu_ms"][stage].is_f64(), "{stage}: {}", stats.0["gpu_ms"]);
    }
    assert_golden("bay_section", &scene.path("picture.png"));
}
