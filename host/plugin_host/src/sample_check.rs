//! Raw samples to samples: what a telemetry plugin may send.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;
use busbar_tags::{DoublePoint, Quality, Reason, Sample, TagHandle, Value};

use crate::TelemetryTag;

/// How far a source's clock may be ahead of the host's.
const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(10);

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
    pub fn check(
        &self,
        raw: &abi::BusbarSample,
        received: Instant,
        wall_clock: SystemTime,
    ) -> Option<Sample> {
        if !self.owned.get(raw.tag as usize).copied().unwrap_or(false) {
            return None;
        }
        let value = match raw.kind {
            abi::BUSBAR_VALUE_NONE => None,
            abi::BUSBAR_VALUE_F64 => Some(Value::F64(f64::from_bits(raw.value))),
            abi::BUSBAR_VALUE_I64 => Some(Value::I64(raw.value as i64)),
            abi::BUSBAR_VALUE_BOOL => Some(Value::Bool(raw.value != 0)),
            abi::BUSBAR_VALUE_DOUBLE_POINT => Some(Value::DoublePoint(match raw.value {
                0 => DoublePoint::Intermediate,
                1 => DoublePoint::Off,
                2 => DoublePoint::On,
                3 => DoublePoint::BadState,
                _ => return None,
            })),
            _ => return None,
        };
        let reason = reason_from_abi(raw.reason)?;
        let quality = match raw.quality {
            abi::BUSBAR_QUALITY_GOOD => Quality::Good,
            abi::BUSBAR_QUALITY_UNCERTAIN => Quality::Uncertain(reason),
            abi::BUSBAR_QUALITY_BAD => Quality::Bad(reason),
            _ => return None,
        };
        // A time in the future orders nothing: it would shut out all that follows.
        let source_time = time_from_abi(raw.source_time_unix_nanos)
            .filter(|&time| time <= wall_clock + MAX_CLOCK_AHEAD);
        let lag = source_time.and_then(|time| wall_clock.duration_since(time).ok());
        let lag = lag.unwrap_or_default();
        Some(Sample { tag: TagHandle(raw.tag), value, quality, source_time, lag, received })
    }
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

fn time_from_abi(unix_nanos: i64) -> Option<SystemTime> {
    if unix_nanos == abi::BUSBAR_NO_TIME {
        return None;
    }
    let distance = Duration::from_nanos(unix_nanos.unsigned_abs());
    if unix_nanos < 0 { UNIX_EPOCH.checked_sub(distance) } else { UNIX_EPOCH.checked_add(distance) }
}
