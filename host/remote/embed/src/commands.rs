//! C functions that command a viewer. Each returns its status at once; a refusal of the viewer
//! arrives as an event. A command given while no viewer runs is executed when one is back.

use std::ffi::{CStr, c_char};

use busbar_client::OutboxFull;
use busbar_protocol::message::{
    AlarmRequest, CameraPose, Command, MAX_TAGS_A_MESSAGE, PointerEvent, TagUpdate,
};
use busbar_protocol::pictures::now;
use busbar_types::{AlarmState, DoublePoint, QualityLevel, Text, Value};

use crate::abi::*;
use crate::calls::{absolute, with};
use crate::strings::from_c;
use crate::view::BusbarView;

/// Checks a command and puts it into the queue.
///
/// # Safety
/// `view` is null or open.
unsafe fn ask(view: *const BusbarView, command: Option<Command>) -> BusbarStatus {
    let send = |view: &BusbarView| match command.filter(|command| command.check().is_ok()) {
        Some(command) => status(view.view.command(command)),
        None => BusbarStatus::Invalid,
    };
    // SAFETY: the caller's.
    unsafe { with(view, send) }
}

fn status(result: Result<(), OutboxFull>) -> BusbarStatus {
    result.map_or(BusbarStatus::Full, |()| BusbarStatus::Ok)
}

/// # Safety
/// `text` is null or ends with a zero byte.
unsafe fn named(text: *const c_char, command: fn(String) -> Command) -> Option<Command> {
    // SAFETY: the caller's.
    unsafe { from_c(text) }.map(|text| command(text.to_owned()))
}

/// Sets the size of the pictures. A view in a window follows the window's size by itself.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_resize(
    view: *const BusbarView,
    width: u32,
    height: u32,
) -> BusbarStatus {
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::Resize([width, height]))) }
}

/// Sets whether anybody can see the picture; it is not drawn otherwise. Alarms continue.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_set_visible(
    view: *const BusbarView,
    visible: i32,
) -> BusbarStatus {
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::SetVisible(visible != 0))) }
}

/// Moves the camera to one of the configuration.
///
/// # Safety
/// `view` is null or open; `name` null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_use_camera(
    view: *const BusbarView,
    name: *const c_char,
) -> BusbarStatus {
    // SAFETY: the caller's.
    unsafe { ask(view, named(name, Command::UseCamera)) }
}

/// Moves the camera to `eye`, looking at `target`: three numbers each, world space in metres.
///
/// # Safety
/// `view` is null or open; `eye` and `target` null or three numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_look(
    view: *const BusbarView,
    eye: *const f64,
    target: *const f64,
) -> BusbarStatus {
    if eye.is_null() || target.is_null() || !eye.is_aligned() || !target.is_aligned() {
        return BusbarStatus::Invalid;
    }
    // SAFETY: the caller's.
    let (eye, target) =
        unsafe { (eye.cast::<[f64; 3]>().read(), target.cast::<[f64; 3]>().read()) };
    let pose = CameraPose { eye, target, is_orthographic: false };
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::SetCamera(pose))) }
}

/// Selects and frames a piece of equipment, by its id or an alias.
///
/// # Safety
/// `view` is null or open; `id` null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_focus(
    view: *const BusbarView,
    id: *const c_char,
) -> BusbarStatus {
    // SAFETY: the caller's.
    unsafe { ask(view, named(id, Command::Focus)) }
}

/// Sets theta of every model, 0 (full detail) to 1; below 0 their policies choose again.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_set_theta(
    view: *const BusbarView,
    theta: f64,
) -> BusbarStatus {
    let theta = (theta >= 0.0 || theta.is_nan()).then_some(theta);
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::SetTheta(theta))) }
}

/// Shows or hides an overlay, by the name of its plugin instance.
///
/// # Safety
/// `view` is null or open; `layer` null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_set_layer(
    view: *const BusbarView,
    layer: *const c_char,
    shown: i32,
) -> BusbarStatus {
    // SAFETY: the caller's.
    let layer = unsafe { from_c(layer) };
    let command = layer.map(|l| Command::SetLayer { layer: l.to_owned(), shown: shown != 0 });
    // SAFETY: the caller's.
    unsafe { ask(view, command) }
}

