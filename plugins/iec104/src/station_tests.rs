use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Quality, Value, ValueKind};
use serde_json::json;

use super::*;
use crate::Settings;

/// A station whose tags 10 to 12 are objects 10 to 12, floats, of address 1.
struct Bench {
    recorder: Recorder,
    station: Station,
    now: Instant,
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
        station.begin(now);
        recorder.clear();
        Self { recorder, station, now }
    }

    fn heed(&mut self, asdu: &[u8]) {
        self.station.heed(asdu, UNIX_EPOCH, self.now);
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

#[test]
fn only_process_data_become_values() {
    let (test, negative) = (0x80, 0x40);
    for cause in 0..=255 {
        let mut bench = Bench::new(json!({}));
        bench.heed(&float(cause, 1, 10));
        let is_plain = cause & (test | negative) == 0;
        let wanted = is_plain && matches!(cause, 1..=5 | 11 | 12 | 20..=41);
        let value = bench.recorder.latest(10).and_then(|sample| sample.value);
        assert_eq!(value, wanted.then_some(Value::F64(2.5)), "cause {cause}");
        let Ignored { no_process_data, other_units, .. } = bench.station.ignored;
        let expected = match (is_plain, wanted) {
            (false, _) => (1, 0),
            (true, wanted) => (0, u64::from(!wanted)),
        };
        assert_eq!((no_process_data, other_units), expected, "cause {cause}");
    }
}

#[test]
fn what_is_not_used_is_counted() {
    let mut bench = Bench::new(json!({}));
    bench.heed(&float(3, 1, 99));
    bench.heed(&float(3, 2, 10));
    bench.heed(&float(3, 1, 10)[..12]);
    bench.heed(&answer(45, 7));
    bench.heed(&answer(120, 3));
    let ignored = Ignored { unknown_objects: 2, no_process_data: 0, other_units: 2, malformed: 1 };
    assert_eq!(bench.station.ignored, ignored);
    assert!(bench.recorder.recording().samples.is_empty());
}

#[test]
fn an_object_of_another_type_is_told_once_and_bad_each_time() {
    let mut bench = Bench::new(json!({}));
    let single = [1, 1, 3, 0, 1, 0, 10, 0, 0, 1];
    for _ in 0..3 {
        bench.heed(&single);
        assert_eq!(bench.quality(10), Some(Quality::Bad(Reason::Configuration)));
    }
    assert_eq!(bench.station.misfits_told, 1);
    bench.heed(&float(3, 1, 10));
    assert_eq!(bench.quality(10), Some(Quality::Good));
}

#[test]
fn the_end_of_initialisation_asks_anew() {
    let mut bench = Bench::new(json!({"interrogate_on_start": false}));
    assert_eq!(bench.station.next_request(bench.now, SystemTime::now), None);
    bench.heed(&[70, 1, 4, 0, 2, 0, 0, 0, 0, 0]);
    assert_eq!(
        bench.station.next_request(bench.now, SystemTime::now),
        None,
        "of an address without tags"
    );
    bench.heed(&[70, 1, 4, 0, 1, 0, 0, 0, 0, 0]);
    let request = bench.station.next_request(bench.now, SystemTime::now);
    assert_eq!(request, Request::Interrogation.to_bytes(1, 0));
}

#[test]
fn what_an_interrogation_leaves_out_is_told_once() {
    let mut bench = Bench::new(json!({"interrogation_period_millis": 1000}));
    for round in 0..3 {
        assert!(bench.station.next_request(bench.now, SystemTime::now).is_some(), "{round}");
        bench.heed(&answer(100, 7));
        bench.heed(&float(20, 1, 11));
        bench.heed(&answer(100, 10));
        assert!(bench.station.is_silence_told);
        bench.now += Duration::from_secs(1);
    }
    assert_eq!(bench.station.is_answered, [false, true, false]);
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
    assert!(warning(json!({"interrogation_period_millis": 6000})).unwrap().contains("'Oil'"));
    assert_eq!(warning(json!({"interrogation_period_millis": 4000})), None);
}
