//! Shared parts of several capabilities: kinds of values, quality, reason and origin of values, and
//! buffers for texts.

use crate::BusbarStr;
use busbar_types::{Origin, Value};

/// Kind of a value, and the field that holds it.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarValueKind {
    /// No value: a sample of this kind sets the quality only.
    None = 0,
    /// IEEE 754 double, in `number`.
    F64 = 1,
    /// Integer of 64 bits, in `integer`.
    I64 = 2,
    /// Single point, 0 or 1 in `integer`.
    Bool = 3,
    /// Double point, in `integer`: 0 intermediate, 1 off, 2 on, 3 bad state (IEC 60870-5-101,
    /// 7.2.6.2).
    DoublePoint = 4,
    /// Text of at most [`BUSBAR_MAX_TEXT_VALUE`] bytes, in `text`.
    Text = 5,
}

enum_numbers! {
    /// Number of a [`BusbarValueKind`] that the other side wrote.
    BusbarValueKindNumber: u8 = BusbarValueKind {
        BUSBAR_VALUE_KIND_NONE = None,
        BUSBAR_VALUE_KIND_F64 = F64,
        BUSBAR_VALUE_KIND_I64 = I64,
        BUSBAR_VALUE_KIND_BOOL = Bool,
        BUSBAR_VALUE_KIND_DOUBLE_POINT = DoublePoint,
        BUSBAR_VALUE_KIND_TEXT = Text,
    }
}

/// Bytes of a text value, at most. A longer one is cut, and is uncertain.
pub const BUSBAR_MAX_TEXT_VALUE: u32 = 255;

/// Quality of a value.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarQuality {
    /// Quality of a usable value.
    Good = 0,
    /// Quality of a doubtful value.
    Uncertain = 1,
    /// Quality of an unusable value.
    Bad = 2,
}

enum_numbers! {
    /// Number of a [`BusbarQuality`] that the other side wrote.
    BusbarQualityNumber: u8 = BusbarQuality {
        BUSBAR_QUALITY_GOOD = Good,
        BUSBAR_QUALITY_UNCERTAIN = Uncertain,
        BUSBAR_QUALITY_BAD = Bad,
    }
}

/// Reason of a quality.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarReason {
    /// Reason of a quality that names none.
    None = 0,
    /// Reason of a link to the device that is down.
    Communication = 1,
    /// Reason of a device that reports a failed sensor.
    Sensor = 2,
    /// Reason of a value outside the measuring range.
    OutOfRange = 3,
    /// Reason of a device that refused the address, or whose answer does not fit.
    Configuration = 4,
    /// Reason of a device that is not connected yet.
    NotConnected = 5,
    /// Reason of a value that is not a finite number.
    NotFinite = 6,
    /// Reason of a value past its freshness limit. The host alone sets it.
    Stale = 7,
    /// Reason of a source timestamp that is missing where one is promised, unreadable, in the
    /// future or impossible.
    SourceTime = 8,
}

enum_numbers! {
    /// Number of a [`BusbarReason`] that the other side wrote.
    BusbarReasonNumber: u8 = BusbarReason {
        BUSBAR_REASON_NONE = None,
        BUSBAR_REASON_COMMUNICATION = Communication,
        BUSBAR_REASON_SENSOR = Sensor,
        BUSBAR_REASON_OUT_OF_RANGE = OutOfRange,
        BUSBAR_REASON_CONFIGURATION = Configuration,
        BUSBAR_REASON_NOT_CONNECTED = NotConnected,
        BUSBAR_REASON_NOT_FINITE = NotFinite,
        BUSBAR_REASON_STALE = Stale,
        BUSBAR_REASON_SOURCE_TIME = SourceTime,
    }
}

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

/// Buffer for a text. The caller owns it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarTextOutput {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Capacity of `text`, bytes.
    pub capacity: u32,
    /// Bytes written; where the capacity was too small, bytes needed.
    pub len: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Text in UTF-8, not terminated.
    pub text: *mut u8,
}

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

/// Value in the fields that samples and values of tags have for it.
///
/// cbindgen:ignore
#[derive(Clone, Copy, Debug)]
pub struct ValueFields {
    /// Kind of the value.
    pub kind: BusbarValueKindNumber,
    /// Value of kind f64; 0 for every other.
    pub number: f64,
    /// Value of an integer, single point or double point; 0 for every other.
    pub integer: i64,
    /// Value of kind text, borrowed; empty for every other.
    pub text: BusbarStr,
}

impl ValueFields {
    /// Lays out a value, or that there is none. The text is valid as long as the value is.
    #[inline]
    pub fn new(value: Option<&Value>) -> Self {
        let none = Self {
            kind: BUSBAR_VALUE_KIND_NONE,
            number: 0.0,
            integer: 0,
            text: BusbarStr::from_static(""),
        };
        let Some(value) = value else { return none };
        let fields = Self { kind: value.kind().code(), ..none };
        match value {
            Value::F64(number) => Self { number: *number, ..fields },
            Value::I64(integer) => Self { integer: *integer, ..fields },
            Value::Bool(is_on) => Self { integer: (*is_on).into(), ..fields },
            Value::DoublePoint(position) => Self { integer: position.bits().into(), ..fields },
            Value::Text(text) => Self { text: BusbarStr::from_borrowed(text.as_str()), ..fields },
        }
    }
}
