//! Fault injection into every Vulkan call while a picture is rendered: the picture is the same to
//! the byte, or a clear message appears where there is no driver.
#![allow(clippy::print_stderr, reason = "progress of a long test")]

mod common;

use std::fs;

use common::{Subject, faults_of, is_final, sample};
use e2e::{Output, finish};
use serde_json::{Value, json};
use vulkan_faults::{VulkanFault, name_of};

const SIZE: [u32; 2] = [160, 120];
/// Position of a pixel that shows the model.
const PICKED: &str = "80,60";
/// Number of faults unless the environment asks for others.
const SAMPLE: usize = 48;
/// Number of sampled faults at high quality.
const HIGH_SAMPLE: usize = 24;
/// Number of faults where frames are drawn in two passes.
const PARTS_SAMPLE: usize = 24;
/// Number of faults on a simulated graphics card.
const CARD_SAMPLE: usize = 12;

/// Renders the scene and picks in it, with a fault if there is one.
fn render(subject: &Subject, fault: Option<&VulkanFault>) -> Output {
    let picture = subject.path("picture.png");
    let _ = fs::remove_file(&picture);
    let out = picture.to_string_lossy().into_owned();
    let mut command = subject.command("render", &["--out", &out, "--pick", PICKED]);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    match fault {
        Some(fault) => subject.strike(&mut command, fault),
        None => subject.count(&mut command),
    }
    finish(&mut command)
}

/// Describes the failure after a fault, if there is any.
fn fault_found(
    subject: &Subject,
    fault: &VulkanFault,
    expected: &(Vec<u8>, String),
) -> Option<String> {
    let output = render(subject, Some(fault));
    let said = format!("{}{}", output.stdout, output.stderr);
    if !subject.was_struck() {
        return Some(format!("the call was never made:\n{said}"));
    }
    if said.contains("panicked") || said.contains("validation:") {
        return Some(said);
    }
    if is_final(fault) {
        let is_clear = output.code == Some(1) && said.contains("install the package");
        return (!is_clear).then(|| format!("no clear message, exit {:?}:\n{said}", output.code));
    }
    if output.code != Some(0) {
        return Some(format!("exit {:?}:\n{said}", output.code));
    }
    let picture = fs::read(subject.path("picture.png")).unwrap_or_default();
    let is_same = (picture, output.stdout.clone()) == *expected;
    (!is_same).then(|| format!("another picture or pick:\n{said}"))
}

#[test]
fn every_failing_call_leaves_the_same_picture() {
    strike_all(&Subject::new(SIZE), SAMPLE);
}

#[test]
fn at_high_quality_too_with_an_outline_and_a_section() {
    let section = json!({ "normal": [1, 0, 0], "distance": 0.6 });
    let view = json!({ "window": { "size": SIZE }, "camera": { "section": section },
        "graphics": { "quality": "high", "ground": true } });
    strike_all(&Subject::with_view(view), HIGH_SAMPLE);
}

/// Faults strike between the two passes of occlusion culling: near equipment first, then the rest
/// that it does not hide.
#[test]
fn between_the_parts_of_a_frame_too() {
    let view = json!({ "window": { "size": SIZE }, "graphics": { "quality": "low" } });
    let subject = Subject::with_sheets(view, 60);
    let stats = subject.path("stats.json").to_string_lossy().into_owned();
    let out = subject.path("picture.png").to_string_lossy().into_owned();
    let words = ["--out", &out, "--pick", PICKED, "--stats", &stats];
    finish(&mut subject.command("render", &words)).expect_code(0);
    let stats: Value = serde_json::from_slice(&fs::read(&stats).unwrap()).unwrap();
    assert!(stats["hide_ms"].as_f64() > Some(0.0), "{}", stats["hide_ms"]);
    strike_all(&subject, PARTS_SAMPLE);
}

#[test]
fn as_on_a_card_too() {
    strike_all(&Subject { as_card: true, ..Subject::new(SIZE) }, CARD_SAMPLE);
}

/// Injects faults into calls of a run, `count` of them unless the environment asks for more.
fn strike_all(subject: &Subject, count: usize) {
    let output = render(subject, None).expect_code(0);
    assert!(output.stdout.contains("=Q1"), "{}", output.stdout);
    let picture = fs::read(subject.path("picture.png")).expect("it was rendered");
    let expected = (picture, output.stdout);
    let calls = subject.calls();
    let faults = faults_of(&calls);
    let chosen = sample(faults.clone(), count);
    eprintln!("{} calls, {} faults, {} of them now", calls.len(), faults.len(), chosen.len());
    assert!(calls.len() > 100, "{} calls", calls.len());
    let mut wrong = Vec::new();
    for fault in &chosen {
        if let Some(what) = fault_found(subject, fault, &expected) {
            let name = format!("{} call {}: {}", fault.command, fault.call, name_of(fault.code));
            eprintln!("WRONG {name}: {what}");
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{} of {} faults: {wrong:#?}", wrong.len(), chosen.len());
}

#[test]
fn a_device_that_is_not_there_is_named_with_those_that_are() {
    let subject = Subject::new(SIZE);
    let out = subject.path("picture.png").to_string_lossy().into_owned();
    for (device, code) in [("no such thing", 1), ("99", 1), ("0", 0), ("", 0)] {
        let mut command = subject.command("render", &["--out", &out]);
        command.env("BUSBAR_DEVICE", device);
        let output = finish(&mut command).expect_code(code);
        let lists = output.stderr.contains(&format!("\"{device}\", but there are: 0 \""));
        assert_eq!(lists, code != 0, "{}", output.stderr);
    }
}
