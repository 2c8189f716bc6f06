//! Raw samples to samples: what a telemetry plugin may send.

use busbar_plugin_abi as abi;
use busbar_tags::{DoublePoint, Moment, Quality, Reason, Sample, SourceTime, TagHandle, Value};

use crate::TelemetryTag;

/// How far a source's clock may be ahead of the host's, nanoseconds.
const MAX_CLOCK_AHEAD: i64 = 10_000_000_000;

/// A good measurement: its small fields, as one number.
const PLAIN: u32 = u32::from_le_bytes([
    abi::BUSBAR_VALUE_F64,
    abi::BUSBAR_QUALITY_GOOD,
    abi::BUSBAR_REASON_NONE,
    0,
]);

/// Where samples go.
pub trait SampleSink {
    /// Takes a sample. Inline it, always, where there may be millions a second.
    fn take(&mut self, sample: &Sample);
}

impl<F: FnMut(&Sample)> SampleSink for F {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        self(sample);
    }
}

/// Judges the samples of one plugin, whichever way they come.
#[derive(Clone, Debug)]
pub struct SampleCheck {
    /// By tag handle: whether the tag is this plugin's.
    owned: Vec<bool>,
}

impl SampleCheck {
    /// Lets samples of these tags pass.
    pub fn new(tags: &[TelemetryTag]) -> Self {
        let size = tags.iter().map(|t| t.tag.0 as usize + 1).max().unwrap_or(0);
        let mut owned = vec![false; size];
        for tag in tags {
            owned[tag.tag.0 as usize] = true;
        }
        Self { owned }
    }

    /// Hands the sample to `sink`; returns whether it did, and not where the sample names
    /// another's tag or makes no sense. It was received at `received`, which `wall_clock`
    /// called so.
    #[inline(always)]
    pub fn take(
        &self,
        raw: &abi::BusbarSample,
        received: Moment,
        wall_clock: SourceTime,
        sink: &mut impl SampleSink,
    ) -> bool {
        if !self.owned.get(raw.tag as usize).copied().unwrap_or(false) {
            return false;
        }
        // There may be millions a second, nearly all of them good measurements with a time
        // since 1970 that has come: these cost least.
        let is_plain = u32::from_le_bytes([raw.kind, raw.quality, raw.reason, 0]) == PLAIN
            && (0..=wall_clock.0).contains(&raw.source_time_unix_nanos);
        if !is_plain {
            return take_other(*raw, received, wall_clock, sink);
        }
        let lag = (wall_clock.0 - raw.source_time_unix_nanos).unsigned_abs();
        sink.take(&Sample {
            tag: TagHandle(raw.tag),
            value: Some(Value::F64(f64::from_bits(raw.value))),
            quality: Quality::Good,
            source_time: Some(SourceTime(raw.source_time_unix_nanos)),
            received,
            valid_from: Moment(received.0.saturating_sub(lag)),
        });
        true
    }
}

#[cold]
#[inline(never)]
fn take_other(
    raw: abi::BusbarSample,
    received: Moment,
    wall_clock: SourceTime,
    sink: &mut impl SampleSink,
) -> bool {
    let sample = sample(&raw, received, wall_clock);
    sample.is_some_and(|sample| {
        sink.take(&sample);
        true
    })
}

/// Any sample of a tag that may be set.
fn sample(raw: &abi::BusbarSample, received: Moment, wall_clock: SourceTime) -> Option<Sample> {
    let source_time = source_time(raw.source_time_unix_nanos, wall_clock);
    let lag = source_time.map_or(0, |time| wall_clock.0.saturating_sub(time.0).max(0));
    Some(Sample {
        tag: TagHandle(raw.tag),
        value: value(raw.kind, raw.value)?,
        quality: quality(raw.quality, raw.reason)?,
        source_time,
        received,
        valid_from: Moment(received.0.saturating_sub(lag.unsigned_abs())),
    })
}

