//! The mark of an alarm: its shape and number tell the priority, its fill the state.
//!
//! A filled symbol is active, a hollow one has cleared. A ring flashes around an unacknowledged
//! alarm at 1 Hz at most; IEC 62682 leaves the rate open.

use busbar_types::Priority;
use egui::{Align2, Color32, Painter, Pos2, Shape, Stroke, Ui, pos2};

use crate::theme;

/// Seconds from one flash to the next.
const FLASH_SECONDS: f64 = 1.0;

/// Symbol of an alarm: shape by priority, fill and ring by state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AlarmSymbol {
    pub(crate) priority: Priority,
    pub(crate) is_active: bool,
    /// True in the phase in which the flashing ring is drawn.
    pub(crate) has_ring: bool,
}

/// Reports whether the flash phase is on, and requests a repaint at its next change.
pub(crate) fn is_flash_on(ui: &Ui, flashes: bool) -> bool {
    if !flashes {
        return true;
    }
    let phase = ui.input(|input| input.time).rem_euclid(FLASH_SECONDS);
    let half = FLASH_SECONDS / 2.0;
    let left = if phase < half { half - phase } else { FLASH_SECONDS - phase };
    ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(left));
    phase < half
}

/// Paints a mark; `radius` is that of the circle around it, points.
pub(crate) fn paint(painter: &Painter, center: Pos2, radius: f32, symbol: AlarmSymbol) {
    let (color, ink) = colors(symbol.priority);
    let fill = if symbol.is_active { color } else { theme::palette(painter.ctx()).background };
    let ink = if symbol.is_active { ink } else { theme::palette(painter.ctx()).text };
    let outline =
        Stroke::new(2.0, if symbol.is_active { theme::palette(painter.ctx()).text } else { color });
    let corners = corners(symbol.priority, center, radius);
    if symbol.has_ring {
        painter.circle_stroke(
            center,
            radius + 3.0,
            Stroke::new(2.5, theme::palette(painter.ctx()).text),
        );
    }
    match corners.is_empty() {
        true => {
            painter.circle(center, radius * 0.86, fill, outline);
        }
        false => {
            painter.add(Shape::convex_polygon(corners, fill, outline));
        }
    }
    let number = (symbol.priority as usize + 1).to_string();
    // The middle of a triangle lies lower or higher than that of its circle.
    let shift = match symbol.priority {
        Priority::High => radius * 0.16,
        Priority::Medium => -radius * 0.16,
        _ => 0.0,
    };
    let at = center + egui::vec2(0.0, shift);
    let font = egui::FontId::new(radius * 1.15, egui::FontFamily::Proportional);
    painter.text(at, Align2::CENTER_CENTER, number, font, ink);
}

/// The shape of a priority: diamond, triangle, triangle upside down; a circle has none.
fn corners(priority: Priority, center: Pos2, radius: f32) -> Vec<Pos2> {
    let at = |x: f32, y: f32| pos2(center.x + x * radius, center.y + y * radius);
    match priority {
        Priority::Critical => vec![at(0.0, -1.0), at(1.0, 0.0), at(0.0, 1.0), at(-1.0, 0.0)],
        Priority::High => vec![at(0.0, -1.0), at(0.98, 0.72), at(-0.98, 0.72)],
        Priority::Medium => vec![at(-0.98, -0.72), at(0.98, -0.72), at(0.0, 1.0)],
        Priority::Low => Vec::new(),
    }
}

/// Colour of a priority, and of its number.
pub(crate) fn colors(priority: Priority) -> (Color32, Color32) {
    match priority {
        Priority::Critical => (theme::ALARM, Color32::WHITE),
        Priority::High => (Color32::from_rgb(240, 120, 20), theme::DARK_TEXT),
        Priority::Medium => (theme::WARNING, theme::DARK_TEXT),
        Priority::Low => (Color32::from_rgb(90, 190, 225), theme::DARK_TEXT),
    }
}
