//! The systems whose alarms are shown and decided on elsewhere.

use egui::{Sense, Ui, Vec2, vec2};

use crate::{AlarmLamp, Mark, hatch, theme};

/// Sources of alarms that the head names.
const MAX_LAMPS: usize = 4;
/// Around what it says of one, points.
const LAMP_MARGIN: Vec2 = vec2(4.0, 1.0);

/// Where alarms of other systems come from; hatched where that is lost.
pub(crate) fn show(ui: &mut Ui, sources: &[AlarmLamp]) {
    let lost_first = |lamp: &&AlarmLamp| lamp.doubt.is_none();
    let mut ordered: Vec<&AlarmLamp> = sources.iter().collect();
    ordered.sort_by_key(lost_first);
    for lamp in ordered.iter().take(MAX_LAMPS) {
        let (words, hint) = lamp_words(lamp);
        let ink = theme::of(ui.ctx()).ink;
        let font = egui::TextStyle::Body.resolve(ui.style());
        let text = ui.painter().layout_no_wrap(words, font, ink);
        let (rect, response) =
            ui.allocate_exact_size(text.size() + 2.0 * LAMP_MARGIN, Sense::hover());
        if let Some(reason) = &lamp.doubt {
            hatch::ground(ui.painter(), rect, &Mark::Bad { reason: reason.clone() });
        }
        ui.painter().galley(rect.min + LAMP_MARGIN, text, ink);
        response.on_hover_text(hint);
    }
    if ordered.len() > MAX_LAMPS {
        ui.label(format!("and {} more", ordered.len() - MAX_LAMPS));
    }
    if !sources.is_empty() {
        ui.separator();
    }
}

/// `× plc 12 +3`, and what that says.
fn lamp_words(lamp: &AlarmLamp) -> (String, String) {
    let AlarmLamp { name, alarms, left_out, doubt } = lamp;
    let (mut words, mut hint) = (format!("{name} {alarms}"), format!("{alarms} alarms of {name}"));
    if *left_out > 0 {
        words += &format!(" +{left_out}");
        hint += &format!(", and {left_out} that are not shown");
    }
    match doubt {
        Some(doubt) => (format!("× {words}"), format!("{hint}\n{doubt}")),
        None => (words, hint),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_source_says_so_with_a_cross() {
        let lamp = AlarmLamp { name: "plc".into(), alarms: 2, ..AlarmLamp::default() };
        assert_eq!(lamp_words(&lamp).0, "plc 2");
        let lost = AlarmLamp { left_out: 3, doubt: Some("stale 12 s".into()), ..lamp };
        assert_eq!(lamp_words(&lost).0, "× plc 2 +3");
        assert!(lamp_words(&lost).1.ends_with("3 that are not shown\nstale 12 s"));
    }
}
