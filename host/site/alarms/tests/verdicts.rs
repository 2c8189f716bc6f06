//! Alarms that follow verdicts of overlays: unknown neither raises nor clears one, whatever its
//! delays, holds and group.

use std::sync::Arc;
use std::time::Duration;

use busbar_alarms::{
    AlarmEvent, AlarmHandle, AlarmRecord, AlarmSet, AlarmSource, AlarmSpec, AlarmTable,
    AlarmTemplate, Condition, TagCondition, VerdictCondition, VerdictInput,
};
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::{
    AlarmAction, AlarmState, Origin, Priority, Quality, Severity, Value, ValueKind,
};
use fastrand::Rng;

const START: Moment = Moment(1 << 40);
const SHIFT: Duration = Duration::from_secs(8 * 3600);
const BREAKER: TagHandle = TagHandle(0);
const RANDOM_STEPS: usize = 20_000;

fn alarm(id: &str, [on, off]: [u64; 2]) -> AlarmSpec {
    AlarmSpec {
        id: id.into(),
        message: "contact hot".into(),
        consequence: String::new(),
        response: String::new(),
        equipment: Some("=Q1".into()),
        priority: Priority::High,
        latched: false,
        group: None,
        source: AlarmSource::Verdict {
            trigger: VerdictCondition {
                overlay: "thermography".into(),
                equipment: "=Q1".into(),
                severity: Severity::Warning,
            },
            on_delay: Duration::from_secs(on),
            off_delay: Duration::from_secs(off),
            suppressed_by: None,
        },
    }
}

/// A table of alarms on verdicts, and of the tag that suppresses them.
struct Bay {
    tags: TagTable,
    set: Arc<TagSet>,
    alarms: AlarmTable,
    now: Moment,
}

