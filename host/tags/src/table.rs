//! The tag table: the last value of every tag, and what it is worth.

use std::ops::RangeInclusive;
use std::time::{Duration, Instant, SystemTime};

use serde::{Deserialize, Serialize};

use crate::{DoublePoint, Quality, Reason, Sample, Value, ValueKind};

/// Names a tag within one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TagHandle(pub u32);

/// What a tag is.
#[derive(Clone, Debug, PartialEq)]
pub struct TagSpec {
    /// Unique id.
    pub id: String,
    /// Name for people.
    pub name: String,
    /// Type of its values; a sample of another type is bad.
    pub kind: ValueKind,
    /// Unit, such as `kV`; empty for none.
    pub unit: String,
    /// Plausible measuring range: a value outside it is uncertain.
    pub range: Option<RangeInclusive<f64>>,
    /// How old a value may be before it is stale.
    pub freshness: Duration,
}

/// A tag at one instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagState {
    /// The last value that came, however old or bad.
    pub value: Option<Value>,
    /// Quality, freshness included.
    pub quality: Quality,
    /// Age of the value: time since it came, and its lag before that.
    pub age: Option<Duration>,
}

/// All tags at one instant, by handle.
#[derive(Clone, Debug)]
pub struct Snapshot {
    states: Vec<TagState>,
}

/// How many tags have which quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QualityCounts {
    /// Good tags.
    pub good: usize,
    /// Uncertain tags.
    pub uncertain: usize,
    /// Bad tags.
    pub bad: usize,
}

/// The tags of a scene and their last values.
#[derive(Debug, Default)]
pub struct TagTable {
    specs: Vec<TagSpec>,
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    value: Option<Value>,
    /// When the value was true: when it came, less its lag.
    value_from: Option<Instant>,
    source_time: Option<SystemTime>,
    /// What the source says of the tag.
    source_quality: Quality,
    /// What the host says of the value.
    verdict: Quality,
}

impl TagTable {
    /// A table of tags without values. A tag's handle is its place in `specs`.
    pub fn new(specs: Vec<TagSpec>) -> Self {
        let entry = Entry {
            value: None,
            value_from: None,
            source_time: None,
            source_quality: Quality::Bad(Reason::NotConnected),
            verdict: Quality::Good,
        };
        Self { entries: vec![entry; specs.len()], specs }
    }

    /// Takes samples over, in order. Returns how many named no tag of this
    /// table or were older, at their source, than the value there is.
    pub fn apply(&mut self, samples: impl IntoIterator<Item = Sample>) -> usize {
        samples.into_iter().filter(|sample| !self.apply_one(sample)).count()
    }

    /// All tags as they are at `now`.
    pub fn snapshot(&self, now: Instant) -> Snapshot {
        let state = |(entry, spec): (&Entry, &TagSpec)| entry.state(spec, now);
        Snapshot { states: self.entries.iter().zip(&self.specs).map(state).collect() }
    }

    fn apply_one(&mut self, sample: &Sample) -> bool {
        let index = sample.tag.0 as usize;
        let (Some(entry), Some(spec)) = (self.entries.get_mut(index), self.specs.get(index)) else {
            return false;
        };
        let Some(value) = sample.value else {
            entry.source_quality = sample.quality;
            return true;
        };
        // An older source time never overwrites a newer one.
        if let (Some(new), Some(old)) = (sample.source_time, entry.source_time)
            && new < old
        {
            return false;
        }
        entry.source_quality = sample.quality;
        entry.value = Some(value);
        entry.verdict = judge(value, spec);
        // A value that was old when it came is as old as its source says.
        entry.value_from = sample.received.checked_sub(sample.lag).or(Some(sample.received));
        entry.source_time = sample.source_time;
        true
    }
}

