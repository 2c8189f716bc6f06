//! Seeded sequences of values, qualities, times and silences, as a plugin is to send them.

use serde_json::{Value, json};

/// Time between two batches, milliseconds.
pub(crate) const STEP_MILLIS: u64 = 20;
/// Duration of one sequence, milliseconds.
pub(crate) const SEQUENCE_MILLIS: u64 = 1500;
/// Time for which all tags show each of their values at the start, as a reference, milliseconds.
pub(crate) const SHOWN_MILLIS: u64 = 1000;
/// Values that are shown at the start, in order.
pub(crate) const SHOWN: [bool; 2] = [false, true];
const SHOWN_STEPS: u64 = SHOWN_MILLIS / STEP_MILLIS;
/// Steps between two samples of a tag whose value stays the same.
const PERIOD: usize = 5;
const HOUR_MILLIS: i64 = 3_600_000;
const STEPS: u64 = SEQUENCE_MILLIS / STEP_MILLIS;

/// Content of a sample beside its quality.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Said {
    /// Quality alone, without a value.
    Nothing,
    NotANumber,
    /// Value of a gauge (true is abnormal) or of a switch (true is closed).
    Value(bool),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Worth {
    Good,
    Uncertain,
    Bad,
}

/// Source times further ahead of the host than this are not believed, milliseconds.
const MAX_AHEAD_MILLIS: i64 = 10_000;

/// A sample on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sent {
    pub(crate) batch: usize,
    pub(crate) said: Said,
    pub(crate) worth: Worth,
    /// By how much its source time is before the batch, milliseconds.
    pub(crate) age: Option<i64>,
    /// True where the sample comes out of a buffer; only then its source time orders it.
    pub(crate) is_buffered: bool,
    /// True where the source promised a time and sent none that can be read.
    pub(crate) is_time_unusable: bool,
}

/// The samples of each tag, in order.
pub(crate) struct Script {
    pub(crate) tags: Vec<Vec<Sent>>,
    batches: u64,
}

/// A small deterministic generator (Knuth's MMIX constants).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }

    pub(crate) fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }
}

impl Script {
    /// Creates a script: both values of all tags, then a number of sequences for each, one after
    /// the other.
    pub(crate) fn new(tags: usize, sequences: u64, random: &mut Random) -> Self {
        let good = |batch: u64| Sent {
            batch: batch as usize,
            said: Said::Value(SHOWN[(batch / SHOWN_STEPS) as usize]),
            worth: Worth::Good,
            age: None,
            is_buffered: false,
            is_time_unusable: false,
        };
        let shown = SHOWN.len() as u64 * SHOWN_STEPS;
        let mut all = vec![(0..shown).step_by(PERIOD).map(good).collect(); tags];
        for start in (0..sequences).map(|sequence| shown + sequence * STEPS) {
            all.iter_mut().for_each(|sent| sequence(start, random, sent));
        }
        Self { tags: all, batches: shown + sequences * STEPS }
    }

    /// Formats the script as the JSON document that the plugin reads.
    pub(crate) fn to_json(&self, ids: &[String], start_unix_millis: u64) -> Value {
        let mut batches = vec![Vec::new(); self.batches as usize];
        for (id, sent) in ids.iter().zip(&self.tags) {
            for sent in sent {
                batches[sent.batch].push(sent.to_json(id));
            }
        }
        let batches: Vec<Value> = batches
            .into_iter()
            .zip(0..)
            .map(|(samples, at)| json!({ "at_millis": at * STEP_MILLIS, "samples": samples }))
            .collect();
        json!({
            "start_unix_millis": start_unix_millis,
            "sent": "sent",
            "first": "first",
            "batches": batches,
        })
    }
}

impl Sent {
    /// Reports whether its quality and its time let the host show it as good.
    pub(crate) fn may_be_good(&self) -> bool {
        // Without a value nothing is said of when it was so.
        let is_believed = self.said == Said::Nothing || self.is_time_believed();
        self.worth == Worth::Good && is_believed
    }

    /// Reports whether the source time is present or past, or none where none was promised.
    pub(crate) fn is_time_believed(&self) -> bool {
        self.age.is_none_or(|age| age >= -MAX_AHEAD_MILLIS) && !self.is_time_unusable
    }

    fn to_json(self, id: &str) -> Value {
        // Gauges are abnormal above 100; `on` and `off` are 1 and 0 to none but switches.
        let value = match (self.said, id.starts_with('L')) {
            (Said::Nothing, _) => Value::Null,
            (Said::NotANumber, _) => "nan".into(),
            (Said::Value(closed), true) => if closed { "on" } else { "off" }.into(),
            (Said::Value(abnormal), false) => if abnormal { 150.0 } else { 50.0 }.into(),
        };
        let quality = match self.worth {
            Worth::Good => "good",
            Worth::Uncertain => "uncertain",
            Worth::Bad => "bad",
        };
        let flags = [("buffered", self.is_buffered), ("time_unusable", self.is_time_unusable)];
        let flags: Vec<&str> =
            flags.into_iter().filter_map(|(name, is_set)| is_set.then_some(name)).collect();
        json!({ "tag": id, "value": value, "quality": quality, "age_millis": self.age,
            "flags": flags })
    }
}

/// Generates a stretch of good values as a device sends them, with faults around it.
fn sequence(start: u64, random: &mut Random, into: &mut Vec<Sent>) {
    let mut steps: Vec<Option<Sent>> = vec![None; STEPS as usize];
    if !random.one_in(4) {
        let (from, period) = (random.below(STEPS / 2), 4 + random.below(6));
        let until = from + random.below(STEPS - from);
        let value = random.one_in(2);
        let with_time = random.one_in(2);
        for step in (from..until).step_by(period as usize) {
            let age = with_time.then_some(0);
            let said = Said::Value(value);
            let worth = Worth::Good;
            let (is_buffered, is_time_unusable) = (false, false);
            let sent = Sent { batch: 0, said, worth, age, is_buffered, is_time_unusable };
            steps[step as usize] = Some(sent);
        }
    }
    for _ in 0..random.below(5) {
        let said = match random.below(7) {
            0 | 6 => Said::Nothing,
            1 => Said::NotANumber,
            said => Said::Value(said % 2 == 0),
        };
        let worth = match random.below(4) {
            0 => Worth::Bad,
            1 => Worth::Uncertain,
            _ => Worth::Good,
        };
        let age = match random.below(10) {
            0..3 => None,
            3..5 => Some(0),
            5 => Some(random.below(250) as i64),
            6 => Some(300 + random.below(3_000) as i64),
            7 => Some(-(random.below(5_000) as i64)),
            // Another zone, or a clock that was never set.
            8 => Some(HOUR_MILLIS * (1 + random.below(12) as i64)),
            _ => Some(-HOUR_MILLIS * (1 + random.below(12) as i64)),
        };
        let is_buffered = random.one_in(3);
        let is_time_unusable = age.is_none() && random.one_in(4);
        let sent = Sent { batch: 0, said, worth, age, is_buffered, is_time_unusable };
        steps[random.below(STEPS) as usize] = Some(sent);
    }
    let batches = (start as usize)..;
    into.extend(
        steps.into_iter().zip(batches).filter_map(|(sent, batch)| Some(Sent { batch, ..sent? })),
    );
}
