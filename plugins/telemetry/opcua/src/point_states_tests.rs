use std::time::UNIX_EPOCH;

use async_opcua::types::{DateTime, Variant};
use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{TagSpec, Text, ValueKind};
use serde_json::json;

use super::*;
use crate::Settings;

/// 2026-01-02T03:04:05Z, and as ticks.
const WALL_SECONDS: u64 = 1_767_323_045;
const TICKS_TO_1970: i64 = 116_444_736_000_000_000;

struct Setting {
    point_states: PointStates,
    recorder: Recorder,
    now: Instant,
}

/// Tags 0 (f64, fresh for 5 s) and 1 (bool) of one item.
fn setting(confirm: bool) -> Setting {
    setting_with(json!({ "confirm_unchanged": confirm }))
}

fn setting_with(more: serde_json::Value) -> Setting {
    let address = json!({"node": "ns=2;s=A"});
    let number = tag_spec(0, "A", ValueKind::F64, address.clone());
    let tags =
        [TagSpec { unit: "MW".into(), ..number }, tag_spec(1, "B", ValueKind::Bool, address)];
    setting_of(&tags, more)
}

fn setting_of(tags: &[TagSpec], more: serde_json::Value) -> Setting {
    let mut all = json!({"url": "opc.tcp://plc"});
    all.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let config = settings.parse().unwrap();
    let points = Points::parse(tags, &config).unwrap();
    let recorder = Recorder::new();
    let point_states = PointStates::new(points, &config, recorder.sink(), host());
    Setting { point_states, recorder, now: Instant::now() }
}

fn wall() -> SystemTime {
    UNIX_EPOCH + Duration::from_secs(WALL_SECONDS)
}

fn data(value: f64, age_seconds: i64) -> DataValue {
    let ticks = (WALL_SECONDS as i64 - age_seconds) * 10_000_000 + TICKS_TO_1970;
    DataValue {
        value: Some(Variant::Double(value)),
        source_timestamp: Some(DateTime::from(ticks)),
        ..DataValue::default()
    }
}

impl Setting {
    fn take(&mut self, data: &DataValue) {
        self.point_states.take(0, data, self.now, wall());
        self.point_states.flush();
    }

    fn confirm_after(&mut self, seconds: u64) {
        self.now += Duration::from_secs(seconds);
        self.point_states.confirm(0..1, self.now, wall());
        self.point_states.flush();
    }

    fn read(&mut self, data: &DataValue) {
        self.point_states.take_read(0, data, self.now, wall());
        self.point_states.flush();
    }

    fn last(&self) -> Sample {
        self.of_tag(0).pop().unwrap()
    }

    fn of_tag(&self, tag: u32) -> Vec<Sample> {
        let samples = self.recorder.recording().samples;
        samples.into_iter().filter(|sample| sample.tag == tag).collect()
    }
}

#[test]
fn a_value_goes_on_as_long_as_its_subscription_lives() {
    let mut setting = setting(true);
    setting.take(&data(1.5, 0));
    let first = setting.of_tag(0);
    assert_eq!(first[0].source_time, Some(wall()));
    assert_eq!(first[0].value, Some(Value::F64(1.5)));
    setting.confirm_after(1);
    assert_eq!(setting.of_tag(0).len(), 1, "it is fresh still");
    setting.confirm_after(1);
    let samples = setting.of_tag(0);
    assert_eq!(samples.len(), 2);
    assert_eq!((&samples[1].value, samples[1].source_time), (&Some(Value::F64(1.5)), None));
    // What never had a value that fits has none to confirm.
    assert_eq!(setting.of_tag(1).len(), 1);
    assert_eq!(setting.of_tag(1)[0].quality, Quality::Bad(Reason::Configuration));
}

