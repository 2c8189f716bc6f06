//! Pace, passes, bounds and times.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

use super::*;
use crate::comtrade::{DataType, Revision};

fn recipe() -> Recipe {
    Recipe::new(Revision::Of1999, DataType::Binary)
}

fn values(samples: &[Sample]) -> Vec<Option<Value>> {
    samples.iter().map(|sample| sample.value.clone()).collect()
}

#[test]
fn it_says_that_it_is_a_replay_and_then_that_it_has_ended() {
    let (_folder, cfg) = written(recipe());
    let running = start(&cfg, json!({}), all_tags());
    running.wait_for_link(LinkState::Up, "REPLAY, not live");
    running.wait_for_link(
        LinkState::Up,
        "of 2024-02-29T13:14:15Z, as fast as possible; times are shifted to now",
    );
    assert_eq!(running.played().len(), 20_000);
    for tag in all_tags() {
        assert_eq!(
            running.recorder.latest(tag.tag).unwrap(),
            Sample::bad(tag.tag, Reason::Communication)
        );
    }
}

#[test]
fn at_a_pace_it_takes_its_time_and_values_are_of_now() {
    let (_folder, cfg) = written(recipe());
    let started = (Instant::now(), SystemTime::now());
    // 0.52 s of recording.
    let running = start(&cfg, json!({"speed": 2, "max_updates_per_second": 20}), all_tags());
    let samples = running.played();
    let (took, ended) = (started.0.elapsed(), SystemTime::now());
    assert!(took >= Duration::from_secs_f64(recipe().seconds(1000) / 2.0), "{took:?}");
    let times: Vec<_> = of_tag(&samples, 0).iter().map(|s| s.source_time.unwrap()).collect();
    assert!(times.is_sorted());
    assert!(times[0] >= started.1 && times[times.len() - 1] <= ended);
    // 0.26 s at 20 a second, and the first.
    assert!((2..=8).contains(&times.len()), "{}", times.len());
    assert_eq!(of_tag(&samples, 0).last().unwrap().value, Some(Value::F64(current(1000))));
}

fn current(sample: u64) -> f64 {
    recipe().analogs(sample)[0].unwrap() * 0.5 - 3.0
}

#[test]
fn no_digital_change_is_lost_by_decimation() {
    let (_folder, cfg) = written(recipe());
    let running = start(&cfg, json!({"max_updates_per_second": 1}), all_tags());
    let samples = running.played();
    assert!(of_tag(&samples, 0).len() < 5);
    for channel in 0..10 {
        let states: Vec<_> = (1..=1000).map(|sample| Recipe::digital(sample, channel)).collect();
        let mut changes: Vec<_> = states.iter().map(|&state| Some(Value::Bool(state))).collect();
        changes.dedup();
        let mut found = values(&of_tag(&samples, channel as u32 + 2));
        found.dedup();
        assert_eq!(found, changes, "channel {channel}");
    }
}

#[test]
fn it_plays_from_start_to_end() {
    for data in [DataType::Ascii, DataType::Binary] {
        for has_timestamps in [false, true] {
            let recipe = Recipe { has_timestamps, ..Recipe::new(Revision::Of1999, data) };
            let (_folder, cfg) = written(recipe);
            // In the middle between samples.
            let place = |sample: u64| recipe.seconds(sample) + 1e-5;
            let settings = json!({"start": place(299), "end": place(400)});
            let samples = start(&cfg, settings, all_tags()).played();
            let found = values(&of_tag(&samples, 0));
            let mut expected: Vec<_> = (300..=400).map(|s| Some(Value::F64(current(s)))).collect();
            if data == DataType::Ascii {
                // Text is read from its start: what was before holds at the start.
                expected.insert(0, Some(Value::F64(current(299))));
            }
            assert_eq!(found, expected, "{recipe:?}");
        }
    }
    let (_folder, cfg) = written(recipe());
    let settings = json!({"start": "2024-02-29T13:14:15.45Z", "end": "2024-02-29T13:14:15.451Z"});
    let samples = start(&cfg, settings, all_tags()).played();
    // 2.25 samples of 1200 Hz.
    assert!((1..=2).contains(&of_tag(&samples, 0).len()));
    let nothing = start(&cfg, json!({"start": 3600}), all_tags());
    nothing.wait_for_link(LinkState::Down, "there is nothing to play between start and end");
}

