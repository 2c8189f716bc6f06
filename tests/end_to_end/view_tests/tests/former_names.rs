//! Former names of settings: a file of release 0.1.0 draws the same, and can be rewritten.

use std::fs;

use e2e::{Scene, busbar, finish};
use serde_json::{Value, json};

/// The demo's configuration as of release 0.1.0.
const FORMER: &str = include_str!("data/former_demo.json");
/// Words that tell a setting with a former name.
const TOLD: &str = "is called";

/// Returns a scene with the former configuration of the demo, whose device is not there.
fn former() -> Scene {
    let mut scene = Scene::demo(1);
    scene.config = serde_json::from_str(FORMER).expect("it is JSON");
    scene.config["plugins"]["bay"]["settings"]["port"] = 1.into();
    scene
}

fn upgrade(scene: &Scene, more: &[&str]) -> String {
    let path = scene.path("scene.json");
    let output = finish(busbar().args(["config", "upgrade"]).arg(path).args(more));
    output.expect_code(0).stdout
}

#[test]
fn a_former_configuration_is_read_and_each_former_name_is_told() {
    let scene = former();
    let output = finish(busbar().arg("check").arg(scene.write())).expect_code(0);
    let said = output.stdout + &output.stderr;
    for names in [
        "'freshness_millis' is called 'freshness_seconds' now",
        "'poll_millis' is called 'poll_seconds' now",
        "'/view/camera' is called '/camera/start' now",
        "busbar config upgrade",
    ] {
        assert!(said.contains(names), "no {names} in: {said}");
    }
}

#[test]
fn a_former_configuration_draws_the_same_before_and_after_an_upgrade() {
    let draw = |scene: &Scene| {
        finish(&mut scene.rendering(0.0)).expect_code(0);
        fs::read(scene.path("picture.png")).expect("a picture was written")
    };
    let former = former();
    let mut present = Scene::demo(1);
    present.config["plugins"]["bay"]["settings"]["poll_seconds"] = 0.5.into();
    // The present file leaves the quality to the machine.
    present.config["graphics"] = json!({ "quality": "medium", "samples": 4 });
    let picture = draw(&present);
    assert!(draw(&former) == picture, "as written");

    let before = fs::read_to_string(former.path("scene.json")).expect("it is text");
    let said = upgrade(&former, &["--dry-run"]);
    assert!(said.contains("/plugins/bay/settings/poll_millis -> "), "{said}");
    assert!(said.contains("would be renamed"), "{said}");
    let after = fs::read_to_string(former.path("scene.json")).expect("it is text");
    assert_eq!(before, after, "a dry run writes nothing");

    upgrade(&former, &[]);
    let text = fs::read_to_string(former.path("scene.json")).expect("it is text");
    let upgraded: Value = serde_json::from_str(&text).expect("it is JSON");
    assert_eq!(upgraded, present.config, "the present names, and nothing else");
    let output = finish(busbar().arg("check").arg(former.path("scene.json"))).expect_code(0);
    assert!(!(output.stdout + &output.stderr).contains(TOLD));
    assert!(upgrade(&former, &[]).contains("all names are the present ones"));
}
