//! Trend curve of a value over the local clock, with gaps while the value is unknown.

use std::ops::RangeInclusive;
use std::time::Duration;

use egui::{Align2, Rangef, Rect, Stroke, Ui, pos2, vec2};
use egui_plot::{AxisHints, GridMark, HLine, Line, Plot, PlotPoint, PlotPoints, PlotTransform};

use crate::{
    Command, Trend, TrendOrigin, TrendPoint, TrendState, ValueMark, origin_mark, quality_hatching,
    theme,
};

/// Height of a curve with its axis, points.
const HEIGHT: f32 = 104.0;
/// Room for the numbers beside it, points.
const NUMBERS_WIDTH: f32 = 46.0;
/// Time spans that the operator can choose.
const SPANS: [(u64, &str); 4] =
    [(10 * 60, "10 min"), (3600, "1 h"), (2 * 3600, "2 h"), (4 * 3600, "4 h")];
/// Seconds between lines of time, to choose from.
const TIME_STEPS: [f64; 8] = [60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0];
/// Lines of time at most.
const MAX_TIME_LINES: f64 = 5.0;
/// Lines of time nearer than this have no clock at them, all those farther have, points.
const CLOCK_SPACING: Rangef = Rangef { min: 34.0, max: 46.0 };
const SECONDS_PER_DAY: f64 = 86_400.0;
/// Points between letters of an origin along a curve.
const ORIGIN_SPACING: f32 = 60.0;

/// Buttons for how far back trends go.
pub(crate) fn spans(ui: &mut Ui, shown: Duration, commands: &mut Vec<Command>) {
    for (seconds, words) in SPANS {
        let span = Duration::from_secs(seconds);
        if ui.selectable_label(span == shown, words).clicked() {
            commands.push(Command::SetTrendSpan(span));
        }
    }
}

/// Shows a curve from `span` ago until now.
pub(crate) fn show(ui: &mut Ui, trend: &Trend, span: Duration) {
    let palette = theme::palette(ui.ctx());
    let quality_intervals = quality_intervals(&trend.points);
    let span = span.as_secs_f64();
    let [low, high] = value_range(trend);
    let unit = if trend.unit.is_empty() { String::new() } else { format!(" ({})", trend.unit) };
    ui.label(format!("{}{unit}", trend.title));
    let now = trend.local_seconds;
    let step = time_step(span);
    let spacer = move |_| {
        let first = ((now - span) / step).ceil() * step;
        let count = ((now - first) / step) as usize;
        let mark = |index| GridMark { value: first + index as f64 * step - now, step_size: step };
        (0..=count).map(mark).collect()
    };
    let clock = move |mark: GridMark, _: &RangeInclusive<f64>| clock_text(now + mark.value);
    let plot = Plot::new(("trend", trend.tag))
        .height(HEIGHT)
        .show_background(false)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_double_click_reset(false)
        .set_margin_fraction(vec2(0.0, 0.0))
        .x_grid_spacer(spacer)
        .y_grid_spacer(|input| value_marks(input.bounds))
        .grid_color(palette.border)
        .cursor_color(palette.weak_text)
        .custom_x_axes(vec![AxisHints::new_x().formatter(clock).label_spacing(CLOCK_SPACING)])
        .custom_y_axes(vec![
            AxisHints::new_y()
                .min_thickness(NUMBERS_WIDTH)
                .formatter(|mark, _| number_text(mark.value, mark.step_size)),
        ])
        .label_formatter(move |at| {
            let egui_plot::HoverPosition::NearDataPoint { position, .. } = at else { return None };
            Some(format!("{}\n{:.3}", clock_text(now + position.x), position.y))
        });
    let shown = plot.show(ui, |plot| {
        plot.set_plot_bounds_x(-span..=0.0);
        plot.set_plot_bounds_y(low..=high);
        for limit in trend.limits.into_iter().flatten() {
            let dashes = egui_plot::LineStyle::Dashed { length: 5.0 };
            let line = HLine::new("limit", limit).style(dashes).allow_hover(false);
            plot.hline(line.stroke(Stroke::new(1.0, palette.weak_text)));
        }
        for interval in quality_intervals.iter().filter(|interval| !interval.line.is_empty()) {
            let stroke =
                Stroke::new(1.4, if interval.is_good { palette.text } else { palette.hatch });
            plot.line(Line::new("", PlotPoints::Borrowed(&interval.line)).stroke(stroke));
        }
    });
    let uncertain = quality_intervals.iter().filter(|interval| !interval.is_good);
    for interval in uncertain {
        stripes(ui, &shown.transform, interval, span);
    }
    // Before the first point nothing is known.
    let first = trend.points.first().map_or(0.0, |point| point.at);
    if first > -span {
        let nothing = QualityInterval { from: -span, to: first, is_good: false, line: Vec::new() };
        stripes(ui, &shown.transform, &nothing, span);
    }
    let origins = trend.origins.iter();
    origins.for_each(|origin| mark_origin(ui, &shown.transform, origin, span));
}

