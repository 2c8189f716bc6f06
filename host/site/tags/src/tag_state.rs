//! State of each tag: last value, quality and times, split into hot and cold parts.

use busbar_types::{DoublePoint, Origin, Quality, Reason, Text, Value, ValueKind};

use crate::packed::Packed;
use crate::timing_wheel::{NO_SLOT, Slot};
use crate::{
    Change, Moment, QualityCounts, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagState,
};

const NANOS_PER_MILLISECOND: u64 = 1_000_000;

/// Hot state of a tag, which nearly every sample reads and writes: half a cache line, in an array
/// of its own, since a burst finds these cold.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct HotState {
    /// Bits of [`HotState::value`]. The kind is stored apart, so that all fits into half a cache
    /// line.
    value_bits: u64,
    pub(crate) source_nanos: i64,
    /// Time at which the value was true; without meaning where there is no value.
    pub(crate) valid_from: Moment,
    freshness_millis: u32,
    value_kind: Option<ValueKind>,
    pub(crate) kind: ValueKind,
    /// Rank of the quality that the counts have it under, and [`PLAIN`].
    state: u8,
    origin: Origin,
}

/// Bit of [`HotState::state`] for a plain tag: only its own samples, unscaled, set it, and no
/// derived tag depends on it.
const PLAIN: u8 = 1 << 7;
/// State of a plain tag that counts as good.
const PLAIN_GOOD: u8 = PLAIN;

const _: () = assert!(size_of::<HotState>() == 32);

/// Cold state of a tag.
#[derive(Clone, Debug)]
pub(crate) struct ColdState {
    /// Slot in the timing wheel, or [`NO_SLOT`]; never later than the deadline.
    pub(crate) slot: Slot,
    /// Quality that the source gave.
    pub(crate) source_quality: Quality,
    /// Quality by the host's rules for the value.
    pub(crate) verdict: Quality,
    /// Doubt of the host about the value's time or its way here.
    pub(crate) doubt: Quality,
    /// True where range, scale or dead band apply.
    pub(crate) has_rules: bool,
    pub(crate) is_derived: bool,
    /// True where derived tags depend on this one.
    pub(crate) is_input: bool,
    /// True where its source reports every change, also after a stop of this process.
    pub(crate) stays_current_across_stops: bool,
    /// Last text, where the value is one.
    text: Option<Text>,
}

/// States of all tags, by handle.
#[derive(Debug)]
pub(crate) struct TagStates {
    pub(crate) hot: Vec<HotState>,
    cold: Vec<ColdState>,
}

/// Mark of a missing source time.
pub(crate) const NO_TIME: i64 = i64::MIN;

/// Returns the quality of a value by its kind alone.
#[inline(always)]
pub(crate) fn value_quality(value: &Value, kind: ValueKind) -> Quality {
    if value.kind() != kind {
        return Quality::Bad(Reason::Configuration);
    }
    match value {
        Value::DoublePoint(position) => position.quality(),
        Value::F64(number) if !number.is_finite() => Quality::Bad(Reason::NotFinite),
        Value::Text(text) if !text.is_whole() => Quality::Uncertain(Reason::Configuration),
        _ => Quality::Good,
    }
}

impl HotState {
    fn from_spec(spec: &TagSpec, is_plain: bool) -> Self {
        Self {
            value_bits: 0,
            source_nanos: NO_TIME,
            value_kind: None,
            valid_from: Moment(0),
            freshness_millis: u32::try_from(spec.freshness.as_millis()).unwrap_or(u32::MAX),
            kind: spec.kind,
            state: Quality::Bad(Reason::NotConnected).level().code()
                | if is_plain { PLAIN } else { 0 },
            origin: Origin::LIVE,
        }
    }

    #[inline(always)]
    pub(crate) fn value(&self) -> Packed {
        Packed { bits: self.value_bits, kind: self.value_kind }
    }

    #[inline(always)]
    pub(crate) fn set_value(&mut self, value: Packed) {
        (self.value_bits, self.value_kind) = (value.bits, value.kind);
    }

    /// Inherits value, times and origin from another state of the same type. A text is inherited
    /// by [`ColdState::take_over_text`].
    pub(crate) fn take_over(&mut self, was: &Self) {
        self.set_value(was.value());
        (self.source_nanos, self.valid_from) = (was.source_nanos, was.valid_from);
        self.origin = was.origin;
    }

    /// Rank of the quality that the counts have it under.
    fn counted(&self) -> u8 {
        self.state & !PLAIN
    }

