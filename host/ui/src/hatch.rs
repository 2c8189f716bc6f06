//! Hatching: what is not to be relied on must not look live.

use egui::{Painter, Pos2, Rect, Stroke, pos2};

use crate::{Mark, theme};

/// Distance between stripes, points.
const BAD_STEP: f32 = 5.0;
const UNCERTAIN_STEP: f32 = 11.0;

/// Fills the ground of a value and hatches it: densely when bad, sparsely when
/// uncertain, not at all when good.
pub(crate) fn ground(painter: &Painter, rect: Rect, mark: &Mark) {
    let (fill, _) = theme::ground_and_ink(painter.ctx(), mark);
    painter.rect_filled(rect, 2.0, fill);
    stripe(painter, rect, mark);
}

/// Hatches a place whose value is not good, over what is there.
pub(crate) fn stripe(painter: &Painter, rect: Rect, mark: &Mark) {
    let step = match mark {
        Mark::Bad { .. } | Mark::LateDisplay => BAD_STEP,
        Mark::Uncertain { .. } => UNCERTAIN_STEP,
        Mark::Normal | Mark::Warning | Mark::Alarm => return,
    };
    let painter = painter.with_clip_rect(rect.intersect(painter.clip_rect()));
    for mut stripe in stripes(rect, step) {
        if matches!(mark, Mark::LateDisplay) {
            // The other way: it is no quality.
            stripe = stripe.map(|at| pos2(at.x, rect.top() + rect.bottom() - at.y));
        }
        painter.line_segment(stripe, Stroke::new(1.0, theme::of(painter.ctx()).hatch));
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