#[test]
fn a_text_is_published_again_and_confirmed_with_the_worse_quality() {
    // A unit is none of a text.
    let text = tag_spec(0, "A", ValueKind::Text, json!({"node": "ns=2;s=A"}));
    let mut setting = setting_of(&[TagSpec { unit: "MW".into(), ..text }], json!({}));
    let of = |text: &str| Some(Value::Text(Text::cut(text)));
    let data = |text: &str, status| DataValue {
        value: Some(Variant::from(text)),
        status: Some(status),
        ..data(0.0, 0)
    };
    setting.take(&data("AUTO", StatusCode::Good));
    setting.take(&data("AUTO", StatusCode::Good));
    setting.confirm_after(2);
    setting.take(&data("", StatusCode::Good));
    let found: Vec<_> = setting.of_tag(0).into_iter().map(|s| (s.value, s.quality)).collect();
    let good = |text| (of(text), Quality::Good);
    assert_eq!(found, [good("AUTO"), good("AUTO"), good("AUTO"), good("")]);
    let long = "x".repeat(256);
    let doubt = Quality::Uncertain(Reason::Configuration);
    for (status, quality) in [
        (StatusCode::Good, doubt),
        (StatusCode::UncertainSensorNotAccurate, Quality::Uncertain(Reason::Sensor)),
        (StatusCode::BadSensorFailure, Quality::Bad(Reason::Sensor)),
    ] {
        setting.take(&data(&long, status));
        assert_eq!(setting.last().quality, quality, "{status}");
    }
    setting.take(&data(&long, StatusCode::Good));
    setting.confirm_after(2);
    let last = setting.last();
    assert_eq!((last.quality, last.source_time), (doubt, None));
    // A number is another text, and a float none.
    setting.take(&DataValue::value_only(Variant::UInt32(4711)));
    assert_eq!(setting.last().value, of("4711"));
    setting.take(&DataValue::value_only(Variant::Double(4711.0)));
    assert_eq!(setting.last(), Sample::bad(0, Reason::Configuration));
}

#[test]
fn an_old_value_comes_with_its_time_and_is_confirmed_at_once() {
    let mut setting = setting(true);
    setting.take(&data(1.5, 3600));
    let times: Vec<_> = setting.of_tag(0).iter().map(|sample| sample.source_time).collect();
    assert_eq!(times, [Some(wall() - Duration::from_secs(3600)), None]);
}

#[test]
fn nothing_is_confirmed_where_the_settings_say_so_or_the_connection_is_lost() {
    let mut setting = setting(false);
    setting.take(&data(1.5, 3600));
    setting.confirm_after(10);
    assert_eq!(setting.of_tag(0).len(), 1);
    let mut setting = self::setting(true);
    setting.take(&data(1.5, 0));
    setting.point_states.lose(Reason::Communication);
    setting.confirm_after(10);
    let samples = setting.of_tag(0);
    assert_eq!(samples.last().unwrap().quality, Quality::Bad(Reason::Communication));
    assert_eq!(samples.len(), 2);
}

#[test]
fn what_is_bad_is_not_confirmed_and_nothing_is_no_value() {
    let mut setting = setting(true);
    setting.take(&data(1.5, 0));
    let failed = DataValue { status: Some(StatusCode::BadSensorFailure), ..data(2.0, 0) };
    setting.take(&failed);
    setting.confirm_after(10);
    let last = setting.last();
    assert_eq!((last.value, last.quality), (Some(Value::F64(2.0)), Quality::Bad(Reason::Sensor)));
    setting.take(&DataValue::default());
    let last = setting.last();
    assert_eq!((last.value, last.quality), (None, Quality::Bad(Reason::Unknown)));
}

#[test]
fn a_refused_node_makes_its_tags_bad() {
    let mut setting = setting(true);
    setting.point_states.refuse(0, StatusCode::BadNodeIdUnknown);
    setting.point_states.refuse(9, StatusCode::BadNodeIdUnknown);
    setting.point_states.flush();
    for tag in [0, 1] {
        assert_eq!(setting.of_tag(tag), [Sample::bad(tag, Reason::Configuration)]);
    }
}

const DOUBT: Quality = Quality::Uncertain(Reason::Communication);

#[test]
fn a_suspect_value_is_uncertain_and_not_confirmed_until_what_is_missing_came() {
    let mut setting = setting(true);
    setting.take(&data(1.5, 3600));
    setting.point_states.suspect(0..1);
    setting.confirm_after(10);
    let count = setting.of_tag(0).len();
    let last = setting.last();
    assert_eq!((last.value, last.quality), (Some(Value::F64(1.5)), DOUBT));
    setting.confirm_after(10);
    assert_eq!(setting.of_tag(0).len(), count);
    setting.point_states.restore(0..1, setting.now, wall());
    setting.point_states.flush();
    assert_eq!(setting.last(), Sample::good(0, Value::F64(1.5)));
    setting.point_states.suspect(0..1);
    setting.take(&data(2.5, 0));
    assert_eq!(
        (setting.last().value, setting.last().quality),
        (Some(Value::F64(2.5)), Quality::Good)
    );
}