    fn source_time(&self) -> Option<SourceTime> {
        (self.source_nanos != NO_TIME).then_some(SourceTime(self.source_nanos))
    }

    #[inline(always)]
    pub(crate) fn set_times(&mut self, sample: &Sample) {
        self.source_nanos = sample.source_time.map_or(NO_TIME, |time| time.0);
        self.valid_from = sample.valid_from;
        self.origin = sample.origin;
    }

    pub(crate) fn origin(&self) -> Origin {
        self.origin
    }

    /// Reports whether the value is newer than a sample, by source time where both have one.
    #[inline(always)]
    pub(crate) fn is_newer_than(&self, sample: &Sample) -> bool {
        match sample.source_time {
            Some(time) if self.source_nanos != NO_TIME => time.0 < self.source_nanos,
            _ => self.value_kind.is_some() && sample.valid_from < self.valid_from,
        }
    }

    /// Reports whether a sample takes the fast path: a plain good tag gets another good value
    /// that is true no earlier. Its slot in the wheel stays right, and [`TagTable::set`] would
    /// end at the same.
    #[inline(always)]
    pub(crate) fn takes_fast_path(&self, value: &Value, sample: &Sample, now: Moment) -> bool {
        self.state == PLAIN_GOOD
            && sample.quality == Quality::Good
            && sample.doubt == Quality::Good
            && sample.origin == self.origin
            && value_quality(value, self.kind) == Quality::Good
            && !(sample.is_buffered && self.is_newer_than(sample))
            && sample.valid_from >= self.valid_from
            && self.deadline_of(sample.valid_from) >= now
    }

    /// Describes the change that a sample made. `text` is the value of a text.
    #[inline(always)]
    pub(crate) fn change(&self, sample: &Sample, quality: Quality, text: Option<&Text>) -> Change {
        Change {
            tag: sample.tag,
            value: self.value().unpack(text),
            quality,
            source_time: self.source_time(),
            received: sample.received,
            origin: self.origin,
        }
    }

    /// Describes a change without a sample.
    pub(crate) fn state_change(&self, tag: TagHandle, cold: &ColdState, now: Moment) -> Change {
        Change {
            tag,
            value: self.value().unpack(cold.text()),
            quality: cold.own_quality(),
            source_time: self.source_time(),
            received: now,
            origin: self.origin,
        }
    }

    /// The last moment at which the value is fresh.
    #[inline(always)]
    pub(crate) fn deadline(&self) -> Moment {
        self.deadline_of(self.valid_from)
    }

    #[inline(always)]
    fn deadline_of(&self, valid_from: Moment) -> Moment {
        let freshness = u64::from(self.freshness_millis) * NANOS_PER_MILLISECOND;
        Moment(valid_from.0.saturating_add(freshness))
    }

    pub(crate) fn is_stale(&self, now: Moment) -> bool {
        !self.value().is_none() && now > self.deadline()
    }

    fn quality(&self, own: Quality, now: Moment) -> Quality {
        let fresh = if self.value().is_none() {
            Quality::Bad(Reason::NotConnected)
        } else if self.is_stale(now) {
            Quality::Bad(Reason::Stale)
        } else {
            Quality::Good
        };
        own.worst(fresh)
    }
}

impl ColdState {
    fn from_spec(spec: &TagSpec, is_input: bool) -> Self {
        Self {
            slot: NO_SLOT,
            source_quality: Quality::Bad(Reason::NotConnected),
            verdict: Quality::Good,
            doubt: Quality::Good,
            has_rules: spec.range.is_some() || spec.scale.is_some() || spec.dead_band > 0.0,
            is_derived: spec.expression.is_some(),
            is_input,
            stays_current_across_stops: false,
            text: None,
        }
    }

    /// Returns the last text, where the value is one.
    pub(crate) fn text(&self) -> Option<&Text> {
        self.text.as_ref()
    }

    /// Inherits the text of another state.
    pub(crate) fn take_over_text(&mut self, was: &Self) {
        self.text.clone_from(&was.text);
    }

    /// Returns the quality without freshness.
    #[inline(always)]
    pub(crate) fn own_quality(&self) -> Quality {
        self.source_quality.worst(self.verdict).worst(self.doubt)
    }
}

