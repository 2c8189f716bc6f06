use egui::{RawInput, pos2};

use super::*;
use crate::test_lists::{EmptyList, texts};
use crate::{Appearance, ListModels, Panels, SceneOverlay, StatusBarModel};

/// Widths of windows, points; the first is the smallest that is promised.
const WIDTHS: [f32; 6] = [320.0, 480.0, 640.0, 800.0, 1280.0, 3840.0];
const DEVICE: &str = "llvmpipe (LLVM 20.1.2, 256 bits)";
const SELECTED: &str = "=S12D1T1-TA1/tank/cover/relay of the station at the river";

/// Returns the places of the parts of the line at a width, by their first words.
fn places(width: f32, selected: &str, words: &[&str]) -> Vec<Option<Rect>> {
    let mut panels = Panels::new(true, Appearance { is_dark: false, scale: 1.0, font: None });
    let status = StatusBarModel {
        clock: Some("17:04:05 UTC".into()),
        triangles: 1_234_567,
        triangles_full: 12_345_678,
        device: DEVICE.into(),
        good: 1998,
        uncertain: 120,
        bad: 314,
        ..StatusBarModel::default()
    };
    let model = ViewModel { status, selected: Some(selected.into()), ..ViewModel::default() };
    let lists = ListModels { tags: &EmptyList, alarms: &EmptyList, equipment: &EmptyList };
    let screen = Rect::from_min_size(pos2(0.0, 0.0), vec2(width, 600.0));
    let mut pass = || {
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        let mut output = panels.run(input, &model, &lists, |_, _| SceneOverlay::default());
        output.egui.textures_delta.clear();
        output
    };
    pass();
    let output = pass();
    let place = |word: &&str| {
        let mut places = Vec::new();
        output.egui.shapes.iter().for_each(|clipped| texts(&clipped.shape, word, &mut places));
        // The line is the lowest.
        places.into_iter().max_by(|a, b| a.top().total_cmp(&b.top())).filter(|p| p.top() > 560.0)
    };
    words.iter().map(place).collect()
}

#[test]
fn a_narrow_window_keeps_clock_and_qualities_whole() {
    let words = ["17:04:05", "=S12D1T1", "1\u{2009}234\u{2009}567", "tags: 1998", "llvmpipe"];
    for width in WIDTHS {
        for selected in [SELECTED, "=S12D1T1"] {
            let mut found = places(width, selected, &words);
            // In the smallest window the counts stand alone.
            found[3] = found[3].or(places(width, selected, &["1998 good"])[0]);
            assert!(found[0].is_some() && found[3].is_some(), "at {width}: {found:?}");
            let mut line: Vec<Rect> = found.iter().flatten().copied().collect();
            line.sort_by(|a, b| a.left().total_cmp(&b.left()));
            let is_apart = line.is_sorted_by(|a, b| a.right() <= b.left());
            let is_within = line.iter().all(|place| place.left() >= 0.0 && place.right() <= width);
            assert!(is_apart && is_within, "at {width}: {found:?}");
            let count = found.iter().flatten().count();
            assert!(width < 1000.0 || count == words.len(), "at {width}: {found:?}");
        }
    }
}
