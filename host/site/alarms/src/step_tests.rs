use std::sync::Arc;

use busbar_tags::{Sample, SourceTime, TagSet, TagSpec, TagTable};
use busbar_types::{AlarmAction, AlarmState, Limit, Priority, Quality, Reason, Value, ValueKind};

use super::*;
use crate::{ActionError, AlarmSet, AlarmSpec};

const START: Moment = Moment(1 << 40);
const SHIFT: Duration = Duration::from_secs(8 * 3600);
const OIL: TagHandle = TagHandle(0);
const BREAKER: TagHandle = TagHandle(1);
const RELAY: TagHandle = TagHandle(2);

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

/// A table of tags and one of alarms on them, and their time.
struct Bay {
    tags: TagTable,
    alarms: AlarmTable,
    now: Moment,
}

fn tag(id: &str, kind: ValueKind) -> TagSpec {
    TagSpec {
        id: id.into(),
        name: id.into(),
        kind,
        unit: String::new(),
        range: None,
        freshness: seconds(3600.0),
        scale: None,
        dead_band: 0.0,
        expression: None,
    }
}

fn watch(tag: TagHandle, condition: Condition) -> AlarmSource {
    let trigger = TagCondition { tag, condition };
    let (on_delay, off_delay) = (Duration::ZERO, Duration::ZERO);
    AlarmSource::Tag { trigger, on_delay, off_delay, suppressed_by: None }
}

fn alarm(id: &str, source: AlarmSource) -> AlarmSpec {
    AlarmSpec {
        id: id.into(),
        message: id.into(),
        consequence: String::new(),
        response: String::new(),
        equipment: None,
        priority: Priority::High,
        latched: false,
        group: None,
        source,
    }
}

fn high(at: f64) -> Condition {
    Condition::Limit { limit: Limit::High, at, deadband: 2.0 }
}

fn hot() -> AlarmSpec {
    alarm("hot", watch(OIL, high(95.0)))
}

impl Bay {
    fn new(specs: Vec<AlarmSpec>) -> Self {
        let tags = vec![
            tag("oil", ValueKind::F64),
            tag("breaker", ValueKind::Bool),
            tag("relay", ValueKind::Bool),
        ];
        let tags = Arc::new(TagSet::new(tags).unwrap());
        let set = Arc::new(AlarmSet::new(specs, &tags).unwrap());
        let alarms = AlarmTable::new(set, SHIFT, START);
        Self { tags: TagTable::new(tags, START), alarms, now: START }
    }

    fn set(&mut self, tag: TagHandle, value: Option<Value>, quality: Quality) {
        let Self { tags, alarms, now } = self;
        let sample = Sample::live(tag, value, quality, *now);
        tags.apply(&sample, |change| alarms.note(change));
    }

    fn set_oil(&mut self, value: f64) {
        self.set(OIL, Some(Value::F64(value)), Quality::Good);
    }

    fn set_bool(&mut self, tag: TagHandle, value: bool) {
        self.set(tag, Some(Value::Bool(value)), Quality::Good);
    }

    fn step(&mut self, after: f64) -> Vec<AlarmRecord> {
        self.now = self.now.after(seconds(after));
        self.tags.advance(self.now, |_| {});
        let mut records = Vec::new();
        let wall = SourceTime(self.now.since(START).as_nanos() as i64);
        self.alarms.step(self.tags.snapshot(), self.now, wall, |record| records.push(record));
        records
    }

    fn state(&self, alarm: u32) -> AlarmState {
        self.alarms.status(AlarmHandle(alarm)).unwrap().state
    }

    fn perform(&mut self, alarm: u32, action: AlarmAction) -> Result<AlarmRecord, ActionError> {
        self.alarms.perform(AlarmHandle(alarm), action, "A. Operator")
    }
}

fn delayed(on: f64, off: f64) -> AlarmSpec {
    let AlarmSource::Tag { trigger, .. } = hot().source else { unreachable!() };
    let (on_delay, off_delay) = (seconds(on), seconds(off));
    AlarmSpec {
        source: AlarmSource::Tag { trigger, on_delay, off_delay, suppressed_by: None },
        ..hot()
    }
}

#[test]
fn delays_are_kept_and_begin_anew_when_the_condition_goes() {
    let mut bay = Bay::new(vec![delayed(5.0, 10.0)]);
    bay.set_oil(96.0);
    assert_eq!(bay.step(0.0), []);
    assert_eq!(bay.step(4.0), []);
    bay.set_oil(90.0);
    bay.step(0.5);
    bay.set_oil(96.0);
    assert_eq!(bay.step(0.5), []);
    assert_eq!(bay.step(4.9), []);
    assert_eq!(bay.alarms.next_due(), Some(bay.now.after(seconds(0.1))));
    assert_eq!(bay.step(0.1)[0].to, AlarmState::Unacknowledged);
    bay.set_oil(92.0);
    assert_eq!(bay.step(0.0), []);
    assert_eq!(bay.step(10.0)[0].to, AlarmState::ReturnedUnacknowledged);
    assert_eq!(bay.alarms.next_due(), None);
}

