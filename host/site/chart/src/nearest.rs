//! The record whose line is under the pointer.

use crate::shape::{NO_RECORD, Shape};

/// Picks the record of the stroke nearest to a place on the screen, no farther than `reach`; of
/// equally near ones the last drawn. `project` maps chart space, metres, to the screen; `None`
/// behind the eye.
pub fn nearest(
    shape: &Shape,
    project: impl Fn([f32; 3]) -> Option<[f32; 2]>,
    at: [f32; 2],
    reach: f32,
) -> Option<usize> {
    let mut found: Option<(f32, usize)> = None;
    for stroke in shape.strokes.iter().filter(|stroke| stroke.record != NO_RECORD) {
        let Some((from, to)) = project(stroke.from).zip(project(stroke.to)) else { continue };
        let distance = distance(at, from, to);
        if distance <= reach && found.is_none_or(|(least, _)| distance <= least) {
            found = Some((distance, stroke.record as usize));
        }
    }
    found.map(|(_, record)| record)
}

/// Distance of a point from a segment.
fn distance(at: [f32; 2], from: [f32; 2], to: [f32; 2]) -> f32 {
    let along = [to[0] - from[0], to[1] - from[1]];
    let away = [at[0] - from[0], at[1] - from[1]];
    let length = along[0] * along[0] + along[1] * along[1];
    let share = (away[0] * along[0] + away[1] * along[1]) / length.max(f32::MIN_POSITIVE);
    let share = share.clamp(0.0, 1.0);
    (away[0] - share * along[0]).hypot(away[1] - share * along[1])
}
