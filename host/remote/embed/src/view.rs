//! View handle of a program in C.

use std::ffi::{CString, c_void};
use std::sync::{Mutex, MutexGuard, PoisonError};

use busbar_client::{Event, Options, View};
use busbar_protocol::message::{AlarmRequest, EquipmentVerdict, TagSnapshot};
use busbar_types::{AlarmState, Origin, QualityLevel};

use crate::abi::*;
use crate::strings::to_c;

/// Events that one call of the callback's thread delivers.
const MAX_A_ROUND: usize = 1024;

/// View of a viewer process.
pub struct BusbarView {
    pub(crate) view: View,
    /// Callback that busbar_view_dispatch runs.
    callback: Mutex<Callback>,
    /// Texts of the event that was taken last.
    held: Mutex<EventTexts>,
}

/// Callback for events, with its context.
#[derive(Clone, Copy)]
pub(crate) struct Callback {
    pub(crate) function: BusbarViewCallback,
    pub(crate) context: *mut c_void,
}

// SAFETY: the context is a word to this library, handed back and never followed; whoever
// allows calls on another thread answers for what it points to.
unsafe impl Send for Callback {}

#[derive(Default)]
struct EventTexts {
    id: CString,
    overlay: CString,
    text: CString,
}

impl BusbarView {
    /// Opens the view and starts its viewer at once.
    ///
    /// # Errors
    /// No descriptors or no thread left.
    pub(crate) fn open(options: Options) -> Result<Self, BusbarStatus> {
        let view = View::open(options).map_err(|_| BusbarStatus::System)?;
        let callback = Callback { function: None, context: std::ptr::null_mut() };
        Ok(Self { view, callback: Mutex::new(callback), held: Mutex::default() })
    }

    /// Sets the callback for events, and the thread that runs it.
    pub(crate) fn set_callback(&self, callback: Callback, on_own_thread: bool) {
        let nobody = Callback { function: None, ..callback };
        *lock(&self.callback) = if on_own_thread { nobody } else { callback };
        if on_own_thread && callback.function.is_some() {
            self.view.set_listener(Some(Box::new(move |events| call_back(callback, events))));
        } else {
            self.view.set_listener(None);
        }
    }

    /// Takes the oldest event; its texts stay until the next is taken.
    pub(crate) fn take_event(&self) -> Option<BusbarViewEvent> {
        let (event, dropped) = self.view.next_event()?;
        Some(to_event(event, dropped, &mut lock(&self.held)))
    }

    /// Runs the callback for each event that waits, on this thread; returns their number.
    pub(crate) fn dispatch(&self) -> usize {
        // Not under its lock: the callback may set another.
        let callback = *lock(&self.callback);
        if callback.function.is_none() {
            return 0;
        }
        let mut count = 0;
        let events = std::iter::from_fn(|| self.view.next_event());
        call_back(callback, &mut events.take(MAX_A_ROUND).inspect(|_| count += 1));
        count
    }
}

/// Locks; a thread that panicked under a lock left nothing half done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn call_back(callback: Callback, events: &mut dyn Iterator<Item = (Event, u32)>) {
    let Some(function) = callback.function else { return };
    let mut held = EventTexts::default();
    for (event, dropped) in events {
        let event = to_event(event, dropped, &mut held);
        // SAFETY: the function is the program's, for events of this form; the event and
        // its texts live until it returns.
        unsafe { function(callback.context, &raw const event) };
    }
}

