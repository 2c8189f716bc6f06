//! Time that nobody saw: start, gaps, clocks that jump, replay.

use busbar_plugin_sdk::Origin;

use super::*;

#[test]
fn a_first_sample_is_no_history() {
    // Hours at 0.3, then 1.5 in the first frame: 165 °C in a steady state, true 46.
    let mut bench = Bench::example();
    let drawing = bench.at_load(0, 1.5);
    let [low, high] = bounds(&drawing.lines[1]);
    let [_, truth] = exact(&[(1e5, 0.3), (1.0, 1.5)]);
    assert!(low < truth && truth < high && high > 165.0, "{low} {truth} {high}");
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    assert!(reason(&drawing).contains("before the first value was not seen"));
}

#[test]
fn the_value_is_good_once_both_solutions_agree() {
    let mut bench = Bench::example();
    let mut minutes = 0;
    let is_between = |line: &DrawnLine| line.text.starts_with("between");
    while bench.at_load(1, 0.8).lines[..2].iter().any(is_between) {
        minutes += 1;
        assert!(minutes < 12 * 60);
    }
    // Not at once, and not never.
    assert!(minutes > 5 * 60, "{minutes}");
    let drawing = bench.at_load(0, 0.8);
    assert_near(degrees(&drawing), exact(&[(1e5, 0.8)]));
    assert_eq!(verdict(&drawing), Verdict::Normal);
}

#[test]
fn a_verdict_that_both_solutions_share_comes_before_the_value() {
    let mut bench = Bench::example();
    let mut drawing = bench.at_load(1, 0.3);
    while verdict(&drawing) == Verdict::Unknown {
        drawing = bench.at_load(1, 0.3);
    }
    assert_eq!(verdict(&drawing), Verdict::Normal);
    assert!(drawing.lines[1].text.starts_with("between"), "{}", drawing.lines[1].text);
}

#[test]
fn three_hours_with_a_bad_load_are_between_bounds() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.3);
    bench.run(180, &[None, Some(25.6)]);
    let drawing = bench.at_load(0, 1.5);
    let [_, truth] = exact(&[(1e5, 0.3), (180.0, 1.5)]);
    let [low, high] = bounds(&drawing.lines[1]);
    assert!(truth > 120.0 && low < truth && truth < high, "{low} {truth} {high}");
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    let during = bench.run(1, &[None, Some(25.6)]);
    assert!(reason(&during).contains("load (T1.load) is bad"), "{}", reason(&during));
}

#[test]
fn a_load_that_is_not_seen_may_be_above_its_limit() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.3);
    let drawing = bench.run(2, &[None, Some(25.6)]);
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    for words in ["load between 0.00 and 2.00 p.u.: load (T1.load) is", "load not seen 0 to 2 p.u."]
    {
        assert!(reason(&drawing).contains(words), "{}", reason(&drawing));
    }
    // It rests on what is good, or the host would take it back.
    assert_eq!(drawing.verdict(0).unwrap().basis, [1]);
    // A plausible load that the limit allows leaves temperatures alone to decide.
    let settings = format!(r#"{EXAMPLE}, "plausible_load": [0.0, 1.2]"#);
    let mut bench = Bench::new(&settings, "", &[("load", "A"), ("ambient", "°C")]);
    bench.at_load(24 * 60, 0.3);
    assert_eq!(verdict(&bench.run(2, &[None, Some(25.6)])), Verdict::Normal);
}

#[test]
fn three_hours_without_a_frame_are_between_bounds() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.3);
    bench.minute += 180;
    let drawing = bench.at_load(0, 0.3);
    let [_, truth] = exact(&[(1e5, 0.3), (180.0, 1.5)]);
    let [low, high] = bounds(&drawing.lines[1]);
    assert!(low < truth && truth < high, "{low} {truth} {high}");
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    assert!(reason(&drawing).contains("180 minutes were not seen"), "{}", reason(&drawing));
}

#[test]
fn a_load_above_the_plausible_ones_is_not_forgotten_in_a_gap() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.3);
    bench.at_load(2, 2.4);
    let drawing = bench.run(60, &[None, Some(25.6)]);
    let [_, truth] = exact(&[(1e5, 0.3), (62.0, 2.4)]);
    let [low, high] = bounds(&drawing.lines[1]);
    assert!(low < truth && truth < high + 0.1, "{low} {truth} {high}");
}

#[test]
fn an_ambient_temperature_that_is_bad_is_between_bounds() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.9);
    let drawing = bench.run(12 * 60, &[Some(360.0), None]);
    let [low, high] = bounds(&drawing.lines[0]);
    let [at_25, _] = exact(&[(1e5, 0.9)]);
    assert!(
        (low - (at_25 - 25.6 - 25.0)).abs() < 0.2 && (high - (at_25 - 25.6 + 40.0)).abs() < 0.2
    );
}

