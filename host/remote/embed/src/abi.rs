//! C ABI of libbusbar: structs, constants and the callback type.

use std::ffi::{c_char, c_void};

/// Version of this interface; a library of another version must not be used.
pub const BUSBAR_VIEW_ABI: u32 = 2;

/// Success of a call.
pub const BUSBAR_VIEW_OK: i32 = 0;
/// Status of an argument that is null, too small, too large, not UTF-8, or not finite. Nothing was
/// done.
pub const BUSBAR_VIEW_INVALID: i32 = -1;
/// Status of a full command queue. Nothing was done: try again later.
pub const BUSBAR_VIEW_FULL: i32 = -2;
/// Status of a system without a descriptor, memory or a thread left. Nothing was done.
pub const BUSBAR_VIEW_SYSTEM: i32 = -3;
/// Status of an internal fault of the library; the view does nothing any more. Close it.
pub const BUSBAR_VIEW_FAULT: i32 = -4;

/// Flag of BusbarViewOptions: show Busbar's own panels beside the scene.
pub const BUSBAR_VIEW_PANELS: u32 = 1;

/// State of a picture whose values were read at most `silent_millis` ago. Where frames take long,
/// the limit is two frame times, at most 900 ms.
pub const BUSBAR_VIEW_LIVE: u32 = 0;
/// State of a picture whose viewer is silent or gone: no value in it may be relied on. The library
/// has removed its colour and hatched it.
pub const BUSBAR_VIEW_DEAD: u32 = 1;
/// State of a picture whose viewer makes progress too slowly: its values were read more than
/// `silent_millis` ago. The library has removed its colour and hatched it, like a dead one.
pub const BUSBAR_VIEW_LATE: u32 = 2;

/// Quality of a usable value.
pub const BUSBAR_VIEW_GOOD: u32 = 0;
/// Quality of a doubtful value.
pub const BUSBAR_VIEW_UNCERTAIN: u32 = 1;
/// Quality of an unusable value.
pub const BUSBAR_VIEW_BAD: u32 = 2;

/// Value kind of a measurement, in `number`.
pub const BUSBAR_VIEW_F64: u32 = 0;
/// Value kind of a counter or code, in `integer`.
pub const BUSBAR_VIEW_I64: u32 = 1;
/// Value kind of a single point: `integer` is 0 or 1.
pub const BUSBAR_VIEW_BOOL: u32 = 2;
/// Value kind of a switch position in `integer`: 0 travelling, 1 open, 2 closed, 3 invalid (IEC
/// 60870-5-101, 7.2.6.2).
pub const BUSBAR_VIEW_DOUBLE_POINT: u32 = 3;
/// Value kind of an update that sets the quality alone.
pub const BUSBAR_VIEW_NO_VALUE: u32 = 4;

/// Source timestamp that is not known.
pub const BUSBAR_VIEW_NO_TIME: i64 = i64::MIN;

/// Event of the first picture. `text`: the graphics device.
pub const BUSBAR_VIEW_READY: u32 = 1;
/// Event of a new picture, or a new state of the last one, for busbar_view_frame. Merged: one waits
/// at most.
pub const BUSBAR_VIEW_FRAME: u32 = 2;
/// Event of a pick. `id`: the equipment, empty for nothing.
pub const BUSBAR_VIEW_PICKED: u32 = 3;
/// Event of the pointer over the equipment `id`, or over nothing. Merged.
pub const BUSBAR_VIEW_HOVERED: u32 = 4;
/// Event of a camera at `eye` that looks at `target`. Merged.
pub const BUSBAR_VIEW_CAMERA: u32 = 5;
/// Event of the alarm `id` in `state`: 'A' to 'I' by IEC 62682, since `unix_nanos`. `origins` names the
/// sources besides the live process of the value or verdict by which it came or went last. `text`:
/// reason of an overlay's verdict, with what is assumed; empty of an alarm on a tag. Each change is
/// delivered while there is room, and the last one of each alarm always.
pub const BUSBAR_VIEW_ALARM: u32 = 6;
/// Event of an operator's request for the alarm `id`, which your program decides on. `state`:
/// BUSBAR_VIEW_ACKNOWLEDGE and so on; `number`: shelving time, seconds.
pub const BUSBAR_VIEW_ASKED: u32 = 7;
/// Event of the tag `id` whose quality `state` is good, uncertain or bad, for the reason `text`.
/// `origins` names the sources of its value besides the live process: mark a value that has any.
/// Merged by tag.
pub const BUSBAR_VIEW_QUALITY: u32 = 8;
/// Event of the plugin instance `id`, whose state is `text`. Merged by plugin.
pub const BUSBAR_VIEW_PLUGIN: u32 = 9;
/// Event of a failed command or another fault; `text` names it and a remedy.
pub const BUSBAR_VIEW_ERROR: u32 = 10;
/// Event of a picture that is not live, for the reason `text`. `state`: BUSBAR_VIEW_DEAD where the
/// viewer is silent or gone, BUSBAR_VIEW_LATE where it is too slow. The library has covered the
/// picture in a window with hatching, and hatches it in memory: state beside it that it is not
/// live.
pub const BUSBAR_VIEW_LOST: u32 = 11;
/// Event of a picture that is live again. A new viewer has the last good configuration, camera,
/// alarms and tags.
pub const BUSBAR_VIEW_RECOVERED: u32 = 12;
/// Event of the configuration `id`, shown from now on.
pub const BUSBAR_VIEW_RELOADED: u32 = 13;

