//! Intake of raw samples: validation of a telemetry plugin's samples and of their times.

use std::time::Duration;

use busbar_plugin_abi as abi;
use busbar_tags::{Moment, Sample, SourceTime, TagHandle};
use busbar_types::{Origin, Quality, Reason, Value, ValueKind};

use crate::source_clock::{ClockReport, FreshnessBasis, MAX_CLOCK_AHEAD, SourceClock};
use crate::{PublishedSample, TelemetryTag};

/// A good, live measurement: its small fields, as one number.
const PLAIN: u32 = u32::from_le_bytes([
    abi::BUSBAR_VALUE_KIND_F64,
    abi::BUSBAR_QUALITY_GOOD,
    abi::BUSBAR_REASON_NONE,
    0,
]);
/// Flags that a sample may have.
const KNOWN_FLAGS: u8 =
    abi::BUSBAR_SAMPLE_BUFFERED | abi::BUSBAR_SAMPLE_TIME_UNUSABLE | ORIGIN_FLAGS;
/// Flags that tell the origin of a sample.
const ORIGIN_FLAGS: u8 = abi::BUSBAR_ORIGIN_SUBSTITUTED
    | abi::BUSBAR_ORIGIN_TEST
    | abi::BUSBAR_ORIGIN_SIMULATED
    | abi::BUSBAR_ORIGIN_RECORDED
    | abi::BUSBAR_ORIGIN_HISTORICAL;
/// Doubt about a value whose source time is not believed. It stays until the next value.
const UNBELIEVED: Quality = Quality::Uncertain(Reason::SourceTime);
/// Source time of a tag that has none yet.
const NO_TIME: i64 = i64::MIN;
/// Time for which one value of the future casts doubt on tags that have shown but one time:
/// the clocks differ, and an old value may look as if it were of now.
const DOUBT_AFTER_FUTURE: Duration = Duration::from_secs(60);
/// Least step back of the host's clock that casts the same doubt, nanoseconds.
const MIN_HOST_STEP: i64 = 1_000_000_000;

/// Receiver of samples that passed the intake.
pub trait SampleSink {
    /// Takes a valid sample. Implementations should be inlined where there may be millions a
    /// second.
    fn take(&mut self, sample: &Sample);
}

impl<F: FnMut(&Sample)> SampleSink for F {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        self(sample);
    }
}

/// Rules of the configuration for all samples of one telemetry instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourcePolicy {
    /// Origin that all samples have, beside what plugin and protocol say.
    pub origin: Origin,
    /// Time from which the age of values is counted.
    pub basis: FreshnessBasis,
}

/// Judges the samples of one telemetry instance, whichever way they come.
#[derive(Clone, Debug)]
pub struct SampleIntake {
    /// Time state of each tag, by tag handle.
    tags: Vec<TagTimes>,
    policy: SourcePolicy,
    clock: SourceClock,
    /// Moment up to which unproven times are doubted.
    doubt_until: Moment,
    /// Wall clock less the clock of moments, nanoseconds.
    clock_offset: Option<i64>,
}

/// Times of one tag's live samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TagTimes {
    /// Source time of the last one, nanoseconds, or [`NO_TIME`].
    last: i64,
    /// Moment from which the last one was true; later for no other sample of its time.
    valid_from: Moment,
    state: TagClock,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TagClock {
    /// Tag of another plugin instance.
    Foreign,
    /// No time has been seen.
    Untimed,
    /// At most one possible time has been seen of live values.
    Unproven,
    /// The last two times were different and possible.
    Plausible,
    /// The last time was ahead of the host's clock. The same time stays unusable after the host's
    /// clock has caught up.
    Ahead,
}

/// Verdict on the time of a sample.
struct JudgedTime {
    source_time: Option<SourceTime>,
    valid_from: Moment,
    is_believed: bool,
}

impl SampleIntake {
    /// Creates the intake for samples of these tags.
    pub fn new(tags: &[TelemetryTag], policy: SourcePolicy) -> Self {
        let size = tags.iter().map(|t| t.tag.0 as usize + 1).max().unwrap_or(0);
        let foreign = TagTimes { last: NO_TIME, valid_from: Moment(0), state: TagClock::Foreign };
        let mut times = vec![foreign; size];
        for tag in tags {
            times[tag.tag.0 as usize].state = TagClock::Untimed;
        }
        let clock = SourceClock::new(policy.basis);
        Self { tags: times, policy, clock, doubt_until: Moment(0), clock_offset: None }
    }

