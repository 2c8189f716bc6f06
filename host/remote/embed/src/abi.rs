//! C ABI of libbusbar: structs, enums, constants and the callback type.
//!
//! Fields and results that the library writes have the type of their enum. Those that a program
//! writes are numbers (`...Number`, which the header declares as the enum too): any number may
//! come, and is checked.

use std::ffi::{c_char, c_void};

/// Version of this interface; a library of another version must not be used.
pub const BUSBAR_VIEW_ABI: u32 = 5;

/// Flag of BusbarViewOptions: show Busbar's own panels beside the scene.
pub const BUSBAR_VIEW_FLAG_PANELS: u32 = 1;

/// Source timestamp that is not known.
pub const BUSBAR_VIEW_NO_TIME: i64 = i64::MIN;

/// Origin of a value that a person or program substituted for the measured one.
pub const BUSBAR_VIEW_ORIGIN_SUBSTITUTED: u32 = 1;
/// Origin of a value from a device under test.
pub const BUSBAR_VIEW_ORIGIN_TEST: u32 = 2;
/// Origin of a value that a simulator made.
pub const BUSBAR_VIEW_ORIGIN_SIMULATED: u32 = 4;
/// Origin of a value that is replayed from a recording.
pub const BUSBAR_VIEW_ORIGIN_RECORDED: u32 = 8;
/// Origin of a value that its source calls historical.
pub const BUSBAR_VIEW_ORIGIN_HISTORICAL: u32 = 16;

/// Status of a call. After a failure, which is below 0, nothing was done.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarStatus {
    /// Success of the call.
    Ok = 0,
    /// Argument that is null, too small, too large, not UTF-8, or not finite.
    Invalid = -1,
    /// Command queue without room: try again later.
    Full = -2,
    /// System without a descriptor, memory or a thread left.
    System = -3,
    /// Internal fault of the library; the view does nothing any more. Close it.
    Fault = -4,
}

/// Liveness of a picture.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewLiveness {
    /// Picture whose values were read at most `silent_millis` ago. Where frames take long, the
    /// limit is two frame times, at most 900 ms.
    Live = 0,
    /// Picture whose viewer is silent or gone: no value in it may be relied on. The library has
    /// removed its colour and hatched it.
    Dead = 1,
    /// Picture whose viewer makes progress too slowly: its values were read more than
    /// `silent_millis` ago. The library has removed its colour and hatched it, like a dead one.
    Late = 2,
}

/// Quality of a value.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewQuality {
    /// Value that can be used.
    Good = 0,
    /// Value that is in doubt.
    Uncertain = 1,
    /// Value that cannot be used.
    Bad = 2,
}

/// Kind of a value, and the field that holds it.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewValueKind {
    /// Measurement, which is in `number`.
    F64 = 0,
    /// Counter or code, in `integer`.
    I64 = 1,
    /// Single point: `integer` is 0 or 1.
    Bool = 2,
    /// Switch position in `integer`: 0 travelling, 1 open, 2 closed, 3 invalid (IEC 60870-5-101,
    /// 7.2.6.2).
    DoublePoint = 3,
    /// No value: the update sets the quality alone.
    None = 4,
    /// Text of at most 255 bytes, which is in `text`. A longer one, or one that is no UTF-8, is
    /// shown as far as it goes, and is uncertain.
    Text = 5,
}

/// State of an alarm by IEC 62682. Numbers are the letters of its states in ASCII.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewAlarmState {
    /// No state: the event is about something else.
    None = 0,
    /// State A: within limits, acknowledged.
    Normal = 65,
    /// State B: outside limits, not acknowledged.
    Unacknowledged = 66,
    /// State C: outside limits, acknowledged.
    Acknowledged = 67,
    /// State D: back within limits, not acknowledged.
    ReturnedUnacknowledged = 68,
    /// State E: back within limits, latched, not acknowledged.
    LatchedUnacknowledged = 69,
    /// State F: back within limits, latched, acknowledged.
    LatchedAcknowledged = 70,
    /// State G: shelved by an operator.
    Shelved = 71,
    /// State H: suppressed by design.
    SuppressedByDesign = 72,
    /// State I: out of service.
    OutOfService = 73,
}