#[test]
fn bad_values_neither_raise_nor_clear_and_the_alarm_says_so() {
    let mut bay = Bay::new(vec![delayed(5.0, 5.0)]);
    bay.set_oil(96.0);
    bay.step(0.0);
    bay.set(OIL, None, Quality::Bad(Reason::Communication));
    assert_eq!(bay.step(2.0), []);
    assert_eq!(bay.step(60.0), [], "never raised by a value that is not known");
    bay.set_oil(96.0);
    assert_eq!(bay.step(0.0), []);
    assert_eq!(bay.step(4.0), [], "the delay began anew");
    assert_eq!(bay.step(1.0)[0].to, AlarmState::Unacknowledged);
    // Stale from here on.
    assert_eq!(bay.step(7200.0), [], "never cleared by silence");
    let status = bay.alarms.status(AlarmHandle(0)).unwrap();
    assert_eq!((status.state, status.is_certain), (AlarmState::Unacknowledged, false));
    bay.set_oil(80.0);
    bay.step(0.0);
    assert!(bay.alarms.status(AlarmHandle(0)).unwrap().is_certain);
    assert_eq!(bay.step(5.0)[0].to, AlarmState::ReturnedUnacknowledged);
}

#[test]
fn a_condition_that_is_over_before_the_frame_is_no_less_an_alarm() {
    let trip = alarm("trip", watch(RELAY, Condition::Equals(Value::Bool(true))));
    let mut bay = Bay::new(vec![trip]);
    bay.set_bool(RELAY, false);
    bay.step(0.0);
    bay.set_bool(RELAY, true);
    bay.set_bool(RELAY, false);
    let records = bay.step(0.016);
    let states: Vec<_> = records.iter().map(|record| record.to).collect();
    assert_eq!(states, [AlarmState::Unacknowledged, AlarmState::ReturnedUnacknowledged]);
    assert_eq!(records[0].value, Some(Value::Bool(true)));
}

#[test]
fn the_first_of_a_group_is_told_until_all_are_normal() {
    let member = |id, tag| AlarmSpec {
        group: Some("trip".into()),
        ..alarm(id, watch(tag, Condition::Equals(Value::Bool(true))))
    };
    let mut bay = Bay::new(vec![member("breaker", BREAKER), member("relay", RELAY)]);
    bay.set_bool(BREAKER, false);
    bay.set_bool(RELAY, false);
    bay.step(0.0);
    // In this order, within one frame.
    bay.set_bool(RELAY, true);
    bay.set_bool(BREAKER, true);
    let records = bay.step(0.016);
    let first: Vec<_> = records.iter().map(|r| (r.alarm.as_str(), r.is_first_out)).collect();
    assert_eq!(first, [("relay", true), ("breaker", false)]);
    for alarm in [0, 1] {
        bay.perform(alarm, AlarmAction::Acknowledge).unwrap();
    }
    bay.set_bool(RELAY, false);
    bay.step(1.0);
    bay.set_bool(RELAY, true);
    assert!(!bay.step(1.0)[0].is_first_out, "the breaker still is in alarm");
}

#[test]
fn what_suppresses_in_the_same_frame_suppresses_and_nothing_is_shown_between() {
    let AlarmSource::Tag { trigger, on_delay, off_delay, .. } = hot().source else {
        unreachable!()
    };
    let by = TagCondition { tag: BREAKER, condition: Condition::Equals(Value::Bool(false)) };
    let suppressed_by = Some(by);
    let source = AlarmSource::Tag { trigger, on_delay, off_delay, suppressed_by };
    let mut bay = Bay::new(vec![AlarmSpec { source, ..hot() }]);
    bay.set_bool(BREAKER, true);
    bay.set_oil(60.0);
    bay.step(0.0);
    bay.set_oil(99.0);
    bay.set_bool(BREAKER, false);
    let states = |records: Vec<AlarmRecord>| records.iter().map(|r| r.to).collect::<Vec<_>>();
    assert_eq!(
        states(bay.step(1.0)),
        [AlarmState::SuppressedByDesign, AlarmState::SuppressedByDesign]
    );
    bay.set_oil(60.0);
    bay.set_bool(BREAKER, true);
    assert_eq!(states(bay.step(1.0)), [AlarmState::SuppressedByDesign, AlarmState::Normal]);
}

