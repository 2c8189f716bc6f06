//! A board against a plain filter, and what it looks like.

use std::collections::BTreeSet;
use std::sync::Arc;

use busbar_chart::{
    Action, Axis, BINS, Band, Brush, BrushOperator, Description, Layout, ParallelCoordinates,
    Record, Records, Size, State, bin_edges, bin_index, bin_pairs, nearest,
};
use busbar_types::Pattern;

const SIZE: Size = Size { width: 20.0, height: 8.0, depth: 10.0 };
const DAY: i64 = 86_400_000_000_000;

fn description() -> Description {
    let axis = |name: &str, log, low, high| Axis {
        name: name.into(),
        unit: "ppm".into(),
        log,
        low,
        high,
        detection_limit: Some(low * 2.0),
        bands: vec![Band {
            name: "above the limit".into(),
            from: Some(high / 2.0),
            to: None,
            is_abnormal: true,
        }],
    };
    let state = |name: &str, is_abnormal| State {
        name: name.into(),
        color: [200, 30, 20],
        pattern: if is_abnormal { Pattern::Striped } else { Pattern::Solid },
        is_abnormal,
    };
    Description {
        name: "test".into(),
        axes: vec![
            axis("a", true, 0.1, 1000.0),
            axis("b", true, 1.0, 1e5),
            axis("c", false, 0.0, 10.0),
        ],
        legend: vec![state("normal", false), state("faulty", true)],
        equipment: (0..10).map(|i| format!("=T{i}")).collect(),
        valid_seconds: 100 * 86_400,
    }
}

/// Seeded records of ten pieces of equipment, a day apart; some have no value.
fn chart(count: usize, seed: u64) -> ParallelCoordinates {
    let description = description();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut records = Records::new(&description);
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for index in 0..count {
        let equipment = (index % 10) as u32;
        let unix_nanos = (index / 10) as i64 * DAY;
        rows.push(Record { unix_nanos, equipment, state: u32::from(random.u8(..) < 60) });
        for axis in &description.axes {
            let share = random.f32() * 1.2 - 0.1;
            let value = match axis.log {
                true => (axis.low.ln() + share * (axis.high / axis.low).ln()).exp(),
                false => axis.low + share * (axis.high - axis.low),
            };
            values.push(if random.u8(..) < 20 { f32::NAN } else { value });
        }
    }
    records.append(&rows, &values, 2).expect("they fit");
    let mut chart = ParallelCoordinates::new(SIZE);
    chart.set_data(Arc::new(description), records);
    chart
}

fn ranges(axis: usize, ranges: &[[f32; 2]], with_missing: bool) -> Action {
    let brush = Brush::Ranges { axis, ranges: ranges.to_vec(), with_missing };
    Action::AddBrush { brush, alone: false }
}

fn brushed(chart: &ParallelCoordinates) -> Vec<bool> {
    (0..chart.records().len()).map(|record| chart.is_brushed(record)).collect()
}

#[test]
fn brushes_mean_what_a_plain_filter_means() {
    let mut chart = chart(5000, 7);
    chart.apply(&ranges(0, &[[1.0, 20.0]], false));
    chart.apply(&ranges(0, &[[300.0, 400.0]], false));
    chart.apply(&ranges(2, &[[2.0, 7.0]], true));
    let on_0 = |v: f32| (1.0..=20.0).contains(&v) || (300.0..=400.0).contains(&v);
    let on_2 = |v: f32| (2.0..=7.0).contains(&v) || v.is_nan();
    for operator in [BrushOperator::And, BrushOperator::Or] {
        chart.apply(&Action::SetBrushOperator(operator));
        let plain: Vec<bool> = (0..chart.records().len())
            .map(|record| {
                let row = chart.records().row(record);
                match operator {
                    BrushOperator::And => on_0(row[0]) && on_2(row[2]),
                    BrushOperator::Or => on_0(row[0]) || on_2(row[2]),
                }
            })
            .collect();
        assert_eq!(brushed(&chart), plain);
        assert!(plain.iter().any(|meant| *meant) && plain.iter().any(|meant| !meant));
    }
    let lines = chart.csv().lines().count();
    assert_eq!(lines, 1 + chart.brushed().count());
    chart.apply(&Action::ClearBrushes);
    assert_eq!(chart.brushed().count(), 0);
}

#[test]
fn a_rise_is_an_angle_between_axes_as_they_are_shown() {
    let mut chart = chart(2000, 8);
    let brush = Brush::Rise { axes: [0, 1], range: [0.3, 1.0] };
    chart.apply(&Action::AddBrush { brush, alone: false });
    let plain = |chart: &ParallelCoordinates| -> Vec<bool> {
        let views = chart.order();
        let rises = |row: &[f32]| {
            let from = views.iter().find(|view| view.axis == 0).unwrap().position(row[0])?;
            let to = views.iter().find(|view| view.axis == 1).unwrap().position(row[1])?;
            Some(to - from >= 0.3)
        };
        (0..chart.records().len()).map(|r| rises(chart.records().row(r)) == Some(true)).collect()
    };
    let upright = plain(&chart);
    assert_eq!(brushed(&chart), upright);
    chart.apply(&Action::FlipAxis(0));
    assert_eq!(brushed(&chart), plain(&chart));
    assert_ne!(brushed(&chart), upright);
}

