use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Quality, Value, ValueKind};
use serde_json::json;

use super::*;
use crate::Settings;
use crate::codec::Zone;

/// Start of data transfer, by the wall clock.
const START: SystemTime = UNIX_EPOCH;

/// A station whose tags 10 to 12 are objects 10 to 12, floats, of address 1.
struct Bench {
    recorder: Recorder,
    station: Station,
    now: Instant,
    wall: SystemTime,
}

impl Bench {
    fn new(settings: serde_json::Value) -> Self {
        let mut all = json!({"host": "a"});
        all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
        let config = serde_json::from_value::<Settings>(all).unwrap().parse().unwrap();
        let tag = |tag| tag_spec(tag, &format!("t{tag}"), ValueKind::F64, json!({"ioa": tag}));
        let points = Points::parse(&[tag(10), tag(11), tag(12)], &config).unwrap();
        let recorder = Recorder::new();
        let mut station = Station::new(config, points, recorder.sink(), host());
        let now = Instant::now();
        station.begin(START, now);
        recorder.clear();
        Self { recorder, station, now, wall: START }
    }

    fn handle_answer(&mut self, asdu: &[u8]) {
        self.station.handle_answer(asdu, self.wall, self.now);
        self.station.flush();
    }

    fn quality(&self, tag: u32) -> Option<Quality> {
        self.recorder.latest(tag).map(|sample| sample.quality)
    }
}

/// Type 13 with the value 2.5.
fn float(cause: u8, common_address: u8, object_address: u8) -> Vec<u8> {
    let value = 2.5_f32.to_le_bytes();
    [&[13, 1, cause, 0, common_address, 0, object_address, 0, 0], &value[..], &[0]].concat()
}

fn answer(type_id: u8, cause: u8) -> Vec<u8> {
    vec![type_id, 1, cause, 0, 1, 0, 0, 0, 0, 20]
}

/// All tags have this value, and it is good.
fn all_good(bench: &mut Bench) {
    for tag in [10, 11, 12] {
        bench.handle_answer(&float(20, 1, tag));
        assert_eq!(bench.quality(tag.into()), Some(Quality::Good));
    }
}

#[test]
fn only_process_data_become_values() {
    let (test, negative) = (0x80, 0x40);
    for cause in 0..=255 {
        let mut bench = Bench::new(json!({}));
        all_good(&mut bench);
        bench.handle_answer(&float(cause, 1, 10));
        let is_process = matches!(cause & 0x3F, 1..=5 | 11 | 12 | 20..=41);
        let sample = bench.recorder.latest(10).unwrap();
        if cause & negative != 0 || !is_process {
            // Of any tag it might have brought a value.
            for tag in [10, 11, 12] {
                assert_eq!(bench.recorder.latest(tag), Some(bad(tag)), "cause {cause}");
            }
            continue;
        }
        let (quality, flags) = match cause & test {
            0 => (Quality::Good, SampleFlags::LIVE),
            _ => (Quality::Bad(Reason::Unknown), SampleFlags::TEST),
        };
        assert_eq!((sample.value, sample.quality), (Some(Value::F64(2.5)), quality), "{cause}");
        assert_eq!(sample.flags, flags, "cause {cause}");
        assert_eq!(bench.quality(11), Some(Quality::Good), "cause {cause}");
    }
}

fn bad(tag: u32) -> Sample {
    Sample::bad(tag, Reason::Communication)
}

