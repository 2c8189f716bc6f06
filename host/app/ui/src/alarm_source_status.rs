//! The systems whose alarms are shown and decided on elsewhere.

use egui::{Sense, Ui, Vec2, vec2};

use crate::{AlarmSourceStatus, ValueMark, quality_hatching, theme};

/// Sources of alarms that the head names.
const MAX_SOURCES: usize = 4;
/// Margin around a source's text, points.
const ENTRY_MARGIN: Vec2 = vec2(4.0, 1.0);

/// Shows the external alarm sources; a lost source is hatched.
pub(crate) fn show(ui: &mut Ui, sources: &[AlarmSourceStatus]) {
    let lost_first = |status: &&AlarmSourceStatus| status.uncertainty.is_none();
    let mut ordered: Vec<&AlarmSourceStatus> = sources.iter().collect();
    ordered.sort_by_key(lost_first);
    for status in ordered.iter().take(MAX_SOURCES) {
        let (words, hint) = status_text(status);
        let ink = theme::palette(ui.ctx()).text;
        let font = egui::TextStyle::Body.resolve(ui.style());
        let text = ui.painter().layout_no_wrap(words, font, ink);
        let (rect, response) =
            ui.allocate_exact_size(text.size() + 2.0 * ENTRY_MARGIN, Sense::hover());
        if let Some(reason) = &status.uncertainty {
            quality_hatching::fill(ui.painter(), rect, &ValueMark::Bad { reason: reason.clone() });
        }
        ui.painter().galley(rect.min + ENTRY_MARGIN, text, ink);
        response.on_hover_text(hint);
    }
    if ordered.len() > MAX_SOURCES {
        ui.label(format!("and {} more", ordered.len() - MAX_SOURCES));
    }
    if !sources.is_empty() {
        ui.separator();
    }
}

/// `× plc 12 +3`, and what that says.
fn status_text(status: &AlarmSourceStatus) -> (String, String) {
    let AlarmSourceStatus { name, alarms, left_out, uncertainty } = status;
    let (mut words, mut hint) = (format!("{name} {alarms}"), format!("{alarms} alarms of {name}"));
    if *left_out > 0 {
        words += &format!(" +{left_out}");
        hint += &format!(", and {left_out} that are not shown");
    }
    match uncertainty {
        Some(uncertainty) => (format!("× {words}"), format!("{hint}\n{uncertainty}")),
        None => (words, hint),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_source_is_marked_with_a_cross() {
        let status =
            AlarmSourceStatus { name: "plc".into(), alarms: 2, ..AlarmSourceStatus::default() };
        assert_eq!(status_text(&status).0, "plc 2");
        let lost =
            AlarmSourceStatus { left_out: 3, uncertainty: Some("stale 12 s".into()), ..status };
        assert_eq!(status_text(&lost).0, "× plc 2 +3");
        assert!(status_text(&lost).1.ends_with("3 that are not shown\nstale 12 s"));
    }
}
