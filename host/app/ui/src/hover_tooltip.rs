//! Tooltip with the equipment id under the pointer.

use std::time::Duration;

use egui::{Rect, Stroke, StrokeKind, Ui, Vec2, vec2};

use crate::theme;

/// Offset of the tooltip from the pointer's tip, points.
const OFFSET: Vec2 = vec2(14.0, 18.0);
/// Pointer rest time before the tooltip appears, seconds.
const REST_SECONDS: f32 = 0.15;
const PADDING: Vec2 = vec2(5.0, 2.0);

/// Paints an equipment id beside the pointer, within the scene.
pub(crate) fn paint(ui: &Ui, id: &str) {
    let scene = ui.max_rect();
    let Some(pointer) = ui.input(|i| i.pointer.hover_pos()).filter(|p| scene.contains(*p)) else {
        return;
    };
    // Named once the hand rests, not while it passes by.
    let rest = ui.input(|i| i.pointer.time_since_last_movement());
    if rest < REST_SECONDS {
        ui.ctx().request_repaint_after(Duration::from_secs_f32(REST_SECONDS - rest));
        return;
    }
    let painter = ui.painter().with_clip_rect(scene);
    let text =
        painter.layout_no_wrap(id.to_owned(), theme::small_font(), theme::palette(ui.ctx()).text);
    let size = text.size() + PADDING * 2.0;
    // Towards the middle where there is no room.
    let below = Rect::from_min_size(pointer + OFFSET, size);
    let left = if below.right() > scene.right() { pointer.x - 6.0 - size.x } else { below.left() };
    let top = if below.bottom() > scene.bottom() { pointer.y - 6.0 - size.y } else { below.top() };
    let place = Rect::from_min_size(egui::pos2(left, top), size);
    let line = Stroke::new(1.0, theme::palette(ui.ctx()).border);
    painter.rect(place, 2.0, theme::palette(ui.ctx()).background, line, StrokeKind::Inside);
    painter.galley(place.min + PADDING, text, theme::palette(ui.ctx()).text);
}