    /// Findings about the source's clock so far.
    pub fn clock_report(&self) -> ClockReport {
        self.clock.report()
    }

    /// Follows the host's wall clock. Where it was set back, old times may look current: every
    /// tag has to prove its times anew.
    pub fn follow_clock(&mut self, wall_clock: SourceTime, now: Moment) {
        let offset = wall_clock.0.saturating_sub_unsigned(now.0);
        let before = self.clock_offset.replace(offset);
        if before.is_some_and(|before| offset < before.saturating_sub(MIN_HOST_STEP)) {
            self.doubt_until = now.after(DOUBT_AFTER_FUTURE);
            let proven = self.tags.iter_mut().filter(|times| times.state == TagClock::Plausible);
            proven.for_each(|times| times.state = TagClock::Unproven);
        }
    }

    /// Adds origins to all samples from now on.
    pub fn add_origin(&mut self, origin: Origin) {
        self.policy.origin |= origin;
    }

    /// Origin that all samples have.
    pub fn origin(&self) -> Origin {
        self.policy.origin
    }

    /// Hands the sample to `sink`; returns whether it did, and not where the sample names
    /// another's tag or makes no sense. It was received at `received`, which `wall_clock`
    /// called so.
    #[inline(always)]
    pub fn take(
        &mut self,
        raw: &PublishedSample,
        received: Moment,
        wall_clock: SourceTime,
        sink: &mut impl SampleSink,
    ) -> bool {
        let Some(times) = self.tags.get_mut(raw.tag as usize) else { return false };
        // There may be millions a second, nearly all of them good measurements with a time
        // since 1970 that has come: these cost least.
        let source_time = raw.source_time_unix_nanos;
        let is_plain = u32::from_le_bytes([raw.kind, raw.quality, raw.reason, raw.flags]) == PLAIN
            && (0..=wall_clock.0).contains(&source_time)
            && times.state == TagClock::Plausible
            && source_time > times.last
            && self.policy == SourcePolicy::default();
        if !is_plain {
            return self.take_other(raw, received, wall_clock, sink);
        }
        let ahead = source_time - wall_clock.0;
        let valid_from = Moment(received.0.saturating_sub(ahead.unsigned_abs()));
        (times.last, times.valid_from) = (source_time, valid_from);
        self.clock.note(ahead, received);
        sink.take(&Sample {
            tag: TagHandle(raw.tag),
            value: Some(Value::F64(f64::from_bits(raw.bits))),
            quality: Quality::Good,
            doubt: Quality::Good,
            source_time: Some(SourceTime(source_time)),
            received,
            valid_from,
            origin: Origin::LIVE,
            is_buffered: false,
        });
        true
    }

    #[cold]
    #[inline(never)]
    fn take_other(
        &mut self,
        raw: &PublishedSample,
        received: Moment,
        wall_clock: SourceTime,
        sink: &mut impl SampleSink,
    ) -> bool {
        let doubted_until = self.doubt_until;
        let sample = self.validate(raw, received, wall_clock);
        if doubted_until < received && received < self.doubt_until {
            self.doubt_unproven(received, sink);
        }
        sample.is_some_and(|sample| {
            sink.take(&sample);
            true
        })
    }

    /// Doubts the values of all tags that have shown one time alone: the first value of the
    /// future came after them.
    fn doubt_unproven(&self, received: Moment, sink: &mut impl SampleSink) {
        for (times, tag) in self.tags.iter().zip(0..) {
            if times.state == TagClock::Unproven {
                let good = Sample::live(TagHandle(tag), None, Quality::Good, received);
                sink.take(&good.with_doubt(UNBELIEVED));
            }
        }
    }

