//! Equality of the ABI's numbers with the vocabulary of `busbar_types`, which host and SDK
//! calculate with. The numbers are literals in this crate, for the headers are generated from them.

use crate::*;
use busbar_types::{
    DefectSeverity, DoublePoint, FaultKind, MAX_TEXT_BYTES, Origin, Pattern, QualityLevel, Reason,
    Severity, SignalShape, ValueKind, Verdict,
};

/// Asserts that numbers of the header equal those of the vocabulary.
macro_rules! assert_equal {
    ($($constant:ident == $number:expr),+ $(,)?) => {
        $(const _: () = assert!($constant as u64 == $number as u64);)+
    };
}

assert_equal! {
    BUSBAR_VALUE_KIND_F64 == ValueKind::F64,
    BUSBAR_VALUE_KIND_I64 == ValueKind::I64,
    BUSBAR_VALUE_KIND_BOOL == ValueKind::Bool,
    BUSBAR_VALUE_KIND_DOUBLE_POINT == ValueKind::DoublePoint,
    BUSBAR_VALUE_KIND_TEXT == ValueKind::Text,
    BUSBAR_MAX_TEXT_VALUE == MAX_TEXT_BYTES,
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
    BUSBAR_DEFECT_SEVERITY_GENERAL == DefectSeverity::General,
    BUSBAR_DEFECT_SEVERITY_SERIOUS == DefectSeverity::Serious,
    BUSBAR_DEFECT_SEVERITY_CRITICAL == DefectSeverity::Critical,
    BUSBAR_SIGNAL_SHAPE_CONSTANT == SignalShape::Constant,
    BUSBAR_SIGNAL_SHAPE_SINE == SignalShape::Sine,
    BUSBAR_SIGNAL_SHAPE_WALK == SignalShape::Walk,
    BUSBAR_SIGNAL_SHAPE_STEPS == SignalShape::Steps,
    BUSBAR_SIGNAL_SHAPE_COUNTER == SignalShape::Counter,
    BUSBAR_FAULT_LINK_LOSS == FaultKind::LinkLoss.bit(),
    BUSBAR_FAULT_SLOW == FaultKind::Slow.bit(),
    BUSBAR_FAULT_HALF_OPEN == FaultKind::HalfOpen.bit(),
    BUSBAR_FAULT_RESET == FaultKind::Reset.bit(),
    BUSBAR_FAULT_GARBAGE == FaultKind::Garbage.bit(),
    BUSBAR_FAULT_LATE == FaultKind::Late.bit(),
    BUSBAR_FAULT_CLOCK_JUMP == FaultKind::ClockJump.bit(),
}
// Positions of switches are told by the text of `BUSBAR_VALUE_KIND_DOUBLE_POINT` alone.
const _: () = assert!(
    DoublePoint::Intermediate as u8 == 0
        && DoublePoint::Off as u8 == 1
        && DoublePoint::On as u8 == 2
        && DoublePoint::BadState as u8 == 3
);