/// Data units that cannot be understood, of common address 1, and what their log line says.
fn strangers() -> Vec<(Vec<u8>, &'static str)> {
    let float = float(3, 1, 10);
    let with = |index: usize, byte: u8| {
        let mut bytes = float.clone();
        bytes[index] = byte;
        bytes
    };
    let mut longer = float.clone();
    longer.push(0);
    let mut timed = vec![36, 0x82, 3, 0, 1, 0, 10, 0, 0];
    timed.extend([0; 23]);
    let beyond = [&[13, 0x82, 3, 0, 1, 0, 0xFF, 0xFF, 0xFF][..], &[0; 10]].concat();
    vec![
        (float[..4].to_vec(), "its header alone has 6"),
        (float[..6].to_vec(), "there are 0"),
        (float[..13].to_vec(), "there are 7"),
        (longer, "there are 9"),
        (with(1, 2), "2 objects take"),
        (with(1, 0), "without an object"),
        (with(1, 0x82), "2 objects take"),
        (timed, "2 objects take"),
        (beyond, "pass the last address"),
        (with(0, 22), "type 22 is not known"),
        (with(0, 41), "type 41 is not known"),
        (with(0, 200), "type 200 is not known"),
        (with(0, 255), "type 255 is not known"),
        (with(2, 0), "cause of transmission 0"),
        (with(2, 6), "cause of transmission 6"),
        (with(2, 13), "cause of transmission 13"),
        (with(2, 44), "cause of transmission 44"),
        (with(2, 63), "cause of transmission 63"),
        (with(2, 0x43), "negative"),
        (with(4, 0), "which is no station"),
        ([&with(4, 0xFF)[..5], &[0xFF], &float[6..]].concat(), "which is no station"),
        (answer(100, 10)[..8].to_vec(), "type 100"),
        (answer(100, 3), "type 100 with cause of transmission 3"),
        ([answer(70, 4), vec![0]].concat(), "type 70"),
    ]
}

#[test]
fn what_cannot_be_understood_makes_its_common_address_bad_and_is_asked_again() {
    for (bytes, words) in strangers() {
        let mut bench = Bench::new(json!({"interrogate_on_start": false}));
        all_good(&mut bench);
        bench.handle_answer(&bytes);
        for tag in [10, 11, 12] {
            assert_eq!(bench.recorder.latest(tag), Some(bad(tag)), "{words}");
        }
        let request = bench.station.next_request(bench.now, SystemTime::now);
        assert_eq!(request, Request::Interrogation.to_bytes(1, 0), "{words}");
        let links = bench.recorder.recording().links;
        let said = &links.back().unwrap_or_else(|| panic!("{words}: nothing said")).1;
        assert!(said.contains(words), "{words}: {said}");
        assert!(said.contains("1 data units could not be used"), "{said}");
        // What comes after it is right.
        bench.handle_answer(&float(3, 1, 11));
        assert_eq!(bench.quality(11), Some(Quality::Good));
        assert_eq!(bench.quality(12), Some(Quality::Bad(Reason::Communication)));
    }
}

#[test]
fn what_carries_no_values_leaves_all_as_it_is() {
    let mut bench = Bench::new(json!({"ignored_types": [200]}));
    all_good(&mut bench);
    bench.recorder.clear();
    let types = [45, 51, 58, 64, 102, 104, 107, 110, 113, 120, 127, 200];
    for type_id in types {
        bench.handle_answer(&answer(type_id, 7));
    }
    bench.handle_answer(&float(3, 1, 99));
    bench.handle_answer(&float(3, 2, 10));
    // Of a common address without tags it concerns nobody, and is told all the same.
    bench.handle_answer(&float(3, 2, 10)[..12]);
    let ignored =
        Ignored { unknown_objects: 2, without_values: types.len() as u64, not_understood: 1 };
    assert_eq!(bench.station.ignored, ignored);
    assert!(bench.recorder.recording().samples.is_empty());
    assert_eq!(bench.recorder.recording().links.len(), 1);
}

#[test]
fn a_flood_is_told_with_its_number_and_asked_for_in_measure() {
    let mut bench = Bench::new(json!({"interrogate_on_start": false}));
    all_good(&mut bench);
    let (start, mut requests) = (bench.now, 0);
    for millis in 0..20_000 {
        bench.now = start + Duration::from_millis(millis);
        bench.handle_answer(&float(3, 1, 10)[..12]);
        if bench.station.next_request(bench.now, SystemTime::now).is_some() {
            requests += 1;
            bench.handle_answer(&answer(100, 7));
            bench.handle_answer(&answer(100, 10));
        }
    }
    assert_eq!(requests, 4, "one each five seconds");
    bench.now += Duration::from_secs(1);
    bench.station.next_request(bench.now, SystemTime::now);
    let links = bench.recorder.recording().links;
    assert_eq!(links.len(), 21, "a line a second");
    assert!(links.back().unwrap().1.contains("20000 data units"), "{links:?}");
    // Bad once, and not twenty thousand times.
    assert_eq!(bench.recorder.recording().samples.len(), 6);
}

