//! Tests of the alarm mirror by events alone, without a server.

use async_opcua::types::{DateTime, LocalizedText};

use busbar_plugin_sdk::QualityLevel;

use super::*;
use crate::conditions::{EVENT_FIELDS, place_of};

/// Test time 2026-01-02 03:04:05 UTC, seconds since 1970.
const TIME_SECONDS: i64 = 1_767_323_045;
/// Seconds from 1601, the epoch of OPC UA, to 1970 (OPC 10000-6, 5.2.2.5).
const SECONDS_TO_1970: i64 = 11_644_473_600;
const TICKS_A_SECOND: i64 = 10_000_000;

struct Event {
    fields: Vec<Variant>,
    time: Variant,
    quality: Variant,
}

impl Event {
    fn from_states(states: &[(Field, bool)], severity: u16) -> Self {
        let mut fields = vec![Variant::Empty; EVENT_FIELDS];
        for (field, value) in states {
            fields[place_of(*field)] = (*value).into();
        }
        fields[place_of(Field::Severity)] = Variant::UInt16(severity);
        fields[EVENT_FIELDS - 4] = Variant::from("S12D1T1.Oil");
        let time = DateTime::from((TIME_SECONDS + SECONDS_TO_1970) * TICKS_A_SECOND);
        Self { fields, time: Variant::from(time), quality: Variant::Empty }
    }

    fn told(&self) -> Told<'_> {
        Told { time: &self.time, quality: &self.quality, fields: &self.fields }
    }
}

fn alarm(retain: bool, severity: u16) -> Event {
    let states = [(Field::ActiveState, true), (Field::AckedState, false), (Field::Retain, retain)];
    Event::from_states(&states, severity)
}

fn namespaces() -> Vec<String> {
    ["http://opcfoundation.org/UA/", "urn:server", "urn:a;b"].map(str::to_owned).into()
}

fn take(mirror: &Mirror, name: &str, event: &Event) {
    mirror.take(&namespaces(), &NodeId::new(2, name), &event.told());
}

/// Creates a mirror after a refresh without conditions.
fn calm() -> Mirror {
    let mirror = Mirror::default();
    mirror.begin_refresh();
    mirror.end_refresh();
    mirror
}

fn ids(mirror: &Mirror) -> Vec<String> {
    let alarms = mirror.report(0).alarms.unwrap();
    alarms.into_iter().map(|alarm| alarm.id).collect()
}

#[test]
fn an_event_is_an_alarm_with_all_that_it_says() {
    let mirror = calm();
    let mut event = alarm(true, 700);
    event.quality = Variant::StatusCode(StatusCode::UncertainInitialValue);
    event.fields[EVENT_FIELDS - 2] = Variant::from(LocalizedText::new("en", "Oil\nhot"));
    take(&mirror, "Hot", &event);
    let alarms = mirror.report(0).alarms.unwrap();
    let expected = SourceAlarm {
        id: "nsu=urn:a%3Bb;s=Hot".into(),
        source: "S12D1T1.Oil".into(),
        message: "Oil hot".into(),
        severity: 700,
        is_active: true,
        is_unacknowledged: true,
        unix_nanos: Some(TIME_SECONDS * 1_000_000_000),
        quality: QualityLevel::Uncertain,
        ..SourceAlarm::default()
    };
    assert_eq!(alarms, [expected]);
    assert_eq!(mirror.report(mirror.report(0).revision).alarms, None);
}

#[test]
fn what_a_refresh_leaves_out_is_gone_and_what_is_lost_stays() {
    let mirror = Mirror::default();
    assert!(mirror.report(0).fault.is_some(), "nothing was heard yet");
    assert_eq!(mirror.report(0).alarms, None, "nor is it known that there is none");
    mirror.begin_refresh();
    take(&mirror, "Hot", &alarm(true, 1));
    take(&mirror, "Cold", &alarm(true, 1));
    assert!(mirror.report(0).fault.is_some(), "not all is told yet");
    mirror.end_refresh();
    assert_eq!((mirror.report(0).fault, ids(&mirror).len()), (None, 2));
    mirror.lose("the link is down");
    let lost = mirror.report(0);
    assert_eq!((lost.fault.as_deref(), ids(&mirror).len()), (Some("the link is down"), 2));
    // A second refresh is asked for before the first has ended.
    mirror.begin_refresh();
    mirror.begin_refresh();
    mirror.end_refresh();
    assert_eq!((mirror.report(0).fault.is_some(), ids(&mirror).len()), (true, 2));
    take(&mirror, "Cold", &alarm(true, 1));
    mirror.end_refresh();
    assert_eq!((mirror.report(0).fault, ids(&mirror)), (None, vec!["nsu=urn:a%3Bb;s=Cold".into()]));
    take(&mirror, "Cold", &alarm(false, 1));
    assert!(ids(&mirror).is_empty(), "it is of no interest any more");
}

#[test]
fn the_most_severe_are_told_where_there_are_too_many() {
    let mirror = Mirror::default();
    mirror.begin_refresh();
    for number in 0..MAX_SOURCE_ALARMS + 10 {
        take(&mirror, &number.to_string(), &alarm(true, if number < 10 { 1 } else { 500 }));
    }
    mirror.end_refresh();
    let report = mirror.report(0);
    let alarms = report.alarms.unwrap();
    assert_eq!((report.left_out, report.fault, alarms.len()), (10, None, MAX_SOURCE_ALARMS));
    assert!(alarms.iter().all(|alarm| alarm.severity == 500));
}

#[test]
fn a_mirror_that_lacks_a_condition_is_not_current() {
    let mirror = Mirror::default();
    mirror.begin_refresh();
    take(&mirror, &"x".repeat(MAX_SOURCE_ALARM_TEXT), &alarm(true, 1));
    mirror.end_refresh();
    assert!(mirror.report(0).fault.unwrap().contains("512 bytes"));
    assert!(ids(&mirror).is_empty());
}

#[test]
fn a_dialog_is_no_alarm() {
    let mirror = calm();
    take(&mirror, "Question", &Event::from_states(&[(Field::Retain, true)], 500));
    assert!(ids(&mirror).is_empty());
}
