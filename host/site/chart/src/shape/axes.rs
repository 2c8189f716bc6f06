//! Geometry of axes: ticks, limits, lanes and the board behind them.

use busbar_types::Pattern;

use super::{Face, GREY, INK, NO_RECORD, PAPER, Shape, Stroke, Text, TextKind};
use crate::axis::short;
use crate::layout::{MISSING_LANE, depth_of};
use crate::{Axis, AxisView, Band, Layout, ParallelCoordinates, Size};

/// Share of an axis' height that its bands are wide.
const BAND_WIDTH: f32 = 0.018;
/// Length of a tick, as a share of the height.
const TICK_LENGTH: f32 = 0.012;
/// Distance of hatching lines, as a share of the height.
const HATCH_STEP: f32 = 0.014;
/// Distance of the board behind the axes, metres.
const BOARD_BEHIND: f32 = 0.06;
/// Distance of the bands behind the axes, metres.
const BAND_BEHIND: f32 = 0.02;

pub(super) fn add(chart: &ParallelCoordinates, shape: &mut Shape) {
    let views = chart.shown_axes();
    let feet = chart.layout.axis_positions(views.len(), chart.size);
    match chart.layout {
        Layout::Flat => add_board(chart.size, shape),
        Layout::Focus => add_floor(&feet, chart.size, shape),
        Layout::Time => {}
    }
    for (view, [x, z]) in views.iter().zip(feet) {
        let height = chart.size.height;
        let place = |position: f32| [x, position * height, z];
        shape.axes.push([place(0.0), place(1.0)]);
        let axis = &chart.description.axes[view.axis];
        add_axis(view, axis, chart.size, place, shape);
    }
    if chart.layout == Layout::Time {
        add_times(chart, shape);
    }
}

/// Paper behind flat axes: lines are read against it, not against the site.
fn add_board(Size { width, height, .. }: Size, shape: &mut Shape) {
    let margin = height * 0.1;
    let [left, right] = [-margin * 1.2, width + margin * 1.2];
    let [below, above] = [height * MISSING_LANE - margin * 0.6, height + margin * 1.4];
    let z = -BOARD_BEHIND;
    let corners = [[left, below, z], [right, below, z], [right, above, z], [left, above, z]];
    shape.faces.push(Face { corners, color: PAPER, cover: 0.94 });
}

/// Adds paper under axes in a circle, as background for lines seen from above.
fn add_floor(feet: &[[f32; 2]], Size { height, .. }: Size, shape: &mut Shape) {
    let end = |i: usize, of: fn(f32, f32) -> f32| feet.iter().map(|foot| foot[i]).reduce(of);
    let ends = [0, 1].map(|i| end(i, f32::min).zip(end(i, f32::max)));
    let [Some((left, right)), Some((back, front))] = ends else { return };
    let margin = height * 0.2;
    let y = height * MISSING_LANE - margin * 0.2;
    let [left, right] = [left - margin, right + margin];
    let [back, front] = [back - margin, front + margin];
    let corners = [[left, y, front], [right, y, front], [right, y, back], [left, y, back]];
    shape.faces.push(Face { corners, color: PAPER, cover: 0.9 });
}

fn add_axis(
    view: &AxisView,
    axis: &Axis,
    Size { height, .. }: Size,
    place: impl Fn(f32) -> [f32; 3],
    shape: &mut Shape,
) {
    for band in &axis.bands {
        add_band(view, band, height, &place, shape);
    }
    let beside = |position: f32, by: f32| {
        let [x, y, z] = place(position);
        [x + by * height, y, z]
    };
    shape.strokes.push(plain(place(0.0), place(1.0), 1.6, INK, 1.0));
    for tick in view.ticks() {
        let ends = [beside(tick.position, -TICK_LENGTH), place(tick.position)];
        shape.strokes.push(plain(ends[0], ends[1], 1.2, INK, 1.0));
        let (at, kind) = (beside(tick.position, -TICK_LENGTH * 1.5), TextKind::Tick);
        shape.texts.push(Text { at, text: tick.text, kind });
    }
    if let Some(position) = axis.detection_limit.and_then(|limit| view.position(limit)) {
        // Below it nothing is certain: a cross bar closes the axis.
        let ends = [beside(position, -TICK_LENGTH * 1.6), beside(position, TICK_LENGTH * 1.6)];
        shape.strokes.push(plain(ends[0], ends[1], 2.4, GREY, 1.0));
    }
    let lane = [beside(MISSING_LANE, -TICK_LENGTH * 2.0), beside(MISSING_LANE, TICK_LENGTH * 2.0)];
    shape
        .strokes
        .push(Stroke { pattern: Pattern::Dotted, ..plain(lane[0], lane[1], 1.6, GREY, 1.0) });
    let unit = if axis.unit.is_empty() { String::new() } else { format!(" [{}]", axis.unit) };
    let text = format!("{}{unit}", axis.name);
    shape.texts.push(Text { at: place(1.0), text, kind: TextKind::Axis });
    shape.texts.push(Text {
        at: place(MISSING_LANE),
        text: "none".into(),
        kind: TextKind::Missing,
    });
}

