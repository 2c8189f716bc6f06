//! C functions for the lifetime of a view, its events and its pictures.
//!
//! Every function may be called on any thread, except that nothing may be called on a view
//! while or after it is closed. None waits for the viewer or for a disk.

use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Duration;

use busbar_client::liveness::{DEFAULT_HUNG, DEFAULT_SILENT};
use busbar_client::{FrameView, Options, PictureState};
use busbar_protocol::message::Target;
use busbar_protocol::pictures::{PIXEL_BYTES, picture_bytes};

use crate::abi::*;
use crate::strings::from_c;
use crate::view::{BusbarView, Callback};

impl From<BusbarStatus> for i32 {
    fn from(status: BusbarStatus) -> Self {
        status as Self
    }
}

/// Default program name of the viewer.
const PROGRAM: &str = "busbar";
const MAX_RESTART: Duration = Duration::from_secs(5);
/// Least limit of a picture's age: one frame takes its time.
const MIN_SILENT: Duration = Duration::from_millis(100);

/// Runs a call; a panic in it becomes a status and never reaches C.
pub(crate) fn guarded<T: From<BusbarStatus>>(call: impl FnOnce() -> T) -> T {
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|_| BusbarStatus::Fault.into())
}

/// Runs a call with a view, after a null check.
///
/// # Safety
/// `view` is null or from [`busbar_view_open`] and not closed.
pub(crate) unsafe fn with<T: From<BusbarStatus>>(
    view: *const BusbarView,
    call: impl FnOnce(&BusbarView) -> T,
) -> T {
    // SAFETY: the caller's.
    let Some(view) = (unsafe { view.as_ref() }) else { return BusbarStatus::Invalid.into() };
    guarded(|| call(view))
}

/// Returns the version of this library's interface: BUSBAR_VIEW_ABI where library and header fit.
#[unsafe(no_mangle)]
pub extern "C" fn busbar_view_abi() -> u32 {
    BUSBAR_VIEW_ABI
}

/// Returns the text of a status for people, which is never null and never freed. A number that is
/// no status has one too.
#[unsafe(no_mangle)]
pub extern "C" fn busbar_status_text(status: BusbarStatusNumber) -> *const c_char {
    const TEXTS: [(BusbarStatus, &CStr); 5] = [
        (BusbarStatus::Ok, c"success"),
        (
            BusbarStatus::Invalid,
            c"an argument is null, too small, too large, not UTF-8 or not finite",
        ),
        (BusbarStatus::Full, c"the command queue is full: try again later"),
        (BusbarStatus::System, c"the system has no descriptor, memory or thread left"),
        (BusbarStatus::Fault, c"internal fault of the library: close the view"),
    ];
    let text = TEXTS.iter().find(|(known, _)| *known as i32 == status);
    text.map_or(c"not a status of this library", |(_, text)| text).as_ptr()
}

/// Opens a view and starts its viewer, a process of its own. `*view` is yours: close it; after a
/// failure it is null. A fault of the configuration arrives as BUSBAR_VIEW_EVENT_KIND_ERROR; the
/// viewer is then started again with growing delays. The library has one thread a view, two for one
/// in a window, and must not be unloaded.
///
/// # Safety
/// `options` points to a struct as its `struct_size` says, with texts that end with a zero
/// byte; `view` to room for a pointer. Neither is kept.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_open(
    options: *const BusbarViewOptions,
    view: *mut *mut BusbarView,
) -> BusbarStatus {
    if view.is_null() || !view.is_aligned() || options.is_null() || !options.is_aligned() {
        return BusbarStatus::Invalid;
    }
    // SAFETY: the caller's, and checked as far as can be.
    unsafe { view.write(std::ptr::null_mut()) };
    // SAFETY: the first field is there in any case; the rest is read only where the size says so.
    let struct_size = unsafe { (*options).struct_size } as usize;
    if struct_size < size_of::<BusbarViewOptions>() {
        return BusbarStatus::Invalid;
    }
    // SAFETY: as large as it must be.
    let options = unsafe { options.read() };
    guarded(|| {
        // SAFETY: the caller's texts.
        let opened = unsafe { parse(&options) };
        match opened.and_then(BusbarView::open) {
            Ok(opened) => {
                // SAFETY: as above.
                unsafe { view.write(Box::into_raw(Box::new(opened))) };
                BusbarStatus::Ok
            }
            Err(status) => status,
        }
    })
}

