//! Every transition of a random walk against the tables of the standard, written out as
//! data (IEC 62682, alarm state transition diagram; for resets OPC 10000-9, 5.8.5). The
//! model here looks at every alarm at every step and has no timers: it shares nothing with
//! the crate but the names of states.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use busbar_alarms::{
    AlarmEvent, AlarmHandle, AlarmRecord, AlarmSet, AlarmSource, AlarmSpec, AlarmTable, Condition,
    TagCondition,
};
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::{
    AlarmAction, AlarmState, DoublePoint, Limit, Priority, Quality, Reason, Text, Value, ValueKind,
};
use fastrand::Rng;

const STEPS: usize = 10_000;
const ALARMS: usize = 64;
const TAGS: u32 = 24;
const MAX_SHELVING: Duration = Duration::from_secs(3600);

/// Transitions of an alarm without suppression: its state, the event, the alarms concerned
/// (`latched`, `plain` or `any`), the next state. An event that is not listed has no effect.
const TRANSITIONS: &str = "
    A occurs      any     B
    B returns     plain   D
    B returns     latched E
    B acknowledge any     C
    C returns     plain   A
    C returns     latched F
    D occurs      any     B
    D acknowledge any     A
    E occurs      any     B
    E acknowledge any     F
    F occurs      any     B
    F reset       any     A
    A shelve      any     G
    B shelve      any     G
    C shelve      any     G
    D shelve      any     G
    E shelve      any     G
    F shelve      any     G
    A suppress    any     H
    B suppress    any     H
    C suppress    any     H
    D suppress    any     H
    E suppress    any     H
    F suppress    any     H
    A remove      any     I
    B remove      any     I
    C remove      any     I
    D remove      any     I
    E remove      any     I
    F remove      any     I
";
/// Transitions of a suppressed alarm: the visible state, the event, and its effect on the
/// suppressions. The strongest suppression is visible: I before H before G.
const HELD: &str = "
    G shelve      +G
    G unshelve    -G
    G expire      -G
    G suppress    +H
    G remove      +I
    H unshelve    -G
    H expire      -G
    H unsuppress  -H
    H remove      +I
    I unshelve    -G
    I expire      -G
    I suppress    +H
    I unsuppress  -H
    I return      -I
";
/// The state after the last hold: by whether the condition holds and a latch is set.
const RELEASED: &str = "
    over  free   A
    over  latch  E
    holds free   B
    holds latch  B
";

/// Alarm of the reference model.
#[derive(Clone, Debug, Default)]
struct Model {
    /// Not held back; none while it is.
    state: Option<AlarmState>,
    holds: BTreeSet<AlarmState>,
    condition: bool,
    latch: bool,
    /// The condition without delays, and since when it is so without interruption.
    raw: bool,
    since: Option<Moment>,
    shelf_ends: Option<Moment>,
}

fn letter(word: &str) -> AlarmState {
    let index = "ABCDEFGHI".find(word).expect("a letter");
    AlarmState::ALL[index]
}

/// Rows of a table whose first words are these.
fn look_up<'t>(table: &'t str, words: &[&str]) -> Option<&'t str> {
    let mut rows = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let row = rows.find(|row| {
        row.len() > words.len()
            && row.iter().zip(words).all(|(cell, word)| cell == word || *cell == "any")
    })?;
    row.last().copied()
}

impl Model {
    fn new() -> Self {
        Self { state: Some(AlarmState::Normal), ..Self::default() }
    }

    fn shown(&self) -> AlarmState {
        self.state.unwrap_or_else(|| *self.holds.last().expect("it is held"))
    }

    /// Lets an event happen; whether the tables know it.
    fn happen(&mut self, event: &str, latched: bool) -> bool {
        let shown = self.shown();
        let name = shown.letter().to_string();
        match event {
            "occurs" => self.condition = true,
            "returns" => self.condition = false,
            _ => {}
        }
        if self.state.is_some() {
            let kind = if latched { "latched" } else { "plain" };
            let Some(next) = look_up(TRANSITIONS, &[&name, event, kind]) else { return false };
            let next = letter(next);
            self.latch |= latched && next == AlarmState::Unacknowledged;
            self.latch &= event != "reset";
            if next >= AlarmState::Shelved {
                self.holds.insert(next);
                self.state = None;
            } else {
                self.state = Some(next);
            }
            return true;
        }
        if event == "occurs" || event == "returns" {
            // Only behind a shelf alone does it latch.
            self.latch |= event == "occurs" && latched && shown == AlarmState::Shelved;
            return true;
        }
        let Some(effect) = look_up(HELD, &[&name, event]) else { return false };
        let (sign, hold) = effect.split_at(1);
        let changed = match sign {
            "+" => self.holds.insert(letter(hold)) || event == "shelve",
            _ => self.holds.remove(&letter(hold)),
        };
        if self.holds.is_empty() {
            let [condition, latch] = [
                if self.condition { "holds" } else { "over" },
                if self.latch { "latch" } else { "free" },
            ];
            self.state = look_up(RELEASED, &[condition, latch]).map(letter);
            // As for every way into B.
            self.latch |= latched && self.state == Some(AlarmState::Unacknowledged);
        }
        changed
    }
}