/// Marks a time in which the value was not live: a bar along the top, with the letters of
/// the origin as often as there is room.
fn mark_origin(ui: &Ui, transform: &PlotTransform, shown: &TrendOrigin, span: f64) {
    let frame = *transform.frame();
    let [left, right] =
        shown.span.map(|at| transform.position_from_point(&PlotPoint::new(at.max(-span), 0.0)).x);
    let bar = Rect::from_min_max(
        pos2(left, frame.top()),
        pos2(right.max(left + 1.0), frame.top() + origin_mark::HEIGHT),
    );
    let painter = ui.painter().with_clip_rect(bar.intersect(frame));
    let palette = theme::palette(ui.ctx());
    painter.rect_filled(bar, 0.0, palette.background);
    let width = origin_mark::size(&painter, shown.origin).x;
    let step = width + ORIGIN_SPACING;
    let count = ((bar.width() - width) / step).floor();
    let line = [bar.left_center(), bar.right_center()];
    painter.line_segment(line, Stroke::new(2.0, palette.text));
    if count < 0.0 {
        // No room for letters: a dark bar, as nothing live has one.
        painter.rect_filled(bar, 0.0, palette.text);
        return;
    }
    for number in 0..=count as u32 {
        let at = pos2(bar.left() + number as f32 * step, bar.center().y);
        origin_mark::paint(&painter, at, Align2::LEFT_CENTER, shown.origin);
    }
}

/// Stripes over a time in which the value was not good: dense where it was not known.
fn stripes(ui: &Ui, transform: &PlotTransform, interval: &QualityInterval, span: f64) {
    let [left, right] = [interval.from.max(-span), interval.to]
        .map(|at| transform.position_from_point(&PlotPoint::new(at, 0.0)).x);
    let frame = *transform.frame();
    let place = Rect::from_x_y_ranges(left..=right.max(left + 1.0), frame.y_range());
    let mark = match interval.line.is_empty() {
        true => ValueMark::Bad { reason: String::new() },
        false => ValueMark::Uncertain { reason: String::new() },
    };
    quality_hatching::draw_stripes(&ui.painter().with_clip_rect(frame), place, &mark);
}

/// A time in which a value was good, or was not.
#[derive(Clone, Debug, PartialEq)]
struct QualityInterval {
    from: f64,
    to: f64,
    is_good: bool,
    /// The value: steps, for each value holds until the next. Empty where it is not known.
    line: Vec<PlotPoint>,
}

/// The times of a trend, one after the other.
fn quality_intervals(points: &[TrendPoint]) -> Vec<QualityInterval> {
    let mut quality_intervals: Vec<QualityInterval> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let to = points.get(index + 1).map_or(0.0, |next| next.at);
        let (value, is_good) = match point.state {
            TrendState::Good(value) => (Some(value), true),
            TrendState::Uncertain(value) => (Some(value), false),
            TrendState::Bad => (None, false),
        };
        let continues = |interval: &&mut QualityInterval| {
            interval.is_good == is_good && interval.line.is_empty() == value.is_none()
        };
        let interval = match quality_intervals.last_mut().filter(continues) {
            Some(interval) => interval,
            None => {
                quality_intervals.push(QualityInterval {
                    from: point.at,
                    to,
                    is_good,
                    line: Vec::new(),
                });
                let Some(interval) = quality_intervals.last_mut() else { continue };
                interval
            }
        };
        interval.to = to;
        if let Some(value) = value {
            interval.line.extend([point.at, to].map(|at| PlotPoint::new(at, value)));
        }
    }
    quality_intervals
}

/// The values that are shown: all of the trend with some air, and no less than a
/// thousandth of their size, so that noise does not look like a fault.
fn value_range(trend: &Trend) -> [f64; 2] {
    let numbers = trend.points.iter().filter_map(|point| match point.state {
        TrendState::Good(value) | TrendState::Uncertain(value) => Some(value),
        TrendState::Bad => None,
    });
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    numbers.for_each(|value| (low, high) = (low.min(value), high.max(value)));
    if low > high {
        return [0.0, 1.0];
    }
    let least = (low.abs().max(high.abs()) * 1e-3).max(1e-6);
    let margin = ((high - low) * 0.08).max(least);
    [low - margin, high + margin]
}

