//! Raw samples to samples: what a telemetry plugin may send.

use busbar_plugin_abi as abi;
use busbar_tags::{DoublePoint, Moment, Quality, Reason, Sample, SourceTime, TagHandle, Value};

use crate::TelemetryTag;

/// How far a source's clock may be ahead of the host's, nanoseconds.
const MAX_CLOCK_AHEAD: i64 = 10_000_000_000;

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

    /// The sample, or nothing where it names another's tag or makes no sense.
    /// It was received at `received`, which `wall_clock` called so.
    #[inline]
    pub fn check(
        &self,
        raw: &abi::BusbarSample,
        received: Moment,
        wall_clock: SourceTime,
    ) -> Option<Sample> {
        if !self.owned.get(raw.tag as usize).copied().unwrap_or(false) {
            return None;
        }
        // Good measurements first: there may be a million a second.
        let value = match raw.kind {
            abi::BUSBAR_VALUE_F64 => Some(Value::F64(f64::from_bits(raw.value))),
            kind => other_value(kind, raw.value)?,
        };
        let quality = match (raw.quality, raw.reason) {
            (abi::BUSBAR_QUALITY_GOOD, abi::BUSBAR_REASON_NONE) => Quality::Good,
            (quality, reason) => other_quality(quality, reason)?,
        };
        let source_time = source_time(raw.source_time_unix_nanos, wall_clock);
        let lag = source_time.map_or(0, |time| wall_clock.0.saturating_sub(time.0).max(0));
        let valid_from = Moment(received.0.saturating_sub(lag.unsigned_abs()));
        Some(Sample { tag: TagHandle(raw.tag), value, quality, source_time, received, valid_from })
    }
}

/// A time in the future orders nothing: it would shut out all that follows.
fn source_time(unix_nanos: i64, wall_clock: SourceTime) -> Option<SourceTime> {
    let is_known = unix_nanos != abi::BUSBAR_NO_TIME;
    let is_possible = unix_nanos <= wall_clock.0.saturating_add(MAX_CLOCK_AHEAD);
    (is_known && is_possible).then_some(SourceTime(unix_nanos))
}

#[cold]
fn other_value(kind: u8, bits: u64) -> Option<Option<Value>> {
    Some(match kind {
        abi::BUSBAR_VALUE_NONE => None,
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

#[cold]
fn other_quality(quality: u8, reason: u8) -> Option<Quality> {
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