/// Evaluates a condition by its definition alone; `None` where nobody knows.
fn verdict(
    condition: &Condition,
    value: Option<&Value>,
    quality: Quality,
    held: bool,
) -> Option<bool> {
    let bad = quality.name() == "bad";
    match (condition, value) {
        (Condition::BadQuality, _) => Some(bad),
        (_, None) => None,
        _ if bad => None,
        (Condition::Equals(wanted), Some(value)) => Some(value == wanted),
        (Condition::Differs(wanted), Some(value)) => Some(value != wanted),
        (Condition::Limit { limit, at, deadband }, Some(value)) => {
            let number = value.as_number()?;
            let beyond = match limit {
                Limit::High | Limit::HighHigh => number - at,
                Limit::Low | Limit::LowLow => at - number,
            };
            Some(beyond > 0.0 || (held && beyond > -deadband))
        }
    }
}

fn event_of(happening: AlarmEvent) -> &'static str {
    match happening {
        AlarmEvent::Occurred => "occurs",
        AlarmEvent::Returned => "returns",
        AlarmEvent::Acknowledged => "acknowledge",
        AlarmEvent::Reset => "reset",
        AlarmEvent::Shelved => "shelve",
        AlarmEvent::Unshelved => "unshelve",
        AlarmEvent::ShelfExpired => "expire",
        AlarmEvent::Suppressed => "suppress",
        AlarmEvent::Unsuppressed => "unsuppress",
        AlarmEvent::RemovedFromService => "remove",
        AlarmEvent::ReturnedToService => "return",
        AlarmEvent::Mirrored => "mirror",
    }
}

fn kind_of(tag: u32) -> ValueKind {
    match tag % 5 {
        0 | 1 => ValueKind::F64,
        2 => ValueKind::Bool,
        3 => ValueKind::Text,
        _ => ValueKind::DoublePoint,
    }
}

fn tags() -> TagSet {
    let spec = |tag| TagSpec {
        id: format!("{tag:02}"),
        name: String::new(),
        kind: kind_of(tag),
        unit: String::new(),
        range: Some(-5.0..=105.0),
        freshness: Duration::from_secs(30 + u64::from(tag) * 20),
        scale: None,
        dead_band: 0.0,
        expression: None,
    };
    TagSet::new((0..TAGS).map(spec).collect()).expect("they can be")
}

fn random_value(tag: u32, dice: &mut Rng) -> Value {
    match kind_of(tag) {
        ValueKind::Bool => Value::Bool(dice.bool()),
        ValueKind::Text => {
            let word = ["LOCAL", "REMOTE", ""][dice.usize(..3)];
            Value::Text(Text::new(word).expect("it is short"))
        }
        ValueKind::DoublePoint => Value::DoublePoint(
            [DoublePoint::Intermediate, DoublePoint::Off, DoublePoint::On, DoublePoint::BadState]
                [dice.usize(..4)],
        ),
        // Whole numbers: often at a limit, and at the end of a deadband.
        _ => Value::F64(f64::from(dice.i32(-8..=108))),
    }
}

fn random_watch(dice: &mut Rng) -> TagCondition {
    let tag = dice.u32(..TAGS);
    let condition = match (kind_of(tag), dice.u32(..8)) {
        (_, 0) => Condition::BadQuality,
        (ValueKind::F64, choice) => {
            let limits = [Limit::LowLow, Limit::Low, Limit::High, Limit::HighHigh];
            let (limit, at) = [(0, 10.0), (1, 30.0), (2, 70.0), (3, 90.0)][choice as usize % 4];
            Condition::Limit { limit: limits[limit], at, deadband: f64::from(dice.u32(..3) * 5) }
        }
        (_, 1..4) => Condition::Differs(random_value(tag, dice)),
        _ => Condition::Equals(random_value(tag, dice)),
    };
    TagCondition { tag: TagHandle(tag), condition }
}

