//! A view as the program holds it.

use std::ffi::OsString;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use busbar_protocol::message::{Command, Target};

use crate::cover_thread::CoverThread;
use crate::desired_state::DesiredState;
use crate::events::{Event, Listener};
use crate::liveness::LivenessLimits;
use crate::pictures::{FrameCopy, FrameView};
use crate::restarts::Restarts;
use crate::shared::{OutboxFull, Shared, lock, signal};
use crate::supervisor::Supervisor;

/// Content of a view, and limits of its supervision.
#[derive(Clone, Debug)]
pub struct Options {
    /// Path of the program `busbar`.
    pub program: OsString,
    /// Path of the configuration, absolute.
    pub config: String,
    /// Destination of the pictures.
    pub target: Target,
    /// Size of the pictures, pixels.
    pub size: [u32; 2],
    /// Reports whether Busbar's own panels are shown beside the scene.
    pub panels: bool,
    /// Operator who acts on alarms, for the audit log; may be empty.
    pub operator: String,
    /// Age from which what the picture shows is not live: the picture is marked.
    pub silent: Duration,
    /// Time without heartbeat and without progress of its process after which the viewer is ended
    /// and started again; at least `silent`. One that makes progress is ended by the limits of
    /// [`crate::liveness`].
    pub hung: Duration,
    /// The longest delay before a viewer that keeps ending is started again.
    pub longest_delay: Duration,
}

/// One view of a viewer process. Dropping it closes it; its viewer ends by itself soon after.
pub struct View {
    shared: Arc<Shared>,
    silent: Duration,
}

impl View {
    /// Begins to watch a viewer, which is started at once.
    ///
    /// # Errors
    /// No descriptors or no thread left.
    pub fn open(options: Options) -> io::Result<Self> {
        let Options { program, silent, hung, longest_delay, .. } = options;
        let mut desired = DesiredState::new(options.config, options.target, options.size);
        desired.panels = options.panels;
        desired.operator = options.operator;
        let shared = Arc::new(Shared::new(desired)?);
        let (limits, restarts) = (LivenessLimits { silent, hung }, Restarts::new(longest_delay));
        let watch = Supervisor::new(shared.clone(), program, limits, restarts);
        let view = Self { shared: shared.clone(), silent };
        if let Target::Window(window) = options.target {
            let cover = CoverThread::new(shared, window, silent);
            std::thread::Builder::new().name("busbar cover".into()).spawn(move || cover.run())?;
        }
        std::thread::Builder::new().name("busbar view".into()).spawn(move || watch.run())?;
        Ok(view)
    }

    /// Queues a command, which must be checked ([`Command::check`]). A refusal of the viewer
    /// arrives as an [`Event::Error`]; commands given while no viewer runs are executed later.
    ///
    /// # Errors
    /// Too much waits for the viewer already.
    pub fn command(&self, command: Command) -> Result<(), OutboxFull> {
        self.shared.command(command)
    }

    /// The oldest event, and how many were dropped before it.
    pub fn next_event(&self) -> Option<(Event, u32)> {
        self.shared.next_event()
    }

    /// A descriptor that is readable while events wait.
    pub fn has_events(&self) -> BorrowedFd<'_> {
        self.shared.has_events.as_fd()
    }

    /// Sets the listener that the view's own thread hands events to. It must not take long, for the
    /// viewer is not supervised meanwhile. Waits for a listener that runs.
    pub fn set_listener(&self, listener: Option<Listener>) {
        *lock(&self.shared.listener) = listener;
        signal(&self.shared.wakes);
    }

    /// Returns the newest picture, marked where it is not live. None before the first.
    pub fn frame(&self) -> Option<FrameView> {
        lock(&self.shared.frames)
            .marked_frame(self.shared.picture_limit(self.silent), self.shared.verdict())
    }

    /// Copies the newest picture, unmarked, where it is new and not dead. None before the first.
    pub fn copy_frame(&self, pixels: &mut Vec<u8>) -> Option<FrameCopy> {
        lock(&self.shared.frames).copy(
            self.shared.picture_limit(self.silent),
            self.shared.verdict(),
            pixels,
        )
    }

    /// The configuration that is shown.
    pub fn config(&self) -> String {
        lock(&self.shared.desired).config.clone()
    }

    /// The process of the viewer, 0 while there is none.
    pub fn process(&self) -> u32 {
        self.shared.viewer_id.load(Ordering::Acquire)
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // Waits for a listener that runs: none is reported after this.
        *lock(&self.shared.listener) = None;
        self.shared.is_closing.store(true, Ordering::Release);
        signal(&self.shared.wakes);
    }
}