impl Bay {
    fn new(specs: Vec<AlarmSpec>) -> Self {
        let breaker = TagSpec {
            id: "breaker".into(),
            name: String::new(),
            kind: ValueKind::Bool,
            unit: String::new(),
            range: None,
            freshness: Duration::from_secs(1 << 20),
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let set = Arc::new(TagSet::new(vec![breaker]).expect("a tag"));
        let alarms = Arc::new(AlarmSet::new(specs, &set).expect("alarms"));
        let alarms = AlarmTable::new(alarms, SHIFT, START);
        Self { tags: TagTable::new(Arc::clone(&set), START), set, alarms, now: START }
    }

    /// Steps the table some seconds later, at verdicts of some alarms.
    fn step(&mut self, after: u64, verdicts: &[(u32, Option<bool>)]) -> Vec<AlarmRecord> {
        for &(alarm, holds) in verdicts {
            self.alarms.note_verdict(input(alarm, holds));
        }
        self.now = self.now.after(Duration::from_secs(after));
        self.tags.advance(self.now, |_| {});
        let wall = SourceTime(self.now.since(START).as_nanos() as i64);
        let mut records = Vec::new();
        self.alarms.step(self.tags.snapshot(), self.now, wall, |record| records.push(record));
        records
    }

    fn state(&self, alarm: u32) -> AlarmState {
        self.alarms.status(AlarmHandle(alarm)).expect("it is there").state
    }

    fn act(&mut self, alarm: u32, action: AlarmAction) {
        self.alarms.perform(AlarmHandle(alarm), action, "A. Operator").expect("it is legal");
    }
}

fn input(alarm: u32, holds: Option<bool>) -> VerdictInput {
    let reason = match holds {
        Some(true) => Some("82 °C, 41 K above its peers".into()),
        Some(false) => None,
        None => Some("L2.Temperature: stale".into()),
    };
    VerdictInput {
        alarm: AlarmHandle(alarm),
        holds,
        origin: Origin::LIVE,
        source_time: None,
        is_assumed: false,
        reason,
    }
}

const ABNORMAL: Option<bool> = Some(true);
const NORMAL: Option<bool> = Some(false);
const UNKNOWN: Option<bool> = None;

#[test]
fn an_unknown_verdict_neither_raises_nor_clears() {
    let mut bay = Bay::new(vec![alarm("hot", [0, 0])]);
    assert_eq!(bay.step(0, &[(0, UNKNOWN)]), []);
    assert_eq!(bay.state(0), AlarmState::Normal);
    let came = bay.step(1, &[(0, ABNORMAL)]);
    assert_eq!(came[0].happened, AlarmEvent::Occurred);
    assert_eq!(came[0].reason.as_deref(), Some("82 °C, 41 K above its peers"));
    for seconds in [1, 3_600, 86_400] {
        assert_eq!(bay.step(seconds, &[(0, UNKNOWN)]), []);
        assert_eq!(bay.step(seconds, &[]), []);
        let status = bay.alarms.status(AlarmHandle(0)).expect("it is there");
        assert!(status.standing.is_active && !status.is_certain, "after {seconds} s");
        assert_eq!(bay.alarms.uncertainty(AlarmHandle(0)), Some("L2.Temperature: stale"));
        assert_eq!(bay.alarms.reason(AlarmHandle(0)), came[0].reason.as_deref());
    }
    bay.act(0, AlarmAction::Acknowledge);
    assert_eq!(bay.step(1, &[(0, UNKNOWN)]), []);
    assert_eq!(bay.state(0), AlarmState::Acknowledged);
    assert_eq!(bay.step(1, &[(0, NORMAL)])[0].happened, AlarmEvent::Returned);
    assert_eq!((bay.state(0), bay.alarms.uncertainty(AlarmHandle(0))), (AlarmState::Normal, None));
}

#[test]
fn an_on_delay_outlasts_an_unknown_verdict_and_an_off_delay_begins_anew() {
    let mut bay = Bay::new(vec![alarm("hot", [10, 10])]);
    bay.step(0, &[(0, ABNORMAL)]);
    assert_eq!(bay.step(4, &[(0, UNKNOWN)]), []);
    assert_eq!(bay.step(4, &[(0, UNKNOWN)]), []);
    assert_eq!(bay.step(2, &[])[0].happened, AlarmEvent::Occurred);
    bay.step(0, &[(0, NORMAL)]);
    assert_eq!(bay.step(9, &[(0, UNKNOWN)]), []);
    assert_eq!(bay.step(100, &[]), [], "nobody knows");
    assert_eq!(bay.step(0, &[(0, NORMAL)]), []);
    assert_eq!(bay.step(9, &[]), []);
    assert_eq!(bay.step(1, &[])[0].happened, AlarmEvent::Returned);
    // Judged normal in between, it begins anew.
    bay.step(0, &[(0, ABNORMAL)]);
    bay.step(9, &[(0, NORMAL)]);
    bay.step(0, &[(0, ABNORMAL)]);
    assert_eq!(bay.step(9, &[]), []);
    assert_eq!(bay.step(1, &[]).len(), 1);
}

/// A model without timers: the time since which each answer holds, and no more.
#[test]
fn random_verdicts_raise_and_clear_as_the_last_known_ones_say() {
    for seed in [39, 62_682] {
        let mut dice = Rng::with_seed(seed);
        let delays = [[0, 0], [7, 0], [0, 7], [7, 11]];
        let specs = delays.iter().zip(0..).map(|(of, id)| alarm(&format!("alarm {id}"), *of));
        let mut bay = Bay::new(specs.collect());
        let mut now = 0;
        // Of each alarm: active, abnormal since, normal since.
        let mut models: [(bool, Option<u64>, Option<u64>); 4] = [(false, None, None); 4];
        let mut unknowns_while_active = 0;
        for step in 0..RANDOM_STEPS {
            let seconds = [0, 1, 2, 5, 30][dice.usize(..5)];
            now += seconds;
            let mut verdicts = Vec::new();
            for (index, model) in models.iter_mut().enumerate() {
                let verdict = [None, Some(ABNORMAL), Some(NORMAL), Some(UNKNOWN)][dice.usize(..4)];
                let [on, off] = delays[index];
                let (active, abnormal, normal) = model;
                match verdict {
                    Some(ABNORMAL) => {
                        (*abnormal, *normal) = (abnormal.or(Some(now)), None);
                    }
                    Some(NORMAL) => (*abnormal, *normal) = (None, normal.or(Some(now))),
                    Some(UNKNOWN) => {
                        *normal = None;
                        unknowns_while_active += usize::from(*active);
                    }
                    None => {}
                }
                verdicts.extend(verdict.map(|holds| (index as u32, holds)));
                if abnormal.is_some_and(|since| now >= since + on) {
                    *active = true;
                }
                if normal.is_some_and(|since| now >= since + off) {
                    *active = false;
                }
            }
            bay.step(seconds, &verdicts);
            for (index, (active, ..)) in models.iter().enumerate() {
                let status = bay.alarms.status(AlarmHandle(index as u32)).expect("it is there");
                let found = status.standing.is_active;
                assert_eq!(found, *active, "seed {seed}, step {step}, alarm {index}");
            }
        }
        assert!(unknowns_while_active > RANDOM_STEPS / 10, "{unknowns_while_active}");
    }
}

#[test]
fn origin_and_assumption_are_those_of_the_verdict() {
    let mut bay = Bay::new(vec![alarm("hot", [0, 0])]);
    let of = |holds, origin, is_assumed| VerdictInput { origin, is_assumed, ..input(0, holds) };
    bay.alarms.note_verdict(of(ABNORMAL, Origin::SIMULATED, true));
    let came = &bay.step(0, &[])[0];
    assert_eq!((came.origin, came.is_assumed), (Origin::SIMULATED, true));
    let line = serde_json::to_string(came).expect("it is a record");
    assert!(line.contains(r#""is_assumed":true"#) && line.contains("82 °C"), "{line}");
    assert_eq!(serde_json::from_str::<AlarmRecord>(&line).expect("it is its own"), *came);
    // What joins later is added, and nothing of it goes while the verdict is unknown.
    bay.alarms.note_verdict(of(ABNORMAL, Origin::RECORDED, false));
    bay.alarms.note_verdict(of(UNKNOWN, Origin::LIVE, false));
    bay.step(1, &[]);
    let status = bay.alarms.status(AlarmHandle(0)).expect("it is there");
    assert_eq!(status.origin, Origin::SIMULATED | Origin::RECORDED);
    assert!(!status.is_assumed, "the last known verdict rests on no default");
    bay.act(0, AlarmAction::Acknowledge);
    let live = bay.step(1, &[(0, NORMAL)]);
    assert_eq!((live[0].origin, live[0].reason.as_deref()), (Origin::LIVE, None));
}

#[test]
fn shelving_latching_suppression_groups_and_chatter_are_those_of_any_alarm() {
    let suppressing =
        TagCondition { tag: BREAKER, condition: Condition::Equals(Value::Bool(true)) };
    let mut specs = vec![alarm("a", [0, 0]), alarm("b", [0, 0])];
    for spec in &mut specs {
        spec.group = Some("bay".into());
    }
    specs[1].latched = true;
    if let AlarmSource::Verdict { suppressed_by, .. } = &mut specs[0].source {
        *suppressed_by = Some(suppressing);
    }
    let mut bay = Bay::new(specs);
    let first = bay.step(0, &[(1, ABNORMAL), (0, ABNORMAL)]);
    assert_eq!(first.iter().map(|record| record.is_first_out).collect::<Vec<_>>(), [true, false]);
    bay.act(1, AlarmAction::Shelve(Duration::from_secs(60)));
    assert_eq!(bay.step(30, &[(1, UNKNOWN)]), []);
    assert_eq!(bay.state(1), AlarmState::Shelved);
    bay.step(30, &[]);
    assert_eq!(bay.state(1), AlarmState::Unacknowledged, "what is unknown stays wrong");
    bay.step(0, &[(1, NORMAL)]);
    assert_eq!(bay.state(1), AlarmState::LatchedUnacknowledged);
    let sample = Sample::live(BREAKER, Some(Value::Bool(true)), Quality::Good, bay.now);
    bay.tags.apply(&sample, |_| {});
    bay.step(0, &[(0, UNKNOWN)]);
    assert_eq!(bay.state(0), AlarmState::SuppressedByDesign);
    for _ in 0..3 {
        bay.step(5, &[(1, ABNORMAL)]);
        bay.step(5, &[(1, NORMAL)]);
    }
    assert!(bay.alarms.status(AlarmHandle(1)).expect("it is there").chatters);
}

#[test]
fn further_alarms_leave_those_before_as_they_are() {
    let mut bay = Bay::new(vec![alarm("own", [0, 0])]);
    bay.step(0, &[(0, ABNORMAL)]);
    let mut general = alarm("hot", [0, 0]);
    general.equipment = None;
    let suppressing =
        TagCondition { tag: BREAKER, condition: Condition::Equals(Value::Bool(true)) };
    if let AlarmSource::Verdict { suppressed_by, .. } = &mut general.source {
        *suppressed_by = Some(suppressing);
    }
    let template = AlarmTemplate::new(general).expect("it follows a verdict");
    let sample = Sample::live(BREAKER, Some(Value::Bool(true)), Quality::Good, bay.now);
    bay.tags.apply(&sample, |_| {});
    bay.step(1, &[]);
    let more = ["=Q2", "=Q3/L1"].map(|equipment| template.alarm_on(equipment));
    let set = bay.alarms.set().extended(more, &bay.set).expect("they are new");
    bay.alarms.extend(Arc::new(set));
    let records = bay.step(1, &[(2, ABNORMAL)]);
    assert_eq!(bay.state(0), AlarmState::Unacknowledged);
    assert_eq!(bay.state(2), AlarmState::SuppressedByDesign, "by a value that came before it");
    assert!(records.iter().all(|record| record.alarm.starts_with("hot:=Q")), "{records:?}");
    let id = &bay.alarms.set().spec(AlarmHandle(2)).expect("it is there").id;
    assert_eq!((id.as_str(), template.equipment_of(id)), ("hot:=Q3/L1", Some("=Q3/L1")));
    for other in ["hot", "hot:", "hotter:=Q1", "own"] {
        assert_eq!(template.equipment_of(other), None, "{other}");
    }
    let counts = bay.alarms.counts(Priority::High);
    let all: usize = AlarmState::ALL.into_iter().map(|state| counts.count(state)).sum();
    assert_eq!(all, 3);
    let twice = bay.alarms.set().extended([template.alarm_on("=Q2")], &bay.set);
    assert!(twice.is_err(), "an alarm is there once");
    assert!(AlarmTemplate::new(mirrored()).is_err());
}

fn mirrored() -> AlarmSpec {
    AlarmSpec { source: AlarmSource::Mirrored, ..alarm("m", [0, 0]) }
}