#[test]
fn a_value_whose_report_is_lost_is_read_until_the_next_report() {
    let mut setting = setting(true);
    setting.read(&data(9.0, 0));
    assert!(setting.of_tag(0).is_empty(), "nothing is lost");
    setting.take(&data(1.5, 0));
    setting.point_states.suspect_lost(0..1);
    setting.point_states.restore(0..1, setting.now, wall());
    setting.point_states.flush();
    assert_eq!(setting.last().quality, DOUBT, "it is lost");
    assert_eq!(setting.point_states.items_to_read(0..1, setting.now), [0]);
    setting.read(&data(2.0, 0));
    assert_eq!(
        (setting.last().value, setting.last().quality),
        (Some(Value::F64(2.0)), Quality::Good)
    );
    // What was read is right now; signs of life of its subscription do not tell more.
    assert!(setting.point_states.items_to_read(0..1, setting.now).is_empty());
    let count = setting.of_tag(0).len();
    setting.confirm_after(2);
    assert_eq!(setting.of_tag(0).len(), count);
    assert_eq!(setting.point_states.items_to_read(0..1, setting.now), [0]);
    setting.take(&data(3.0, 0));
    setting.read(&data(2.0, 0));
    assert_eq!(setting.last().value, Some(Value::F64(3.0)), "the report is newer");
    assert!(!setting.point_states.has_lost(0..1));
}

#[test]
fn a_refused_item_is_not_read() {
    let mut setting = setting(true);
    setting.point_states.refuse(0, StatusCode::BadNodeIdUnknown);
    setting.point_states.suspect_lost(0..1);
    assert!(setting.point_states.items_to_read(0..1, setting.now).is_empty());
    setting.read(&data(2.0, 0));
    assert_eq!(setting.last().quality, Quality::Bad(Reason::Configuration));
}

#[test]
fn origins_stay_with_confirmed_values() {
    let cases = [
        (StatusCode::GoodLocalOverride, SampleFlags::SUBSTITUTED),
        (StatusCode::UncertainSimulatedValue, SampleFlags::SIMULATED),
    ];
    for (status, flags) in cases {
        let mut setting = setting(true);
        setting.take(&DataValue { status: Some(status), ..data(1.5, 0) });
        setting.confirm_after(2);
        let found: Vec<_> = setting.of_tag(0).iter().map(|sample| sample.flags).collect();
        assert_eq!(found, [flags, flags], "{status}");
    }
    // What a historian says is not so now.
    let mut setting = setting(true);
    let calculated = StatusCode::from(0x0401);
    setting.take(&DataValue { status: Some(calculated), ..data(1.5, 3600) });
    setting.confirm_after(2);
    let found: Vec<_> = setting.of_tag(0).iter().map(|sample| sample.flags).collect();
    assert_eq!(found, [SampleFlags::HISTORICAL | SampleFlags::BUFFERED]);
}

#[test]
fn a_server_in_test_mode_marks_all_and_one_that_fails_vouches_for_nothing() {
    let mut setting = setting(true);
    setting.take(&data(1.5, 0));
    setting.point_states.set_server(false, SampleFlags::TEST, setting.now, wall());
    setting.take(&data(2.5, 0));
    let found: Vec<_> = setting.of_tag(0).iter().map(|s| (s.value.clone(), s.flags)).collect();
    let value = |value| Some(Value::F64(value));
    let test = SampleFlags::TEST;
    assert_eq!(found, [(value(1.5), SampleFlags::LIVE), (value(1.5), test), (value(2.5), test)]);
    setting.point_states.set_server(true, SampleFlags::LIVE, setting.now, wall());
    setting.confirm_after(2);
    setting.take(&data(3.5, 0));
    assert!(setting.of_tag(0)[3..].iter().all(|sample| sample.quality == DOUBT));
    setting.point_states.set_server(false, SampleFlags::LIVE, setting.now, wall());
    setting.point_states.flush();
    assert_eq!(setting.last(), Sample::good(0, Value::F64(3.5)));
}

#[test]
fn times_are_used_as_the_settings_say() {
    let without = DataValue { source_timestamp: None, ..data(1.0, 0) };
    let impossible = DataValue { source_timestamp: Some(DateTime::null()), ..data(1.0, 0) };
    let early = DataValue { source_timestamp: Some(DateTime::from(1)), ..data(1.0, 0) };
    let unusable = SampleFlags::TIME_UNUSABLE;
    let cases = [
        ("optional", &without, SampleFlags::LIVE),
        ("required", &without, unusable),
        ("ignored", &without, SampleFlags::LIVE),
        ("optional", &impossible, unusable),
        ("required", &impossible, unusable),
        ("ignored", &impossible, SampleFlags::LIVE),
        ("optional", &early, unusable),
    ];
    for (usage, data, flags) in cases {
        let mut setting = setting_with(json!({ "source_time": usage }));
        setting.take(data);
        setting.confirm_after(2);
        for sample in setting.of_tag(0) {
            assert_eq!((sample.source_time, sample.flags), (None, flags), "{usage}: {data:?}");
        }
    }
    let mut ignored = setting_with(json!({"source_time": "ignored"}));
    ignored.take(&data(1.0, 3600));
    assert_eq!(ignored.of_tag(0), [Sample::good(0, Value::F64(1.0))]);
}