/// Converts an event to its C struct.
fn to_event(event: Event, dropped: u32, held: &mut EventTexts) -> BusbarViewEvent {
    use BusbarViewEventKind as Kind;
    let mut told = BusbarViewEvent {
        struct_size: size_of::<BusbarViewEvent>() as u32,
        kind: Kind::Ready,
        dropped,
        liveness: BusbarViewLiveness::Live,
        alarm_state: BusbarViewAlarmState::None,
        alarm_action: BusbarViewAlarmAction::None,
        shelve_seconds: 0,
        quality: BusbarViewQuality::Good,
        origins: 0,
        verdict: BusbarViewVerdict::Normal,
        is_assumed: 0,
        reserved: 0,
        unix_nanos: 0,
        eye: [0.0; 3],
        target: [0.0; 3],
        id: std::ptr::null(),
        overlay: std::ptr::null(),
        text: std::ptr::null(),
    };
    let none = String::new();
    let mut overlay = String::new();
    let (kind, id, text) = match event {
        Event::Ready { device } => (Kind::Ready, none, device),
        Event::Frame => (Kind::Frame, none.clone(), none),
        Event::Picked(id) => (Kind::Picked, id, none),
        Event::Hovered(id) => (Kind::Hovered, id, none),
        Event::Camera(pose) => {
            (told.eye, told.target) = (pose.eye, pose.target);
            (Kind::Camera, none.clone(), none)
        }
        Event::Alarm(snapshot) => {
            told.alarm_state = alarm_state(snapshot.state);
            told.unix_nanos = snapshot.since;
            told.origins = origin_bits(snapshot.origin);
            (Kind::Alarm, snapshot.alarm, snapshot.reason)
        }
        Event::AlarmRequested { alarm, action } => {
            (told.alarm_action, told.shelve_seconds) = alarm_action(action);
            (Kind::ActionRequested, alarm, none)
        }
        Event::Quality(TagSnapshot { tag, quality, origin, reason }) => {
            told.quality = self::quality(quality);
            told.origins = origin_bits(origin);
            (Kind::Quality, tag, reason)
        }
        Event::Verdict(snapshot) => {
            told.verdict = verdict(snapshot.verdict);
            told.is_assumed = snapshot.is_assumed.into();
            told.origins = origin_bits(snapshot.origin);
            overlay = snapshot.overlay;
            (Kind::Verdict, snapshot.equipment, snapshot.reason)
        }
        Event::Plugin { plugin, state } => (Kind::Plugin, plugin, state),
        Event::Error(words) | Event::Failed(words) => (Kind::Error, none, words),
        Event::Lost(how) => {
            told.liveness = BusbarViewLiveness::Dead;
            (Kind::Lost, none, how)
        }
        Event::Late(how) => {
            told.liveness = BusbarViewLiveness::Late;
            (Kind::Lost, none, how)
        }
        Event::Recovered { how, .. } => (Kind::Recovered, none, how),
        Event::Reloaded(config) => (Kind::Reloaded, config, none),
    };
    *held = EventTexts { id: to_c(&id), overlay: to_c(&overlay), text: to_c(&text) };
    told.kind = kind;
    (told.id, told.overlay, told.text) =
        (held.id.as_ptr(), held.overlay.as_ptr(), held.text.as_ptr());
    told
}

/// Converts a state, whose number in C is its letter.
fn alarm_state(state: AlarmState) -> BusbarViewAlarmState {
    BusbarViewAlarmState::from_number(state.letter().into()).unwrap_or(BusbarViewAlarmState::None)
}

fn quality(quality: QualityLevel) -> BusbarViewQuality {
    match quality {
        QualityLevel::Good => BusbarViewQuality::Good,
        QualityLevel::Uncertain => BusbarViewQuality::Uncertain,
        QualityLevel::Bad => BusbarViewQuality::Bad,
    }
}

fn origin_bits(origin: Origin) -> u32 {
    let bits = [
        (Origin::SUBSTITUTED, BUSBAR_VIEW_ORIGIN_SUBSTITUTED),
        (Origin::TEST, BUSBAR_VIEW_ORIGIN_TEST),
        (Origin::SIMULATED, BUSBAR_VIEW_ORIGIN_SIMULATED),
        (Origin::RECORDED, BUSBAR_VIEW_ORIGIN_RECORDED),
        (Origin::HISTORICAL, BUSBAR_VIEW_ORIGIN_HISTORICAL),
    ];
    bits.into_iter().filter(|(one, _)| origin.contains(*one)).fold(0, |all, (_, bit)| all | bit)
}

fn verdict(verdict: EquipmentVerdict) -> BusbarViewVerdict {
    match verdict {
        EquipmentVerdict::Normal => BusbarViewVerdict::Normal,
        EquipmentVerdict::Abnormal => BusbarViewVerdict::Abnormal,
        EquipmentVerdict::Unknown => BusbarViewVerdict::Unknown,
        EquipmentVerdict::UnknownAfterAbnormal => BusbarViewVerdict::UnknownAfterAbnormal,
    }
}

/// Converts an action, with the shelving time in seconds.
fn alarm_action(action: AlarmRequest) -> (BusbarViewAlarmAction, u32) {
    match action {
        AlarmRequest::Acknowledge => (BusbarViewAlarmAction::Acknowledge, 0),
        AlarmRequest::Shelve(seconds) => (BusbarViewAlarmAction::Shelve, seconds),
        AlarmRequest::Unshelve => (BusbarViewAlarmAction::Unshelve, 0),
        AlarmRequest::Reset => (BusbarViewAlarmAction::Reset, 0),
    }
}
