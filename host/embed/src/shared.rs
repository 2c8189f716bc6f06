//! What the program's threads and the one that watches the viewer share. Nobody does
//! anything under the lock that could wait.

use std::ffi::c_void;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use busbar_protocol::message::Command;
use rustix::event::{EventfdFlags, eventfd};

use crate::abi::{BUSBAR_VIEW_FULL, BUSBAR_VIEW_OK, BusbarViewCallback};
use crate::events::{Event, Events};
use crate::frames::Frames;
use crate::outbox::Outbox;
use crate::wanted::Wanted;

/// Shared by both sides of a view.
pub(crate) struct Shared {
    pub(crate) wanted: Mutex<Wanted>,
    pub(crate) outbox: Mutex<Outbox>,
    pub(crate) events: Mutex<Events>,
    pub(crate) frames: Mutex<Frames>,
    pub(crate) callback: Mutex<Callback>,
    /// Readable while events wait: the program's.
    pub(crate) has_events: OwnedFd,
    /// Readable while there is something to send: the watching thread's.
    pub(crate) wakes: OwnedFd,
    pub(crate) is_closing: AtomicBool,
    /// The viewer's process, 0 for none.
    pub(crate) viewer_id: AtomicU32,
}

/// Who is told of events.
#[derive(Clone, Copy)]
pub(crate) struct Callback {
    pub(crate) function: BusbarViewCallback,
    pub(crate) context: *mut c_void,
    /// Whether the watching thread may call it.
    pub(crate) on_own_thread: bool,
}

// SAFETY: the context is a word to this library, handed back and never followed; whoever
// allows calls on another thread answers for what it points to.
unsafe impl Send for Callback {}

/// Locks; a thread that panicked under a lock left nothing half done.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// # Errors
    /// No descriptors left.
    pub(crate) fn new(wanted: Wanted) -> rustix::io::Result<Self> {
        let flags = EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC;
        let callback =
            Callback { function: None, context: std::ptr::null_mut(), on_own_thread: false };
        Ok(Self {
            wanted: Mutex::new(wanted),
            outbox: Mutex::default(),
            events: Mutex::default(),
            frames: Mutex::default(),
            callback: Mutex::new(callback),
            has_events: eventfd(0, flags)?,
            wakes: eventfd(0, flags)?,
            is_closing: AtomicBool::new(false),
            viewer_id: AtomicU32::new(0),
        })
    }

    /// Puts a command on its way; a status of the header.
    pub(crate) fn command(&self, command: Command) -> i32 {
        let (mut wanted, mut outbox) = (lock(&self.wanted), lock(&self.outbox));
        if !outbox.has_room() || !wanted.note(&command) {
            return BUSBAR_VIEW_FULL;
        }
        outbox.push(command);
        drop((wanted, outbox));
        raise(&self.wakes);
        BUSBAR_VIEW_OK
    }

    /// Tells the program something.
    pub(crate) fn tell(&self, event: Event) {
        lock(&self.events).push(event);
        raise(&self.has_events);
    }

    /// The next event for the program, and how many were dropped before it.
    pub(crate) fn next_event(&self) -> Option<(Event, u32)> {
        let mut events = lock(&self.events);
        let next = events.pop();
        if events.is_empty() {
            lower(&self.has_events);
        }
        next
    }

    pub(crate) fn is_closing(&self) -> bool {
        self.is_closing.load(Ordering::Acquire)
    }
}

/// Makes an eventfd readable.
pub(crate) fn raise(eventfd: &OwnedFd) {
    // Full is readable, too.
    let _ = rustix::io::write(eventfd, &1_u64.to_ne_bytes());
}

/// Makes it unreadable.
pub(crate) fn lower(eventfd: &OwnedFd) {
    let _ = rustix::io::read(eventfd, &mut [0_u8; 8]);
}