/// Action of an operator on an alarm.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewAlarmAction {
    /// No action: the event is about something else.
    None = 0,
    /// Acknowledgement of the alarm.
    Acknowledge = 1,
    /// Shelving of the alarm for some time.
    Shelve = 2,
    /// End of the shelving.
    Unshelve = 3,
    /// Reset of a latched alarm.
    Reset = 4,
}

/// Verdict of an overlay on equipment.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewVerdict {
    /// Equipment within its limits.
    Normal = 0,
    /// Equipment outside its limits, or in a state that needs attention.
    Abnormal = 1,
    /// Equipment that cannot be judged.
    Unknown = 2,
    /// Equipment that cannot be judged, and was abnormal at the last judgment.
    UnknownAfterAbnormal = 3,
}

/// Input of a pointer over a picture.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewPointer {
    /// Movement of the pointer to x, y.
    Moved = 1,
    /// Press of a button at x, y.
    Pressed = 2,
    /// Release of a button at x, y.
    Released = 3,
    /// Turn of the wheel by `steps`, positive away from the user.
    Scrolled = 4,
    /// Pointer leaves the picture.
    Left = 5,
}

/// Window system of the window that a view draws into.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewWindowSystem {
    /// No window: pictures are in memory.
    None = 0,
    /// X11: `window` is the XID of the window.
    X11 = 1,
}

/// Kind of an event, and the fields that it fills. All other fields are 0, and texts empty.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarViewEventKind {
    /// First picture. `text`: the graphics device.
    Ready = 1,
    /// New picture, or a new liveness of the last one, for busbar_view_frame. Merged: one waits at
    /// most.
    Frame = 2,
    /// Pick. `id`: the equipment, empty for nothing.
    Picked = 3,
    /// Pointer over the equipment `id`, or over nothing. Merged.
    Hovered = 4,
    /// Camera at `eye` that looks at `target`. Merged.
    Camera = 5,
    /// Alarm `id` in `alarm_state` since `unix_nanos`. `origins` names the sources, besides the live
    /// process, of the value or verdict by which it came or went last. `text`: reason of an
    /// overlay's verdict, with what is assumed; empty of an alarm on a tag. Each change is
    /// delivered while there is room, and the last one of each alarm always.
    Alarm = 6,
    /// Operator's request `alarm_action` for the alarm `id`, which your program decides on.
    /// `shelve_seconds`: shelving time.
    ActionRequested = 7,
    /// Tag `id` whose quality is `quality`, for the reason `text`. `origins` names the sources of
    /// its value besides the live process: mark a value that has any. Merged by tag.
    Quality = 8,
    /// Plugin instance `id`, whose state is `text`. Merged by instance.
    Plugin = 9,
    /// Failed command or another fault; `text` names it and a remedy.
    Error = 10,
    /// Picture that is not live, for the reason `text`. `liveness`: dead where the viewer is silent
    /// or gone, late where it is too slow. The library has covered the picture in a window with
    /// hatching, and hatches it in memory: state beside it that it is not live.
    Lost = 11,
    /// Picture that is live again, `text` says how. A new viewer has the last good configuration,
    /// camera, alarms and tags.
    Recovered = 12,
    /// Configuration `id`, shown from now on.
    Reloaded = 13,
    /// Verdict `verdict` of the plugin instance `overlay` on the equipment `id`, for the reason
    /// `text`. `is_assumed` is 1 where it rests on a default, which the reason names; `origins` are
    /// those of the values that it rests on. Merged by overlay and equipment.
    Verdict = 14,
}