#[test]
fn an_interrogation_that_fails_is_never_forgotten() {
    let refused = answer(100, 7 | 0x40);
    let unknown = answer(100, 46 | 0x40);
    for (outcome, limit) in [(Some(refused), 30), (Some(unknown), 30), (None, 15 + 30)] {
        let mut bench = Bench::new(json!({}));
        for round in 0..3 {
            let request = bench.station.next_request(bench.now, SystemTime::now);
            assert!(request.is_some(), "{outcome:?}, round {round}");
            if let Some(outcome) = &outcome {
                bench.handle_answer(outcome);
            }
            // What is due meanwhile.
            let end = bench.now + Duration::from_secs(limit);
            while let Some(deadline) = bench.station.deadline().filter(|at| *at < end) {
                bench.now = deadline.max(bench.now + Duration::from_millis(1));
                assert_eq!(bench.station.next_request(bench.now, SystemTime::now), None);
            }
            bench.now = end;
        }
    }
}

#[test]
fn a_common_address_that_is_not_known_has_no_values() {
    let mut bench = Bench::new(json!({}));
    all_good(&mut bench);
    assert!(bench.station.next_request(bench.now, SystemTime::now).is_some());
    bench.handle_answer(&answer(100, 46 | 0x40));
    for tag in [10, 11, 12] {
        assert_eq!(bench.quality(tag), Some(Quality::Bad(Reason::Configuration)));
    }
    let links = bench.recorder.recording().links;
    assert!(links.back().unwrap().1.contains("does not know common address 1"), "{links:?}");
}

#[test]
fn an_object_of_another_type_may_be_that_of_any_tag() {
    let mut bench = Bench::new(json!({"interrogate_on_start": false}));
    let single = |cause| [1, 1, cause, 0, 1, 0, 10, 0, 0, 1];
    for round in 0..6 {
        bench.handle_answer(&float(20, 1, 11));
        bench.handle_answer(&single(3));
        assert_eq!(bench.quality(10), Some(Quality::Bad(Reason::Configuration)));
        let is_doubtful = round < 4;
        let other = if is_doubtful { Quality::Bad(Reason::Communication) } else { Quality::Good };
        assert_eq!(bench.quality(11), Some(other), "round {round}");
    }
    assert!(bench.station.next_request(bench.now, SystemTime::now).is_some());
    // Where it is so when asked, the configuration is at fault.
    bench.handle_answer(&float(20, 1, 10));
    for round in 0..3 {
        bench.handle_answer(&float(20, 1, 11));
        bench.handle_answer(&single(20));
        assert_eq!(bench.quality(11).unwrap().is_good(), round > 0, "round {round}");
    }
}

#[test]
fn an_object_of_another_type_is_told_once_and_bad_each_time() {
    let mut bench = Bench::new(json!({}));
    let single = [1, 1, 3, 0, 1, 0, 10, 0, 0, 1];
    for _ in 0..3 {
        bench.handle_answer(&single);
        assert_eq!(bench.quality(10), Some(Quality::Bad(Reason::Configuration)));
    }
    assert_eq!(bench.station.misfits_told, 1);
    bench.handle_answer(&float(3, 1, 10));
    assert_eq!(bench.quality(10), Some(Quality::Good));
}

