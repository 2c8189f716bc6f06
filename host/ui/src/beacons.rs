//! Marks in the scene at equipment in alarm.

use egui::{Align2, Pos2, Rect, Stroke, Ui, Vec2, pos2, vec2};

use crate::alarm_mark::{self, Look};
use crate::{Beacon, origin_mark, theme};

const RADIUS: f32 = 11.0;
/// From the equipment's top to the middle of the mark, points.
const HEIGHT: f32 = 26.0;

/// Places of beacons in a scene, points: labels go elsewhere.
pub(crate) fn places(scene: Rect, beacons: &[Beacon]) -> impl Iterator<Item = Rect> {
    beacons.iter().map(move |beacon| {
        Rect::from_center_size(center(scene, beacon), Vec2::splat(2.0 * RADIUS + 8.0))
    })
}

/// Middle of a mark; within the scene where its equipment is.
fn center(scene: Rect, beacon: &Beacon) -> Pos2 {
    let above = beacon.anchor - vec2(0.0, HEIGHT);
    let highest = scene.top() + RADIUS + 4.0;
    pos2(above.x, above.y.max(highest.min(beacon.anchor.y)))
}

/// Paints beacons over the scene, the most urgent last, so that nothing covers it.
pub(crate) fn paint(ui: &Ui, viewport: Rect, beacons: &[Beacon], flashes: bool) {
    if beacons.is_empty() {
        return;
    }
    let painter = ui.painter().with_clip_rect(viewport);
    let lit = alarm_mark::is_lit(ui, flashes && beacons.iter().any(|b| b.is_unacknowledged));
    let mut ordered: Vec<&Beacon> =
        beacons.iter().filter(|beacon| viewport.contains(beacon.anchor)).collect();
    ordered.sort_by_key(|beacon| std::cmp::Reverse(beacon.priority));
    for beacon in ordered {
        let center = center(viewport, beacon);
        painter.line_segment([beacon.anchor, center], Stroke::new(2.0, theme::of(ui.ctx()).ink));
        painter.circle_filled(center, RADIUS + 4.0, theme::of(ui.ctx()).paper.gamma_multiply(0.85));
        let look = Look {
            priority: beacon.priority,
            is_active: !beacon.is_doubtful,
            has_ring: beacon.is_unacknowledged && lit,
        };
        alarm_mark::paint(&painter, center, RADIUS, look);
        let mut note = String::new();
        if beacon.count > 1 {
            note += &format!("×{}", beacon.count);
        }
        if beacon.is_doubtful {
            note += " ?";
        }
        if !note.is_empty() {
            let at = center + vec2(RADIUS + 6.0, 0.0);
            let font = theme::small_font();
            let text = painter.layout_no_wrap(note.clone(), font.clone(), theme::of(ui.ctx()).ink);
            let ground = Rect::from_min_size(at - vec2(2.0, text.size().y * 0.5), text.size());
            painter.rect_filled(ground.expand(2.0), 2.0, theme::of(ui.ctx()).paper);
            painter.text(at, Align2::LEFT_CENTER, note, font, theme::of(ui.ctx()).ink);
        }
        let below = center + vec2(0.0, RADIUS + 4.0);
        origin_mark::paint(&painter, below, Align2::CENTER_TOP, beacon.origin);
    }
}