#[test]
fn shelves_end_by_themselves_and_what_is_wrong_still_is_annunciated_anew() {
    let mut bay = Bay::new(vec![hot()]);
    bay.set_oil(96.0);
    bay.step(0.0);
    bay.perform(0, AlarmAction::Acknowledge).unwrap();
    let shelved = bay.perform(0, AlarmAction::Shelve(seconds(600.0))).unwrap();
    assert_eq!(shelved.standing.shelved_until, Some(SourceTime(600_000_000_000)));
    assert_eq!(bay.step(599.0), []);
    let left = bay.alarms.status(AlarmHandle(0)).unwrap().shelf_left;
    assert_eq!(left, Some(seconds(1.0)));
    let expired = &bay.step(1.0)[0];
    assert_eq!(
        (expired.happened, expired.to),
        (AlarmEvent::ShelfExpired, AlarmState::Unacknowledged)
    );
    let too_long = bay.perform(0, AlarmAction::Shelve(SHIFT + seconds(1.0))).unwrap_err();
    assert!(too_long.to_string().contains("from 1 to 28800 s"), "{too_long}");
    assert_eq!(bay.state(0), AlarmState::Unacknowledged);
}

#[test]
fn a_table_goes_on_where_the_log_ends() {
    let latched = AlarmSpec { latched: true, ..alarm("latched", watch(OIL, high(95.0))) };
    let cold = alarm("shelved", watch(OIL, high(95.0)));
    let specs = || vec![hot(), latched.clone(), cold.clone()];
    let mut before = Bay::new(specs());
    before.set_oil(96.0);
    let mut log = before.step(0.0);
    log.push(before.perform(0, AlarmAction::Acknowledge).unwrap());
    log.push(before.perform(2, AlarmAction::Shelve(seconds(60.0))).unwrap());
    let last = log.last().unwrap().number;
    assert!(log.iter().map(|record| record.number).eq(1..=last));
    let mut after = Bay::new(specs());
    let standings = log.iter().map(|record| (record.alarm.as_str(), record.standing, record.time));
    // 59 s later, by the wall clock.
    after.alarms.restore(standings, last, SourceTime(59_000_000_000));
    assert_eq!(
        [0, 1, 2].map(|alarm| after.state(alarm)),
        [AlarmState::Acknowledged, AlarmState::Unacknowledged, AlarmState::Shelved]
    );
    assert!(!after.alarms.status(AlarmHandle(0)).unwrap().is_certain, "nothing is known yet");
    assert_eq!(after.step(0.5), [], "nothing came: all stays");
    after.set_oil(96.0);
    let records = after.step(0.5);
    let told: Vec<_> = records.iter().map(|r| (r.number, r.alarm.as_str(), r.to)).collect();
    assert_eq!(
        told,
        [(last + 1, "shelved", AlarmState::Unacknowledged)],
        "acknowledged stays acknowledged"
    );
    after.set_oil(60.0);
    after.step(1.0);
    assert_eq!(
        [0, 1, 2].map(|alarm| after.state(alarm)),
        [AlarmState::Normal, AlarmState::LatchedUnacknowledged, AlarmState::ReturnedUnacknowledged]
    );
}

#[test]
fn what_is_mirrored_is_decided_on_by_the_host_alone() {
    let mut bay = Bay::new(vec![alarm("host", AlarmSource::Mirrored)]);
    bay.step(0.0);
    let mirror = |bay: &mut Bay, state| {
        bay.alarms.mirror(AlarmHandle(0), state, None, Some("host")).unwrap()
    };
    assert_eq!(mirror(&mut bay, AlarmState::Normal), None);
    for state in AlarmState::ALL.into_iter().skip(1) {
        let record = mirror(&mut bay, state).expect("it changes");
        assert_eq!((record.to, record.happened), (state, AlarmEvent::Mirrored));
        let refused = bay.perform(0, AlarmAction::Acknowledge).unwrap_err();
        assert!(matches!(refused, ActionError::Mirrored { .. }));
    }
    let mut own = Bay::new(vec![hot()]);
    let refused = own.alarms.mirror(AlarmHandle(0), AlarmState::Unacknowledged, None, None);
    assert_eq!(refused, Err(ActionError::Unknown), "a tag decides on that one");
}

#[test]
fn counts_and_what_is_open_follow_and_timers_hold_one_entry_an_alarm() {
    let specs = (0..100).map(|at| AlarmSpec { id: at.to_string(), ..delayed(60.0, 60.0) });
    let mut bay = Bay::new(specs.collect());
    for round in 0..1000 {
        bay.set_oil(if round % 2 == 0 { 99.0 } else { 50.0 });
        bay.step(0.01);
        assert!(bay.alarms.timers.len() <= 100);
    }
    bay.set_oil(99.0);
    bay.step(0.0);
    bay.step(60.0);
    let counts = bay.alarms.counts(Priority::High);
    assert_eq!(
        (counts.count(AlarmState::Unacknowledged), counts.annunciated(), counts.unacknowledged()),
        (100, 100, 100)
    );
    assert_eq!(bay.alarms.open().len(), 100);
}

