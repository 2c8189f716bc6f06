//! The thread that has the viewer: starts it, talks to it, notices its end, starts it again.

use std::ffi::OsString;
use std::process::Child;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use busbar_protocol::message::{FromViewer, ToViewer};
use busbar_protocol::pictures::now;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::events::Event;
use crate::process::{Viewer, ending};
use crate::restarts::Restarts;
use crate::shared::{Shared, lock, lower};

/// How often a viewer's signs of life are looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(25);
/// From a viewer's start to its first picture at most: optimisers may have much to do.
const MAX_START: Duration = Duration::from_secs(300);
/// From a viewer's start to its first sign of life at most: it may have to wait for the disk
/// and the processor. From there to the first picture it shows signs of life by itself.
const MAX_START_SILENCE: Duration = Duration::from_secs(10);
/// Viewers that were killed and are not gone yet; with more, none is started.
const MAX_DYING: usize = 8;
/// How long the end of a viewer is waited for when a view is closed.
const CLOSE_GRACE: Duration = Duration::from_secs(2);

/// When a viewer is taken for dead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patience {
    pub(crate) silent: Duration,
    pub(crate) hung: Duration,
}

pub(crate) struct Watch {
    shared: Arc<Shared>,
    program: OsString,
    patience: Patience,
    restarts: Restarts,
    viewer: Option<Running>,
    /// When the next is to be started, without one.
    due: Instant,
    dying: Vec<Child>,
    /// Whether the program was told that the viewer is lost, and not yet that it is back.
    is_lost: bool,
    was_ever_ready: bool,
}

struct Running {
    viewer: Viewer,
    started: Instant,
    is_ready: bool,
    /// Whether it told why it ends.
    has_said_why: bool,
}

impl Watch {
    pub(crate) fn new(
        shared: Arc<Shared>,
        program: OsString,
        patience: Patience,
        restarts: Restarts,
    ) -> Self {
        Self {
            shared,
            program,
            patience,
            restarts,
            viewer: None,
            due: Instant::now(),
            dying: Vec::new(),
            is_lost: false,
            was_ever_ready: false,
        }
    }

    /// Until the view is closed.
    pub(crate) fn run(mut self) {
        while !self.shared.is_closing() {
            self.dying.retain_mut(|child| matches!(child.try_wait(), Ok(None)));
            if self.viewer.is_none() && Instant::now() >= self.due && self.dying.len() < MAX_DYING {
                self.start();
            }
            self.wait();
            if let Err(why) = self.talk() {
                self.lose(&why);
            }
            self.look_for_life();
            self.shared.tell_listener();
        }
        self.close();
    }

    fn start(&mut self) {
        let wanted = lock(&self.shared.wanted).clone();
        lock(&self.shared.outbox).begin_anew(&wanted);
        match Viewer::start(&self.program, &wanted) {
            Ok((viewer, reader)) => {
                lock(&self.shared.frames).follow(reader);
                self.shared.viewer_id.store(viewer.id(), Ordering::Release);
                let started = Instant::now();
                self.viewer =
                    Some(Running { viewer, started, is_ready: false, has_said_why: false });
            }
            Err(why) => {
                self.shared.tell(Event::Error(why));
                self.due = Instant::now() + self.restarts.note(Instant::now());
            }
        }
    }

    /// Until something comes, there is something to send, or it is time to look.
    fn wait(&self) {
        let timeout = match (&self.viewer, self.due.saturating_duration_since(Instant::now())) {
            (None, left) if self.dying.is_empty() => left,
            (None, left) => left.clamp(Duration::from_millis(1), LOOK_PERIOD),
            (Some(_), _) => LOOK_PERIOD,
        };
        let timeout = Timespec {
            tv_sec: timeout.as_secs() as i64,
            tv_nsec: i64::from(timeout.subsec_nanos()),
        };
        let mut descriptors = vec![PollFd::new(&self.shared.wakes, PollFlags::IN)];
        if let Some(running) = &self.viewer {
            let out = if running.viewer.has_unsent() { PollFlags::OUT } else { PollFlags::empty() };
            descriptors.push(PollFd::new(running.viewer.socket(), PollFlags::IN | out));
        }
        // Interrupted is as good as awake.
        let _ = poll(&mut descriptors, Some(&timeout));
        lower(&self.shared.wakes);
    }

    /// Sends what waits and takes what came.
    fn talk(&mut self) -> Result<(), String> {
        let Some(running) = &mut self.viewer else { return Ok(()) };
        let shared = &self.shared;
        running.viewer.send(|| lock(&shared.outbox).pop().map(ToViewer::Do));
        let mut messages = Vec::new();
        let heard = running.viewer.hear(|message| messages.push(message));
        for message in messages {
            self.take(message);
        }
        heard
    }