#[test]
fn the_end_of_initialisation_asks_anew() {
    let mut bench = Bench::new(json!({"interrogate_on_start": false}));
    assert_eq!(bench.station.next_request(bench.now, SystemTime::now), None);
    bench.handle_answer(&[70, 1, 4, 0, 2, 0, 0, 0, 0, 0]);
    assert_eq!(
        bench.station.next_request(bench.now, SystemTime::now),
        None,
        "of an address without tags"
    );
    all_good(&mut bench);
    bench.handle_answer(&[70, 1, 4, 0, 1, 0, 0, 0, 0, 0]);
    for tag in [10, 11, 12] {
        assert_eq!(bench.quality(tag), Some(Quality::Bad(Reason::NotConnected)));
    }
    let request = bench.station.next_request(bench.now, SystemTime::now);
    assert_eq!(request, Request::Interrogation.to_bytes(1, 0));
}

#[test]
fn what_an_interrogation_leaves_out_is_told_once() {
    let mut bench = Bench::new(json!({"interrogation_period_seconds": 1}));
    for round in 0..3 {
        assert!(bench.station.next_request(bench.now, SystemTime::now).is_some(), "{round}");
        bench.handle_answer(&answer(100, 7));
        bench.handle_answer(&float(20, 1, 11));
        bench.handle_answer(&answer(100, 10));
        assert!(bench.station.is_silence_told);
        bench.now += Duration::from_secs(1);
    }
    let is_answered = [0, 1, 2].map(|point| bench.station.validity.is_answered(point));
    assert_eq!(is_answered, [false, true, false]);
    assert_eq!(list(&["a"]), "tag 'a'");
    assert_eq!(
        list(&["a", "b", "c", "d", "e", "f", "g"]),
        "tags 'a', 'b', 'c', 'd', 'e' and 2 more"
    );
}

#[test]
fn tags_that_go_stale_between_interrogations_are_named() {
    let warning = |settings: serde_json::Value| {
        let mut all = json!({"host": "a"});
        all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
        let config = serde_json::from_value::<Settings>(all).unwrap().parse().unwrap();
        // Fresh for five seconds.
        freshness_warning(&config, &[tag_spec(1, "Oil", ValueKind::F64, json!({"ioa": 1}))])
    };
    assert!(warning(json!({})).unwrap().contains("when data transfer starts"));
    assert!(warning(json!({"interrogation_period_seconds": 6})).unwrap().contains("'Oil'"));
    assert_eq!(warning(json!({"interrogation_period_seconds": 4})), None);
}

/// Type 36 with a value and this many milliseconds since 2001-01-01.
fn timed(cause: u8, object_address: u8, value: f32, millis: u64) -> Vec<u8> {
    let time = crate::codec::Cp56::from_system_time(at(millis), Zone::Utc).unwrap();
    stamped(cause, object_address, value, &time.to_bytes())
}

fn stamped(cause: u8, object_address: u8, value: f32, time: &[u8]) -> Vec<u8> {
    let type_id = if time.len() == 3 { 14 } else { 36 };
    let head = [type_id, 1, cause, 0, 1, 0, object_address, 0, 0];
    [&head[..], &value.to_le_bytes(), &[0], time].concat()
}

fn at(millis: u64) -> SystemTime {
    UNIX_EPOCH + Duration::from_millis(978_307_200_000 + millis)
}

/// A station whose data transfer has started a minute after 2001-01-01.
fn bench_of_minute() -> Bench {
    let mut bench = Bench::new(json!({}));
    bench.wall = at(60_000);
    bench.station.begin(bench.wall, bench.now);
    assert!(bench.station.next_request(bench.now, SystemTime::now).is_some());
    bench.handle_answer(&answer(100, 7));
    bench.recorder.clear();
    bench
}

fn latest(bench: &Bench) -> (Option<Value>, Quality, Option<SystemTime>, SampleFlags) {
    let sample = bench.recorder.latest(10).unwrap();
    (sample.value, sample.quality, sample.source_time, sample.flags)
}

