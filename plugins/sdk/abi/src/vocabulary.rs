//! Numbers of the shared vocabulary: kinds of values, qualities, reasons, origins, patterns,
//! severities, verdicts, signals and faults.
//!
//! The numbers are literals, for the header is generated from them. Each is asserted at compile
//! time to equal that of `busbar_types`, which host and SDK calculate with.

use busbar_types::{
    DefectSeverity, DoublePoint, FaultKind, Origin, Pattern, QualityLevel, Reason, Severity,
    SignalShape, Value, ValueKind, Verdict,
};

/// Value kind of a sample without a value: it sets the quality only.
pub const BUSBAR_VALUE_NONE: u8 = 0;
/// Value kind of an IEEE 754 double, its bits in `value`.
pub const BUSBAR_VALUE_F64: u8 = 1;
/// Value kind of a two's complement 64-bit integer.
pub const BUSBAR_VALUE_I64: u8 = 2;
/// Value kind of a single point, 0 or 1.
pub const BUSBAR_VALUE_BOOL: u8 = 3;
/// Value kind of a double point: 0 intermediate, 1 off, 2 on, 3 bad state (IEC 60870-5-101,
/// 7.2.6.2).
pub const BUSBAR_VALUE_DOUBLE_POINT: u8 = 4;

/// Quality of a usable value.
pub const BUSBAR_QUALITY_GOOD: u8 = 0;
/// Quality of a doubtful value.
pub const BUSBAR_QUALITY_UNCERTAIN: u8 = 1;
/// Quality of an unusable value.
pub const BUSBAR_QUALITY_BAD: u8 = 2;

/// Reason of a quality that names none.
pub const BUSBAR_REASON_NONE: u8 = 0;
/// Reason of a link to the device that is down.
pub const BUSBAR_REASON_COMMUNICATION: u8 = 1;
/// Reason of a device that reports a failed sensor.
pub const BUSBAR_REASON_SENSOR: u8 = 2;
/// Reason of a value outside the measuring range.
pub const BUSBAR_REASON_OUT_OF_RANGE: u8 = 3;
/// Reason of a device that refused the address, or whose answer does not fit.
pub const BUSBAR_REASON_CONFIGURATION: u8 = 4;
/// Reason of a device that is not connected yet.
pub const BUSBAR_REASON_NOT_CONNECTED: u8 = 5;
/// Reason of a value that is not a finite number.
pub const BUSBAR_REASON_NOT_FINITE: u8 = 6;
/// Reason of a value past its freshness limit. The host alone sets it.
pub const BUSBAR_REASON_STALE: u8 = 7;
/// Reason of a source timestamp that is missing where one is promised, unreadable, in the future or
/// impossible.
pub const BUSBAR_REASON_SOURCE_TIME: u8 = 8;

/// Origin of a value that a person or program substituted for the measured one.
pub const BUSBAR_ORIGIN_SUBSTITUTED: u8 = 1 << 2;
/// Origin of a value from a device under test.
pub const BUSBAR_ORIGIN_TEST: u8 = 1 << 3;
/// Origin of a value that a simulator made.
pub const BUSBAR_ORIGIN_SIMULATED: u8 = 1 << 4;
/// Origin of a value that is replayed from a recording.
pub const BUSBAR_ORIGIN_RECORDED: u8 = 1 << 5;
/// Origin of a value that its source calls historical.
pub const BUSBAR_ORIGIN_HISTORICAL: u8 = 1 << 6;

/// Pattern of a plain colour.
pub const BUSBAR_PATTERN_SOLID: u32 = 0;
/// Pattern of diagonal stripes.
pub const BUSBAR_PATTERN_STRIPED: u32 = 1;
/// Pattern: stripes that cross.
pub const BUSBAR_PATTERN_CROSSED: u32 = 2;
/// Pattern of regular dots.
pub const BUSBAR_PATTERN_DOTTED: u32 = 3;

