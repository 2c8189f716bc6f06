//! Marks in the scene at equipment in alarm.

use egui::{Align2, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};

use crate::alarm_symbol::{self, AlarmSymbol};
use crate::{AlarmMarker, origin_mark, theme};

const RADIUS: f32 = 11.0;
/// Distance from the equipment's top to the marker's center, points.
const HEIGHT: f32 = 26.0;

/// Places of beacons in a scene, points: labels go elsewhere.
pub(crate) fn places(scene: Rect, alarm_markers: &[AlarmMarker]) -> impl Iterator<Item = Rect> {
    alarm_markers.iter().map(move |marker| {
        Rect::from_center_size(center(scene, marker), Vec2::splat(2.0 * RADIUS + 8.0))
    })
}

/// Middle of a mark; within the scene where its equipment is.
fn center(scene: Rect, marker: &AlarmMarker) -> Pos2 {
    let above = marker.anchor - vec2(0.0, HEIGHT);
    let highest = scene.top() + RADIUS + 4.0;
    pos2(above.x, above.y.max(highest.min(marker.anchor.y)))
}

/// Paints beacons over the scene, the most urgent last, so that nothing covers it.
pub(crate) fn paint(ui: &Ui, viewport: Rect, alarm_markers: &[AlarmMarker], flashes: bool) {
    if alarm_markers.is_empty() {
        return;
    }
    let painter = ui.painter().with_clip_rect(viewport);
    let lit =
        alarm_symbol::is_flash_on(ui, flashes && alarm_markers.iter().any(|b| b.is_unacknowledged));
    let mut ordered: Vec<&AlarmMarker> =
        alarm_markers.iter().filter(|marker| viewport.contains(marker.anchor)).collect();
    ordered.sort_by_key(|marker| std::cmp::Reverse(marker.priority));
    for marker in ordered {
        let center = center(viewport, marker);
        painter
            .line_segment([marker.anchor, center], Stroke::new(2.0, theme::palette(ui.ctx()).text));
        painter.circle_filled(
            center,
            RADIUS + 4.0,
            theme::palette(ui.ctx()).background.gamma_multiply(0.85),
        );
        let symbol = AlarmSymbol {
            priority: marker.priority,
            is_active: !marker.is_uncertain,
            has_ring: marker.is_unacknowledged && lit,
        };
        alarm_symbol::paint(&painter, center, RADIUS, symbol);
        let mut note = String::new();
        if marker.count > 1 {
            note += &format!("×{}", marker.count);
        }
        if marker.is_uncertain {
            note += " ?";
        }
        if !note.is_empty() {
            let at = center + vec2(RADIUS + 6.0, 0.0);
            let font = theme::small_font();
            let text =
                painter.layout_no_wrap(note.clone(), font.clone(), theme::palette(ui.ctx()).text);
            let ground = Rect::from_min_size(at - vec2(2.0, text.size().y * 0.5), text.size());
            painter.rect_filled(ground.expand(2.0), 2.0, theme::palette(ui.ctx()).background);
            painter.text(at, Align2::LEFT_CENTER, note, font, theme::palette(ui.ctx()).text);
        }
        let below = center + vec2(0.0, RADIUS + 4.0);
        origin_mark::paint(&painter, below, Align2::CENTER_TOP, marker.origin);
    }
}