#[test]
fn alarms_that_cannot_be_are_told_all_at_once() {
    let tags = TagSet::new(vec![tag("oil", ValueKind::F64)]).unwrap();
    let on = |condition| alarm("a", watch(OIL, condition));
    let specs = vec![
        hot(),
        hot(),
        on(Condition::Equals(Value::F64(1.0))),
        alarm("b", watch(TagHandle(7), Condition::BadQuality)),
        AlarmSpec { id: "c".into(), ..delayed(1e9, 0.0) },
        AlarmSpec { id: "d".into(), ..on(high(f64::NAN)) },
    ];
    let faults = AlarmSet::new(specs, &tags).unwrap_err();
    let ids: Vec<_> = faults.iter().map(|fault| fault.id.as_str()).collect();
    assert_eq!(ids, ["hot", "a", "b", "c", "d"], "{faults:?}");
}

#[test]
fn a_table_goes_on_where_another_was_whatever_numbers_alarms_and_tags_have() {
    let hot = |tag, at, on_delay| AlarmSource::Tag {
        trigger: TagCondition {
            tag,
            condition: Condition::Limit { limit: Limit::High, at, deadband: 1.0 },
        },
        on_delay: seconds(on_delay),
        off_delay: Duration::ZERO,
        suppressed_by: None,
    };
    let number = |id: &str| tag(id, ValueKind::F64);
    let set_of = |alarms, tags: &TagTable| Arc::new(AlarmSet::new(alarms, tags.tags()).unwrap());
    let mut tags =
        TagTable::new(Arc::new(TagSet::new(vec![number("o"), number("w")]).unwrap()), START);
    for (tag, value) in [(0, 100.0), (1, 100.0)] {
        let value = Some(Value::F64(value));
        let sample = Sample::live(TagHandle(tag), value, Quality::Good, START);
        tags.apply(&sample, |_| {});
    }
    let group = |spec| AlarmSpec { group: Some("T1".into()), ..spec };
    let first = vec![
        group(alarm("gone", hot(TagHandle(0), 90.0, 0.0))),
        group(alarm("oil", hot(TagHandle(0), 90.0, 0.0))),
        alarm("shelved", hot(TagHandle(1), 90.0, 0.0)),
        alarm("slow", hot(TagHandle(1), 90.0, 10.0)),
    ];
    let mut before = AlarmTable::new(set_of(first, &tags), SHIFT, START);
    let step = |table: &mut AlarmTable, tags: &mut TagTable, after: f64| {
        let now = START.after(seconds(after));
        tags.advance(now, |_| {});
        let mut records = Vec::new();
        table.step(tags.snapshot(), now, SourceTime(now.0 as i64), |record| records.push(record));
        records
    };
    assert_eq!(step(&mut before, &mut tags, 1.0).len(), 3);
    before.perform(AlarmHandle(1), AlarmAction::Acknowledge, "Anna").unwrap();
    before.perform(AlarmHandle(2), AlarmAction::Shelve(seconds(30.0)), "Anna").unwrap();

    let second = vec![
        alarm("new", hot(TagHandle(1), 99.0, 0.0)),
        group(alarm("oil", hot(TagHandle(0), 95.0, 0.0))),
        alarm("shelved", hot(TagHandle(1), 90.0, 0.0)),
        alarm("slow", hot(TagHandle(1), 90.0, 10.0)),
    ];
    let mut after = AlarmTable::new(set_of(second, &tags), SHIFT, START);
    after.inherit(before, |id| id != "oil");
    let state = |table: &AlarmTable, alarm| table.status(AlarmHandle(alarm)).unwrap().state;
    let states = |table: &AlarmTable| [0, 1, 2, 3].map(|alarm| state(table, alarm));
    assert_eq!(
        states(&after),
        [AlarmState::Normal, AlarmState::Acknowledged, AlarmState::Shelved, AlarmState::Normal]
    );
    let records = step(&mut after, &mut tags, 2.0);
    let happened: Vec<_> = records.iter().map(|record| record.alarm.as_str()).collect();
    assert_eq!(happened, ["new"], "what was acknowledged stays so, its limit moved or not");
    assert_eq!(records[0].number, 6, "records are counted on");
    let records = step(&mut after, &mut tags, 11.5);
    assert_eq!(records[0].alarm, "slow", "its delay went on");
    assert_eq!(
        states(&after),
        [
            AlarmState::Unacknowledged,
            AlarmState::Acknowledged,
            AlarmState::Shelved,
            AlarmState::Unacknowledged
        ]
    );
    step(&mut after, &mut tags, 31.5);
    assert_eq!(state(&after, 2), AlarmState::Unacknowledged, "its shelf ended when it was to");
}
