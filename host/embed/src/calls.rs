//! What C calls: a view's life, its events, its pictures.
//!
//! Every function may be called on any thread, except that nothing may be called on a view
//! while or after it is closed. None waits for the viewer or for a disk.

use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Duration;

use busbar_client::{Given, Options, PictureState};
use busbar_protocol::message::Target;
use busbar_protocol::pictures::{PIXEL_BYTES, bytes_of};

use crate::abi::*;
use crate::strings::from_c;
use crate::view::{BusbarView, Callback};

/// Where no other is named.
const PROGRAM: &str = "busbar";
const SILENT_MILLIS: u32 = 500;
const HUNG_MILLIS: u32 = 1000;
const MAX_RESTART_MILLIS: u32 = 5000;
/// The least patience: a frame takes its time.
const MIN_SILENT_MILLIS: u32 = 100;

/// A call with a fault of ours in it answers that, and no panic leaves it.
pub(crate) fn guarded(call: impl FnOnce() -> i32) -> i32 {
    catch_unwind(AssertUnwindSafe(call)).unwrap_or(BUSBAR_VIEW_FAULT)
}

/// Does something with a view.
///
/// # Safety
/// `view` is null or from [`busbar_view_open`] and not closed.
pub(crate) unsafe fn with(view: *const BusbarView, call: impl FnOnce(&BusbarView) -> i32) -> i32 {
    // SAFETY: the caller's.
    let Some(view) = (unsafe { view.as_ref() }) else { return BUSBAR_VIEW_INVALID };
    guarded(|| call(view))
}

/// The version of this library's interface: BUSBAR_VIEW_ABI where library and header fit.
#[unsafe(no_mangle)]
pub extern "C" fn busbar_view_abi() -> u32 {
    BUSBAR_VIEW_ABI
}

/// Opens a view and starts its viewer, a process of its own. `*view` is yours: close it.
/// Whatever is wrong with the configuration comes as BUSBAR_VIEW_ERROR; the viewer is then
/// tried again, less and less often. The library has one thread a view, two for one in a window,
/// and must not be unloaded. Returns BUSBAR_VIEW_OK, INVALID or SYSTEM; `*view` is then null.
///
/// # Safety
/// `options` points to a struct as its `struct_size` says, with texts that end with a zero
/// byte; `view` to room for a pointer. Neither is kept.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_open(
    options: *const BusbarViewOptions,
    view: *mut *mut BusbarView,
) -> i32 {
    if view.is_null() || !view.is_aligned() || options.is_null() || !options.is_aligned() {
        return BUSBAR_VIEW_INVALID;
    }
    // SAFETY: the caller's, and checked as far as can be.
    unsafe { view.write(std::ptr::null_mut()) };
    // SAFETY: the first field is there in any case; the rest is read only where the size says so.
    let struct_size = unsafe { (*options).struct_size } as usize;
    if struct_size < size_of::<BusbarViewOptions>() {
        return BUSBAR_VIEW_INVALID;
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
                BUSBAR_VIEW_OK
            }
            Err(status) => status,
        }
    })
}

