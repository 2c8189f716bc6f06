//! What crosses the border to C: structs and numbers.

use std::ffi::{c_char, c_void};

/// Version of this interface: of another one, do not use the library.
pub const BUSBAR_VIEW_ABI: u32 = 2;

/// Done.
pub const BUSBAR_VIEW_OK: i32 = 0;
/// An argument is null, too small, too large, not UTF-8, or not finite. Nothing was done.
pub const BUSBAR_VIEW_INVALID: i32 = -1;
/// Too much waits for the viewer already. Nothing was done: try again later.
pub const BUSBAR_VIEW_FULL: i32 = -2;
/// The system has no descriptor, no memory or no thread left. Nothing was done.
pub const BUSBAR_VIEW_SYSTEM: i32 = -3;
/// A fault of the library itself; the view does nothing any more. Close it.
pub const BUSBAR_VIEW_FAULT: i32 = -4;

/// Flag of BusbarViewOptions: show Busbar's own panels beside the scene.
pub const BUSBAR_VIEW_PANELS: u32 = 1;

/// The picture shows values that were read at most `silent_millis` ago; where frames take long,
/// two frame times, at most 900 ms.
pub const BUSBAR_VIEW_LIVE: u32 = 0;
/// The viewer is silent or gone: no value in the picture may be relied on. The library has taken
/// its colour and hatched it.
pub const BUSBAR_VIEW_DEAD: u32 = 1;
/// The viewer goes on, and is too slow: the picture shows values that were read more than
/// `silent_millis` ago. The library has taken its colour and hatched it, as a dead one.
pub const BUSBAR_VIEW_LATE: u32 = 2;

/// Usable.
pub const BUSBAR_VIEW_GOOD: u32 = 0;
/// Doubtful.
pub const BUSBAR_VIEW_UNCERTAIN: u32 = 1;
/// Not usable.
pub const BUSBAR_VIEW_BAD: u32 = 2;

/// `number` is a measurement.
pub const BUSBAR_VIEW_F64: u32 = 0;
/// `integer` is a counter or code.
pub const BUSBAR_VIEW_I64: u32 = 1;
/// `integer` is 0 or 1.
pub const BUSBAR_VIEW_BOOL: u32 = 2;
/// `integer` is a switch position: 0 travelling, 1 open, 2 closed, 3 invalid
/// (IEC 60870-5-101, 7.2.6.2).
pub const BUSBAR_VIEW_DOUBLE_POINT: u32 = 3;
/// No value: something is said of the quality alone.
pub const BUSBAR_VIEW_NO_VALUE: u32 = 4;

/// No time is known.
pub const BUSBAR_VIEW_NO_TIME: i64 = i64::MIN;

/// The first picture is there. `text`: the graphics device.
pub const BUSBAR_VIEW_READY: u32 = 1;
/// busbar_view_frame has something new. Merged: one waits at most.
pub const BUSBAR_VIEW_FRAME: u32 = 2;
/// Something was picked. `id`: its equipment, empty for nothing.
pub const BUSBAR_VIEW_PICKED: u32 = 3;
/// The pointer is over `id`, or over nothing. Merged.
pub const BUSBAR_VIEW_HOVERED: u32 = 4;
/// The camera is at `eye` and looks at `target`. Merged.
pub const BUSBAR_VIEW_CAMERA: u32 = 5;
/// The alarm `id` is in `state`: 'A' to 'I' by IEC 62682, since `unix_nanos`. Each change
/// comes while there is room, and the last one of each alarm always.
pub const BUSBAR_VIEW_ALARM: u32 = 6;
/// An operator wants something of the alarm `id`, which your program decides on. `state`:
/// BUSBAR_VIEW_ACKNOWLEDGE and so on; `number`: seconds on the shelf.
pub const BUSBAR_VIEW_ASKED: u32 = 7;
/// The tag `id` is good, uncertain or bad (`state`), for the reason `text`. `origins` says of
/// what its value is besides the live process: mark a value that has any. Merged by tag.
pub const BUSBAR_VIEW_QUALITY: u32 = 8;
/// The plugin instance `id` goes as `text` says. Merged by plugin.
pub const BUSBAR_VIEW_PLUGIN: u32 = 9;
/// Something could not be done, or goes wrong; `text` says what, and what helps.
pub const BUSBAR_VIEW_ERROR: u32 = 10;
/// The picture is not live; `text` says how. `state`: BUSBAR_VIEW_DEAD where the viewer is silent
/// or gone, BUSBAR_VIEW_LATE where it goes on too slowly. In a window the library has covered the
/// picture with hatching, in memory it hatches it: say beside it that it is not live.
pub const BUSBAR_VIEW_LOST: u32 = 11;
/// The picture is live again. Of another viewer it is with its last good configuration, camera,
/// alarms and tags.
pub const BUSBAR_VIEW_RECOVERED: u32 = 12;
/// The configuration `id` is shown from here on.
pub const BUSBAR_VIEW_RELOADED: u32 = 13;

