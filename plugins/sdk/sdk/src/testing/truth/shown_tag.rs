//! Rules of the host's tag table for one tag: the value and quality that an operator sees.
//!
//! A test of `busbar_plugin_host` compares them with the host's own.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::{DoublePoint, Quality, Reason, Sample, SampleFlags, TagSpec, Value, ValueKind};

/// Greatest lead of a source time over the host's clock.
const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(10);
/// Time for which a time of the future casts doubt on a tag that has shown but one.
const DOUBT_AFTER_FUTURE: Duration = Duration::from_secs(60);

/// Tag as the host shows it: its samples so far, by order of arrival, by source time where they are
/// [`SampleFlags::BUFFERED`], and by freshness.
///
/// ```
/// use std::time::{Duration, SystemTime};
/// use busbar_plugin_sdk::testing::{ShownTag, tag_spec};
/// use busbar_plugin_sdk::{Quality, Reason, Sample, Value, ValueKind};
///
/// let start = SystemTime::now();
/// let mut shown = ShownTag::new(&tag_spec(1, "Oil", ValueKind::F64, "oil".into()));
/// shown.take(&Sample::good(1, Value::F64(60.5)), start);
/// assert_eq!(shown.quality(start), Quality::Good);
/// // Past the freshness limit of five seconds.
/// let later = start + Duration::from_secs(6);
/// assert_eq!(shown.quality(later), Quality::Bad(Reason::Stale));
/// ```
#[derive(Clone, Debug)]
pub struct ShownTag {
    kind: ValueKind,
    freshness: Duration,
    value: Option<Value>,
    source_quality: Quality,
    /// Verdict of the host on the value itself.
    verdict: Quality,
    /// Doubt about the value's time, which stays until the next value.
    doubt: Quality,
    source_time: Option<SystemTime>,
    /// Time from which the age counts, by the host's clock.
    valid_from: SystemTime,
    /// Source time of the last live sample.
    last_time: Option<SystemTime>,
    /// Instant from which that sample counted.
    last_valid_from: SystemTime,
    clock: TagClock,
    /// Instant up to which a tag that has shown one time is doubted.
    doubt_until: SystemTime,
}

/// Finding about the times of a tag, as the host keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TagClock {
    /// At most one possible time has been shown.
    Unproven,
    /// Two last times were different and possible.
    Plausible,
    /// Last time that was ahead of the host's clock.
    Ahead,
}

/// Verdict on the source time of a sample.
struct JudgedTime {
    source_time: Option<SystemTime>,
    valid_from: SystemTime,
    is_believed: bool,
}

impl ShownTag {
    /// Creates a tag without a value.
    pub fn new(spec: &TagSpec) -> Self {
        Self {
            kind: spec.kind,
            freshness: spec.freshness,
            value: None,
            source_quality: Quality::Bad(Reason::NotConnected),
            verdict: Quality::Good,
            doubt: Quality::Good,
            source_time: None,
            valid_from: UNIX_EPOCH,
            last_time: None,
            last_valid_from: UNIX_EPOCH,
            clock: TagClock::Unproven,
            doubt_until: UNIX_EPOCH,
        }
    }

    /// Returns the last value that counts.
    pub fn value(&self) -> Option<Value> {
        self.value.clone()
    }

    /// Returns the quality at an instant of the host's clock.
    pub fn quality(&self, now: SystemTime) -> Quality {
        let age = now.duration_since(self.valid_from).unwrap_or_default();
        let fresh = match self.value {
            None => Quality::Bad(Reason::NotConnected),
            Some(_) if age > self.freshness => Quality::Bad(Reason::Stale),
            Some(_) => Quality::Good,
        };
        worst(worst(worst(self.source_quality, self.verdict), self.doubt), fresh)
    }