fn random_spec(id: usize, dice: &mut Rng) -> AlarmSpec {
    let delay = |dice: &mut Rng| Duration::from_millis([0, 0, 100, 2_500, 40_000][dice.usize(..5)]);
    AlarmSpec {
        id: format!("alarm {id:02}"),
        message: String::new(),
        consequence: String::new(),
        response: String::new(),
        equipment: None,
        priority: Priority::ALL[dice.usize(..4)],
        latched: dice.bool(),
        group: (dice.u32(..3) == 0).then(|| format!("{}", dice.u32(..5))),
        source: AlarmSource::Tag {
            trigger: random_watch(dice),
            on_delay: delay(dice),
            off_delay: delay(dice),
            suppressed_by: (dice.u32(..4) == 0).then(|| random_watch(dice)),
        },
    }
}

/// Returns the events of each alarm that the model expects of a step, in their order.
fn expected_step(
    model: &mut Model,
    spec: &AlarmSpec,
    history: &[(TagHandle, Value, Quality)],
    now: Moment,
    state_of: &dyn Fn(TagHandle) -> (Option<Value>, Quality),
) -> Vec<&'static str> {
    let AlarmSource::Tag { trigger, on_delay, off_delay, suppressed_by } = &spec.source else {
        panic!("all are of tags")
    };
    let mut events = Vec::new();
    let mut happen = |model: &mut Model, event| {
        assert!(model.happen(event, spec.latched) || event == "shelve", "{event} {model:?}");
        events.push(event);
    };
    let suppression = suppressed_by.as_ref().map(|by| {
        let (value, quality) = state_of(by.tag);
        verdict(
            &by.condition,
            value.as_ref(),
            quality,
            model.holds.contains(&AlarmState::SuppressedByDesign),
        )
    });
    if suppression == Some(Some(true)) && !model.holds.contains(&AlarmState::SuppressedByDesign) {
        happen(model, "suppress");
    }
    let of_tag = || history.iter().filter(|(tag, ..)| *tag == trigger.tag);
    let came = |(_, value, quality): &(_, Value, Quality)| {
        verdict(&trigger.condition, Some(value), *quality, false) == Some(true)
    };
    if on_delay.is_zero() && !model.raw && of_tag().any(came) {
        (model.raw, model.since) = (true, Some(now));
        if !model.condition {
            happen(model, "occurs");
        }
    }
    let (value, quality) = state_of(trigger.tag);
    match verdict(&trigger.condition, value.as_ref(), quality, model.raw) {
        None => model.since = None,
        Some(raw) => {
            if raw != model.raw || model.since.is_none() {
                (model.raw, model.since) = (raw, Some(now));
            }
            let delay = if raw { on_delay } else { off_delay };
            let lasted = model.since.is_some_and(|since| now.since(since) >= *delay);
            if lasted && raw != model.condition {
                happen(model, if raw { "occurs" } else { "returns" });
            }
        }
    }
    if model.shelf_ends.take_if(|ends| *ends <= now).is_some() {
        happen(model, "expire");
    }
    if suppression == Some(Some(false)) && model.holds.contains(&AlarmState::SuppressedByDesign) {
        happen(model, "unsuppress");
    }
    events
}

#[test]
fn every_transition_of_a_random_walk_is_that_of_the_tables() {
    let (mut transitions, mut refusals) = (BTreeSet::new(), 0);
    for seed in [1, 62_682] {
        walk(seed, &mut transitions, &mut refusals);
    }
    // Each row for an alarm that is not held back was walked, and most for others.
    let rows = TRANSITIONS.lines().filter(|line| !line.trim().is_empty());
    for row in rows {
        let cells: Vec<_> = row.split_whitespace().collect();
        let (from, event, to) = (letter(cells[0]), cells[1], letter(cells[3]));
        assert!(transitions.contains(&(from, event, to)), "{row} never happened");
    }
    for row in HELD.lines().filter(|line| !line.trim().is_empty()) {
        let cells: Vec<_> = row.split_whitespace().collect();
        let is_walked =
            |t: &&(AlarmState, &str, AlarmState)| t.0 == letter(cells[0]) && t.1 == cells[1];
        assert!(transitions.iter().any(|t| is_walked(&t)), "{row} never happened");
    }
    assert!(refusals > 1000, "{refusals} refusals");
}