/// Severity of the normal state; grey.
pub const BUSBAR_SEVERITY_NORMAL: u32 = 0;
/// Severity: outside the normal band.
pub const BUSBAR_SEVERITY_WARNING: u32 = 1;
/// Severity: needs action now.
pub const BUSBAR_SEVERITY_ALARM: u32 = 2;

/// Verdict: within its limits.
pub const BUSBAR_VERDICT_NORMAL: u32 = 1;
/// Verdict: outside its limits, or in a state that needs attention.
pub const BUSBAR_VERDICT_ABNORMAL: u32 = 2;
/// Verdict: not to be judged, for the reason given.
pub const BUSBAR_VERDICT_UNKNOWN: u32 = 3;

/// Severity of a row that is no defect, or of which that is not known.
pub const BUSBAR_RECORD_NO_SEVERITY: u32 = 0;
/// Severity of a defect to be mended when there is occasion.
pub const BUSBAR_RECORD_GENERAL: u32 = 1;
/// Severity of a defect to be mended soon, and watched until then.
pub const BUSBAR_RECORD_SERIOUS: u32 = 2;
/// Severity of a defect to be mended at once.
pub const BUSBAR_RECORD_CRITICAL: u32 = 3;

/// Shape of a constant at the base.
pub const BUSBAR_SHAPE_CONSTANT: u32 = 0;
/// Shape of a sine about the base.
pub const BUSBAR_SHAPE_SINE: u32 = 1;
/// Shape of a smooth random walk about the base.
pub const BUSBAR_SHAPE_WALK: u32 = 2;
/// Shape of levels about the base, or positions of a switch, each held for a period.
pub const BUSBAR_SHAPE_STEPS: u32 = 3;
/// Shape of a counter: one more each period, from the base to base and amplitude, then anew.
pub const BUSBAR_SHAPE_COUNTER: u32 = 4;

/// Fault of a lost link: connections end, and new ones are refused.
pub const BUSBAR_FAULT_LINK_LOSS: u32 = 1;
/// Fault of a slow device: every answer is delayed, but within the deadline.
pub const BUSBAR_FAULT_SLOW: u32 = 2;
/// Fault of half-open connections, through which no bytes come.
pub const BUSBAR_FAULT_HALF_OPEN: u32 = 4;
/// Fault of connections that are reset, again and again.
pub const BUSBAR_FAULT_RESET: u32 = 8;
/// Fault of random bytes instead of answers.
pub const BUSBAR_FAULT_GARBAGE: u32 = 16;
/// Fault of answers after the client's deadline.
pub const BUSBAR_FAULT_LATE: u32 = 32;
/// Fault of a wrong device clock.
pub const BUSBAR_FAULT_CLOCK_JUMP: u32 = 64;

/// Distance of `BUSBAR_ORIGIN_*` from the bits of [`Origin`].
const ORIGIN_SHIFT: u32 = 2;

/// Returns the origins that flags `BUSBAR_ORIGIN_*` tell, of a sample, a plugin or a value.
#[inline]
pub const fn origin_of_flags(flags: u8) -> Origin {
    Origin::from_bits(flags >> ORIGIN_SHIFT)
}

/// Returns the flags `BUSBAR_ORIGIN_*` of origins.
#[inline]
pub const fn flags_of_origin(origin: Origin) -> u8 {
    origin.bits() << ORIGIN_SHIFT
}

/// Returns kind and bits of a value, `BUSBAR_VALUE_NONE` and 0 for none.
#[inline]
pub fn value_codes(value: Option<Value>) -> (u8, u64) {
    value.map_or((BUSBAR_VALUE_NONE, 0), |value| (value.kind().code(), value.bits()))
}

/// Asserts that numbers of the header equal those of the vocabulary.
macro_rules! assert_equal {
    ($($constant:ident == $number:expr),+ $(,)?) => {
        $(const _: () = assert!($constant as u64 == $number as u64);)+
    };
}