#[test]
fn values_count_in_order_of_arrival_whatever_their_times() {
    let mut bench = bench_of_minute();
    bench.handle_answer(&float(20, 1, 10));
    bench.handle_answer(&answer(100, 10));
    let live = |value, millis| {
        (Some(Value::F64(value)), Quality::Good, Some(at(millis)), SampleFlags::LIVE)
    };
    for (value, millis) in [(1.0, 90_000), (2.0, 88_000), (3.0, 1000), (4.0, 90_000)] {
        bench.handle_answer(&timed(3, 10, value as f32, millis));
        assert_eq!(latest(&bench), live(value, millis));
    }
}

#[test]
fn a_buffer_overtakes_no_interrogated_value_and_no_clock_drops_a_live_one() {
    for (time, flags) in [
        (timed(3, 10, 7.0, 30_000), SampleFlags::BUFFERED),
        (timed(11, 10, 7.0, 30_000), SampleFlags::BUFFERED),
        // By a clock that is ahead a little.
        (timed(3, 10, 7.0, 65_000), SampleFlags::LIVE),
        (stamped(3, 10, 7.0, &[0, 0, 30]), SampleFlags::LIVE),
        (stamped(3, 10, 7.0, &[0, 0, 30 | 0x80]), SampleFlags::TIME_UNUSABLE),
        (stamped(3, 10, 7.0, &[0, 0, 1, 0, 1, 13, 1]), SampleFlags::TIME_UNUSABLE),
    ] {
        let mut bench = bench_of_minute();
        // Before the interrogated value, whose order is right in any case.
        bench.handle_answer(&time);
        assert!(latest(&bench).1.is_good());
        bench.handle_answer(&float(20, 1, 10));
        assert_eq!(latest(&bench).1, Quality::Good);
        // After it nobody can say, so it is asked for again.
        bench.handle_answer(&time);
        assert_eq!(latest(&bench).1, Quality::Uncertain(Reason::SourceTime));
        assert_eq!(latest(&bench).3, flags);
        bench.handle_answer(&answer(100, 10));
        assert!(bench.station.next_request(bench.now, SystemTime::now).is_some());
        bench.handle_answer(&answer(100, 7));
        bench.handle_answer(&float(20, 1, 10));
        bench.handle_answer(&answer(100, 10));
        assert_eq!(latest(&bench).1, Quality::Good);
        // The buffer is empty now, and the clock is as it is.
        bench.handle_answer(&time);
        assert!(latest(&bench).1.is_good());
        assert!(!latest(&bench).3.contains(SampleFlags::BUFFERED));
    }
}

#[test]
fn an_older_event_of_the_buffer_overtakes_no_live_one_before_the_interrogated_value() {
    for (older, flags) in [
        (timed(3, 10, 7.0, 30_000), SampleFlags::BUFFERED),
        (timed(3, 10, 7.0, 64_000), SampleFlags::LIVE),
        (stamped(3, 10, 7.0, &[0, 0, 0]), SampleFlags::LIVE),
    ] {
        for live in [65_000, 71_000] {
            let mut bench = bench_of_minute();
            // A buffer is in order, and its events count until there is better.
            bench.handle_answer(&timed(3, 10, 5.0, 20_000));
            assert_eq!(latest(&bench).1, Quality::Good);
            bench.handle_answer(&timed(3, 10, 6.0, live));
            assert_eq!(latest(&bench).1, Quality::Good);
            bench.handle_answer(&older);
            assert_eq!(latest(&bench).1, Quality::Uncertain(Reason::SourceTime), "{older:?}");
            assert_eq!(latest(&bench).3, flags, "{older:?}");
            // Nobody can say which is right until it is asked for.
            bench.handle_answer(&float(20, 1, 10));
            assert_eq!(latest(&bench).1, Quality::Good);
        }
    }
}