    /// Any sample of a tag that may be set.
    fn validate(
        &mut self,
        raw: &PublishedSample,
        received: Moment,
        wall_clock: SourceTime,
    ) -> Option<Sample> {
        let is_foreign = self.tags.get(raw.tag as usize)?.state == TagClock::Foreign;
        if is_foreign || raw.flags & !KNOWN_FLAGS != 0 {
            return None;
        }
        let value = value(raw)?;
        let quality = Quality::from_codes(raw.quality, raw.reason)?;
        let is_buffered = raw.flags & abi::BUSBAR_SAMPLE_BUFFERED != 0;
        let time = match &value {
            Some(_) => self.judge_time(raw, received, wall_clock),
            // Nothing is said of a value, so nothing of when it was so.
            None => JudgedTime { source_time: None, valid_from: received, is_believed: true },
        };
        // A plugin may doubt the time of its value as well.
        let is_doubted =
            !time.is_believed || (value.is_some() && quality.reason() == Some(Reason::SourceTime));
        let sample = Sample {
            tag: TagHandle(raw.tag),
            value,
            quality,
            doubt: Quality::Good,
            source_time: time.source_time,
            received,
            valid_from: time.valid_from,
            origin: self.policy.origin | abi::origin_of_flags(raw.flags),
            is_buffered,
        };
        Some(if is_doubted { sample.with_doubt(UNBELIEVED) } else { sample })
    }

    /// Judges the time of a sample with a value.
    fn judge_time(
        &mut self,
        raw: &PublishedSample,
        received: Moment,
        wall_clock: SourceTime,
    ) -> JudgedTime {
        let times = &mut self.tags[raw.tag as usize];
        let source_time = raw.source_time_unix_nanos;
        let is_buffered = raw.flags & abi::BUSBAR_SAMPLE_BUFFERED != 0;
        let counts_reception = self.policy.basis == FreshnessBasis::Reception && !is_buffered;
        let is_unusable = raw.flags & abi::BUSBAR_SAMPLE_TIME_UNUSABLE != 0
            || (source_time != abi::BUSBAR_NO_TIME && source_time < 0);
        if is_unusable || source_time == abi::BUSBAR_NO_TIME {
            if is_unusable {
                self.clock.note_unusable();
            }
            let is_believed = !is_unusable || counts_reception;
            return JudgedTime { source_time: None, valid_from: received, is_believed };
        }
        let ahead = source_time.saturating_sub(wall_clock.0);
        let is_future = ahead > MAX_CLOCK_AHEAD;
        let mut valid_from = Moment(received.0.saturating_sub(ahead.min(0).unsigned_abs()));
        if source_time == times.last {
            // The same again is no younger, whatever the host's clock shows by now.
            valid_from = valid_from.min(times.valid_from);
        }
        if !is_buffered {
            self.clock.note(ahead, received);
            if source_time != times.last {
                if source_time < times.last {
                    self.clock.note_older(ahead, times.last.saturating_sub(source_time));
                }
                times.state = match times.state {
                    _ if is_future => TagClock::Ahead,
                    _ if times.last == NO_TIME => TagClock::Unproven,
                    _ => TagClock::Plausible,
                };
            }
            (times.last, times.valid_from) = (source_time, valid_from);
        } else if times.state == TagClock::Untimed {
            times.state = TagClock::Unproven;
        }
        if is_future {
            self.clock.note_future();
            self.doubt_until = received.after(DOUBT_AFTER_FUTURE);
        }
        let is_believed = !is_future
            && match times.state {
                TagClock::Ahead => false,
                TagClock::Untimed | TagClock::Unproven => received >= self.doubt_until,
                TagClock::Plausible | TagClock::Foreign => true,
            };
        if counts_reception {
            let source_time = Some(SourceTime(source_time));
            return JudgedTime { source_time, valid_from: received, is_believed: true };
        }
        // A time of the future would shut out all that a buffer holds after it.
        let source_time = (!is_future).then_some(SourceTime(source_time));
        JudgedTime { source_time, valid_from, is_believed }
    }
}

/// Value of a sample; none for a kind that is not known, or a position that no switch has.
fn value(raw: &PublishedSample) -> Option<Option<Value>> {
    if raw.kind == abi::BUSBAR_VALUE_KIND_NONE {
        return Some(None);
    }
    let value = match ValueKind::from_code(raw.kind)? {
        ValueKind::Text => Value::Text(raw.text.clone()?),
        ValueKind::DoublePoint if raw.bits > 3 => return None,
        kind => Value::from_bits(kind, raw.bits)?,
    };
    Some(Some(value))
}

#[cfg(test)]
#[path = "sample_intake_tests.rs"]
mod tests;