#[test]
fn a_brush_drawn_on_an_axis_takes_in_what_is_seen_there() {
    let chart = chart(3000, 9);
    for (shown, flipped) in [(0, false), (2, false), (0, true)] {
        let mut chart = chart.clone();
        if flipped {
            chart.apply(&Action::FlipAxis(shown));
        }
        let view = chart.shown_axes()[shown];
        let brush = chart.brush_at(shown, [0.8, 1.0]).unwrap();
        chart.apply(&Action::AddBrush { brush, alone: true });
        for record in 0..chart.records().len() {
            let position = view.position(chart.records().row(record)[view.axis]);
            let is_inside = position.is_some_and(|position| position > 0.8 + 1e-5);
            let is_outside = position.is_none_or(|position| position < 0.8 - 1e-5);
            assert!(!is_inside || chart.is_brushed(record), "{position:?}");
            assert!(!is_outside || !chart.is_brushed(record), "{position:?}");
        }
    }
    let missing = chart.brush_at(1, [-0.1, -0.05]).unwrap();
    assert_eq!(missing, Brush::Ranges { axis: 1, ranges: vec![], with_missing: true });
}

#[test]
fn records_too_old_do_not_speak_for_their_equipment() {
    let mut chart = chart(50, 10);
    let state = |chart: &ParallelCoordinates, now| {
        chart.known(now).map(|known| known.state).collect::<Vec<_>>()
    };
    let last = 4 * DAY;
    assert!(state(&chart, last + 100 * DAY).iter().all(Option::is_some));
    assert!(state(&chart, last + 101 * DAY).iter().all(Option::is_none));
    // At the playhead it was known, and later records were not.
    chart.apply(&Action::SetPlayhead(Some(2 * DAY)));
    let known: Vec<_> = chart.known(last + 101 * DAY).collect();
    assert!(known.iter().all(|known| known.state.is_some() && known.age_nanos == 0));
    assert!(known.iter().all(|known| chart.records().all()[known.record].unix_nanos == 2 * DAY));
    chart.apply(&Action::SetPlayhead(Some(-DAY)));
    assert_eq!(chart.known(0).count(), 0);
}

#[test]
fn brushed_equipment_is_that_whose_last_known_record_is_meant() {
    let mut chart = chart(200, 11);
    chart.apply(&ranges(2, &[[0.0, 5.0]], false));
    let plain: Vec<usize> = (0..10)
        .filter(|equipment| {
            let record = 190 + equipment;
            (0.0..=5.0).contains(&chart.records().row(record)[2])
        })
        .collect();
    assert!(!plain.is_empty() && plain.len() < 10);
    assert_eq!(chart.brushed_equipment(i64::MAX), plain);
}

#[test]
fn each_line_goes_through_the_values_of_its_record() {
    let mut chart = chart(30, 12);
    for layout in [Layout::Flat, Layout::Focus, Layout::Time] {
        chart.apply(&Action::SetLayout(layout));
        let shape = chart.shape(i64::MAX);
        let own = |record: u32| shape.strokes.iter().filter(move |s| s.record == record);
        for record in 0..30 {
            let between = own(record).filter(|s| s.from[0] != s.to[0] || s.from[2] == s.to[2]);
            assert!(between.count() >= 2, "{layout:?} {record}");
            let row = chart.records().row(record as usize);
            let first = own(record).find(|s| s.from[..2] != s.to[..2]).unwrap();
            let view = chart.shown_axes()[0];
            let height = view.position(row[0]).unwrap_or(-8.5 / BINS as f32) * SIZE.height;
            let on_first = own(record).any(|s| (s.from[1] - height).abs() < 1e-4);
            assert!(on_first, "{layout:?} {record}: {first:?} {height}");
        }
        assert_eq!(shape.axes.len(), 3);
    }
}

#[test]
fn the_line_under_the_pointer_is_found_and_what_is_in_front_first() {
    let mut chart = chart(30, 13);
    chart.select(BTreeSet::from([3]));
    let shape = chart.shape(i64::MAX);
    let project = |[x, y, _]: [f32; 3]| Some([x * 10.0, y * 10.0]);
    for stroke in shape.strokes.iter().filter(|stroke| stroke.record != u32::MAX) {
        let middle = [0, 1].map(|i| (stroke.from[i] + stroke.to[i]) * 5.0);
        let found = nearest(&shape, project, middle, 0.01).unwrap();
        let is_there = shape.strokes.iter().filter(|s| s.record as usize == found).any(|s| {
            let [dx, dy] = [0, 1].map(|i| (s.to[i] - s.from[i]) * 10.0);
            let [px, py] = [0, 1].map(|i| middle[i] - s.from[i] * 10.0);
            (dx * py - dy * px).abs() / dx.hypot(dy) < 0.02
        });
        assert!(is_there);
    }
    assert_eq!(nearest(&shape, project, [-500.0, 0.0], 5.0), None);
    let last = shape.strokes.last().unwrap().record as usize;
    assert_eq!(chart.records().all()[last].equipment, 3, "what is selected is drawn last");
}

