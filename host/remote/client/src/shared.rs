//! State shared by the program's threads and the supervisor's. No operation under a lock may wait.

use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use busbar_protocol::message::Command;
use busbar_protocol::pictures::PictureMemory;
use rustix::event::{EventfdFlags, eventfd};

use crate::desired_state::DesiredState;
use crate::events::{Event, Events, Listener};
use crate::liveness::Liveness;
use crate::outbox::Outbox;
use crate::pictures::PictureStream;

/// Events handed to a listener in one call.
const MAX_A_ROUND: usize = 1024;

/// Shared by both sides of a view.
pub(crate) struct Shared {
    pub(crate) desired: Mutex<DesiredState>,
    pub(crate) outbox: Mutex<Outbox>,
    pub(crate) events: Mutex<Events>,
    pub(crate) frames: Mutex<PictureStream>,
    pub(crate) listener: Mutex<Option<Listener>>,
    /// Readable while events wait: the program's.
    pub(crate) has_events: OwnedFd,
    /// Readable while there is something to send: the watching thread's.
    pub(crate) wakes: OwnedFd,
    pub(crate) is_closing: AtomicBool,
    /// The viewer's process, 0 for none.
    pub(crate) viewer_id: AtomicU32,
    /// Memory of the viewer that runs, in which it confirms its picture.
    memory: Mutex<Option<PictureMemory>>,
    /// Last verdict on the viewer, as a number of [`VERDICTS`].
    verdict: AtomicU8,
    /// Greatest age of a live picture, as the frame times have it, milliseconds.
    picture_limit: AtomicU32,
}

/// Verdicts in the order of their numbers.
const VERDICTS: [Liveness; 4] = [Liveness::Lost, Liveness::Live, Liveness::Late, Liveness::Hung];

/// Too much waits for the viewer already. Nothing was done: try again later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutboxFull;

/// Locks; a thread that panicked under a lock left nothing half done.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// # Errors
    /// No descriptors left.
    pub(crate) fn new(desired: DesiredState) -> rustix::io::Result<Self> {
        let flags = EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC;
        Ok(Self {
            desired: Mutex::new(desired),
            outbox: Mutex::default(),
            events: Mutex::default(),
            frames: Mutex::default(),
            listener: Mutex::default(),
            has_events: eventfd(0, flags)?,
            wakes: eventfd(0, flags)?,
            is_closing: AtomicBool::new(false),
            viewer_id: AtomicU32::new(0),
            memory: Mutex::default(),
            verdict: AtomicU8::new(0),
            picture_limit: AtomicU32::new(0),
        })
    }

    /// Greatest age of a live picture: at least `silent`.
    pub(crate) fn picture_limit(&self, silent: Duration) -> Duration {
        let millis = self.picture_limit.load(Ordering::Acquire);
        silent.max(Duration::from_millis(u64::from(millis)))
    }

    /// Sets the greatest age of a live picture.
    pub(crate) fn set_picture_limit(&self, limit: Duration) {
        let millis = u32::try_from(limit.as_millis()).unwrap_or(u32::MAX);
        self.picture_limit.store(millis, Ordering::Release);
    }

    /// Queues a command for the viewer.
    ///
    /// # Errors
    /// There is no room.
    pub(crate) fn command(&self, command: Command) -> Result<(), OutboxFull> {
        let (mut desired, mut outbox) = (lock(&self.desired), lock(&self.outbox));
        if !outbox.has_room() || !desired.note(&command) {
            return Err(OutboxFull);
        }
        outbox.push(command);
        drop((desired, outbox));
        signal(&self.wakes);
        Ok(())
    }

    /// Queues an event for the program.
    pub(crate) fn push_event(&self, event: Event) {
        lock(&self.events).push(event);
        signal(&self.has_events);
    }

    /// The next event for the program, and how many were dropped before it.
    pub(crate) fn next_event(&self) -> Option<(Event, u32)> {
        let mut events = lock(&self.events);
        let next = events.pop();
        if events.is_empty() {
            clear(&self.has_events);
        }
        next
    }

    /// Hands waiting events to the listener, if there is one.
    pub(crate) fn notify_listener(&self) {
        let mut listener = lock(&self.listener);
        let Some(listener) = &mut *listener else { return };
        listener(&mut std::iter::from_fn(|| self.next_event()).take(MAX_A_ROUND));
        if !lock(&self.events).is_empty() {
            signal(&self.wakes);
        }
    }

    /// Sets the viewer whose picture counts from now on; none for no viewer.
    pub(crate) fn set_viewer(&self, process: u32, memory: Option<PictureMemory>) {
        self.viewer_id.store(process, Ordering::Release);
        *lock(&self.memory) = memory;
    }

    /// Instant of the values in the running viewer's picture, on the clock since boot. None
    /// without a viewer, or before its first picture.
    pub(crate) fn picture_true_at(&self) -> Option<u64> {
        let true_at = lock(&self.memory).as_ref()?.last_true();
        (true_at != 0).then_some(true_at)
    }

    /// Returns the last verdict on the viewer; lost before the first viewer.
    pub(crate) fn verdict(&self) -> Liveness {
        let number = usize::from(self.verdict.load(Ordering::Acquire));
        VERDICTS.get(number).copied().unwrap_or(Liveness::Lost)
    }

    pub(crate) fn set_verdict(&self, verdict: Liveness) {
        let number = VERDICTS.iter().position(|other| *other == verdict).unwrap_or(0);
        self.verdict.store(number as u8, Ordering::Release);
    }

    pub(crate) fn is_closing(&self) -> bool {
        self.is_closing.load(Ordering::Acquire)
    }
}

/// Makes an eventfd readable.
pub(crate) fn signal(eventfd: &OwnedFd) {
    // A full counter is readable, too.
    let _ = rustix::io::write(eventfd, &1_u64.to_ne_bytes());
}

/// Makes an eventfd unreadable again.
pub(crate) fn clear(eventfd: &OwnedFd) {
    let _ = rustix::io::read(eventfd, &mut [0_u8; 8]);
}
