//! Hatching of values that are not reliable.

use egui::{Painter, Pos2, Rect, Stroke, pos2};

use crate::{ValueMark, theme};

/// Distance between stripes, points.
const BAD_STEP: f32 = 5.0;
const UNCERTAIN_STEP: f32 = 11.0;

/// Fills the ground of a value and hatches it: densely when bad, sparsely when
/// uncertain, not at all when good.
pub(crate) fn fill(painter: &Painter, rect: Rect, mark: &ValueMark) {
    let (fill, _) = theme::background_and_text(painter.ctx(), mark);
    painter.rect_filled(rect, 2.0, fill);
    draw_stripes(painter, rect, mark);
}

/// Hatches a place whose value is not good over its existing content.
pub(crate) fn draw_stripes(painter: &Painter, rect: Rect, mark: &ValueMark) {
    let step = match mark {
        ValueMark::Bad { .. } | ValueMark::LateDisplay => BAD_STEP,
        ValueMark::Uncertain { .. } => UNCERTAIN_STEP,
        ValueMark::Normal | ValueMark::Warning | ValueMark::Alarm => return,
    };
    let painter = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    for mut stripe in stripes(rect, step) {
        if matches!(mark, ValueMark::LateDisplay) {
            // The other way: it is no quality.
            stripe = stripe.map(|at| pos2(at.x, rect.top() + rect.bottom() - at.y));
        }
        painter.line_segment(stripe, Stroke::new(1.0, theme::palette(painter.ctx()).hatch));
    }
}

/// Lines at 45 degrees that cover a rectangle.
fn stripes(rect: Rect, step: f32) -> impl Iterator<Item = [Pos2; 2]> {
    let count = ((rect.width() + rect.height()) / step) as u32;
    (1..=count).map(move |i| {
        let x = rect.left() + i as f32 * step;
        [pos2(x - rect.height(), rect.bottom()), pos2(x, rect.top())]
    })
}