/// # Safety
/// The options' texts are null or end with a zero byte.
unsafe fn parse(options: &BusbarViewOptions) -> Result<Options, BusbarStatus> {
    let millis = |millis: u32| Duration::from_millis(u64::from(millis));
    let or = |value: u32, usual: Duration| if value == 0 { usual } else { millis(value) };
    let size = [options.width, options.height];
    let silent = or(options.silent_millis, DEFAULT_SILENT);
    let hung = or(options.hung_millis, DEFAULT_HUNG.max(silent));
    // SAFETY: the caller's.
    let config = unsafe { from_c(options.config) }.filter(|config| !config.is_empty());
    let config = config.and_then(absolute).ok_or(BusbarStatus::Invalid)?;
    let is_valid = picture_bytes(size).is_some()
        && options.flags & !BUSBAR_VIEW_FLAG_PANELS == 0
        && silent >= MIN_SILENT
        && hung >= silent;
    if !is_valid {
        return Err(BusbarStatus::Invalid);
    }
    let target = target(options).ok_or(BusbarStatus::Invalid)?;
    let optional = |text: *const c_char| {
        // SAFETY: the caller's.
        (!text.is_null()).then(|| unsafe { from_c(text) }.ok_or(BusbarStatus::Invalid)).transpose()
    };
    Ok(Options {
        program: optional(options.program)?.unwrap_or(PROGRAM).into(),
        config,
        target,
        size,
        panels: options.flags & BUSBAR_VIEW_FLAG_PANELS != 0,
        operator: optional(options.operator_name)?.unwrap_or_default().to_owned(),
        silent,
        hung,
        longest_delay: or(options.max_restart_millis, MAX_RESTART),
    })
}

/// Returns the target of the options' window; none where its system does not have such a window.
fn target(options: &BusbarViewOptions) -> Option<Target> {
    match (BusbarViewWindowSystem::from_number(options.window_system)?, options.window) {
        (BusbarViewWindowSystem::None, 0) => Some(Target::Offscreen),
        (BusbarViewWindowSystem::X11, 1..) => options.window.try_into().ok().map(Target::Window),
        _ => None,
    }
}

/// Returns an absolute path, which a process in another folder finds.
pub(crate) fn absolute(path: &str) -> Option<String> {
    let path: PathBuf = std::path::absolute(path).ok()?;
    path.into_os_string().into_string().ok()
}

/// Closes a view; its viewer ends by itself soon after. No callback runs after this; one that runs
/// on another thread is waited for. A null view is no fault. No other call on the view may be under
/// way or come later, and the call may not come from its own callback.
///
/// # Safety
/// `view` is null or from [`busbar_view_open`]; no other call on it is under way or comes
/// later; not from its own callback.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_close(view: *mut BusbarView) {
    if !view.is_null() {
        // SAFETY: the caller's.
        let view = unsafe { Box::from_raw(view) };
        guarded(|| {
            drop(view);
            BusbarStatus::Ok
        });
    }
}

/// Returns a descriptor that is readable while events wait, for your event loop. The view owns it:
/// do not read, write or close it. A number below 0 is a status.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_descriptor(view: *const BusbarView) -> i32 {
    use std::os::fd::AsRawFd;
    // SAFETY: the caller's.
    unsafe { with(view, |view| view.view.has_events().as_raw_fd()) }
}

/// Takes the next event: 1 where there is one, 0 where none waits, below 0 a status. Set
/// `event->struct_size` first. Its texts stay valid until the next call. One thread at a time.
///
/// # Safety
/// `view` is null or open; `event` points to a struct as its `struct_size` says. One thread
/// at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_next_event(
    view: *const BusbarView,
    event: *mut BusbarViewEvent,
) -> i32 {
    // SAFETY: the caller's; the first field is there in any case.
    if !unsafe { fits(event.cast(), event.is_aligned(), size_of::<BusbarViewEvent>()) } {
        return BusbarStatus::Invalid as i32;
    }
    let take = |view: &BusbarView| {
        let Some(mut taken) = view.take_event() else { return 0 };
        // SAFETY: as large as it says.
        unsafe {
            taken.struct_size = (*event).struct_size;
            event.write(taken);
        }
        1
    };
    // SAFETY: the caller's.
    unsafe { with(view, take) }
}