/// What the host itself says of a value.
fn judge(value: Value, spec: &TagSpec) -> Quality {
    if value.kind() != spec.kind {
        return Quality::Bad(Reason::Configuration);
    }
    if value == Value::DoublePoint(DoublePoint::BadState) {
        return Quality::Uncertain(Reason::Sensor);
    }
    match (value.as_number(), &spec.range) {
        (Some(number), _) if !number.is_finite() => Quality::Bad(Reason::NotFinite),
        (Some(number), Some(range)) if !range.contains(&number) => {
            Quality::Uncertain(Reason::OutOfRange)
        }
        _ => Quality::Good,
    }
}

impl Entry {
    fn state(&self, spec: &TagSpec, now: Instant) -> TagState {
        let age = self.value_from.map(|from| now.saturating_duration_since(from));
        let fresh = match age {
            None => Quality::Bad(Reason::NotConnected),
            Some(age) if age > spec.freshness => Quality::Bad(Reason::Stale),
            Some(_) => Quality::Good,
        };
        TagState {
            value: self.value,
            quality: self.source_quality.worst(self.verdict).worst(fresh),
            age,
        }
    }
}

impl Snapshot {
    /// The state of a tag of the same table.
    pub fn state(&self, tag: TagHandle) -> Option<&TagState> {
        self.states.get(tag.0 as usize)
    }

    /// All states, by handle.
    pub fn states(&self) -> &[TagState] {
        &self.states
    }