#[test]
fn a_loop_begins_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.csv");
    std::fs::write(&file, "time,a\n0,1\n0.1,2\n0.2,3\n").unwrap();
    let tags = vec![tag_spec(1, "a", ValueKind::I64, json!({"column": "a"}))];
    let settings = json!({"loop": true, "speed": 20, "csv": {"time_format": "seconds"}});
    let running = start(&file, settings, tags);
    let enough =
        |seen: &Recording| seen.samples.iter().filter(|s| s.quality.is_good()).count() > 30;
    assert!(running.recorder.wait_until(PATIENCE, enough));
    let recording = running.recorder.recording();
    let good: Vec<_> = recording.samples.iter().filter(|s| s.quality.is_good()).collect();
    for (sample, number) in good.iter().zip((1..=3).cycle()) {
        assert_eq!(sample.value, Some(Value::I64(number)));
    }
    assert!(good.iter().map(|sample| sample.source_time).is_sorted());
    assert!(recording.links.iter().all(|(state, _)| *state != LinkState::Down));
}

#[test]
fn a_tag_without_a_value_at_the_start_is_bad_there_in_every_pass() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.csv");
    // The second tag has no value before 0.2 s: that of the end is not one of the start.
    std::fs::write(&file, "time,name,value\n0,a,1\n0.2,b,7\n0.4,a,2\n").unwrap();
    let tag = |tag, name: &str| tag_spec(tag, name, ValueKind::I64, json!({"name": name}));
    let csv = json!({"form": "long", "time_format": "seconds"});
    let settings = json!({"loop": true, "speed": 20, "csv": csv});
    let running = start(&file, settings, vec![tag(1, "a"), tag(2, "b")]);
    let passes =
        |seen: &Recording| seen.samples.iter().filter(|s| s.value == Some(Value::I64(7))).count();
    assert!(running.recorder.wait_until(PATIENCE, |seen| passes(seen) > 5));
    let samples = Vec::from(running.recorder.recording().samples);
    let second: Vec<_> = of_tag(&samples, 2).into_iter().map(|sample| sample.value).collect();
    for (index, value) in second.iter().enumerate() {
        assert_eq!(*value, [None, Some(Value::I64(7))][index % 2], "{second:?}");
    }
    let first = of_tag(&samples, 1);
    assert!(first.iter().skip(1).all(|sample| sample.quality.is_good()), "{first:?}");
}

#[test]
fn samples_that_are_missing_leave_a_gap() {
    for (data, has_timestamps) in
        [(DataType::Ascii, false), (DataType::Binary, false), (DataType::Ascii, true)]
    {
        let recipe = Recipe { has_timestamps, ..Recipe::new(Revision::Of1999, data) };
        let (folder, cfg) = written(recipe);
        let dat = recipe.dat();
        // Samples 300 to 309 are cut out.
        let cut = if data == DataType::Ascii {
            let lines = dat.split_inclusive(|byte| *byte == b'\n').enumerate();
            let kept = lines.filter(|(index, _)| !(299..309).contains(index));
            kept.flat_map(|(_, line)| line.to_vec()).collect()
        } else {
            let size = dat.len() / 1000;
            [&dat[..299 * size], &dat[309 * size..]].concat()
        };
        std::fs::write(folder.path().join("fault.dat"), cut).unwrap();
        let samples = start(&cfg, json!({}), all_tags()).played();
        for tag in all_tags() {
            let of_tag = of_tag(&samples, tag.tag);
            assert_eq!(of_tag.len(), 991, "{data:?}");
            assert_eq!(
                of_tag[299],
                Sample {
                    source_time: of_tag[299].source_time,
                    ..Sample::bad(tag.tag, Reason::Sensor)
                }
            );
            assert!(of_tag[298].value.is_some() && of_tag[300].value.is_some());
        }
    }
}

#[test]
fn original_times_are_those_of_the_recording() {
    let recipe = Recipe::new(Revision::Of1999, DataType::Binary);
    let (_folder, cfg) = written(recipe);
    let settings = json!({"times": "original", "utc_offset_minutes": -330});
    let samples = start(&cfg, settings, all_tags()).played();
    let first = of_tag(&samples, 0)[0].source_time.unwrap();
    let expected = Duration::from_millis(1_709_212_455_250) + Duration::from_secs(330 * 60);
    assert_eq!(first, UNIX_EPOCH + expected);
}

#[test]
fn times_that_no_value_can_have_are_refused() {
    for (date, part) in [
        ("01/01/1969", "it starts at 1969-01-01T13:14:15Z, before 1970 or in the future"),
        ("01/01/2200", "in the future: set times to now"),
        ("00/00/0000", "it has no dates: set times to now"),
    ] {
        let (folder, cfg) = written(recipe());
        std::fs::write(&cfg, recipe().cfg().replace("29/02/2024", date)).unwrap();
        let running = start(&cfg, json!({"times": "original"}), all_tags());
        running.wait_for_link(LinkState::Down, part);
        let now = start(&cfg, json!({}), all_tags());
        assert_eq!(now.played().len(), 20_000, "{date}");
        drop(folder);
    }
}