/// # Safety
/// A pointer that is not null and is aligned points to a struct whose first field, 32 bits,
/// is its size.
unsafe fn fits(to: *const u32, is_aligned: bool, size: usize) -> bool {
    // SAFETY: the caller's.
    !to.is_null() && is_aligned && unsafe { to.read() } as usize >= size
}

/// Sets the callback for events; null for none. With `on_own_thread` 0 the callback runs within
/// busbar_view_dispatch alone. Otherwise the view's own thread calls it at once. It must not take
/// long there: the viewer is not supervised meanwhile. `context` must be valid until another
/// callback is set or the view is closed. Not to be called from a callback on the view's own
/// thread.
///
/// # Safety
/// `view` is null or open; `callback` can be called with `context` until another is set or
/// the view is closed. Not from a callback on the view's own thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_set_callback(
    view: *const BusbarView,
    callback: BusbarViewCallback,
    context: *mut c_void,
    on_own_thread: i32,
) -> BusbarStatus {
    let set = |view: &BusbarView| {
        view.set_callback(Callback { function: callback, context }, on_own_thread != 0);
        BusbarStatus::Ok
    };
    // SAFETY: the caller's.
    unsafe { with(view, set) }
}

/// Calls the callback for each event that waits, on this thread. Returns the number of events, at
/// most 1024; a number below 0 is a status.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_dispatch(view: *const BusbarView) -> i32 {
    // SAFETY: the caller's.
    unsafe { with(view, |view| view.dispatch() as i32) }
}

/// Returns the newest picture of a view without a window. The result is 1 where it differs from
/// that of the call before, 0 where it does not, below 0 a status. Set `frame->struct_size` first.
/// One thread at a time. The library marks a picture that is old: see BusbarViewLiveness.
///
/// # Safety
/// `view` is null or open; `frame` points to a struct as its `struct_size` says. One thread
/// at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_frame(
    view: *const BusbarView,
    frame: *mut BusbarViewFrame,
) -> i32 {
    // SAFETY: the caller's; the first field is there in any case.
    if !unsafe { fits(frame.cast(), frame.is_aligned(), size_of::<BusbarViewFrame>()) } {
        return BusbarStatus::Invalid as i32;
    }
    let give = |view: &BusbarView| {
        let given = view.view.frame();
        let is_new = given.as_ref().is_some_and(|given| given.is_new);
        // SAFETY: as large as it says.
        let struct_size = unsafe { (*frame).struct_size };
        let written =
            given.map_or_else(|| no_frame(struct_size), |given| to_frame(&given, struct_size));
        // SAFETY: as large as it says.
        unsafe { frame.write(written) };
        i32::from(is_new)
    };
    // SAFETY: the caller's.
    unsafe { with(view, give) }
}

fn to_frame(given: &FrameView, struct_size: u32) -> BusbarViewFrame {
    let ([width, height], damage) = (given.info.size, given.info.damage);
    BusbarViewFrame {
        struct_size,
        liveness: match given.state {
            PictureState::Live => BusbarViewLiveness::Live,
            PictureState::Late => BusbarViewLiveness::Late,
            PictureState::Dead => BusbarViewLiveness::Dead,
        },
        width,
        height,
        stride: width * PIXEL_BYTES as u32,
        damage_x: damage.x,
        damage_y: damage.y,
        damage_width: damage.width,
        damage_height: damage.height,
        age_millis: u32::try_from(given.age.as_millis()).unwrap_or(u32::MAX),
        sequence: given.info.sequence,
        pixels: given.pixels,
    }
}

fn no_frame(struct_size: u32) -> BusbarViewFrame {
    BusbarViewFrame {
        struct_size,
        liveness: BusbarViewLiveness::Dead,
        width: 0,
        height: 0,
        stride: 0,
        damage_x: 0,
        damage_y: 0,
        damage_width: 0,
        damage_height: 0,
        age_millis: u32::MAX,
        sequence: 0,
        pixels: std::ptr::null(),
    }
}

/// Returns the process id of the viewer, 0 while there is none. For diagnosis.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_process(view: *const BusbarView) -> u32 {
    // SAFETY: the caller's.
    unsafe { with(view, |view| view.view.process() as i32) }.max(0) as u32
}