/// Values that have a line and a number: two to four round ones.
fn value_marks((low, high): (f64, f64)) -> Vec<GridMark> {
    let rough = (high - low) / 3.0;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10_f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough);
    let step = factor.unwrap_or(10.0) * power;
    let first = (low / step).ceil();
    let count = ((high / step).floor() - first).clamp(0.0, 8.0) as usize;
    let mark = |index| GridMark { value: (first + index as f64) * step, step_size: step };
    (0..=count).map(mark).collect()
}

/// A number as exactly as its steps need.
fn number_text(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    if value.abs() >= 1e6 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

fn time_step(span: f64) -> f64 {
    let fits = |step: &&f64| span / **step <= MAX_TIME_LINES;
    TIME_STEPS.iter().find(fits).copied().unwrap_or(TIME_STEPS[TIME_STEPS.len() - 1])
}

/// A time of day of the local clock.
fn clock_text(local_seconds: f64) -> String {
    let minutes = (local_seconds.rem_euclid(SECONDS_PER_DAY) / 60.0 + 1e-6) as u32;
    format!("{:02}:{:02}", minutes / 60 % 24, minutes % 60)
}

#[cfg(test)]
mod tests {
    use egui::Color32;

    use super::*;

    fn trend(points: &[(f64, TrendState)]) -> Trend {
        let point = |&(at, state): &(f64, TrendState)| TrendPoint { at, state };
        Trend { points: points.iter().map(point).collect(), ..Trend::default() }
    }

    #[test]
    fn an_interval_of_bad_quality_is_a_separate_gap() {
        let of = trend(&[
            (-9.0, TrendState::Good(1.0)),
            (-8.0, TrendState::Good(2.0)),
            (-7.0, TrendState::Bad),
            (-5.0, TrendState::Uncertain(2.0)),
            (-4.0, TrendState::Good(2.0)),
        ]);
        let quality_intervals = quality_intervals(&of.points);
        let times: Vec<(f64, f64, bool, usize)> =
            quality_intervals.iter().map(|p| (p.from, p.to, p.is_good, p.line.len())).collect();
        let expected = [
            (-9.0, -7.0, true, 4),
            (-7.0, -5.0, false, 0),
            (-5.0, -4.0, false, 2),
            (-4.0, 0.0, true, 2),
        ];
        assert_eq!(times, expected);
        assert_eq!(
            quality_intervals[0].line[1],
            PlotPoint::new(-8.0, 1.0),
            "a value holds until the next"
        );
    }

    #[test]
    fn value_ranges_have_a_margin_and_noise_stays_small() {
        let [low, high] =
            value_range(&trend(&[(-1.0, TrendState::Good(10.0)), (0.0, TrendState::Good(20.0))]));
        assert!(low < 10.0 && high > 20.0 && high - low < 13.0);
        let [low, high] = value_range(&trend(&[(-1.0, TrendState::Good(1000.0))]));
        assert!(high - low >= 2.0, "{low} to {high}");
        assert_eq!(value_range(&trend(&[(-1.0, TrendState::Bad)])), [0.0, 1.0]);
    }

    #[test]
    fn axes_have_few_round_numbers() {
        let marks = |low, high| -> Vec<String> {
            let text = |mark: &GridMark| number_text(mark.value, mark.step_size);
            value_marks((low, high)).iter().map(text).collect()
        };
        assert_eq!(marks(49.93, 50.08), ["49.95", "50.00", "50.05"]);
        assert_eq!(marks(0.0, 100.0), ["0", "50", "100"]);
        assert_eq!(marks(1.0, 1.0), [""; 0]);
        assert_eq!(time_step(600.0), 120.0);
        assert_eq!(time_step(4.0 * 3600.0), 3600.0);
        assert_eq!(clock_text(86_400.0 * 19_000.0 + 3600.0 * 23.5), "23:30");
    }

    #[test]
    fn colours_of_curves_are_not_those_of_alarms() {
        for palette in [theme::LIGHT, theme::DARK] {
            let grey = |color: Color32| color.r() == color.g() && color.g() == color.b();
            assert!(grey(palette.text) && grey(palette.hatch));
        }
    }
}
