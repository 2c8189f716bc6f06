//! One tag of the table: its last value, and what it is worth.

use crate::value::Packed;
use crate::wheel::{NO_SLOT, Slot, Wheel};
use crate::{
    Change, DoublePoint, Moment, Quality, QualityCounts, Reason, Sample, SourceTime, TagHandle,
    TagSpec, TagState, Value, ValueKind,
};

const NANOS_PER_MILLISECOND: u64 = 1_000_000;

/// One tag, on a cache line of its own.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Cell {
    /// What [`Cell::value`] and [`Cell::source_time`] are made of: apart, all fits.
    value_bits: u64,
    pub(crate) source_nanos: i64,
    value_kind: Option<ValueKind>,
    /// When the value was true; of no meaning without one.
    pub(crate) valid_from: Moment,
    /// Where the wheel has it, or [`NO_SLOT`].
    pub(crate) slot: Slot,
    freshness_millis: u32,
    /// What the source says of the tag.
    pub(crate) source_quality: Quality,
    /// What the host says of the value.
    pub(crate) verdict: Quality,
    pub(crate) kind: ValueKind,
    /// Rank of the quality that the counts have it under.
    counted: u8,
    /// Whether range, scale or dead band have to be looked up.
    pub(crate) has_rules: bool,
    pub(crate) is_derived: bool,
    /// Whether derived tags rest on it.
    pub(crate) is_input: bool,
    /// The turn in which it changed last.
    changed_in: u64,
}

const _: () = assert!(size_of::<Cell>() == 64);
/// No source time.
pub(crate) const NO_TIME: i64 = i64::MIN;

/// What the host itself says of a value.
#[inline]
pub(crate) fn judge(value: Value, kind: ValueKind) -> Quality {
    if value.kind() != kind {
        return Quality::Bad(Reason::Configuration);
    }
    match value {
        Value::DoublePoint(DoublePoint::BadState) => Quality::Uncertain(Reason::Sensor),
        Value::F64(number) if !number.is_finite() => Quality::Bad(Reason::NotFinite),
        _ => Quality::Good,
    }
}

impl Cell {
    pub(crate) fn of(spec: &TagSpec) -> Self {
        Self {
            value_bits: 0,
            source_nanos: NO_TIME,
            value_kind: None,
            valid_from: Moment(0),
            slot: NO_SLOT,
            freshness_millis: u32::try_from(spec.freshness.as_millis()).unwrap_or(u32::MAX),
            source_quality: Quality::Bad(Reason::NotConnected),
            verdict: Quality::Good,
            kind: spec.kind,
            counted: Quality::Bad(Reason::NotConnected).rank(),
            has_rules: spec.range.is_some() || spec.scale.is_some() || spec.dead_band > 0.0,
            is_derived: spec.expression.is_some(),
            is_input: false,
            changed_in: 0,
        }
    }

    /// Puts the cell under the quality that it has at `now`.
    #[inline]
    pub(crate) fn count(&mut self, counts: &mut QualityCounts, now: Moment) {
        let rank = self.quality(now).rank();
        if rank != self.counted {
            *counts.of(self.counted) -= 1;
            *counts.of(rank) += 1;
            self.counted = rank;
        }
    }

    /// Notes, once a turn, that the cell's tag changes.
    #[inline]
    pub(crate) fn note_change(&mut self, tag: TagHandle, turn: u64, into: &mut Vec<TagHandle>) {
        if self.changed_in != turn {
            self.changed_in = turn;
            into.push(tag);
        }
    }

    #[inline]
    pub(crate) fn value(&self) -> Packed {
        Packed { bits: self.value_bits, kind: self.value_kind }
    }

    #[inline]
    pub(crate) fn set_value(&mut self, value: Packed) {
        (self.value_bits, self.value_kind) = (value.bits, value.kind);
    }

    fn source_time(&self) -> Option<SourceTime> {
        (self.source_nanos != NO_TIME).then_some(SourceTime(self.source_nanos))
    }

    #[inline]
    pub(crate) fn set_times(&mut self, sample: &Sample) {
        self.source_nanos = sample.source_time.map_or(NO_TIME, |time| time.0);
        self.valid_from = sample.valid_from;
    }

    /// By source time, where both have one.
    #[inline]
    pub(crate) fn is_newer_than(&self, sample: &Sample) -> bool {
        sample.source_time.is_some_and(|time| time.0 < self.source_nanos)
    }

    /// Whether it is a good tag without rules, to which a sample brings but another good
    /// value: nearly all samples do, and [`TagTable::set`] would end at the same.
    #[inline]
    pub(crate) fn stays_good(&self, value: Value, sample: &Sample, now: Moment) -> bool {
        let is_plain = !(self.has_rules | self.is_derived | self.is_input);
        let deadline = self.deadline_of(sample.valid_from);
        is_plain
            && self.counted == Quality::Good.rank()
            && sample.quality == Quality::Good
            && judge(value, self.kind) == Quality::Good
            && !self.is_newer_than(sample)
            && deadline >= now
            && Wheel::is_within(deadline, self.slot)
    }

    #[inline]
    pub(crate) fn change(&self, sample: &Sample) -> Change {
        Change {
            tag: sample.tag,
            value: self.value().unpack(),
            quality: self.own_quality(),
            source_time: self.source_time(),
            received: sample.received,
        }
    }

    /// Scale, dead band and range.
    pub(crate) fn judge_by_rules(&mut self, value: Value, spec: &TagSpec) {
        let value = match (value, spec.scale) {
            (Value::F64(number), Some(scale)) => Value::F64(scale.apply(number)),
            (value, _) => value,
        };
        let verdict = match judge(value, self.kind) {
            Quality::Good => match (value.as_number(), &spec.range) {
                (Some(number), Some(range)) if !range.contains(&number) => {
                    Quality::Uncertain(Reason::OutOfRange)
                }
                _ => Quality::Good,
            },
            verdict => verdict,
        };
        let within = match (self.value().unpack().and_then(Value::as_number), value.as_number()) {
            (Some(old), Some(new)) => (new - old).abs() < spec.dead_band,
            _ => false,
        };
        if !within || verdict != self.verdict {
            self.set_value(Packed::of(value));
        }
        self.verdict = verdict;
    }

    /// The last moment at which the value is fresh.
    #[inline]
    pub(crate) fn deadline(&self) -> Moment {
        self.deadline_of(self.valid_from)
    }

    #[inline]
    fn deadline_of(&self, valid_from: Moment) -> Moment {
        let freshness = u64::from(self.freshness_millis) * NANOS_PER_MILLISECOND;
        Moment(valid_from.0.saturating_add(freshness))
    }

    pub(crate) fn is_stale(&self, now: Moment) -> bool {
        !self.value().is_none() && now > self.deadline()
    }

    /// Quality without freshness.
    #[inline]
    pub(crate) fn own_quality(&self) -> Quality {
        self.source_quality.worst(self.verdict)
    }

    fn quality(&self, now: Moment) -> Quality {
        let fresh = if self.value().is_none() {
            Quality::Bad(Reason::NotConnected)
        } else if self.is_stale(now) {
            Quality::Bad(Reason::Stale)
        } else {
            Quality::Good
        };
        self.own_quality().worst(fresh)
    }

    pub(crate) fn state(&self, now: Moment) -> TagState {
        TagState {
            value: self.value().unpack(),
            quality: self.quality(now),
            age: (!self.value().is_none()).then(|| now.since(self.valid_from)),
            source_time: self.source_time(),
        }
    }
}