/// Adds a strip beside the axis; abnormal ranges are hatched, and their limits named.
fn add_band(
    view: &AxisView,
    band: &Band,
    height: f32,
    place: &impl Fn(f32) -> [f32; 3],
    shape: &mut Shape,
) {
    let end = |value: Option<f32>, otherwise| view.position(value.unwrap_or(otherwise));
    let Some((a, b)) = end(band.from, view.low).zip(end(band.to, view.high)) else { return };
    let [low, high] = [a.min(b), a.max(b)];
    if high <= low {
        return;
    }
    let beside = |position: f32, by: f32| {
        let [x, y, z] = place(position);
        [x + by * height, y, z - BAND_BEHIND]
    };
    let width = BAND_WIDTH;
    let corners = [beside(low, 0.0), beside(low, width), beside(high, width), beside(high, 0.0)];
    let (color, cover) = if band.is_abnormal { ([150; 3], 0.75) } else { ([205; 3], 0.8) };
    shape.faces.push(Face { corners, color, cover });
    if !band.is_abnormal {
        return;
    }
    let mut at = low;
    while at + HATCH_STEP <= high {
        let hatch = plain(beside(at, 0.0), beside(at + HATCH_STEP, width), 1.0, INK, 0.75);
        shape.strokes.push(hatch);
        at += HATCH_STEP;
    }
    if let Some((limit, position)) = band.from.and_then(|from| Some((from, view.position(from)?))) {
        shape.strokes.push(plain(beside(position, 0.0), beside(position, width), 2.0, INK, 1.0));
        let (at, text) = (beside(position, width * 1.3), short(limit));
        shape.texts.push(Text { at, text, kind: TextKind::Limit });
    }
}

/// The first and the last time, and a frame where the playhead is.
fn add_times(chart: &ParallelCoordinates, shape: &mut Shape) {
    let Some([first, last]) = chart.records.span() else { return };
    let Size { width, height, depth } = chart.size;
    for (time, z) in [(first, 0.0), (last, depth)] {
        let (at, kind) = ([width * 1.02, 0.0, z], TextKind::Time);
        shape.texts.push(Text { at, text: date(time), kind });
    }
    let rail = plain([width, 0.0, 0.0], [width, 0.0, depth], 1.2, GREY, 1.0);
    shape.strokes.push(rail);
    shape.strokes.push(plain([0.0, 0.0, 0.0], [0.0, 0.0, depth], 1.2, GREY, 1.0));
    let playhead = chart.playhead.unwrap_or(last);
    let z = depth_of(playhead, [first, last], depth);
    let corners = [[0.0, 0.0, z], [width, 0.0, z], [width, height, z], [0.0, height, z]];
    shape.faces.push(Face { corners, color: PAPER, cover: 0.45 });
    for side in 0..4 {
        shape.strokes.push(plain(corners[side], corners[(side + 1) % 4], 1.4, INK, 0.9));
    }
    if chart.playhead.is_some() {
        let (at, kind) = ([width * 1.02, height, z], TextKind::Time);
        shape.texts.push(Text { at, text: date(playhead), kind });
    }
}

pub(super) fn plain(
    from: [f32; 3],
    to: [f32; 3],
    width: f32,
    color: [u8; 3],
    cover: f32,
) -> Stroke {
    Stroke { from, to, width, color, cover, pattern: Pattern::Solid, record: NO_RECORD }
}

/// The day of a time, UTC (days from civil, H. Hinnant, "chrono-Compatible Low-Level Date
/// Algorithms").
pub fn date(unix_nanos: i64) -> String {
    let days = unix_nanos.div_euclid(86_400_000_000_000) + 719_468;
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::date;

    #[test]
    fn days_are_those_of_the_calendar() {
        let check = |seconds: i64, day: &str| assert_eq!(date(seconds * 1_000_000_000), day);
        check(0, "1970-01-01");
        check(-1, "1969-12-31");
        check(951_782_400, "2000-02-29");
        check(1_782_777_600, "2026-06-30");
    }
}