/// # Safety
/// The options' texts are null or end with a zero byte.
unsafe fn parse(options: &BusbarViewOptions) -> Result<Options, i32> {
    let or = |value: u32, usual: u32| if value == 0 { usual } else { value };
    let (size, silent) =
        ([options.width, options.height], or(options.silent_millis, SILENT_MILLIS));
    let hung = or(options.hung_millis, HUNG_MILLIS.max(silent));
    // SAFETY: the caller's.
    let config = unsafe { from_c(options.config) }.filter(|config| !config.is_empty());
    let config = config.and_then(absolute).ok_or(BUSBAR_VIEW_INVALID)?;
    let is_valid = bytes_of(size).is_some()
        && options.flags & !BUSBAR_VIEW_PANELS == 0
        && silent >= MIN_SILENT_MILLIS
        && hung >= silent;
    if !is_valid {
        return Err(BUSBAR_VIEW_INVALID);
    }
    let target = match options.window {
        0 => Target::Offscreen,
        window => Target::Window(window),
    };
    let optional = |text: *const std::ffi::c_char| {
        // SAFETY: the caller's.
        (!text.is_null()).then(|| unsafe { from_c(text) }.ok_or(BUSBAR_VIEW_INVALID)).transpose()
    };
    let millis = |millis: u32| Duration::from_millis(u64::from(millis));
    Ok(Options {
        program: optional(options.program)?.unwrap_or(PROGRAM).into(),
        config,
        target,
        size,
        panels: options.flags & BUSBAR_VIEW_PANELS != 0,
        operator: optional(options.operator_name)?.unwrap_or_default().to_owned(),
        silent: millis(silent),
        hung: millis(hung),
        longest_delay: millis(or(options.max_restart_millis, MAX_RESTART_MILLIS)),
    })
}

/// A path as a process in another folder finds it.
pub(crate) fn absolute(path: &str) -> Option<String> {
    let path: PathBuf = std::path::absolute(path).ok()?;
    path.into_os_string().into_string().ok()
}

/// Closes a view; its viewer ends by itself soon after. No callback runs after this; one that
/// runs on another thread is waited for. Null is no view and no fault.
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
            BUSBAR_VIEW_OK
        });
    }
}

/// A descriptor that is readable while events wait, for your event loop. It is the view's:
/// do not read, write or close it. Below 0 is a status.
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
/// `event->struct_size` first. Its texts stay until the next call.
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
        return BUSBAR_VIEW_INVALID;
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

/// Sets who is told of events; null for nobody. With `on_own_thread` 0 the callback runs
/// within busbar_view_dispatch alone; else the view's own thread calls it, as soon as
/// something happens, and it must not take long: the viewer is not watched meanwhile.
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
) -> i32 {
    let set = |view: &BusbarView| {
        view.set_callback(Callback { function: callback, context }, on_own_thread != 0);
        BUSBAR_VIEW_OK
    };
    // SAFETY: the caller's.
    unsafe { with(view, set) }
}

/// Calls the callback for each event that waits, on this thread. Returns how many, at most
/// 1024; below 0 is a status.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_dispatch(view: *const BusbarView) -> i32 {
    // SAFETY: the caller's.
    unsafe { with(view, |view| view.dispatch() as i32) }
}

/// Gives the newest picture of a view without a window: 1 where it differs from that of the
/// call before, 0 where it does not, below 0 a status. Set `frame->struct_size` first. A
/// picture that is old is marked by the library: see BUSBAR_VIEW_DEAD and BUSBAR_VIEW_LATE.
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
        return BUSBAR_VIEW_INVALID;
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

fn to_frame(given: &Given, struct_size: u32) -> BusbarViewFrame {
    let ([width, height], damage) = (given.numbers.size, given.numbers.damage);
    BusbarViewFrame {
        struct_size,
        state: match given.state {
            PictureState::Live => BUSBAR_VIEW_LIVE,
            PictureState::Late => BUSBAR_VIEW_LATE,
            PictureState::Dead => BUSBAR_VIEW_DEAD,
        },
        width,
        height,
        stride: width * PIXEL_BYTES as u32,
        damage_x: damage.x,
        damage_y: damage.y,
        damage_width: damage.width,
        damage_height: damage.height,
        age_millis: u32::try_from(given.age.as_millis()).unwrap_or(u32::MAX),
        sequence: given.numbers.sequence,
        pixels: given.pixels,
    }
}

fn no_frame(struct_size: u32) -> BusbarViewFrame {
    BusbarViewFrame {
        struct_size,
        state: BUSBAR_VIEW_DEAD,
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

/// The process of the viewer, 0 while there is none. For diagnosis.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_process(view: *const BusbarView) -> u32 {
    // SAFETY: the caller's.
    unsafe { with(view, |view| view.view.process() as i32) }.max(0) as u32
}