/// The verdict of an overlay on the equipment `id` is `state`: BUSBAR_VIEW_NORMAL,
/// BUSBAR_VIEW_ABNORMAL, BUSBAR_VIEW_UNKNOWN or BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL. `text` is the
/// overlay's name, a line feed, and the reason; `number` is 1 where it rests on a default, which
/// the reason names. Merged by overlay and equipment.
pub const BUSBAR_VIEW_VERDICT: u32 = 14;

/// Origin of a value that a person or program put in place of the measured one.
pub const BUSBAR_VIEW_SUBSTITUTED: u32 = 1;
/// Origin of a value from a device under test.
pub const BUSBAR_VIEW_TEST: u32 = 2;
/// Origin of a value that a simulator made.
pub const BUSBAR_VIEW_SIMULATED: u32 = 4;
/// Origin of a value that is replayed from a recording.
pub const BUSBAR_VIEW_RECORDED: u32 = 8;
/// Origin of a value of the past, as its source says.
pub const BUSBAR_VIEW_HISTORICAL: u32 = 16;

/// Within its limits.
pub const BUSBAR_VIEW_NORMAL: u32 = 0;
/// Outside its limits, or in a state that needs attention.
pub const BUSBAR_VIEW_ABNORMAL: u32 = 1;
/// Nobody can judge it.
pub const BUSBAR_VIEW_UNKNOWN: u32 = 2;
/// Nobody can judge it, and it was abnormal when it was last known.
pub const BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL: u32 = 3;

/// Acknowledge an alarm.
pub const BUSBAR_VIEW_ACKNOWLEDGE: u32 = 1;
/// Put an alarm on the shelf.
pub const BUSBAR_VIEW_SHELVE: u32 = 2;
/// Take an alarm off the shelf.
pub const BUSBAR_VIEW_UNSHELVE: u32 = 3;
/// Let go of an alarm's latch.
pub const BUSBAR_VIEW_RESET: u32 = 4;

/// The pointer moved to x, y.
pub const BUSBAR_VIEW_MOVED: u32 = 1;
/// A button went down at x, y.
pub const BUSBAR_VIEW_PRESSED: u32 = 2;
/// A button went up at x, y.
pub const BUSBAR_VIEW_RELEASED: u32 = 3;
/// The wheel turned by `steps`, away from the hand above 0.
pub const BUSBAR_VIEW_SCROLLED: u32 = 4;
/// The pointer left the picture.
pub const BUSBAR_VIEW_LEFT: u32 = 5;

