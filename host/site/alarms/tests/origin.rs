//! Alarms of values that are not live say so, in their state and in the records of the log.

use std::sync::Arc;
use std::time::Duration;

use busbar_alarms::{
    AlarmEvent, AlarmHandle, AlarmRecord, AlarmSet, AlarmSource, AlarmSpec, AlarmTable, Condition,
    TagCondition,
};
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::{AlarmAction, Limit, Origin, Priority, Quality, Value, ValueKind};

const TAG: TagHandle = TagHandle(0);
const ALARM: AlarmHandle = AlarmHandle(0);
const WALL_CLOCK: SourceTime = SourceTime(1_700_000_000_000_000_000);

struct Bay {
    tags: TagTable,
    alarms: AlarmTable,
    now: Moment,
}

impl Bay {
    fn new(delay: Duration) -> Self {
        let tag = TagSpec {
            id: "Load".into(),
            name: String::new(),
            kind: ValueKind::F64,
            unit: String::new(),
            range: None,
            freshness: Duration::from_secs(60),
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let tags = Arc::new(TagSet::new(vec![tag]).expect("it can be"));
        let condition = Condition::Limit { limit: Limit::High, at: 90.0, deadband: 0.0 };
        let alarm = AlarmSpec {
            id: "Hot".into(),
            message: String::new(),
            consequence: String::new(),
            response: String::new(),
            equipment: None,
            priority: Priority::High,
            latched: false,
            group: None,
            source: AlarmSource::Tag {
                trigger: TagCondition { tag: TAG, condition },
                on_delay: delay,
                off_delay: Duration::ZERO,
                suppressed_by: None,
            },
        };
        let set = Arc::new(AlarmSet::new(vec![alarm], &tags).expect("it can be"));
        let now = Moment::now();
        let alarms = AlarmTable::new(set, Duration::from_secs(3600), now);
        Self { tags: TagTable::new(tags, now), alarms, now }
    }

    /// The records that a value leads to, after some seconds.
    fn take(&mut self, value: f64, origin: Origin, seconds: u64) -> Vec<AlarmRecord> {
        let live = Sample::live(TAG, Some(Value::F64(value)), Quality::Good, self.now);
        let alarms = &mut self.alarms;
        self.tags.apply(&Sample { origin, ..live }, |change| alarms.note(change));
        let mut records = Vec::new();
        for _ in 0..=seconds {
            self.tags.advance(self.now, |_| {});
            let snapshot = self.tags.snapshot();
            self.alarms.step(snapshot, self.now, WALL_CLOCK, |record| records.push(record));
            self.now = self.now.after(Duration::from_secs(1));
        }
        records
    }

    fn origin(&self) -> Origin {
        self.alarms.status(ALARM).expect("it is there").origin
    }
}

#[test]
fn an_alarm_has_the_origin_of_the_value_that_raised_it() {
    for delay in [Duration::ZERO, Duration::from_secs(2)] {
        let mut bay = Bay::new(delay);
        let records = bay.take(95.0, Origin::SIMULATED | Origin::TEST, 4);
        assert_eq!(records.len(), 1, "{delay:?}");
        assert_eq!(records[0].happened, AlarmEvent::Occurred);
        assert_eq!(records[0].origin, Origin::SIMULATED | Origin::TEST);
        assert_eq!(bay.origin(), Origin::SIMULATED | Origin::TEST);
        let record = bay.alarms.perform(ALARM, AlarmAction::Acknowledge, "A. Operator");
        assert_eq!(record.expect("it can be").origin, Origin::SIMULATED | Origin::TEST);
        let returned = bay.take(80.0, Origin::LIVE, 0);
        assert_eq!(
            (returned[0].happened, returned[0].origin),
            (AlarmEvent::Returned, Origin::LIVE)
        );
    }
}

#[test]
fn an_alarm_that_holds_on_by_a_value_that_is_not_live_says_so_from_then_on() {
    let mut bay = Bay::new(Duration::ZERO);
    assert_eq!(bay.take(95.0, Origin::LIVE, 0)[0].origin, Origin::LIVE);
    let revision = bay.alarms.revision();
    assert_eq!(bay.take(96.0, Origin::TEST, 0), []);
    assert_eq!(bay.origin(), Origin::TEST);
    assert_ne!(bay.alarms.revision(), revision, "it is listed anew");
    bay.take(97.0, Origin::LIVE, 0);
    assert_eq!(bay.origin(), Origin::TEST, "until it is over");
}

#[test]
fn records_name_origins_and_those_of_older_logs_have_none() {
    let mut bay = Bay::new(Duration::ZERO);
    let record = bay.take(95.0, Origin::RECORDED | Origin::SUBSTITUTED, 0).remove(0);
    let json = serde_json::to_value(&record).expect("it can be written");
    assert_eq!(json["origin"], serde_json::json!(["substituted", "recorded"]));
    assert_eq!(
        serde_json::from_value::<AlarmRecord>(json.clone()).expect("it can be read"),
        record
    );
    let live = Bay::new(Duration::ZERO).take(95.0, Origin::LIVE, 0).remove(0);
    let mut json = serde_json::to_value(&live).expect("it can be written");
    assert!(json.get("origin").is_none());
    assert_eq!(serde_json::from_value::<AlarmRecord>(json.clone()).expect("it can be read"), live);
    json["origin"] = serde_json::json!(["dreamt"]);
    assert!(serde_json::from_value::<AlarmRecord>(json).is_err());
}