/// Event of an overlay's verdict `state` on the equipment `id`: BUSBAR_VIEW_NORMAL,
/// BUSBAR_VIEW_ABNORMAL, BUSBAR_VIEW_UNKNOWN or BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL. `text` is the
/// overlay's name, a line feed, and the reason. `number` is 1 where the verdict rests on a default,
/// which the reason names. Merged by overlay and equipment.
pub const BUSBAR_VIEW_VERDICT: u32 = 14;

/// Origin of a value that a person or program substituted for the measured one.
pub const BUSBAR_VIEW_SUBSTITUTED: u32 = 1;
/// Origin of a value from a device under test.
pub const BUSBAR_VIEW_TEST: u32 = 2;
/// Origin of a value that a simulator made.
pub const BUSBAR_VIEW_SIMULATED: u32 = 4;
/// Origin of a value that is replayed from a recording.
pub const BUSBAR_VIEW_RECORDED: u32 = 8;
/// Origin of a value that its source calls historical.
pub const BUSBAR_VIEW_HISTORICAL: u32 = 16;

/// Verdict on equipment within its limits.
pub const BUSBAR_VIEW_NORMAL: u32 = 0;
/// Verdict on equipment outside its limits, or in a state that needs attention.
pub const BUSBAR_VIEW_ABNORMAL: u32 = 1;
/// Verdict on equipment that cannot be judged.
pub const BUSBAR_VIEW_UNKNOWN: u32 = 2;
/// Verdict on equipment that cannot be judged, and was abnormal at the last judgment.
pub const BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL: u32 = 3;

/// Acknowledgement of an alarm.
pub const BUSBAR_VIEW_ACKNOWLEDGE: u32 = 1;
/// Shelving of an alarm.
pub const BUSBAR_VIEW_SHELVE: u32 = 2;
/// Unshelving of an alarm.
pub const BUSBAR_VIEW_UNSHELVE: u32 = 3;
/// Reset of a latched alarm.
pub const BUSBAR_VIEW_RESET: u32 = 4;

/// Movement of the pointer to x, y.
pub const BUSBAR_VIEW_MOVED: u32 = 1;
/// Press of a button at x, y.
pub const BUSBAR_VIEW_PRESSED: u32 = 2;
/// Release of a button at x, y.
pub const BUSBAR_VIEW_RELEASED: u32 = 3;
/// Turn of the wheel by `steps`, positive away from the user.
pub const BUSBAR_VIEW_SCROLLED: u32 = 4;
/// Pointer leaves the picture.
pub const BUSBAR_VIEW_LEFT: u32 = 5;

/// Content and limits of a view. Set all to 0 first, then `struct_size`, `config` and the size.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewOptions {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Flags of the view: BUSBAR_VIEW_PANELS or 0.
    pub flags: u32,
    /// Width of the picture, pixels: 1 to 8192.
    pub width: u32,
    /// Height of the picture, pixels: 1 to 8192; width times height at most 16,777,216.
    pub height: u32,
    /// X11 window to draw into; 0 draws offscreen.
    pub window: u32,
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
    /// Kind of the event: BUSBAR_VIEW_READY and so on.
    pub kind: u32,
    /// State, by the kind of the event.
    pub state: u32,
    /// Events dropped for want of room since the last one; events of alarms are never dropped.
    pub dropped: u32,
    /// Time by the kind of the event, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Number, by the kind of the event.
    pub number: f64,
    /// Origins, a sum of BUSBAR_VIEW_SUBSTITUTED and so on; 0 for a live value, and for other kinds of event.
    pub origins: u32,
    /// Reserved field, always 0.
    pub reserved: u32,
    /// Position of the camera, world space in metres.
    pub eye: [f32; 3],
    /// Point that the camera looks at, world space in metres.
    pub target: [f32; 3],
    /// Identifier, by the kind of the event.
    pub id: *const c_char,
    /// Text, by the kind of the event.
    pub text: *const c_char,
}

/// Picture of a view. Its pixels are blue, green, red and 255, rows from the top.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewFrame {
    /// Size of this struct, bytes; set it before the call.
    pub struct_size: u32,
    /// Liveness of the picture: BUSBAR_VIEW_LIVE, BUSBAR_VIEW_LATE or BUSBAR_VIEW_DEAD.
    pub state: u32,
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
    /// Kind of the value: BUSBAR_VIEW_F64 and so on.
    pub kind: u32,
    /// Quality of the value: BUSBAR_VIEW_GOOD, BUSBAR_VIEW_UNCERTAIN or BUSBAR_VIEW_BAD.
    pub quality: u32,
    /// Source timestamp, nanoseconds since 1970-01-01 UTC, or BUSBAR_VIEW_NO_TIME.
    pub source_unix_nanos: i64,
    /// Value of kind BUSBAR_VIEW_F64.
    pub number: f64,
    /// Value of the other kinds.
    pub integer: i64,
}

/// Callback for events. It must not close the view, and not unwind.
pub type BusbarViewCallback =
    Option<unsafe extern "C" fn(context: *mut c_void, event: *const BusbarViewEvent)>;
