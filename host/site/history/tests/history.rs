//! Retention and downsampling of histories over a long time.

use std::time::Duration;

use busbar_history::{BUCKET, History, MAX_AGE, MAX_FINE_POINTS, MAX_TAGS, Point, PointState};
use busbar_tags::{Change, Moment, TagHandle};
use busbar_types::{Origin, Quality, Reason, Value};
use proptest::prelude::*;

const TAG: TagHandle = TagHandle(3);
const START: Moment = Moment(1 << 63);

fn after(seconds: f64) -> Moment {
    START.after(Duration::from_secs_f64(seconds))
}

fn note(history: &mut History, seconds: f64, value: f64, quality: Quality) {
    let value = Some(Value::F64(value));
    let (received, origin) = (after(seconds), Origin::LIVE);
    history.note(&Change { tag: TAG, value, quality, source_time: None, received, origin });
}

fn noted(values: &[(f64, f64, Quality)]) -> History {
    let mut history = History::new([TAG]);
    values.iter().for_each(|&(at, value, quality)| note(&mut history, at, value, quality));
    history
}

#[test]
fn one_spike_in_hours_is_in_every_picture_of_them() {
    let mut history = History::new([TAG]);
    let hours = MAX_AGE.as_secs();
    for second in 0..hours {
        let value = if second == 600 { 99.0 } else { (second % 7) as f64 };
        note(&mut history, second as f64, value, Quality::Good);
    }
    for columns in [1, 10, 300] {
        let points = history.between(TAG, START, after(hours as f64), columns);
        assert!(
            points.iter().any(|point| point.state == PointState::Good(99.0)),
            "{columns} columns"
        );
        assert!(points.len() <= 5 * columns + 5, "{} points", points.len());
    }
}

#[test]
fn a_short_fault_hours_ago_is_still_a_gap() {
    let mut history = History::new([TAG]);
    for second in 0..3 * 3600 {
        let quality = match second {
            1000 => Quality::Bad(Reason::Sensor),
            _ => Quality::Good,
        };
        note(&mut history, f64::from(second), 1.0, quality);
    }
    let points = history.between(TAG, START, after(3.0 * 3600.0), 300);
    let gap = points.iter().find(|point| point.state == PointState::Bad).expect("the gap is there");
    assert_eq!(gap.at, after(1000.0));
    let end = points.iter().find(|point| point.at > gap.at).expect("it ends");
    assert!(end.at.since(gap.at) <= BUCKET, "at most a bucket longer than it was");
    assert!(end.state.is_good());
}

#[test]
fn a_window_begins_with_what_was_before_it() {
    let history = noted(&[(0.0, 5.0, Quality::Good), (100.0, 6.0, Quality::Good)]);
    let points = history.between(TAG, after(50.0), after(200.0), 100);
    let expected = [
        Point { at: after(50.0), state: PointState::Good(5.0) },
        Point { at: after(100.0), state: PointState::Good(6.0) },
    ];
    assert_eq!(points, expected);
    let points = history.between(TAG, after(150.0), after(200.0), 100);
    assert_eq!(points, [Point { at: after(150.0), state: PointState::Good(6.0) }]);
    assert_eq!(history.between(TagHandle(0), after(0.0), after(9.0), 9), []);
}

#[test]
fn memory_is_bounded_by_tags_time_and_points() {
    let mut history = History::new((0..2 * MAX_TAGS as u32).map(TagHandle));
    assert!(
        history.has(TagHandle(MAX_TAGS as u32 - 1)) && !history.has(TagHandle(MAX_TAGS as u32))
    );
    // Twice as long as it goes back, ten values a second, each worse than the last.
    for tenth in 0..2 * MAX_AGE.as_secs() * 10 {
        let value = (tenth % 997) as f64;
        let quality = match tenth % 11 {
            0 => Quality::Bad(Reason::Sensor),
            1 => Quality::Uncertain(Reason::OutOfRange),
            _ => Quality::Good,
        };
        note(&mut history, tenth as f64 / 10.0, value, quality);
    }
    let limit = (MAX_FINE_POINTS + 5 * (MAX_AGE.as_secs() / BUCKET.as_secs()) as usize + 128) * 16;
    assert!(history.bytes() <= limit, "{} bytes of {limit}", history.bytes());
    let end = after(2.0 * MAX_AGE.as_secs_f64());
    let first = history.between(TAG, START, end, 1000)[0];
    assert!(end.since(first.at) <= MAX_AGE + BUCKET, "nothing older is kept");
}

proptest! {
    /// Whatever came: a picture is in order, within its window, and has both extremes.
    #[test]
    fn pictures_keep_order_and_extremes(
        steps in prop::collection::vec((0.0..90.0f64, -1e6..1e6f64, 0..4u8), 1..2000),
        columns in 1..200usize,
    ) {
        let mut history = History::new([TAG]);
        let (mut at, mut states) = (0.0, Vec::new());
        for (step, value, quality) in steps {
            at += step;
            let (quality, number) = match quality {
                0 => (Quality::Bad(Reason::Communication), None),
                1 => (Quality::Uncertain(Reason::OutOfRange), Some(value)),
                _ => (Quality::Good, Some(value)),
            };
            states.push((after(at), number));
            note(&mut history, at, value, quality);
        }
        // What is older may be forgotten; what is reduced is exact from bucket to bucket.
        let end = after(at);
        let oldest = end.before(MAX_AGE).after(2 * BUCKET).min(end);
        let from = Moment(oldest.0 - oldest.0 % BUCKET.as_nanos() as u64);
        let points = history.between(TAG, from, end, columns);
        prop_assert!(points.windows(2).all(|pair| pair[0].at <= pair[1].at));
        prop_assert!(points.iter().all(|point| point.at >= from && point.at <= end));
        // What held at the beginning counts.
        let first = states.partition_point(|(at, _)| *at <= from).saturating_sub(1);
        let within = || states[first..].iter().filter_map(|(_, number)| *number);
        let shown: Vec<f64> = points.iter().filter_map(|point| point.state.number()).collect();
        for extreme in [within().reduce(f64::min), within().reduce(f64::max)].into_iter().flatten() {
            prop_assert!(shown.contains(&extreme), "{extreme} is not shown");
        }
    }
}