    fn take(&mut self, message: FromViewer) {
        let shared = &self.shared;
        let event = match message {
            FromViewer::Ready { device } => return self.note_ready(device),
            FromViewer::Reloaded { config } => {
                // The viewer shows it with its own state: the rest is told anew.
                let mut wanted = lock(&shared.wanted);
                wanted.config.clone_from(&config);
                lock(&shared.outbox).begin_anew(&wanted);
                Event::Reloaded(config)
            }
            FromViewer::Pictured => Event::Frame,
            FromViewer::Picked(id) => Event::Picked(id.unwrap_or_default()),
            FromViewer::Hovered(id) => Event::Hovered(id.unwrap_or_default()),
            FromViewer::Looks(pose) => {
                lock(&shared.wanted).note_pose(pose);
                Event::Camera(pose)
            }
            FromViewer::Alarm(standing) => {
                lock(&shared.wanted).note_alarm(&standing);
                Event::Alarm(standing)
            }
            FromViewer::Asked { alarm, action } => Event::Asked { alarm, action },
            FromViewer::Quality { tag, quality, reason } => Event::Quality { tag, quality, reason },
            FromViewer::Plugin { plugin, state } => Event::Plugin { plugin, state },
            FromViewer::Refused(words) => Event::Error(words),
            FromViewer::Failed(words) => {
                if let Some(running) = &mut self.viewer {
                    running.has_said_why = true;
                }
                Event::Failed(words)
            }
        };
        shared.tell(event);
    }

    fn note_ready(&mut self, device: String) {
        if let Some(running) = &mut self.viewer {
            running.is_ready = true;
        }
        self.is_lost = false;
        self.shared.tell(match std::mem::replace(&mut self.was_ever_ready, true) {
            true => Event::Recovered { is_another: true, how: device },
            false => Event::Ready { device },
        });
    }

    /// Notes silence, and ends a viewer that hangs.
    fn look_for_life(&mut self) {
        let Some(running) = &self.viewer else { return };
        let memory = running.viewer.memory();
        let since = |then: u64| Duration::from_nanos(now().saturating_sub(then));
        let silence = since(memory.last_beat()).min(running.started.elapsed());
        let patience = match running.is_ready {
            true => self.patience.hung,
            false => self.patience.hung.max(MAX_START_SILENCE),
        };
        if silence >= patience {
            let why = format!("silent for {} ms", silence.as_millis());
            return self.lose(&why);
        }
        if !running.is_ready {
            if running.started.elapsed() >= MAX_START {
                self.lose(&format!("no picture within {} s", MAX_START.as_secs()));
            }
            return;
        }
        let age = since(memory.last_confirmed());
        let is_silent = age >= self.patience.silent;
        if is_silent && !std::mem::replace(&mut self.is_lost, true) {
            let words = format!("no picture for {} ms", age.as_millis());
            self.shared.tell(Event::Lost(words));
            self.shared.tell(Event::Frame);
        } else if !is_silent && std::mem::replace(&mut self.is_lost, false) {
            self.shared.tell(Event::Recovered { is_another: false, how: "it goes on".into() });
            self.shared.tell(Event::Frame);
        }
    }

    /// Ends what is left of a viewer, and sees to the next one.
    fn lose(&mut self, why: &str) {
        let Some(running) = self.viewer.take() else { return };
        self.shared.viewer_id.store(0, Ordering::Release);
        lock(&self.shared.frames).let_go();
        let was_ready = running.is_ready;
        let has_said_why = running.has_said_why;
        let mut child = running.viewer.into_child();
        let why = match child.try_wait() {
            Ok(Some(status)) => ending(status),
            _ => {
                self.dying.push(child);
                why.to_owned()
            }
        };
        self.due = Instant::now() + self.restarts.note(Instant::now());
        // One that was never there is no loss; why is told by an error.
        if was_ready && !std::mem::replace(&mut self.is_lost, true) {
            self.shared.tell(Event::Lost(why));
            self.shared.tell(Event::Frame);
        } else if !has_said_why {
            self.shared.tell(Event::Error(format!("the viewer: {why}")));
        }
    }

    /// Lets the viewer end by itself, so that what operators did gets to the disk, and ends
    /// it where it does not.
    fn close(&mut self) {
        self.dying.extend(self.viewer.take().map(|running| running.viewer.let_go()));
        if !self.reap() {
            self.dying.iter_mut().for_each(|child| drop(child.kill()));
            self.reap();
        }
    }

    /// Waits a while for the ends of viewers; whether all have ended.
    fn reap(&mut self) -> bool {
        let start = Instant::now();
        while !self.dying.is_empty() && start.elapsed() < CLOSE_GRACE {
            self.dying.retain_mut(|child| matches!(child.try_wait(), Ok(None)));
            std::thread::sleep(Duration::from_millis(1));
        }
        self.dying.is_empty()
    }
}
