//! Results of several scenes as a table of text.

use crate::scene_results::{Distribution, SceneResults};

/// Width of the first column and of the others, characters.
const NAME_WIDTH: usize = 34;
const COLUMN_WIDTH: usize = 18;

/// Writes results as a table with a column for each scene, and the device above it.
pub fn format_table(results: &[SceneResults]) -> String {
    let Some(first) = results.first() else { return String::new() };
    let [width, height] = first.size;
    let mut text = format!("{}, {width} x {height} pixels\n\n", first.device);
    let mut row = |name: &str, cell: &dyn Fn(&SceneResults) -> String| {
        let cells: String =
            results.iter().map(|scene| format!("{:>COLUMN_WIDTH$}", cell(scene))).collect();
        text.push_str(format!("{name:<NAME_WIDTH$}{cells}").trim_end());
        text.push('\n');
    };
    row("", &|scene| scene.scene.clone());
    row("triangles", &|scene| scene.triangles.to_string());
    row("triangles drawn in motion", &|scene| scene.motion_triangles.to_string());
    row("tags", &|scene| scene.tags.to_string());
    row("first picture, s", &|scene| format!("{:.2}", scene.start_seconds));
    row("memory, MiB", &|scene| {
        scene.peak_bytes.map_or_else(|| "-".to_owned(), |bytes| (bytes >> 20).to_string())
    });
    row("", &|_| "p50 / p99 ms".to_owned());
    row("step at rest", &|scene| milliseconds(scene.rest_ms));
    row("frame, still", &|scene| milliseconds(Some(scene.still_ms)));
    row("frame, camera in motion", &|scene| milliseconds(Some(scene.motion_ms)));
    row("frame, every tag changed", &|scene| milliseconds(scene.tags_ms));
    row("detail changed by 1 %", &|scene| milliseconds(scene.detail_step_ms));
    row("detail changed from full to least", &|scene| milliseconds(scene.detail_full_ms));
    let mut passes: Vec<&String> = results.iter().flat_map(|scene| scene.pass_ms.keys()).collect();
    passes.sort();
    passes.dedup();
    for pass in passes {
        let name = format!("device in motion: {pass}");
        row(&name, &|scene| milliseconds(scene.pass_ms.get(pass).copied()));
    }
    text
}

fn milliseconds(of: Option<Distribution>) -> String {
    of.map_or_else(|| "-".to_owned(), |of| format!("{:.2} / {:.2}", of.p50, of.p99))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn each_scene_has_a_column_and_what_was_not_measured_a_dash() {
        let of = |p50: f64| Distribution { p50, p99: p50 * 2.0, count: 9 };
        let bay = SceneResults {
            scene: "bay".into(),
            device: "card".into(),
            size: [1920, 1080],
            triangles: 1234,
            tags: 3,
            start_seconds: 0.5,
            rest_ms: Some(of(0.01)),
            motion_triangles: 1234,
            still_ms: of(5.0),
            motion_ms: of(6.0),
            tags_ms: None,
            detail_step_ms: None,
            detail_full_ms: Some(of(8.0)),
            pass_ms: BTreeMap::from([("scene".to_owned(), of(4.0))]),
            peak_bytes: Some(300 << 20),
            validation_messages: Vec::new(),
        };
        let yard = SceneResults {
            scene: "yard".into(),
            pass_ms: BTreeMap::new(),
            peak_bytes: None,
            ..bay.clone()
        };
        let text = format_table(&[bay, yard]);
        let line = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(text.starts_with("card, 1920 x 1080 pixels\n"));
        assert_eq!(line("triangles").split_whitespace().count(), 3);
        assert!(line("memory").ends_with("300                 -"));
        assert!(line("frame, every tag").ends_with("-                 -"));
        assert!(line("device in motion: scene").ends_with("4.00 / 8.00                 -"));
        assert!(format_table(&[]).is_empty());
    }
}