    /// How many tags have which quality.
    pub fn counts(&self) -> QualityCounts {
        let mut counts = QualityCounts::default();
        for state in &self.states {
            match state.quality {
                Quality::Good => counts.good += 1,
                Quality::Uncertain(_) => counts.uncertain += 1,
                Quality::Bad(_) => counts.bad += 1,
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MAX_QUEUED_SAMPLES, SampleQueue};

    const TAG: TagHandle = TagHandle(0);

    fn table() -> TagTable {
        TagTable::new(vec![TagSpec {
            id: "T1.TopOil".into(),
            name: "Top oil".into(),
            kind: ValueKind::F64,
            unit: "°C".into(),
            range: Some(-40.0..=150.0),
            freshness: Duration::from_secs(3),
        }])
    }

    fn sample(value: f64, received: Instant) -> Sample {
        Sample {
            tag: TAG,
            value: Some(Value::F64(value)),
            quality: Quality::Good,
            source_time: None,
            lag: Duration::ZERO,
            received,
        }
    }

    fn quality_of(table: &TagTable, now: Instant) -> Quality {
        table.snapshot(now).state(TAG).unwrap().quality
    }

    #[test]
    fn a_tag_without_a_value_is_not_connected() {
        let now = Instant::now();
        assert_eq!(quality_of(&table(), now), Quality::Bad(Reason::NotConnected));
    }

    #[test]
    fn a_value_past_its_limit_is_stale_whatever_its_source_says() {
        let (mut table, start) = (table(), Instant::now());
        table.apply([sample(60.0, start)]);
        assert_eq!(quality_of(&table, start + Duration::from_secs(3)), Quality::Good);
        let late = start + Duration::from_millis(3001);
        assert_eq!(quality_of(&table, late), Quality::Bad(Reason::Stale));
        let state = *table.snapshot(late).state(TAG).unwrap();
        assert_eq!(state.value, Some(Value::F64(60.0)), "the last value stays, marked");
        assert_eq!(state.age, Some(Duration::from_millis(3001)));
    }

    #[test]
    fn a_quality_without_a_value_does_not_make_the_value_fresh() {
        let (mut table, start) = (table(), Instant::now());
        table.apply([sample(60.0, start)]);
        let later = start + Duration::from_secs(2);
        let bad = Quality::Bad(Reason::Communication);
        table.apply([Sample { value: None, quality: bad, ..sample(0.0, later) }]);
        assert_eq!(quality_of(&table, later), bad);
        let good = Sample { value: None, quality: Quality::Good, ..sample(0.0, later) };
        table.apply([good]);
        let past = start + Duration::from_secs(4);
        assert_eq!(quality_of(&table, past), Quality::Bad(Reason::Stale));
    }

    #[test]
    fn a_good_quality_without_a_value_does_not_launder_a_bad_value() {
        let now = Instant::now();
        for value in [Value::F64(f64::NAN), Value::F64(151.0), Value::Bool(true)] {
            let mut table = table();
            table.apply([Sample { value: Some(value), ..sample(0.0, now) }]);
            let before = quality_of(&table, now);
            assert!(!before.is_good());
            table.apply([Sample { value: None, quality: Quality::Good, ..sample(0.0, now) }]);
            assert_eq!(quality_of(&table, now), before, "{value:?}");
        }
    }

    #[test]
    fn a_value_that_was_old_when_it_came_is_stale_at_once() {
        let (mut table, now) = (table(), Instant::now());
        table.apply([Sample { lag: Duration::from_secs(4), ..sample(60.0, now) }]);
        assert_eq!(quality_of(&table, now), Quality::Bad(Reason::Stale));
    }

    #[test]
    fn a_bad_quality_is_taken_whatever_its_source_time() {
        let (mut table, now) = (table(), Instant::now());
        let new = SystemTime::UNIX_EPOCH + Duration::from_secs(100);
        table.apply([Sample { source_time: Some(new), ..sample(1.0, now) }]);
        let bad = Quality::Bad(Reason::Communication);
        let old = Some(SystemTime::UNIX_EPOCH);
        table.apply([Sample { value: None, quality: bad, source_time: old, ..sample(0.0, now) }]);
        assert_eq!(quality_of(&table, now), bad);
    }

    #[test]
    fn an_older_source_time_never_overwrites_a_newer_one() {
        let (mut table, now) = (table(), Instant::now());
        let new = SystemTime::UNIX_EPOCH + Duration::from_secs(100);
        let old = SystemTime::UNIX_EPOCH + Duration::from_secs(99);
        table.apply([Sample { source_time: Some(new), ..sample(1.0, now) }]);
        let ignored = table.apply([Sample { source_time: Some(old), ..sample(2.0, now) }]);
        assert_eq!(ignored, 1);
        assert_eq!(table.snapshot(now).state(TAG).unwrap().value, Some(Value::F64(1.0)));
    }

    #[test]
    fn the_host_judges_values_itself() {
        let now = Instant::now();
        let check = |value, expected| {
            let mut table = table();
            table.apply([Sample { value: Some(value), ..sample(0.0, now) }]);
            assert_eq!(quality_of(&table, now), expected, "{value:?}");
        };
        check(Value::F64(150.0), Quality::Good);
        check(Value::F64(150.1), Quality::Uncertain(Reason::OutOfRange));
        check(Value::F64(f64::NAN), Quality::Bad(Reason::NotFinite));
        check(Value::F64(f64::INFINITY), Quality::Bad(Reason::NotFinite));
        check(Value::DoublePoint(DoublePoint::On), Quality::Bad(Reason::Configuration));
        let mut table = TagTable::new(vec![TagSpec {
            kind: ValueKind::DoublePoint,
            range: None,
            ..table().specs[0].clone()
        }]);
        let faulty = Some(Value::DoublePoint(DoublePoint::BadState));
        table.apply([Sample { value: faulty, ..sample(0.0, now) }]);
        assert_eq!(quality_of(&table, now), Quality::Uncertain(Reason::Sensor));
    }

    #[test]
    fn samples_of_unknown_tags_are_counted_and_harmless() {
        let (mut table, now) = (table(), Instant::now());
        assert_eq!(table.apply([Sample { tag: TagHandle(7), ..sample(1.0, now) }]), 1);
    }

    #[test]
    fn a_full_queue_drops_its_oldest_and_counts() {
        let (queue, now) = (SampleQueue::default(), Instant::now());
        queue.publish((0..MAX_QUEUED_SAMPLES + 5).map(|i| sample(i as f64, now)));
        assert_eq!(queue.dropped(), 5);
        let drained = queue.drain();
        assert_eq!(drained.len(), MAX_QUEUED_SAMPLES);
        assert_eq!(drained[0].value, Some(Value::F64(5.0)));
        assert_eq!(queue.drain().len(), 0);
    }
}