#[test]
fn in_replay_time_is_that_of_the_recording() {
    // At 1,000 times the speed a frame comes each 100 s of the recording.
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.3);
    let start = START + bench.minute * MINUTE;
    let mut drawing = Drawing::default();
    for frame in 1..=108_i64 {
        let values = [600.0, 25.6].map(|number| TagValue {
            value: Some(Value::F64(number)),
            quality: Quality::Good,
            age: Duration::ZERO,
            origin: Origin::LIVE,
        });
        let now = start + frame * 100_000_000_000;
        drawing = draw_at(&mut bench.overlay, None, &values, now).unwrap();
    }
    assert_near(degrees(&drawing), exact(&[(1e5, 0.3), (180.0, 1.5)]));
    assert_eq!(verdict(&drawing), Verdict::Abnormal);
}

#[test]
fn a_clock_that_is_set_back_widens_the_band() {
    let mut bench = Bench::example();
    bench.at_load(24 * 60, 0.3);
    // By a second of a time service: hardly.
    let near = {
        let mut other = Bench::example();
        other.at_load(24 * 60, 0.3);
        other.minute -= 1;
        other.at_load(0, 0.3)
    };
    let width = |drawing: &Drawing| bounds(&drawing.lines[0])[1] - bounds(&drawing.lines[0])[0];
    assert!(width(&near) < 5.0, "{}", near.lines[0].text);
    // By hours, as a replay is: anything plausible was then.
    bench.minute -= 20 * 60;
    let drawing = bench.at_load(0, 0.3);
    let [low, high] = bounds(&drawing.lines[1]);
    let [_, truth] = exact(&[(1e5, 1.5)]);
    assert!(low < 30.0 && high > truth, "{low} {high}");
    assert_eq!(verdict(&drawing), Verdict::Unknown);
    assert!(reason(&drawing).contains("set back"), "{}", reason(&drawing));
    assert_near(degrees(&bench.at_load(20 * 60, 0.3)), exact(&[(1e5, 0.3)]));
}

#[test]
fn a_clock_that_stands_still_changes_nothing() {
    let mut bench = Bench::example();
    let before = degrees(&bench.at_load(24 * 60, 0.5));
    for _ in 0..100 {
        bench.at_load(0, 1.5);
    }
    assert_eq!(degrees(&bench.at_load(0, 1.5)), before);
}

#[test]
fn clocks_at_their_ends_do_no_harm() {
    for clocks in [[i64::MIN, i64::MAX], [i64::MAX, i64::MIN], [0, -1], [i64::MAX, i64::MAX]] {
        let mut bench = Bench::example();
        bench.draw(&[Some(100.0), Some(20.0)]);
        for now in clocks {
            let values = [100.0, 20.0].map(|number| TagValue {
                value: Some(Value::F64(number)),
                quality: Quality::Good,
                age: Duration::ZERO,
                origin: Origin::LIVE,
            });
            let drawing = draw_at(&mut bench.overlay, None, &values, now).unwrap();
            let [low, high] = bounds(&drawing.lines[1]);
            assert!(low.is_finite() && high.is_finite() && low <= high, "{clocks:?}");
        }
    }
}

/// A history of simulated, recorded or test values is one of another plant than the real one.
#[test]
fn a_history_of_another_origin_says_nothing_of_live_values() {
    for origin in [Origin::SIMULATED, Origin::RECORDED, Origin::TEST | Origin::SIMULATED] {
        let mut bench = Bench::example();
        let hour = |bench: &mut Bench, current: f64, origin| {
            let mut drawing = Drawing::default();
            for _ in 0..60 {
                bench.minute += 1;
                let values = [current, 25.6].map(|number| TagValue {
                    value: Some(Value::F64(number)),
                    quality: Quality::Good,
                    age: Duration::ZERO,
                    origin,
                });
                let now = START + bench.minute * MINUTE;
                let bindings = bench.bindings.take();
                drawing = draw_at(&mut bench.overlay, bindings, &values, now).unwrap();
            }
            drawing
        };
        for _ in 0..24 {
            hour(&mut bench, 120.0, origin);
        }
        let simulated = hour(&mut bench, 120.0, origin);
        assert_eq!(verdict(&simulated), Verdict::Normal, "{origin}");
        // Live values follow: at the least and at the greatest load before, they differ.
        let live = hour(&mut bench, 440.0, Origin::LIVE);
        assert_eq!(verdict(&live), Verdict::Unknown, "{origin}");
        assert!(reason(&live).contains("another origin"), "{}", reason(&live));
        // A value that a person put in place of a measured one is of the same plant.
        for _ in 0..24 {
            hour(&mut bench, 120.0, Origin::LIVE);
        }
        assert_eq!(verdict(&hour(&mut bench, 120.0, Origin::SUBSTITUTED)), Verdict::Normal);
        let back = hour(&mut bench, 440.0, origin);
        assert_eq!(verdict(&back), Verdict::Unknown, "{origin}");
    }
}