/// Sets tags, at most 4096 at once; all of them or none. Set them again before their freshness
/// ends: a value that nobody repeats goes stale, whatever the reason.
///
/// # Safety
/// `view` is null or open; `tags` null or so many tags with texts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_set_tags(
    view: *const BusbarView,
    tags: *const BusbarViewTag,
    count: usize,
) -> BusbarStatus {
    if tags.is_null() || !tags.is_aligned() || count > MAX_TAGS_A_MESSAGE {
        return BusbarStatus::Invalid;
    }
    // SAFETY: the caller's.
    let tags = unsafe { std::slice::from_raw_parts(tags, count) };
    let sent_at = now();
    // SAFETY: the caller's texts.
    let updates: Option<Vec<_>> = tags.iter().map(|tag| unsafe { update(tag, sent_at) }).collect();
    // SAFETY: the caller's.
    unsafe { ask(view, updates.map(Command::SetTags)) }
}

/// # Safety
/// The tag's id, and its text where it is one, are null or end with a zero byte.
unsafe fn update(tag: &BusbarViewTag, sent_at: u64) -> Option<TagUpdate> {
    // SAFETY: the caller's.
    let id = unsafe { from_c(tag.id) }?;
    let value = match BusbarViewValueKind::from_number(tag.kind)? {
        BusbarViewValueKind::F64 => Some(Value::F64(tag.number)),
        BusbarViewValueKind::I64 => Some(Value::I64(tag.integer)),
        BusbarViewValueKind::Bool => Some(Value::Bool(tag.integer != 0)),
        BusbarViewValueKind::DoublePoint => Some(Value::DoublePoint(position(tag.integer)?)),
        BusbarViewValueKind::None => None,
        BusbarViewValueKind::Text if tag.text.is_null() => return None,
        BusbarViewValueKind::Text => {
            // SAFETY: not null; the caller's.
            let bytes = unsafe { CStr::from_ptr(tag.text) }.to_bytes();
            Some(Value::Text(Text::from_utf8_lossy(bytes)))
        }
    };
    let quality = match BusbarViewQuality::from_number(tag.quality)? {
        BusbarViewQuality::Good => QualityLevel::Good,
        BusbarViewQuality::Uncertain => QualityLevel::Uncertain,
        BusbarViewQuality::Bad => QualityLevel::Bad,
    };
    let is_known = tag.source_unix_nanos != BUSBAR_VIEW_NO_TIME;
    let source_time = is_known.then_some(tag.source_unix_nanos);
    Some(TagUpdate { tag: id.to_owned(), value, quality, source_time, sent_at })
}

fn position(number: i64) -> Option<DoublePoint> {
    u64::try_from(number).ok().filter(|bits| *bits <= 3).map(DoublePoint::from_bits)
}

/// Applies an operator's action to an alarm. `shelve_seconds` is the shelving time. A null
/// `operator_name` stands for that of the options.
///
/// # Safety
/// `view` is null or open; texts are null or texts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_act_on_alarm(
    view: *const BusbarView,
    alarm: *const c_char,
    action: BusbarViewAlarmActionNumber,
    shelve_seconds: u32,
    operator_name: *const c_char,
) -> BusbarStatus {
    let action = match BusbarViewAlarmAction::from_number(action) {
        Some(BusbarViewAlarmAction::Acknowledge) => AlarmRequest::Acknowledge,
        Some(BusbarViewAlarmAction::Shelve) => AlarmRequest::Shelve(shelve_seconds),
        Some(BusbarViewAlarmAction::Unshelve) => AlarmRequest::Unshelve,
        Some(BusbarViewAlarmAction::Reset) => AlarmRequest::Reset,
        Some(BusbarViewAlarmAction::None) | None => return BusbarStatus::Invalid,
    };
    // SAFETY: the caller's.
    let alarm = unsafe { from_c(alarm) };
    // SAFETY: the caller's.
    let by = if operator_name.is_null() { Some("") } else { unsafe { from_c(operator_name) } };
    let command = alarm.zip(by).map(|(alarm, operator)| Command::ActOnAlarm {
        alarm: alarm.to_owned(),
        action,
        operator: operator.to_owned(),
    });
    // SAFETY: the caller's.
    unsafe { ask(view, command) }
}