#[test]
fn a_time_in_the_future_stays_unbelieved_when_its_value_is_confirmed() {
    let mut setting = setting(true);
    setting.take(&data(1.0, -3600));
    setting.confirm_after(2);
    let found = setting.of_tag(0);
    assert_eq!(found[0].source_time, Some(wall() + Duration::from_secs(3600)));
    assert_eq!(found[1].flags, SampleFlags::TIME_UNUSABLE);
    let mut setting = self::setting(true);
    setting.take(&data(1.0, -9));
    setting.confirm_after(2);
    assert_eq!(setting.last(), Sample::good(0, Value::F64(1.0)));
}

#[test]
fn older_times_and_values_of_one_queue_come_in_order_of_arrival() {
    let mut setting = setting(true);
    for (value, age) in [(1.0, 0), (2.0, 2), (3.0, 1)] {
        setting.take(&data(value, age));
    }
    let values: Vec<_> = setting.of_tag(0).into_iter().map(|sample| sample.value).collect();
    assert_eq!(values, [1.0, 2.0, 3.0].map(|value| Some(Value::F64(value))));
    assert!(setting.of_tag(0).iter().all(|sample| sample.flags == SampleFlags::LIVE));
}

#[test]
fn a_value_whose_meaning_changed_is_uncertain_until_the_next_connection() {
    let mut setting = setting(true);
    let changed = StatusCode::Good.set_semantics_changed(true);
    setting.take(&DataValue { status: Some(changed), ..data(1.0, 0) });
    setting.take(&data(2.0, 0));
    let doubt = Quality::Uncertain(Reason::Configuration);
    assert!(setting.of_tag(0).iter().all(|sample| sample.quality == doubt));
    setting.point_states.lose(Reason::Communication);
    setting.take(&data(3.0, 0));
    assert_eq!(setting.last().quality, Quality::Good);
}

#[test]
fn what_is_no_such_value_never_leaves_the_one_before() {
    let array = || {
        let values = vec![Variant::Double(1.0)];
        Variant::from(
            async_opcua::types::Array::new(async_opcua::types::VariantScalarTypeId::Double, values)
                .unwrap(),
        )
    };
    let cases = [
        DataValue { value: Some(array()), ..data(0.0, 0) },
        DataValue { value: Some(Variant::from(vec![1_u8, 2])), ..data(0.0, 0) },
        DataValue { value: Some(Variant::from("text")), ..data(0.0, 0) },
        DataValue { value: None, ..data(0.0, 0) },
        DataValue { value: Some(Variant::Empty), ..data(0.0, 0) },
        DataValue { value: None, status: Some(StatusCode::UncertainInitialValue), ..data(0.0, 0) },
        DataValue { value: None, status: Some(StatusCode::BadSensorFailure), ..data(0.0, 0) },
    ];
    for case in cases {
        let mut setting = setting(true);
        setting.take(&data(1.0, 0));
        setting.take(&case);
        setting.confirm_after(10);
        assert!(matches!(setting.last().quality, Quality::Bad(_)), "{case:?}");
        assert_eq!(setting.of_tag(0).len(), 2, "{case:?}");
    }
}

#[test]
fn a_unit_limits_the_quality_of_the_tags_that_have_one() {
    let mut setting = setting(false);
    let stated = |name: &str| StatedUnit { name: name.into(), by_id: None };
    let bad = Quality::Bad(Reason::Configuration);
    let uncertain = Quality::Uncertain(Reason::Configuration);
    for (unit, quality) in [
        (Ok(stated("MW")), Quality::Good),
        (Err(UnreadableUnit), uncertain),
        (Ok(stated("kW")), bad),
        (Ok(stated("apples")), Quality::Good),
    ] {
        setting.point_states.note_unit(0, unit.as_ref());
        setting.take(&data(1.0, 0));
        assert_eq!(setting.recorder.latest(0).unwrap().quality, quality, "{unit:?}");
    }
    let truth = DataValue { value: Some(Variant::Boolean(true)), ..data(0.0, 0) };
    setting.point_states.note_unit(0, Err(&UnreadableUnit));
    setting.take(&truth);
    assert_eq!(setting.recorder.latest(1).unwrap().quality, Quality::Good);
}