/// A time in the future orders nothing: it would shut out all that follows.
fn source_time(unix_nanos: i64, wall_clock: SourceTime) -> Option<SourceTime> {
    let is_known = unix_nanos != abi::BUSBAR_NO_TIME;
    let is_possible = unix_nanos <= wall_clock.0.saturating_add(MAX_CLOCK_AHEAD);
    (is_known && is_possible).then_some(SourceTime(unix_nanos))
}

fn value(kind: u8, bits: u64) -> Option<Option<Value>> {
    Some(match kind {
        abi::BUSBAR_VALUE_NONE => None,
        abi::BUSBAR_VALUE_F64 => Some(Value::F64(f64::from_bits(bits))),
        abi::BUSBAR_VALUE_I64 => Some(Value::I64(bits as i64)),
        abi::BUSBAR_VALUE_BOOL => Some(Value::Bool(bits != 0)),
        abi::BUSBAR_VALUE_DOUBLE_POINT => Some(Value::DoublePoint(match bits {
            0 => DoublePoint::Intermediate,
            1 => DoublePoint::Off,
            2 => DoublePoint::On,
            3 => DoublePoint::BadState,
            _ => return None,
        })),
        _ => return None,
    })
}

fn quality(quality: u8, reason: u8) -> Option<Quality> {
    let reason = reason_from_abi(reason)?;
    Some(match quality {
        abi::BUSBAR_QUALITY_GOOD => Quality::Good,
        abi::BUSBAR_QUALITY_UNCERTAIN => Quality::Uncertain(reason),
        abi::BUSBAR_QUALITY_BAD => Quality::Bad(reason),
        _ => return None,
    })
}

fn reason_from_abi(reason: u8) -> Option<Reason> {
    Some(match reason {
        abi::BUSBAR_REASON_NONE => Reason::Unknown,
        abi::BUSBAR_REASON_COMMUNICATION => Reason::Communication,
        abi::BUSBAR_REASON_SENSOR => Reason::Sensor,
        abi::BUSBAR_REASON_OUT_OF_RANGE => Reason::OutOfRange,
        abi::BUSBAR_REASON_CONFIGURATION => Reason::Configuration,
        abi::BUSBAR_REASON_NOT_CONNECTED => Reason::NotConnected,
        abi::BUSBAR_REASON_NOT_FINITE => Reason::NotFinite,
        abi::BUSBAR_REASON_STALE => Reason::Stale,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use busbar_tags::ValueKind;
    use proptest::prelude::*;

    use super::*;

    const NOW: i64 = 1_000_000_000_000;

    proptest! {
        #[test]
        fn the_short_way_ends_where_the_long_one_does(
            tag in 0..3_u32,
            kind in prop_oneof![3 => Just(1), 1 => 0..6_u8],
            quality in prop_oneof![3 => Just(0), 1 => 0..4_u8],
            reason in prop_oneof![3 => Just(0), 1 => 0..10_u8],
            value: u64,
            source_time in prop_oneof![
                NOW - 9..NOW + 9,
                NOW + MAX_CLOCK_AHEAD - 9..NOW + MAX_CLOCK_AHEAD + 9,
                any::<i64>(),
                Just(abi::BUSBAR_NO_TIME),
                Just(0),
            ],
            received in 0..2_000_000_000_000_u64,
        ) {
            let own = TelemetryTag {
                tag: TagHandle(1),
                kind: ValueKind::F64,
                freshness: Duration::from_secs(1),
                id: String::new(),
                address_json: String::new(),
            };
            let source_time_unix_nanos = source_time;
            let raw = abi::BusbarSample {
                tag, kind, quality, reason, reserved: 0, value, source_time_unix_nanos,
            };
            let (received, wall_clock) = (Moment(received), SourceTime(NOW));
            let mut taken = Vec::new();
            let mut sink = |sample: &Sample| taken.push(format!("{sample:?}"));
            let passes = SampleCheck::new(&[own]).take(&raw, received, wall_clock, &mut sink);
            let expected = sample(&raw, received, wall_clock).filter(|_| tag == 1);
            prop_assert_eq!(passes, expected.is_some());
            let expected = expected.map(|sample| format!("{sample:?}"));
            prop_assert_eq!(taken, Vec::from_iter(expected));
        }
    }
}
