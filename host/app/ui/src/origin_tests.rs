//! Marks and band of values that are not live, as panels paint them.

use busbar_types::{Origin, Pattern};
use egui::{RawInput, Rect, pos2, vec2};

use crate::test_lists::{EmptyList, texts};
use crate::{
    Appearance, Faceplate, FaceplateState, FaceplateValue, Label, LabelLine, LegendRow, ListModels,
    Panels, PanelsOutput, SceneOverlay, TagRow, ValueMark, ViewModel, origin_mark,
};

/// Sizes of windows, from the smallest that is promised.
const SIZES: [[f32; 2]; 4] = [[320.0, 180.0], [640.0, 360.0], [1280.0, 720.0], [3840.0, 2160.0]];

fn band_words() -> Vec<&'static str> {
    origin_mark::ORIGINS.iter().filter_map(|words| words.band).collect()
}

fn every_origin() -> Origin {
    origin_mark::ORIGINS.iter().fold(Origin::LIVE, |all, words| all | words.origin)
}

fn run(shown: bool, is_dark: bool, size: [f32; 2], origin: Origin) -> PanelsOutput {
    run_model(shown, is_dark, size, &ViewModel { origin, ..ViewModel::default() })
}

/// The last of some passes; places and fonts are known from the second on.
fn run_model(shown: bool, is_dark: bool, size: [f32; 2], model: &ViewModel) -> PanelsOutput {
    let mut panels = Panels::new(shown, Appearance { is_dark, scale: 1.0, font: None });
    let origin = model.origin;
    let lists = ListModels { tags: &EmptyList, alarms: &EmptyList, equipment: &EmptyList };
    let screen = Rect::from_min_size(pos2(0.0, 0.0), size.into());
    let mut pass = || {
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        let mut output = panels.run(input, model, &lists, |scene, _| {
            let label = |number: u32| Label {
                title: format!("=Q{number}"),
                // At the top, where the band is.
                anchor: scene.center_top() + vec2(40.0 * number as f32 - 60.0, 18.0),
                lines: vec![LabelLine {
                    caption: "P".into(),
                    text: "4".into(),
                    origin,
                    ..LabelLine::default()
                }],
                ..Label::default()
            };
            SceneOverlay { labels: (0..3).map(label).collect(), ..SceneOverlay::default() }
        });
        output.egui.textures_delta.clear();
        output
    };
    pass();
    pass();
    pass()
}

fn found(output: &PanelsOutput, word: &str) -> Vec<Rect> {
    let mut places = Vec::new();
    output.egui.shapes.iter().for_each(|clipped| texts(&clipped.shape, word, &mut places));
    places
}

#[test]
fn the_band_names_every_origin_at_every_size_with_and_without_panels() {
    for (size, shown, is_dark) in SIZES.into_iter().flat_map(|size| {
        [(true, true), (true, false), (false, true), (false, false)]
            .map(|(shown, is_dark)| (size, shown, is_dark))
    }) {
        let screen = Rect::from_min_size(pos2(0.0, 0.0), size.into());
        let output = run(shown, is_dark, size, every_origin());
        let top = if output.viewport.width() < 160.0 { screen } else { output.viewport };
        for word in band_words() {
            let places = found(&output, word);
            let is_whole =
                |place: &Rect| screen.contains_rect(*place) && place.top() < top.top() + 100.0;
            assert!(places.iter().any(is_whole), "{word} at {size:?}, {shown}: {places:?}");
        }
        assert!(found(&output, "SUBSTITUTED").is_empty());
    }
}

#[test]
fn a_live_view_has_neither_band_nor_marks() {
    for shown in [true, false] {
        let output = run(shown, false, SIZES[2], Origin::LIVE);
        for words in &origin_mark::ORIGINS {
            assert!(found(&output, words.letters).is_empty(), "{}", words.letters);
            assert!(words.band.is_none_or(|word| found(&output, word).is_empty()));
        }
    }
}

#[test]
fn labels_stay_below_the_band_and_carry_their_origin() {
    for size in SIZES {
        let output = run(false, false, size, Origin::SIMULATED);
        let band = found(&output, "SIMULATED");
        let bottom = band.iter().map(|place| place.bottom()).fold(0.0, f32::max);
        let titles = found(&output, "=Q");
        assert!(!titles.is_empty(), "{size:?}");
        assert!(titles.iter().all(|title| title.top() >= bottom), "{size:?}: {titles:?}");
        let marks: Vec<Rect> =
            found(&output, "SIM").into_iter().filter(|mark| !band.contains(mark)).collect();
        assert!(marks.len() >= titles.len(), "{size:?}: {marks:?}");
        assert!(marks.iter().all(|mark| mark.top() >= bottom), "{size:?}: {marks:?}");
    }
}

#[test]
fn substituted_values_are_marked_at_the_value_alone() {
    let output = run(false, false, SIZES[2], Origin::SUBSTITUTED);
    assert!(!found(&output, "SUB").is_empty());
    assert!(band_words().iter().all(|word| found(&output, word).is_empty()));
}

#[test]
fn a_faceplate_marks_each_state_and_value_by_its_origin() {
    let letters_in = |of_state: Origin, of_value: Origin| {
        let state = FaceplateState {
            layer: "condition".into(),
            state: LegendRow { name: "normal".into(), color: [128; 3], pattern: Pattern::Solid },
            place: None,
            mark: ValueMark::Normal,
            age: None,
            origin: of_state,
        };
        let row = TagRow { origin: of_value, ..TagRow::default() };
        let value = FaceplateValue { row, ..FaceplateValue::default() };
        let faceplate =
            Faceplate { states: vec![state], values: vec![value], ..Faceplate::default() };
        let model = ViewModel { faceplate: Some(faceplate), ..ViewModel::default() };
        let output = run_model(true, false, SIZES[2], &model);
        let all = origin_mark::ORIGINS.iter();
        all.map(|words| found(&output, words.letters).len()).collect::<Vec<_>>()
    };
    let none = letters_in(Origin::LIVE, Origin::LIVE);
    for (index, words) in origin_mark::ORIGINS.iter().enumerate() {
        let cases = [(words.origin, Origin::LIVE), (Origin::LIVE, words.origin)];
        for (of_state, of_value) in cases {
            let marks = letters_in(of_state, of_value)[index] - none[index];
            assert_eq!(marks, 1, "{}: {of_state:?} {of_value:?}", words.letters);
        }
    }
}
