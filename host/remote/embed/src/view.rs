//! View handle of a program in C.

use std::ffi::{CString, c_void};
use std::sync::{Mutex, MutexGuard, PoisonError};

use busbar_client::{Event, Options, View};
use busbar_protocol::message::{AlarmRequest, EquipmentVerdict, TagSnapshot};
use busbar_types::{Origin, QualityLevel};

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
    text: CString,
}

impl BusbarView {
    /// Opens the view and starts its viewer at once.
    ///
    /// # Errors
    /// No descriptors or no thread left.
    pub(crate) fn open(options: Options) -> Result<Self, i32> {
        let view = View::open(options).map_err(|_| BUSBAR_VIEW_SYSTEM)?;
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
    let mut told = BusbarViewEvent {
        struct_size: size_of::<BusbarViewEvent>() as u32,
        kind: 0,
        state: 0,
        dropped,
        unix_nanos: 0,
        number: 0.0,
        origins: 0,
        reserved: 0,
        eye: [0.0; 3],
        target: [0.0; 3],
        id: std::ptr::null(),
        text: std::ptr::null(),
    };
    let none = String::new();
    let (kind, id, text) = match event {
        Event::Ready { device } => (BUSBAR_VIEW_READY, none, device),
        Event::Frame => (BUSBAR_VIEW_FRAME, none.clone(), none),
        Event::Picked(id) => (BUSBAR_VIEW_PICKED, id, none),
        Event::Hovered(id) => (BUSBAR_VIEW_HOVERED, id, none),
        Event::Camera(pose) => {
            (told.eye, told.target) = (pose.eye, pose.target);
            (BUSBAR_VIEW_CAMERA, none.clone(), none)
        }
        Event::Alarm(snapshot) => {
            told.state = snapshot.state.letter().into();
            told.unix_nanos = snapshot.since;
            (BUSBAR_VIEW_ALARM, snapshot.alarm, none)
        }
        Event::AlarmRequested { alarm, action } => {
            (told.state, told.number) = action_number(action);
            (BUSBAR_VIEW_ASKED, alarm, none)
        }
        Event::Quality(TagSnapshot { tag, quality, origin, reason }) => {
            told.state = quality_number(quality);
            told.origins = origin_bits(origin);
            (BUSBAR_VIEW_QUALITY, tag, reason)
        }
        Event::Verdict(snapshot) => {
            told.state = verdict_number(snapshot.verdict);
            told.number = f64::from(u8::from(snapshot.is_assumed));
            let text = format!("{}\n{}", snapshot.overlay, snapshot.reason);
            (BUSBAR_VIEW_VERDICT, snapshot.equipment, text)
        }
        Event::Plugin { plugin, state } => (BUSBAR_VIEW_PLUGIN, plugin, state),
        Event::Error(words) | Event::Failed(words) => (BUSBAR_VIEW_ERROR, none, words),
        Event::Lost(how) => {
            told.state = BUSBAR_VIEW_DEAD;
            (BUSBAR_VIEW_LOST, none, how)
        }
        Event::Late(how) => {
            told.state = BUSBAR_VIEW_LATE;
            (BUSBAR_VIEW_LOST, none, how)
        }
        Event::Recovered { how, .. } => (BUSBAR_VIEW_RECOVERED, none, how),
        Event::Reloaded(config) => (BUSBAR_VIEW_RELOADED, config, none),
    };
    *held = EventTexts { id: to_c(&id), text: to_c(&text) };
    (told.kind, told.id, told.text) = (kind, held.id.as_ptr(), held.text.as_ptr());
    told
}

fn quality_number(quality: QualityLevel) -> u32 {
    match quality {
        QualityLevel::Good => BUSBAR_VIEW_GOOD,
        QualityLevel::Uncertain => BUSBAR_VIEW_UNCERTAIN,
        QualityLevel::Bad => BUSBAR_VIEW_BAD,
    }
}

fn origin_bits(origin: Origin) -> u32 {
    let bits = [
        (Origin::SUBSTITUTED, BUSBAR_VIEW_SUBSTITUTED),
        (Origin::TEST, BUSBAR_VIEW_TEST),
        (Origin::SIMULATED, BUSBAR_VIEW_SIMULATED),
        (Origin::RECORDED, BUSBAR_VIEW_RECORDED),
        (Origin::HISTORICAL, BUSBAR_VIEW_HISTORICAL),
    ];
    bits.into_iter().filter(|(one, _)| origin.contains(*one)).fold(0, |all, (_, bit)| all | bit)
}

fn verdict_number(verdict: EquipmentVerdict) -> u32 {
    match verdict {
        EquipmentVerdict::Normal => BUSBAR_VIEW_NORMAL,
        EquipmentVerdict::Abnormal => BUSBAR_VIEW_ABNORMAL,
        EquipmentVerdict::Unknown => BUSBAR_VIEW_UNKNOWN,
        EquipmentVerdict::UnknownAfterAbnormal => BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL,
    }
}

/// Returns the number of an action in the C ABI, with the shelving time in seconds.
fn action_number(action: AlarmRequest) -> (u32, f64) {
    match action {
        AlarmRequest::Acknowledge => (BUSBAR_VIEW_ACKNOWLEDGE, 0.0),
        AlarmRequest::Shelve(seconds) => (BUSBAR_VIEW_SHELVE, f64::from(seconds)),
        AlarmRequest::Unshelve => (BUSBAR_VIEW_UNSHELVE, 0.0),
        AlarmRequest::Reset => (BUSBAR_VIEW_RESET, 0.0),
    }
}