/// Number of a [`BusbarViewQuality`] that a program wrote.
pub type BusbarViewQualityNumber = u32;
/// Number of a [`BusbarViewValueKind`] that a program wrote.
pub type BusbarViewValueKindNumber = u32;
/// Number of a [`BusbarViewAlarmAction`] that a program wrote.
pub type BusbarViewAlarmActionNumber = u32;
/// Number of a [`BusbarViewAlarmState`] that a program wrote.
pub type BusbarViewAlarmStateNumber = u32;
/// Number of a [`BusbarViewPointer`] that a program wrote.
pub type BusbarViewPointerNumber = u32;
/// Number of a [`BusbarViewWindowSystem`] that a program wrote.
pub type BusbarViewWindowSystemNumber = u32;
/// Number of a [`BusbarStatus`] that a program wrote.
pub type BusbarStatusNumber = i32;

/// Enum of the C ABI that a program writes as a number.
pub(crate) trait FromNumber: Copy + 'static {
    /// All values of the enum.
    const ALL: &'static [Self];

    /// Returns the number of a value in the C ABI.
    fn number(self) -> u32;

    /// Returns the value of a number; none where it has none.
    fn from_number(number: u32) -> Option<Self> {
        Self::ALL.iter().copied().find(|value| value.number() == number)
    }
}

macro_rules! from_number {
    ($($name:ident { $($value:ident)* })*) => {$(
        impl FromNumber for $name {
            const ALL: &'static [Self] = &[$(Self::$value),*];

            fn number(self) -> u32 {
                self as u32
            }
        }
    )*};
}

from_number! {
    BusbarViewQuality { Good Uncertain Bad }
    BusbarViewValueKind { F64 I64 Bool DoublePoint None Text }
    BusbarViewAlarmState {
        None Normal Unacknowledged Acknowledged ReturnedUnacknowledged LatchedUnacknowledged
        LatchedAcknowledged Shelved SuppressedByDesign OutOfService
    }
    BusbarViewAlarmAction { None Acknowledge Shelve Unshelve Reset }
    BusbarViewPointer { Moved Pressed Released Scrolled Left }
    BusbarViewWindowSystem { None X11 }
}

/// Content and limits of a view. Set all to 0 first, then `struct_size`, `config` and the size.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewOptions {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Flags of the view: BUSBAR_VIEW_FLAG_PANELS or 0.
    pub flags: u32,
    /// Width of the picture, pixels: 1 to 8192.
    pub width: u32,
    /// Height of the picture, pixels: 1 to 8192; width times height at most 16,777,216.
    pub height: u32,
    /// Window system of `window`.
    pub window_system: BusbarViewWindowSystemNumber,
    /// Age of the picture's values from which it is not live and hatched, milliseconds; 0 for 500.
    /// Where frames take longer, the limit is two frame times, at most 900 ms. A window is covered
    /// at most 50 ms later, on a machine with a CPU to spare.
    pub silent_millis: u32,
    /// Time without a heartbeat and without progress of its process after which the viewer is ended
    /// and started again, milliseconds; 0 for 1000. At least silent_millis. A viewer that makes
    /// progress is slow and not hung: it is ended after 30 s without a frame. One that sleeps is
    /// ended after 5 s, one that a signal stopped after 10 s. All limits are at least hung_millis;
    /// those of 30 s and 5 s are at least eight of its longest recent frame times.
    pub hung_millis: u32,
    /// Longest delay before a viewer that keeps ending is started again, milliseconds; 0 for 5000.
    pub max_restart_millis: u32,
    /// Window to draw into, as its system names windows; 0 without a system.
    pub window: u64,
    /// Path of the configuration, UTF-8.
    pub config: *const c_char,
    /// Path of the program `busbar`; null looks for it in PATH.
    pub program: *const c_char,
    /// Operator who acts on alarms, for the audit log; null for nobody.
    pub operator_name: *const c_char,
}