    /// Takes a sample that arrived at `now`, by the host's clock. Returns whether its value
    /// is now the one shown.
    pub fn take(&mut self, sample: &Sample, now: SystemTime) -> bool {
        let time = match &sample.value {
            Some(_) => self.judge_time(sample, now),
            None => JudgedTime { source_time: None, valid_from: now, is_believed: true },
        };
        let is_doubted_by_plugin = sample.value.is_some()
            && matches!(
                sample.quality,
                Quality::Uncertain(Reason::SourceTime) | Quality::Bad(Reason::SourceTime)
            );
        let doubt = match time.is_believed && !is_doubted_by_plugin {
            true => Quality::Good,
            false => Quality::Uncertain(Reason::SourceTime),
        };
        let quality = worst(sample.quality, doubt);
        let is_buffered = sample.flags.contains(SampleFlags::BUFFERED);
        let is_outdated = is_buffered && self.is_newer_than(&time);
        let value = sample.value.as_ref().filter(|_| !is_outdated);
        if sample.value.is_some() && is_outdated && quality.is_good() {
            return false;
        }
        if let Some(value) = value {
            self.value = Some(value.clone());
            (self.verdict, self.doubt) = (judge_value(value, self.kind), doubt);
            (self.source_time, self.valid_from) = (time.source_time, time.valid_from);
        }
        // Said of quality, it counts however old it is.
        self.source_quality = quality;
        value.is_some()
    }

    fn is_newer_than(&self, time: &JudgedTime) -> bool {
        match (time.source_time, self.source_time) {
            (Some(time), Some(own)) => time < own,
            _ => self.value.is_some() && time.valid_from < self.valid_from,
        }
    }

    fn judge_time(&mut self, sample: &Sample, now: SystemTime) -> JudgedTime {
        let is_unusable = sample.flags.contains(SampleFlags::TIME_UNUSABLE)
            || sample.source_time.is_some_and(|time| time < UNIX_EPOCH);
        let (Some(time), false) = (sample.source_time, is_unusable) else {
            return JudgedTime { source_time: None, valid_from: now, is_believed: !is_unusable };
        };
        let is_future = time > now + MAX_CLOCK_AHEAD;
        let is_buffered = sample.flags.contains(SampleFlags::BUFFERED);
        let is_repeated = self.last_time == Some(time);
        let mut valid_from = time.min(now);
        if is_repeated {
            // The same again is no younger.
            valid_from = valid_from.min(self.last_valid_from);
        }
        if !is_buffered {
            if !is_repeated {
                // A time that was ahead is no better once the host's clock has caught up.
                self.clock = match self.last_time {
                    _ if is_future => TagClock::Ahead,
                    None => TagClock::Unproven,
                    Some(_) => TagClock::Plausible,
                };
            }
            (self.last_time, self.last_valid_from) = (Some(time), valid_from);
        }
        if is_future {
            self.doubt_until = now + DOUBT_AFTER_FUTURE;
        }
        let is_believed = match self.clock {
            _ if is_future => false,
            TagClock::Ahead => false,
            TagClock::Unproven => now >= self.doubt_until,
            TagClock::Plausible => true,
        };
        let source_time = Some(time).filter(|_| !is_future);
        JudgedTime { source_time, valid_from, is_believed }
    }
}

/// Judges a value apart from its time, as the host does.
fn judge_value(value: &Value, kind: ValueKind) -> Quality {
    match value {
        _ if value.kind() != kind => Quality::Bad(Reason::Configuration),
        Value::DoublePoint(DoublePoint::BadState) => Quality::Uncertain(Reason::Sensor),
        Value::F64(number) if !number.is_finite() => Quality::Bad(Reason::NotFinite),
        Value::Text(text) if !text.is_whole() => Quality::Uncertain(Reason::Configuration),
        _ => Quality::Good,
    }
}

/// Returns the worse of two qualities; the first where they are alike.
fn worst(first: Quality, second: Quality) -> Quality {
    let rank = |quality| match quality {
        Quality::Good => 0,
        Quality::Uncertain(_) => 1,
        Quality::Bad(_) => 2,
    };
    if rank(second) > rank(first) { second } else { first }
}
