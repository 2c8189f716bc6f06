use std::time::UNIX_EPOCH;

use async_opcua::types::{DateTime, Variant};
use busbar_plugin_sdk::ValueKind;
use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use serde_json::json;

use super::*;
use crate::Settings;

/// 2026-01-02T03:04:05Z, and as ticks.
const WALL_SECONDS: u64 = 1_767_323_045;
const TICKS_TO_1970: i64 = 116_444_736_000_000_000;

struct Setting {
    board: Board,
    recorder: Recorder,
    now: Instant,
}

/// Tags 0 (f64, fresh for 5 s) and 1 (bool) of one item.
fn setting(confirm: bool) -> Setting {
    let settings: Settings = serde_json::from_value(json!({"url": "opc.tcp://plc"})).unwrap();
    let address = json!({"node": "ns=2;s=A"});
    let tags = [
        tag_spec(0, "A", ValueKind::F64, address.clone()),
        tag_spec(1, "B", ValueKind::Bool, address),
    ];
    let points = Points::parse(&tags, &settings.parse().unwrap()).unwrap();
    let recorder = Recorder::new();
    let board = Board::new(points, confirm, recorder.sink(), host());
    Setting { board, recorder, now: Instant::now() }
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
        self.board.take(0, data, self.now, wall());
        self.board.flush();
    }

    fn confirm_after(&mut self, seconds: u64) {
        self.now += Duration::from_secs(seconds);
        self.board.confirm(0..1, self.now);
        self.board.flush();
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
    assert_eq!((samples[1].value, samples[1].source_time), (Some(Value::F64(1.5)), None));
    // What never had a value that fits has none to confirm.
    assert_eq!(setting.of_tag(1).len(), 1);
    assert_eq!(setting.of_tag(1)[0].quality, Quality::Bad(Reason::Configuration));
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
    setting.board.lose(Reason::Communication);
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
    let last = *setting.of_tag(0).last().unwrap();
    assert_eq!((last.value, last.quality), (Some(Value::F64(2.0)), Quality::Bad(Reason::Sensor)));
    setting.take(&DataValue::default());
    let last = *setting.of_tag(0).last().unwrap();
    assert_eq!((last.value, last.quality), (None, Quality::Bad(Reason::Unknown)));
}

#[test]
fn a_refused_node_makes_its_tags_bad() {
    let mut setting = setting(true);
    setting.board.refuse(0, StatusCode::BadNodeIdUnknown);
    setting.board.refuse(9, StatusCode::BadNodeIdUnknown);
    setting.board.flush();
    for tag in [0, 1] {
        assert_eq!(setting.of_tag(tag), [Sample::bad(tag, Reason::Configuration)]);
    }
}
