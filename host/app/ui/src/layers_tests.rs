use egui::{Pos2, RawInput, Rect, pos2, vec2};

use super::*;
use crate::test_lists::{EmptyList, texts};
use crate::view_model::{Label, LabelLine, ViewModel};
use crate::{Appearance, ListModels, Panels, SceneOverlay};

const SCREEN: Rect = Rect { min: Pos2::ZERO, max: pos2(1280.0, 720.0) };

#[test]
fn labels_avoid_the_layer_list_and_the_list_leaves_half_of_the_scene() {
    let row = |number: u32| LegendRow {
        name: format!("state {number}"),
        color: [120; 3],
        pattern: Pattern::Solid,
    };
    let layers = vec![LayerRow {
        name: "values".into(),
        shown: true,
        legend: (0..40).map(row).collect(),
        ..LayerRow::default()
    }];
    let model = ViewModel { layers: layers.clone(), ..ViewModel::default() };
    let lists = ListModels { tags: &EmptyList, alarms: &EmptyList, equipment: &EmptyList };
    let mut panels = Panels::new(true, Appearance { is_dark: false, scale: 1.0, font: None });
    let (mut titles, mut last) = (Vec::new(), Rect::NOTHING);
    // Fonts, and where things are, are known from the second on.
    for _ in 0..4 {
        let input = RawInput { screen_rect: Some(SCREEN), ..RawInput::default() };
        let mut output = panels.run(input, &model, &lists, |scene, _| {
            let label = |number: u32| Label {
                title: format!("=Q{number}"),
                anchor: scene.left_bottom() + vec2(100.0 + 10.0 * number as f32, -60.0),
                lines: vec![LabelLine {
                    caption: "P".into(),
                    text: "4 MW".into(),
                    ..LabelLine::default()
                }],
                ..Label::default()
            };
            SceneOverlay { labels: (0..3).map(label).collect(), ..SceneOverlay::default() }
        });
        output.egui.textures_delta.clear();
        titles.clear();
        output.egui.shapes.iter().for_each(|clipped| texts(&clipped.shape, "=Q", &mut titles));
        last = last_rect(panels.context(), &layers).expect("they are shown");
        assert!(last.height() < output.viewport.height() * 0.6, "{last:?}");
    }
    assert_eq!(titles.len(), 3);
    assert!(titles.iter().all(|title| !title.intersects(last)), "{titles:?} {last:?}");
}