/// Sets an alarm that your program decides on ("mirrored") to a state.
///
/// # Safety
/// `view` is null or open; `alarm` null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_mirror_alarm(
    view: *const BusbarView,
    alarm: *const c_char,
    state: BusbarViewAlarmStateNumber,
) -> BusbarStatus {
    // SAFETY: the caller's.
    let alarm = unsafe { from_c(alarm) };
    let known = BusbarViewAlarmState::from_number(state);
    let state = known.and_then(|state| AlarmState::from_letter(char::from(state as u8)));
    let command = alarm
        .zip(state)
        .map(|(alarm, state)| Command::MirrorAlarm { alarm: alarm.to_owned(), state });
    // SAFETY: the caller's.
    unsafe { ask(view, command) }
}

/// Sets the instant that a chart in the scene shows, nanoseconds since 1970-01-01 UTC;
/// BUSBAR_VIEW_NO_TIME shows all.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_set_time(
    view: *const BusbarView,
    unix_nanos: i64,
) -> BusbarStatus {
    let time = (unix_nanos != BUSBAR_VIEW_NO_TIME).then_some(unix_nanos);
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::SetTime(time))) }
}

/// Loads a configuration, or null for the present one, anew. The present scene stays until the new
/// one is loaded without a fault (BUSBAR_VIEW_EVENT_KIND_RELOADED). It stays for good where the new
/// one has a fault (BUSBAR_VIEW_EVENT_KIND_ERROR).
///
/// # Safety
/// `view` is null or open; `config` null or a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_reload(
    view: *const BusbarView,
    config: *const c_char,
) -> BusbarStatus {
    let reload = |view: &BusbarView| {
        let config = match config.is_null() {
            true => Some(view.view.config()),
            // SAFETY: the caller's.
            false => unsafe { from_c(config) }.and_then(absolute),
        };
        match config.map(Command::Reload).filter(|command| command.check().is_ok()) {
            Some(command) => status(view.view.command(command)),
            None => BusbarStatus::Invalid,
        }
    };
    // SAFETY: the caller's.
    unsafe { with(view, reload) }
}

/// Selects the equipment at a pixel, which a BUSBAR_VIEW_EVENT_KIND_PICKED reports.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_pick(view: *const BusbarView, x: u32, y: u32) -> BusbarStatus {
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::Pick([x, y]))) }
}

/// Sends pointer input over the picture of a view without a window. `x` and `y` are in pixels from
/// the top left; `button` is 1 the left, 2 the middle, 3 the right one; `steps` are those of the
/// wheel.
///
/// # Safety
/// `view` is null or open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn busbar_view_point(
    view: *const BusbarView,
    input: BusbarViewPointerNumber,
    x: f32,
    y: f32,
    button: u32,
    steps: f32,
) -> BusbarStatus {
    let at = [x, y];
    let pointing = match (BusbarViewPointer::from_number(input), button) {
        (Some(BusbarViewPointer::Moved), _) => PointerEvent::Moved(at),
        (Some(input @ (BusbarViewPointer::Pressed | BusbarViewPointer::Released)), 1..=3) => {
            let pressed = input == BusbarViewPointer::Pressed;
            PointerEvent::Button { at, button: button as u8, pressed }
        }
        (Some(BusbarViewPointer::Scrolled), _) => PointerEvent::Scrolled(steps),
        (Some(BusbarViewPointer::Left), _) => PointerEvent::Left,
        _ => return BusbarStatus::Invalid,
    };
    // SAFETY: the caller's.
    unsafe { ask(view, Some(Command::Pointer(pointing))) }
}