impl TagStates {
    /// Creates tags without values.
    pub(crate) fn new(tags: &TagSet) -> Self {
        let cold =
            |(spec, tag)| ColdState::from_spec(spec, tags.derived().is_input(TagHandle(tag)));
        let cold: Vec<ColdState> = tags.specs().iter().zip(0..).map(cold).collect();
        let hot = |(spec, tag): (_, &ColdState)| {
            HotState::from_spec(spec, !(tag.has_rules | tag.is_derived | tag.is_input))
        };
        Self { hot: tags.specs().iter().zip(&cold).map(hot).collect(), cold }
    }

    pub(crate) fn len(&self) -> usize {
        self.hot.len()
    }

    /// Returns the state of a tag that exists.
    pub(crate) fn get(&self, tag: TagHandle) -> (&HotState, &ColdState) {
        (&self.hot[tag.0 as usize], &self.cold[tag.0 as usize])
    }

    /// Returns the state of a tag that exists.
    pub(crate) fn get_mut(&mut self, tag: TagHandle) -> (&mut HotState, &mut ColdState) {
        (&mut self.hot[tag.0 as usize], &mut self.cold[tag.0 as usize])
    }

    /// Counts a tag under the quality that it has at `now`.
    pub(crate) fn count(&mut self, tag: TagHandle, counts: &mut QualityCounts, now: Moment) {
        let (hot, cold) = self.get_mut(tag);
        let level = hot.quality(cold.own_quality(), now).level().code();
        if level != hot.counted() {
            *counts.count_mut(hot.counted()) -= 1;
            *counts.count_mut(level) += 1;
            hot.state = hot.state & PLAIN | level;
        }
    }

    pub(crate) fn state(&self, tag: TagHandle, now: Moment) -> Option<TagState> {
        let index = tag.0 as usize;
        Some(state(self.hot.get(index)?, self.cold.get(index)?, now))
    }

    pub(crate) fn states(&self, now: Moment) -> impl ExactSizeIterator<Item = TagState> {
        self.hot.iter().zip(&self.cold).map(move |(hot, tag)| state(hot, tag, now))
    }
}

fn state(hot: &HotState, cold: &ColdState, now: Moment) -> TagState {
    let value = hot.value().unpack(cold.text());
    let quality = hot.quality(cold.own_quality(), now);
    let is_contradiction = value == Some(Value::DoublePoint(DoublePoint::BadState));
    let report_quality = match is_contradiction && hot.kind == ValueKind::DoublePoint {
        true if !cold.is_derived => hot.quality(cold.source_quality.worst(cold.doubt), now),
        _ => quality,
    };
    let age = value.as_ref().map(|_| now.since(hot.valid_from));
    TagState {
        value,
        quality,
        report_quality,
        age,
        source_time: hot.source_time(),
        origin: hot.origin,
    }
}

/// Returns the quality of a value in the tag's unit, its range included.
pub(crate) fn value_quality_in_range(value: &Value, kind: ValueKind, spec: &TagSpec) -> Quality {
    match value_quality(value, kind) {
        Quality::Good => match (value.as_number(), &spec.range) {
            (Some(number), Some(range)) if !range.contains(&number) => {
                Quality::Uncertain(Reason::OutOfRange)
            }
            _ => Quality::Good,
        },
        verdict => verdict,
    }
}

/// Sets the value of a tag as it is.
pub(crate) fn set_value(hot: &mut HotState, cold: &mut ColdState, value: &Value) {
    let packed = Packed::from_value(value);
    match (packed, value) {
        (Some(value), _) => {
            hot.set_value(value);
            cold.text = None;
        }
        (None, Value::Text(text)) if cold.text.as_ref() != Some(text) => {
            let bits = hot.value().bits.wrapping_add(1);
            hot.set_value(Packed { bits, kind: Some(ValueKind::Text) });
            cold.text = Some(text.clone());
        }
        (None, _) => {}
    }
}

/// Scale, dead band and range: a value goes into its tag as they have it.
pub(crate) fn apply_rules(hot: &mut HotState, cold: &mut ColdState, value: &Value, spec: &TagSpec) {
    let scaled = match (value, spec.scale) {
        (Value::F64(number), Some(scale)) => Some(Value::F64(scale.apply(*number))),
        _ => None,
    };
    let value = scaled.as_ref().unwrap_or(value);
    let verdict = value_quality_in_range(value, hot.kind, spec);
    let old = hot.value().unpack(None).and_then(|value| value.as_number());
    let within = match (old, value.as_number()) {
        (Some(old), Some(new)) => (new - old).abs() < spec.dead_band,
        _ => false,
    };
    if !within || verdict != cold.verdict {
        set_value(hot, cold, value);
    }
    cold.verdict = verdict;
}
