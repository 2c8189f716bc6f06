//! A view as the program holds it.

use std::ffi::{CString, OsString};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::abi::*;
use crate::events::Event;
use crate::restarts::Restarts;
use crate::shared::{Callback, Shared, lock, raise};
use crate::strings::to_c;
use crate::wanted::Wanted;
use crate::watch::{Patience, Watch};

/// Events that one round of callbacks tells.
const MAX_A_ROUND: usize = 1024;

/// One view.
pub struct BusbarView {
    pub(crate) shared: Arc<Shared>,
    pub(crate) silent_millis: u64,
    /// Texts of the event that was taken last.
    held: std::sync::Mutex<Held>,
}

#[derive(Default)]
struct Held {
    id: CString,
    text: CString,
}

/// How a view is watched.
pub(crate) struct Watching {
    pub(crate) program: OsString,
    pub(crate) patience: Patience,
    pub(crate) longest_delay: Duration,
}

impl BusbarView {
    /// Begins to watch a viewer, which is started at once.
    ///
    /// # Errors
    /// No descriptors or no thread left.
    pub(crate) fn open(wanted: Wanted, watching: Watching) -> Result<Self, i32> {
        let shared = Arc::new(Shared::new(wanted).map_err(|_| BUSBAR_VIEW_SYSTEM)?);
        let Watching { program, patience, longest_delay } = watching;
        let restarts = Restarts::new(longest_delay);
        let watch = Watch::new(shared.clone(), program, patience, restarts);
        let builder = std::thread::Builder::new().name("busbar view".into());
        builder.spawn(move || watch.run()).map_err(|_| BUSBAR_VIEW_SYSTEM)?;
        let silent_millis = patience.silent.as_millis() as u64;
        Ok(Self { shared, silent_millis, held: std::sync::Mutex::default() })
    }

    /// Takes the oldest event; its texts stay until the next is taken.
    pub(crate) fn take_event(&self) -> Option<BusbarViewEvent> {
        let (event, dropped) = self.shared.next_event()?;
        Some(to_event(&event, dropped, &mut lock(&self.held)))
    }

    /// Tells the callback what waits, on this thread; how many events.
    pub(crate) fn dispatch(&self) -> usize {
        // Not under its lock: the callback may set another.
        let callback = *lock(&self.shared.callback);
        call_back(&self.shared, callback)
    }
}

impl Drop for BusbarView {
    fn drop(&mut self) {
        // Waits for a callback that runs: none comes after this.
        lock(&self.shared.callback).function = None;
        self.shared.is_closing.store(true, Ordering::Release);
        raise(&self.shared.wakes);
    }
}

/// Tells the callback what waits, if the program allows that on the watching thread.
pub(crate) fn call_back_on_own_thread(shared: &Shared) {
    let callback = lock(&shared.callback);
    if callback.on_own_thread {
        call_back(shared, *callback);
    }
}

fn call_back(shared: &Shared, callback: Callback) -> usize {
    let Some(function) = callback.function else { return 0 };
    let mut held = Held::default();
    for count in 0..MAX_A_ROUND {
        let Some((event, dropped)) = shared.next_event() else { return count };
        let event = to_event(&event, dropped, &mut held);
        // SAFETY: the function is the program's, for events of this form; the event and
        // its texts live until it returns.
        unsafe { function(callback.context, &raw const event) };
    }
    // More may wait: whoever calls comes again.
    raise(&shared.wakes);
    MAX_A_ROUND
}

fn to_event(event: &Event, dropped: u32, held: &mut Held) -> BusbarViewEvent {
    *held = Held { id: to_c(&event.id), text: to_c(&event.text) };
    let pose = event.pose;
    BusbarViewEvent {
        struct_size: size_of::<BusbarViewEvent>() as u32,
        kind: event.kind,
        state: event.state,
        dropped,
        unix_nanos: event.unix_nanos,
        number: event.number,
        eye: pose.map_or([0.0; 3], |pose| pose.eye),
        target: pose.map_or([0.0; 3], |pose| pose.target),
        id: held.id.as_ptr(),
        text: held.text.as_ptr(),
    }
}