#[test]
fn a_buffer_overtakes_no_value_of_an_interrogation_that_was_answered_late() {
    let mut bench = bench_of_minute();
    // The first one was given up, and its answer comes all the same.
    bench.now += Duration::from_secs(121);
    bench.station.next_request(bench.now, SystemTime::now);
    bench.handle_answer(&float(20, 1, 10));
    bench.handle_answer(&timed(3, 10, 7.0, 30_000));
    assert_eq!(latest(&bench).1, Quality::Uncertain(Reason::SourceTime));
    // Of a station that never answers, events count in order of arrival after the second.
    for _ in 0..4 {
        bench.now += Duration::from_secs(121);
        bench.station.next_request(bench.now, SystemTime::now);
    }
    bench.handle_answer(&float(1, 1, 10));
    bench.handle_answer(&timed(3, 10, 7.0, 30_000));
    assert_eq!(latest(&bench).1, Quality::Good);
}

#[test]
fn a_clock_that_is_set_back_in_an_interrogation_is_asked_about_and_then_counts() {
    let mut bench = bench_of_minute();
    bench.handle_answer(&timed(3, 10, 5.0, 90_000));
    bench.handle_answer(&timed(3, 10, 6.0, 88_000));
    assert_eq!(latest(&bench).1, Quality::Uncertain(Reason::SourceTime));
    bench.handle_answer(&float(20, 1, 10));
    bench.handle_answer(&answer(100, 10));
    assert!(bench.station.next_request(bench.now, SystemTime::now).is_some(), "once more");
    bench.handle_answer(&answer(100, 7));
    bench.handle_answer(&float(20, 1, 10));
    bench.handle_answer(&answer(100, 10));
    bench.handle_answer(&timed(3, 10, 7.0, 86_000));
    assert_eq!(latest(&bench).1, Quality::Good);
}

#[test]
fn events_of_this_connection_are_live_in_an_interrogation_too() {
    let mut bench = bench_of_minute();
    bench.handle_answer(&float(20, 1, 10));
    bench.handle_answer(&timed(3, 10, 7.0, 71_000));
    assert_eq!(latest(&bench).1, Quality::Good);
    assert_eq!(latest(&bench).3, SampleFlags::LIVE);
}

#[test]
fn times_that_are_none_are_flagged_and_their_values_kept() {
    // 56.789 s of 12:34, 29 February 2024, with one thing wrong each.
    let good = [0xD5, 0xDD, 34, 12, 29, 2, 24];
    for (index, byte) in
        [(1, 0xFF), (2, 34 | 0x80), (2, 60), (3, 24), (4, 0), (4, 30), (5, 0), (5, 13), (6, 100)]
    {
        let mut bench = Bench::new(json!({}));
        let mut time = good;
        time[index] = byte;
        bench.handle_answer(&stamped(3, 10, 7.0, &time));
        let (value, quality, source_time, flags) = latest(&bench);
        assert_eq!((value, quality), (Some(Value::F64(7.0)), Quality::Good), "{time:?}");
        assert_eq!((source_time, flags), (None, SampleFlags::TIME_UNUSABLE), "{time:?}");
    }
    let mut bench = Bench::new(json!({}));
    bench.handle_answer(&stamped(3, 10, 7.0, &good));
    assert!(latest(&bench).2.is_some());
    // Types without a time promise none.
    bench.handle_answer(&float(3, 1, 10));
    assert_eq!((latest(&bench).2, latest(&bench).3), (None, SampleFlags::LIVE));
}

#[test]
fn quality_bits_have_their_origins() {
    let with = |quality: u8| {
        let mut bytes = float(3, 1, 10);
        bytes[13] = quality;
        bytes
    };
    for (bits, flags) in [
        (0x20, SampleFlags::SUBSTITUTED),
        (0xA0, SampleFlags::SUBSTITUTED),
        (0xD1, SampleFlags::LIVE),
    ] {
        let mut bench = Bench::new(json!({}));
        bench.handle_answer(&with(bits));
        let sample = bench.recorder.latest(10).unwrap();
        assert!(!sample.quality.is_good() && sample.flags == flags, "{bits:02X}: {sample:?}");
    }
    let mut bench = Bench::new(json!({}));
    bench.handle_answer(&stamped(3, 10, f32::NAN, &[0xD5, 0xDD, 34, 12, 29, 2, 24]));
    assert_eq!(latest(&bench).1, Quality::Bad(Reason::NotFinite));
}