fn walk(
    seed: u64,
    transitions: &mut BTreeSet<(AlarmState, &'static str, AlarmState)>,
    refusals: &mut u32,
) {
    let mut dice = Rng::with_seed(seed);
    let start = Moment(1 << 50);
    let mut now = start;
    let tag_set = Arc::new(tags());
    let mut tags = TagTable::new(tag_set.clone(), now);
    let specs: Vec<_> = (0..ALARMS).map(|id| random_spec(id, &mut dice)).collect();
    let set = Arc::new(AlarmSet::new(specs.clone(), &tag_set).expect("they can be"));
    let mut alarms = AlarmTable::new(set, MAX_SHELVING, now);
    let mut models = vec![Model::new(); ALARMS];
    let mut number = 0;
    for step in 0..STEPS {
        now = now.after(Duration::from_millis([16, 100, 1_000, 20_000][dice.usize(..4)]));
        let mut history = Vec::new();
        for _ in 0..dice.u32(..6) {
            let tag = dice.u32(..TAGS);
            let quality = match dice.u32(..12) {
                0 => Quality::Bad(Reason::Communication),
                1 => Quality::Uncertain(Reason::Sensor),
                _ => Quality::Good,
            };
            let value = Some(random_value(tag, &mut dice));
            let sample = Sample::live(TagHandle(tag), value, quality, now);
            tags.apply(&sample, |change| {
                let value = change.value.clone();
                history.extend(value.map(|value| (change.tag, value, change.quality)));
                alarms.note(change);
            });
        }
        tags.advance(now, |_| {});
        let wall = SourceTime(now.since(start).as_nanos() as i64);
        let mut found: Vec<AlarmRecord> = Vec::new();
        alarms.step(tags.snapshot(), now, wall, |record| found.push(record));
        for record in &found {
            number += 1;
            assert_eq!((record.number, record.time), (number, wall));
        }
        let state_of = |tag| {
            let state = tags.snapshot().state(tag).expect("it is there");
            (state.value, state.quality)
        };
        for ((model, spec), index) in models.iter_mut().zip(&specs).zip(0..) {
            let mut from = model.shown();
            let expected = expected_step(model, spec, &history, now, &state_of);
            let own: Vec<_> = found.iter().filter(|record| record.alarm == spec.id).collect();
            let events: Vec<_> = own.iter().map(|record| event_of(record.happened)).collect();
            assert_eq!(events, expected, "seed {seed}, step {step}, {spec:?}, {model:?}");
            for record in own {
                assert_eq!(record.from, from, "seed {seed}, step {step}");
                transitions.insert((record.from, event_of(record.happened), record.to));
                from = record.to;
            }
            let status = alarms.status(AlarmHandle(index)).expect("it is there");
            assert_eq!((status.state, from), (model.shown(), model.shown()), "step {step}");
        }
        for _ in 0..dice.u32(..4) {
            let index = dice.usize(..ALARMS);
            let shelf = Duration::from_secs(dice.u64(1..=600));
            let (action, event) = [
                (AlarmAction::Acknowledge, "acknowledge"),
                (AlarmAction::Acknowledge, "acknowledge"),
                (AlarmAction::Reset, "reset"),
                (AlarmAction::Shelve(shelf), "shelve"),
                (AlarmAction::Unshelve, "unshelve"),
                (AlarmAction::RemoveFromService, "remove"),
                (AlarmAction::ReturnToService, "return"),
            ][dice.usize(..7)];
            let model = &mut models[index];
            let (before, from) = (model.clone(), model.shown());
            let is_known = model.happen(event, specs[index].latched);
            let alarm = AlarmHandle(index as u32);
            let status = alarms.status(alarm);
            match alarms.perform(alarm, action, "operator") {
                Ok(record) => {
                    number += 1;
                    assert!(is_known, "{event} of {before:?} at step {step}");
                    assert_eq!((record.number, record.from), (number, from));
                    assert_eq!((record.to, event_of(record.happened)), (model.shown(), event));
                    transitions.insert((from, event, record.to));
                    match event {
                        "shelve" => model.shelf_ends = Some(now.after(shelf)),
                        "unshelve" => model.shelf_ends = None,
                        _ => {}
                    }
                }
                Err(error) => {
                    *refusals += 1;
                    assert!(!is_known, "{event} of {before:?} at step {step}: {error}");
                    assert_eq!(alarms.status(alarm), status, "nothing has changed");
                    *model = before;
                }
            }
        }
        for priority in Priority::ALL {
            for state in AlarmState::ALL {
                let is_so = |(model, spec): &(&Model, &AlarmSpec)| {
                    spec.priority == priority && model.shown() == state
                };
                let count = models.iter().zip(&specs).filter(is_so).count();
                assert_eq!(alarms.counts(priority).count(state), count, "step {step}");
            }
        }
    }
    assert!(number > STEPS as u64, "{number} records");
}