#[test]
fn counts_of_bins_are_those_of_lines() {
    let chart = chart(4000, 14);
    let views = chart.shown_axes();
    let pairs = Layout::Flat.pairs(views.len());
    let counts = bin_pairs(chart.records(), &views, &pairs, |_| true);
    let side = BINS + 1;
    assert_eq!(counts.len(), 2 * side * side);
    assert!(counts.chunks(side * side).all(|pair| pair.iter().sum::<u32>() == 4000));
    // A bin holds what lies between its edges, wherever rounding puts them.
    for view in &views {
        let edges = bin_edges(view);
        assert!(edges.is_sorted());
        for record in 0..chart.records().len() {
            let value = chart.records().row(record)[view.axis];
            match bin_index(value, &edges) {
                BINS => assert!(value.is_nan()),
                bin => {
                    assert!(bin == 0 || edges[bin - 1] <= value);
                    assert!(bin == BINS - 1 || value < edges[bin]);
                }
            }
        }
    }
}

#[test]
fn axes_are_moved_hidden_turned_and_rescaled() {
    let mut chart = chart(100, 15);
    let axes =
        |chart: &ParallelCoordinates| chart.shown_axes().iter().map(|v| v.axis).collect::<Vec<_>>();
    chart.apply(&Action::MoveAxis { from: 0, to: 2 });
    assert_eq!(axes(&chart), [1, 2, 0]);
    chart.apply(&Action::HideAxis(1));
    assert_eq!(axes(&chart), [1, 0]);
    chart.apply(&Action::HideAxis(0));
    assert_eq!(axes(&chart), [1, 0], "two axes always stay");
    chart.apply(&Action::HideAxis(1));
    assert_eq!(axes(&chart), [1, 2, 0]);
    chart.apply(&ranges(0, &[[2.0, 30.0]], false));
    chart.apply(&Action::Rescale(2));
    let view = chart.order()[2];
    assert!(view.axis == 0 && view.low >= 2.0 && view.high <= 30.0 && view.low < view.high);
    chart.apply(&Action::ClearBrushes);
    chart.apply(&Action::Rescale(2));
    assert_eq!((chart.order()[2].low, chart.order()[2].high), (0.1, 1000.0));
    chart.apply(&Action::SwitchScale(2));
    assert!(!chart.order()[2].log);
    // Out of range: nothing happens.
    let before = chart.revision();
    chart.apply(&Action::MoveAxis { from: 0, to: 9 });
    chart.apply(&Action::FlipAxis(9));
    chart.apply(&Action::RemoveBrush(4));
    assert!(chart.revision() > before && axes(&chart) == [1, 2, 0]);
}

#[test]
fn wrong_records_are_refused_whole() {
    let description = description();
    let record = |unix_nanos, equipment, state| Record { unix_nanos, equipment, state };
    let refused = |rows: &[Record], values: &[f32], why: &str| {
        let mut records = Records::new(&description);
        records.append(&[record(5, 1, 0)], &[1.0; 3], 2).unwrap();
        let before = records.clone();
        let fault = records.append(rows, values, 2).unwrap_err();
        assert!(fault.to_string().contains(why), "{fault}");
        assert_eq!(records, before);
    };
    refused(&[record(6, 1, 0)], &[1.0; 4], "more or fewer values");
    refused(&[record(6, 10, 0)], &[1.0; 3], "equipment or a state");
    refused(&[record(6, 1, 2)], &[1.0; 3], "equipment or a state");
    refused(&[record(6, 1, 0)], &[f32::INFINITY, 1.0, 1.0], "infinite");
    refused(&[record(4, 1, 0)], &[1.0; 3], "order of time");
    refused(&[record(6, 2, 0), record(5, 2, 0)], &[1.0; 6], "order of time");
    let wrong = |change: fn(&mut Description), why: &str| {
        let mut description = description.clone();
        change(&mut description);
        let fault = description.check().unwrap_err();
        assert!(fault.to_string().contains(why), "{fault}");
    };
    assert_eq!(description.check(), Ok(()));
    wrong(|d| d.axes.truncate(1), "2 to 32");
    wrong(|d| d.axes[0].low = 0.0, "begins above 0");
    wrong(|d| d.axes[0].high = f32::NAN, "not finite");
    wrong(|d| d.axes[1].bands[0].from = Some(f32::INFINITY), "a limit is not finite");
    wrong(|d| d.legend.clear(), "its legend has 0 states");
    wrong(|d| d.equipment[0] = "x".repeat(200), "longer than");
}
