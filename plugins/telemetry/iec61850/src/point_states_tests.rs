use std::time::{Duration, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{TagSpec, Text, ValueKind};
use iec61850_rs::{Quality as Bits, TimeQuality, UtcTime, Validity};
use serde_json::json;

use super::*;

const SHARE: fn() -> Share =
    || Share { value: Some(vec![0]), quality: Some(vec![1]), time: Some(vec![2]) };
const CHANGE: Origin = Origin { is_change: true, is_replayed: false, entry_time: None };

fn point_states(recorder: &Recorder) -> PointStates {
    let address = json!({"reference": "L/M.T", "fc": "MX"});
    let points = Points::parse(&[tag_spec(1, "t", ValueKind::F64, address)]).unwrap();
    let mut point_states = PointStates::new(points, recorder.sink(), host(), "server".into());
    point_states.note_type(0, true);
    point_states
}

fn data(value: f32, seconds: u32, quality: TimeQuality) -> data::Value {
    data::Value::Structure(vec![
        data::Value::Float32(value),
        data::Value::quality(Bits::GOOD),
        data::Value::UtcTime(UtcTime::from_unix(seconds, 0, quality)),
    ])
}

/// The quality and the source time in seconds of what is published.
fn publish(
    point_states: &mut PointStates,
    recorder: &Recorder,
    seconds: u32,
    origin: Origin,
) -> (Quality, Option<u64>) {
    publish_with(point_states, recorder, seconds, origin, TimeQuality::SYNCHRONIZED)
}

fn publish_with(
    point_states: &mut PointStates,
    recorder: &Recorder,
    seconds: u32,
    origin: Origin,
    clock: TimeQuality,
) -> (Quality, Option<u64>) {
    point_states.take(0, &SHARE(), &data(1.0, seconds, clock));
    point_states.commit(origin);
    point_states.flush();
    let sample = recorder.latest(1).unwrap();
    let seconds = |time: SystemTime| time.duration_since(UNIX_EPOCH).unwrap().as_secs();
    (sample.quality, sample.source_time.map(seconds))
}

#[test]
fn a_text_has_the_worse_of_its_quality_and_the_servers() {
    let recorder = Recorder::new();
    let address = json!({"reference": "L/GGIO1.Mode", "fc": "ST"});
    let points = Points::parse(&[tag_spec(1, "t", ValueKind::Text, address)]).unwrap();
    let mut point_states = PointStates::new(points, recorder.sink(), host(), "server".into());
    point_states.note_type(0, true);
    let mut take = |text: &str, quality: Bits| {
        let parts = [data::Value::VisibleString(text.into()), data::Value::quality(quality)];
        let share = Share { time: None, ..SHARE() };
        assert!(point_states.take(0, &share, &data::Value::Structure(parts.to_vec())));
        point_states.commit(Origin::default());
        point_states.flush();
        recorder.latest(1).unwrap()
    };
    let invalid = Bits { validity: Validity::Invalid, ..Bits::GOOD };
    let questionable = Bits { validity: Validity::Questionable, ..Bits::GOOD };
    let (long, doubt) = ("x".repeat(256), Quality::Uncertain(Reason::Configuration));
    for (text, bits, quality) in [
        ("AUTO", Bits::GOOD, Quality::Good),
        ("AUTO", Bits::GOOD, Quality::Good),
        ("", Bits::GOOD, Quality::Good),
        (&long, Bits::GOOD, doubt),
        (&long, questionable, Quality::Uncertain(Reason::Unknown)),
        (&long, invalid, Quality::Bad(Reason::Sensor)),
        ("AUTO", Bits::GOOD, Quality::Good),
    ] {
        let sample = take(text, bits);
        assert_eq!(sample.value, Some(Value::Text(Text::cut(text))));
        assert_eq!(sample.quality, quality, "{text} {bits:?}");
    }
    assert_eq!(recorder.recording().samples.len(), 7, "the same text again is a value");
}

#[test]
fn a_time_is_handed_on_where_it_is_news() {
    let recorder = Recorder::new();
    let mut point_states = point_states(&recorder);
    let good = Quality::Good;
    let reading = Origin::default();
    // As it is now, however long it has been so.
    assert_eq!(publish(&mut point_states, &recorder, 100, reading), (good, None));
    assert_eq!(publish(&mut point_states, &recorder, 100, reading), (good, None));
    assert_eq!(publish(&mut point_states, &recorder, 105, reading), (good, Some(105)));
    assert_eq!(publish(&mut point_states, &recorder, 105, reading), (good, None));
    // A clock that was set back holds nothing up.
    assert_eq!(publish(&mut point_states, &recorder, 50, reading), (good, None));
    // In a report it is told as it is: the host looks for steps of clocks.
    assert_eq!(publish(&mut point_states, &recorder, 51, CHANGE), (good, Some(51)));
    assert_eq!(publish(&mut point_states, &recorder, 51, CHANGE), (good, None));
    assert_eq!(publish(&mut point_states, &recorder, 106, CHANGE), (good, Some(106)));
}

#[test]
fn what_is_of_the_past_says_so() {
    let recorder = Recorder::new();
    let mut point_states = point_states(&recorder);
    let entry_time = Some(UNIX_EPOCH + Duration::from_secs(70));
    let past = Origin { is_change: true, is_replayed: true, entry_time };
    assert_eq!(publish(&mut point_states, &recorder, 60, past), (Quality::Good, Some(60)));
    assert_eq!(publish(&mut point_states, &recorder, 60, past), (Quality::Good, Some(60)));
    let lost = TimeQuality { clock_failure: true, ..TimeQuality::SYNCHRONIZED };
    let doubtful = (Quality::Uncertain(Reason::SourceTime), None);
    assert_eq!(publish_with(&mut point_states, &recorder, 61, past, lost), doubtful);
    let present = Origin { is_replayed: false, ..past };
    assert_eq!(
        publish_with(&mut point_states, &recorder, 61, present, lost),
        (Quality::Good, None)
    );
    let flags = |recorder: &Recorder| recorder.latest(1).unwrap().flags;
    assert_eq!(flags(&recorder), SampleFlags::TIME_UNUSABLE);
    let free = TimeQuality { clock_not_synchronized: true, ..TimeQuality::SYNCHRONIZED };
    assert_eq!(
        publish_with(&mut point_states, &recorder, 61, present, free),
        (Quality::Good, None)
    );
    assert_eq!(flags(&recorder), SampleFlags::LIVE);
    assert_eq!(publish_with(&mut point_states, &recorder, 61, past, free), doubtful);
    assert_eq!(flags(&recorder), SampleFlags::BUFFERED | SampleFlags::TIME_UNUSABLE);
    publish(&mut point_states, &recorder, 61, past);
    assert_eq!(flags(&recorder), SampleFlags::BUFFERED);
}

#[test]
fn a_value_without_its_quality_is_not_good() {
    let recorder = Recorder::new();
    let mut point_states = point_states(&recorder);
    let alone = Share { value: Some(vec![]), quality: None, time: None };
    point_states.take(0, &alone, &data::Value::Float32(2.0));
    point_states.commit(CHANGE);
    point_states.flush();
    let sample = recorder.latest(1).unwrap();
    assert_eq!(sample.quality, Quality::Uncertain(Reason::Unknown));
    // And one that is no quality makes it bad.
    point_states.take(0, &SHARE(), &data::Value::Structure(vec![data::Value::Float32(2.0); 3]));
    point_states.commit(CHANGE);
    point_states.flush();
    assert_eq!(recorder.latest(1).unwrap().quality, Quality::Bad(Reason::Configuration));
}

#[test]
fn what_was_known_is_forgotten_with_the_connection() {
    let recorder = Recorder::new();
    let mut point_states = point_states(&recorder);
    publish(&mut point_states, &recorder, 100, CHANGE);
    point_states.reset(Reason::Communication);
    assert_eq!(recorder.latest(1).unwrap(), Sample::bad(1, Reason::Communication));
    let quality = Share { value: None, quality: Some(vec![1]), time: None };
    recorder.clear();
    // Good, and nobody knows what.
    point_states.take(0, &quality, &data(1.0, 100, TimeQuality::SYNCHRONIZED));
    point_states.commit(CHANGE);
    point_states.flush();
    assert_eq!(recorder.latest(1), None);
}

#[test]
fn what_is_not_of_the_process_says_so() {
    let (recorder, data) = (Recorder::new(), |bits| {
        data::Value::Structure(vec![
            data::Value::Float32(1.0),
            data::Value::quality(bits),
            data::Value::UtcTime(UtcTime::from_unix(7, 0, TimeQuality::SYNCHRONIZED)),
        ])
    });
    let mut point_states = point_states(&recorder);
    let substituted = Bits { source: iec61850_rs::common::Source::Substituted, ..Bits::GOOD };
    let test = Bits { test: true, ..Bits::GOOD };
    for (bits, quality, flags) in [
        (substituted, Quality::Uncertain(Reason::Unknown), SampleFlags::SUBSTITUTED),
        (test, Quality::Bad(Reason::Unknown), SampleFlags::TEST),
        (Bits::GOOD, Quality::Good, SampleFlags::LIVE),
    ] {
        point_states.take(0, &SHARE(), &data(bits));
        point_states.commit(CHANGE);
        point_states.flush();
        let sample = recorder.latest(1).unwrap();
        assert_eq!((sample.quality, sample.flags), (quality, flags));
        assert_eq!(sample.value, Some(Value::F64(1.0)));
    }
}

#[test]
fn a_time_that_is_none_and_a_number_that_is_none_are_told() {
    let recorder = Recorder::new();
    let mut point_states = point_states(&recorder);
    let none = data::Value::Structure(vec![
        data::Value::Float32(1.0),
        data::Value::quality(Bits::GOOD),
        data::Value::Boolean(true),
    ]);
    point_states.take(0, &SHARE(), &none);
    point_states.commit(CHANGE);
    point_states.flush();
    assert_eq!(recorder.latest(1).unwrap().flags, SampleFlags::TIME_UNUSABLE);
    point_states.take(0, &SHARE(), &self::data(f32::NAN, 5, TimeQuality::SYNCHRONIZED));
    point_states.commit(CHANGE);
    point_states.flush();
    assert_eq!(recorder.latest(1).unwrap().quality, Quality::Bad(Reason::NotFinite));
}

#[test]
fn what_is_distrusted_needs_value_and_quality_anew() {
    let recorder = Recorder::new();
    let mut point_states = point_states(&recorder);
    publish(&mut point_states, &recorder, 100, CHANGE);
    let before = point_states.reports();
    point_states.begin_report();
    point_states.distrust(0);
    point_states.flush();
    assert_eq!(recorder.latest(1).unwrap(), Sample::bad(1, Reason::Communication));
    assert!(
        point_states.is_overtaken(0, before)
            && !point_states.is_overtaken(0, point_states.reports())
    );
    let quality = Share { value: None, quality: Some(vec![1]), time: None };
    point_states.take(0, &quality, &data(1.0, 100, TimeQuality::SYNCHRONIZED));
    point_states.commit(CHANGE);
    point_states.flush();
    assert_eq!(recorder.latest(1).unwrap(), Sample::bad(1, Reason::Communication));
    assert_eq!(publish(&mut point_states, &recorder, 101, CHANGE).0, Quality::Good);
}

#[test]
fn a_unit_that_cannot_be_read_leaves_values_uncertain() {
    let recorder = Recorder::new();
    let address = json!({"reference": "L/M.T", "fc": "MX"});
    let tag = TagSpec { unit: "MW".into(), ..tag_spec(1, "t", ValueKind::F64, address) };
    let points = Points::parse(&[tag]).unwrap();
    let mut point_states = PointStates::new(points, recorder.sink(), host(), "server".into());
    point_states.note_type(0, true);
    assert_eq!(publish(&mut point_states, &recorder, 1_700_000_000, CHANGE).0, Quality::Good);
    point_states.note_unit(0, Err(UnreadableUnit));
    let (quality, _) = publish(&mut point_states, &recorder, 1_700_000_001, CHANGE);
    assert_eq!(quality, Quality::Uncertain(Reason::Configuration));
    // A quality alone makes nothing of a value that was lost.
    point_states.distrust(0);
    point_states.flush();
    let alone = Share { value: None, quality: Some(vec![1]), time: Some(vec![2]) };
    point_states.take(0, &alone, &data(1.0, 1_700_000_002, TimeQuality::SYNCHRONIZED));
    point_states.commit(CHANGE);
    point_states.flush();
    let quality = recorder.latest(1).unwrap().quality;
    assert!(matches!(quality, Quality::Bad(_)), "{quality:?}");
}