/// What a view is to show. Set all to 0 first, then `struct_size`, `config` and the size.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewOptions {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// BUSBAR_VIEW_PANELS or 0.
    pub flags: u32,
    /// Width of the picture, pixels: 1 to 8192.
    pub width: u32,
    /// Height, likewise; width times height at most 16,777,216.
    pub height: u32,
    /// X11 window to draw into; 0 draws offscreen.
    pub window: u32,
    /// Milliseconds since the values in the picture were read after which it is not live: it is
    /// hatched; 0 for 500. Where frames take so long that no picture could be younger it is two
    /// frame times, at most 900 ms. A window is covered at most 50 ms later, on a machine with a CPU to
    /// spare.
    pub silent_millis: u32,
    /// Milliseconds without a heartbeat and without progress of its process after which the
    /// viewer is ended and started again; 0 for 1000. At least silent_millis. A viewer that
    /// makes progress is slow and not hung: it is ended after 30 s without a frame, one that
    /// sleeps after 5 s, one that a signal stopped after 10 s; later where hung_millis is more,
    /// or where its last frames took more than an eighth of that.
    pub hung_millis: u32,
    /// The longest delay before a viewer that keeps dying is started again, milliseconds;
    /// 0 for 5000.
    pub max_restart_millis: u32,
    /// Path of the configuration, UTF-8.
    pub config: *const c_char,
    /// Path of the program `busbar`; null looks for it in PATH.
    pub program: *const c_char,
    /// Who acts on alarms, for the audit log; null for nobody.
    pub operator_name: *const c_char,
}

/// What happened. Texts end with a zero byte and are never null; they stay as they are
/// until the next event of the view is taken, or until the callback returns.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewEvent {
    /// Size of this struct, bytes; set it before the call.
    pub struct_size: u32,
    /// BUSBAR_VIEW_READY and so on.
    pub kind: u32,
    /// See the kind.
    pub state: u32,
    /// Events that were dropped since the last one for want of room; never of alarms.
    pub dropped: u32,
    /// See the kind; nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// See the kind.
    pub number: f64,
    /// Sum of BUSBAR_VIEW_SUBSTITUTED and so on; 0 for a live value, and for other kinds of event.
    pub origins: u32,
    /// Always 0.
    pub reserved: u32,
    /// Where the camera stands, world space in metres.
    pub eye: [f32; 3],
    /// What it looks at.
    pub target: [f32; 3],
    /// See the kind.
    pub id: *const c_char,
    /// See the kind.
    pub text: *const c_char,
}

/// A picture. Its pixels are blue, green, red and 255, rows from the top.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewFrame {
    /// Size of this struct, bytes; set it before the call.
    pub struct_size: u32,
    /// BUSBAR_VIEW_LIVE, BUSBAR_VIEW_LATE or BUSBAR_VIEW_DEAD.
    pub state: u32,
    /// Pixels in a row; 0 where there is no picture yet.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from row to row.
    pub stride: u32,
    /// Leftmost column of what may differ from the picture of the call before.
    pub damage_x: u32,
    /// Topmost row of it.
    pub damage_y: u32,
    /// Its columns; 0 where nothing differs.
    pub damage_width: u32,
    /// Its rows.
    pub damage_height: u32,
    /// Milliseconds since the values that the picture shows were read.
    pub age_millis: u32,
    /// Number of the picture in its viewer, from 1.
    pub sequence: u64,
    /// The first pixel; null where there is no picture yet. Stays as it is until the next
    /// call of busbar_view_frame or busbar_view_close.
    pub pixels: *const u8,
}

/// A value of a tag that the configuration marks with "set_by_host". Its age counts from the
/// call, or from its source time if that is earlier; past the tag's freshness it is stale.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarViewTag {
    /// Id of the tag, UTF-8.
    pub id: *const c_char,
    /// BUSBAR_VIEW_F64 and so on.
    pub kind: u32,
    /// BUSBAR_VIEW_GOOD, BUSBAR_VIEW_UNCERTAIN or BUSBAR_VIEW_BAD.
    pub quality: u32,
    /// When it was so, nanoseconds since 1970-01-01 UTC, or BUSBAR_VIEW_NO_TIME.
    pub source_unix_nanos: i64,
    /// The value of kind BUSBAR_VIEW_F64.
    pub number: f64,
    /// The value of the other kinds.
    pub integer: i64,
}

/// Told of each event. It must not close the view, and not unwind.
pub type BusbarViewCallback =
    Option<unsafe extern "C" fn(context: *mut c_void, event: *const BusbarViewEvent)>;