/// Event of a view. Texts end with a zero byte and are never null. They stay valid until the next
/// event of the view is taken, or until the callback returns.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewEvent {
    /// Size of this struct, bytes; set it before the call.
    pub struct_size: u32,
    /// Kind of the event.
    pub kind: BusbarViewEventKind,
    /// Events dropped for want of room since the last one; events of alarms are never dropped.
    pub dropped: u32,
    /// Liveness of the picture.
    pub liveness: BusbarViewLiveness,
    /// State of the alarm.
    pub alarm_state: BusbarViewAlarmState,
    /// Action that the operator asks for.
    pub alarm_action: BusbarViewAlarmAction,
    /// Shelving time that the operator asks for, seconds.
    pub shelve_seconds: u32,
    /// Quality of the tag's value.
    pub quality: BusbarViewQuality,
    /// Origins, a sum of BUSBAR_VIEW_ORIGIN_SUBSTITUTED and so on; 0 for a live value.
    pub origins: u32,
    /// Verdict on the equipment.
    pub verdict: BusbarViewVerdict,
    /// Number 1 where the verdict rests on a default.
    pub is_assumed: u32,
    /// Reserved field, always 0.
    pub reserved: u32,
    /// Time since which the alarm is in its state, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Position of the camera, world space in metres.
    pub eye: [f64; 3],
    /// Point that the camera looks at, world space in metres.
    pub target: [f64; 3],
    /// Identifier of the equipment, alarm, tag, plugin instance or configuration.
    pub id: *const c_char,
    /// Plugin instance that gives the verdict.
    pub overlay: *const c_char,
    /// Text for people, by the kind of the event.
    pub text: *const c_char,
}

/// Picture of a view. Its pixels are blue, green, red and 255, rows from the top.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewFrame {
    /// Size of this struct, bytes; set it before the call.
    pub struct_size: u32,
    /// Liveness of the picture.
    pub liveness: BusbarViewLiveness,
    /// Width of the picture, pixels; 0 where there is no picture yet.
    pub width: u32,
    /// Height of the picture, pixels.
    pub height: u32,
    /// Bytes from one row to the next.
    pub stride: u32,
    /// Left column of the damaged area, which may differ from the picture of the call before.
    pub damage_x: u32,
    /// Top row of the damaged area.
    pub damage_y: u32,
    /// Width of the damaged area, pixels; 0 where nothing differs.
    pub damage_width: u32,
    /// Height of the damaged area, pixels.
    pub damage_height: u32,
    /// Age of the values that the picture shows, milliseconds since they were read.
    pub age_millis: u32,
    /// Sequence number of the picture in its viewer, from 1.
    pub sequence: u64,
    /// First pixel; null where there is no picture yet. The pixels stay unchanged until the next
    /// call of busbar_view_frame or busbar_view_close.
    pub pixels: *const u8,
}

/// Value of a tag that the configuration marks with "set_by_host". Its age counts from the call, or
/// from its source time if that is earlier. Past the tag's freshness it is stale.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewTag {
    /// Id of the tag, UTF-8.
    pub id: *const c_char,
    /// Kind of the value.
    pub kind: BusbarViewValueKindNumber,
    /// Quality of the value.
    pub quality: BusbarViewQualityNumber,
    /// Source timestamp, nanoseconds since 1970-01-01 UTC, or BUSBAR_VIEW_NO_TIME.
    pub source_unix_nanos: i64,
    /// Value of kind BUSBAR_VIEW_VALUE_KIND_F64.
    pub number: f64,
    /// Value of the kinds I64, BOOL and DOUBLE_POINT.
    pub integer: i64,
    /// Value of kind BUSBAR_VIEW_VALUE_KIND_TEXT, UTF-8; of no meaning for others.
    pub text: *const c_char,
}

/// Callback for events. It must not close the view, and not unwind.
pub type BusbarViewCallback =
    Option<unsafe extern "C" fn(context: *mut c_void, event: *const BusbarViewEvent)>;
