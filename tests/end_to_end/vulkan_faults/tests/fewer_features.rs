//! Rendering without optional device features: pictures are the same, as with other ways of
//! drawing.

mod common;

use std::fs;

use common::Subject;
use e2e::finish;
use serde_json::{Value, json};
use vulkan_faults::WITHOUT_VARIABLE;

/// Renders on a device without these features; returns the picture and `--stats`.
fn render(subject: &Subject, without: &str) -> (Vec<u8>, Value) {
    let [picture, stats] = ["picture.png", "stats.json"].map(|name| subject.path(name));
    let paths = [&picture, &stats].map(|path| path.to_string_lossy().into_owned());
    let words = ["--out", &paths[0], "--stats", &paths[1]];
    let mut command = subject.command("render", &words);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.env(WITHOUT_VARIABLE, without);
    let output = finish(&mut command).expect_code(0);
    assert!(!output.stderr.contains("validation:"), "{}", output.stderr);
    let stats = fs::read(stats).expect("it was written");
    let stats: Value = serde_json::from_slice(&stats).expect("it is JSON");
    assert_eq!(stats["validation_messages"], json!([]));
    (fs::read(picture).expect("it was rendered"), stats)
}

#[test]
fn without_indirect_draws_each_is_a_command_and_the_picture_the_same() {
    let subject = Subject::new([160, 120]);
    let (picture, stats) = render(&subject, "");
    let draws = &stats["draw_calls"];
    assert!(stats["draw_commands"].as_u64() < draws.as_u64(), "{stats}");
    for without in ["multiDrawIndirect", "drawIndirectFirstInstance"] {
        let (same, stats) = render(&subject, without);
        assert_eq!((&stats["draw_calls"], &stats["draw_commands"]), (draws, draws));
        assert!(same == picture, "without {without}");
    }
}

/// Draws everything on a simulated graphics card, hidden or not, without the two passes of
/// occlusion culling.
#[test]
fn as_on_a_card_the_picture_is_the_same() {
    for view in [
        json!({ "graphics": { "quality": "low" } }),
        json!({ "graphics": { "quality": "medium", "samples": 1 } }),
        json!({ "graphics": { "quality": "high", "ground": true, "fog": true } }),
    ] {
        let with_size = |mut view: Value| {
            view["window"] = json!({ "size": [320, 240] });
            view
        };
        let mut subject = Subject::with_sheets(with_size(view.clone()), 60);
        let (picture, of_processor) = render(&subject, "");
        subject.as_card = true;
        let (same, of_card) = render(&subject, "");
        assert!(same == picture, "{view}");
        let triangles = [&of_processor, &of_card].map(|stats| stats["triangles"].clone());
        assert_eq!(triangles[0], triangles[1]);
        let draws = [&of_processor, &of_card].map(|stats| stats["draw_calls"].as_u64());
        assert_ne!(draws[0], draws[1], "{view}: drawn in the same way");
    }
}