assert_equal! {
    BUSBAR_VALUE_F64 == ValueKind::F64,
    BUSBAR_VALUE_I64 == ValueKind::I64,
    BUSBAR_VALUE_BOOL == ValueKind::Bool,
    BUSBAR_VALUE_DOUBLE_POINT == ValueKind::DoublePoint,
    BUSBAR_QUALITY_GOOD == QualityLevel::Good,
    BUSBAR_QUALITY_UNCERTAIN == QualityLevel::Uncertain,
    BUSBAR_QUALITY_BAD == QualityLevel::Bad,
    BUSBAR_REASON_NONE == Reason::Unknown,
    BUSBAR_REASON_COMMUNICATION == Reason::Communication,
    BUSBAR_REASON_SENSOR == Reason::Sensor,
    BUSBAR_REASON_OUT_OF_RANGE == Reason::OutOfRange,
    BUSBAR_REASON_CONFIGURATION == Reason::Configuration,
    BUSBAR_REASON_NOT_CONNECTED == Reason::NotConnected,
    BUSBAR_REASON_NOT_FINITE == Reason::NotFinite,
    BUSBAR_REASON_STALE == Reason::Stale,
    BUSBAR_REASON_SOURCE_TIME == Reason::SourceTime,
    BUSBAR_ORIGIN_SUBSTITUTED == flags_of_origin(Origin::SUBSTITUTED),
    BUSBAR_ORIGIN_TEST == flags_of_origin(Origin::TEST),
    BUSBAR_ORIGIN_SIMULATED == flags_of_origin(Origin::SIMULATED),
    BUSBAR_ORIGIN_RECORDED == flags_of_origin(Origin::RECORDED),
    BUSBAR_ORIGIN_HISTORICAL == flags_of_origin(Origin::HISTORICAL),
    BUSBAR_PATTERN_SOLID == Pattern::Solid,
    BUSBAR_PATTERN_STRIPED == Pattern::Striped,
    BUSBAR_PATTERN_CROSSED == Pattern::Crossed,
    BUSBAR_PATTERN_DOTTED == Pattern::Dotted,
    BUSBAR_SEVERITY_NORMAL == Severity::Normal,
    BUSBAR_SEVERITY_WARNING == Severity::Warning,
    BUSBAR_SEVERITY_ALARM == Severity::Alarm,
    BUSBAR_VERDICT_NORMAL == Verdict::Normal,
    BUSBAR_VERDICT_ABNORMAL == Verdict::Abnormal,
    BUSBAR_VERDICT_UNKNOWN == Verdict::Unknown,
    BUSBAR_RECORD_GENERAL == DefectSeverity::General,
    BUSBAR_RECORD_SERIOUS == DefectSeverity::Serious,
    BUSBAR_RECORD_CRITICAL == DefectSeverity::Critical,
    BUSBAR_SHAPE_CONSTANT == SignalShape::Constant,
    BUSBAR_SHAPE_SINE == SignalShape::Sine,
    BUSBAR_SHAPE_WALK == SignalShape::Walk,
    BUSBAR_SHAPE_STEPS == SignalShape::Steps,
    BUSBAR_SHAPE_COUNTER == SignalShape::Counter,
    BUSBAR_FAULT_LINK_LOSS == FaultKind::LinkLoss.bit(),
    BUSBAR_FAULT_SLOW == FaultKind::Slow.bit(),
    BUSBAR_FAULT_HALF_OPEN == FaultKind::HalfOpen.bit(),
    BUSBAR_FAULT_RESET == FaultKind::Reset.bit(),
    BUSBAR_FAULT_GARBAGE == FaultKind::Garbage.bit(),
    BUSBAR_FAULT_LATE == FaultKind::Late.bit(),
    BUSBAR_FAULT_CLOCK_JUMP == FaultKind::ClockJump.bit(),
}
// Positions of switches are told by the text of `BUSBAR_VALUE_DOUBLE_POINT` alone.
const _: () = assert!(
    DoublePoint::Intermediate as u8 == 0
        && DoublePoint::Off as u8 == 1
        && DoublePoint::On as u8 == 2
        && DoublePoint::BadState as u8 == 3
);