#[test]
fn values_are_of_the_side_that_is_asked_for() {
    let (_folder, cfg) = written(recipe());
    let ratios =
        [("primary", 1.0, 100.0), ("secondary", 1.0 / 120.0, 1.0), ("as_recorded", 1.0, 1.0)];
    for (side, current_ratio, voltage_ratio) in ratios {
        let samples = start(&cfg, json!({"values": side}), all_tags()).played();
        let value = |tag: u32, sample: usize| match &of_tag(&samples, tag)[sample - 1].value {
            Some(Value::F64(value)) => *value,
            other => panic!("{other:?}"),
        };
        let [raw_current, raw_voltage] = recipe().analogs(7).map(Option::unwrap);
        assert!((value(0, 7) - (raw_current * 0.5 - 3.0) * current_ratio).abs() < 1e-9, "{side}");
        assert!((value(1, 7) - raw_voltage / 512.0 * voltage_ratio).abs() < 1e-9, "{side}");
    }
}

#[test]
fn whole_numbers_and_positions_come_from_channels_too() {
    let (_folder, cfg) = written(recipe());
    let tags = vec![
        tag_spec(0, "I", ValueKind::I64, json!({"channel": 1})),
        tag_spec(1, "Q", ValueKind::DoublePoint, json!({"off": "D1", "on": 2})),
    ];
    let samples = start(&cfg, json!({}), tags).played();
    let whole = (1..=1000).map(|sample| Some(Value::I64(current(sample).round() as i64)));
    assert_eq!(values(&of_tag(&samples, 0)), whole.collect::<Vec<_>>());
    let positions = (1..=1000_u64)
        .map(|sample| Some(Value::DoublePoint(busbar_plugin_sdk::DoublePoint::from_bits(sample))));
    assert_eq!(values(&of_tag(&samples, 1)), positions.collect::<Vec<_>>());
}

#[test]
fn what_is_out_of_range_or_of_a_failed_clock_is_uncertain() {
    let of_2013 = Recipe::new(Revision::Of2013, DataType::Binary32);
    let (_folder, cfg) = written(of_2013);
    std::fs::write(
        &cfg,
        of_2013.cfg().replace("+1,+1\r\n0,0", "0,0\r\nF,1").replacen("30000", "500", 2),
    )
    .unwrap();
    let samples = start(&cfg, json!({}), all_tags()).played();
    for sample in of_tag(&samples, 0) {
        let Some(Value::F64(value)) = sample.value else { panic!("{sample:?}") };
        let raw = (value + 3.0) / 0.5;
        let reason = if raw.abs() > 500.0 { Reason::OutOfRange } else { Reason::Unknown };
        assert_eq!(sample.quality, Quality::Uncertain(reason), "{raw}");
    }
    assert!(of_tag(&samples, 2).iter().all(|s| s.quality == Quality::Uncertain(Reason::Unknown)));
}

#[test]
fn stopping_is_quick_and_starting_again_is_possible() {
    let (_folder, cfg) = written(recipe());
    let mut plugin = create(&cfg, json!({"speed": 0.1}));
    for _ in 0..3 {
        let recorder = Recorder::new();
        plugin.start(all_tags(), recorder.sink()).unwrap();
        let has_good = |seen: &Recording| seen.samples.iter().any(|s| s.quality.is_good());
        assert!(recorder.wait_until(PATIENCE, has_good));
        let stopped = Instant::now();
        plugin.stop();
        assert!(stopped.elapsed() < busbar_plugin_sdk::MAX_STOP);
    }
}

#[test]
fn a_channel_of_another_unit_than_its_tags_is_refused() {
    let (_folder, cfg) = written(recipe());
    let tag = |unit: &str| {
        let address = json!({"channel": "IA"});
        vec![TagSpec { unit: unit.into(), ..tag_spec(0, "T", ValueKind::F64, address) }]
    };
    for unit in ["A", "Amps", "", "apples"] {
        assert_eq!(start(&cfg, json!({}), tag(unit)).played().len(), 1000, "{unit}");
    }
    for unit in ["kA", "V"] {
        let fault = create(&cfg, json!({})).check(&tag(unit)).unwrap_err();
        let part = format!("channel 'IA' is in A, and {unit} is wanted");
        assert!(fault.message().contains(&part), "{}", fault.message());
    }
}
