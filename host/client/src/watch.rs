//! The thread that has the viewer: starts it, talks to it, notices its end, starts it again.

use std::ffi::OsString;
use std::process::Child;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_protocol::message::{FromViewer, ToViewer};
use busbar_protocol::pictures::now;
use busbar_protocol::progress::Activity;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::cover_thread::MIN_LIVE;
use crate::events::Event;
use crate::liveness::{
    Beats, Liveness, LivenessLimits, LivenessWatch, SignsOfLife, assess, picture_limit,
};
use crate::process::{Viewer, ending};
use crate::restarts::Restarts;
use crate::shared::{Shared, lock, lower};

/// How often a viewer's signs of life are looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(25);
/// From a viewer's start to its first picture at most: optimisers may have much to do.
const MAX_START: Duration = Duration::from_secs(300);
/// The longest time without heartbeat and progress before the first picture: a process that
/// starts may have to wait for the disk and the processor.
const MAX_START_SILENCE: Duration = Duration::from_secs(10);
/// Viewers that were killed and are not gone yet; with more, none is started.
const MAX_DYING: usize = 8;
/// How long the end of a viewer is waited for when a view is closed.
const CLOSE_GRACE: Duration = Duration::from_secs(2);

pub(crate) struct Watch {
    shared: Arc<Shared>,
    program: OsString,
    limits: LivenessLimits,
    restarts: Restarts,
    viewer: Option<Running>,
    /// When the next is to be started, without one.
    due: Instant,
    dying: Vec<Child>,
    /// What the program was told last of the picture: live, late or lost.
    told: Liveness,
    /// Since when the picture has been live without a pause.
    live_since: Option<Instant>,
    was_ever_ready: bool,
}

struct Running {
    viewer: Viewer,
    life: LivenessWatch,
    started: Instant,
    is_ready: bool,
    /// Whether it told why it ends.
    has_said_why: bool,
}

impl Watch {
    pub(crate) fn new(
        shared: Arc<Shared>,
        program: OsString,
        limits: LivenessLimits,
        restarts: Restarts,
    ) -> Self {
        Self {
            shared,
            program,
            limits,
            restarts,
            viewer: None,
            due: Instant::now(),
            dying: Vec::new(),
            told: Liveness::Live,
            live_since: None,
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
                self.shared.set_viewer(viewer.id(), Some(viewer.memory().clone()));
                let started = Instant::now();
                let life = LivenessWatch::new(viewer.id(), started);
                let (is_ready, has_said_why) = (false, false);
                self.viewer = Some(Running { viewer, life, started, is_ready, has_said_why });
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
            FromViewer::Quality(standing) => Event::Quality(standing),
            FromViewer::Verdict(standing) => Event::Verdict(standing),
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
        self.told = Liveness::Live;
        self.shared.tell(match std::mem::replace(&mut self.was_ever_ready, true) {
            true => Event::Recovered { is_another: true, how: device },
            false => Event::Ready { device },
        });
    }

    /// Judges the viewer by its signs of life, and ends one that hangs.
    fn look_for_life(&mut self) {
        let Some(running) = &mut self.viewer else { return };
        let signs = running.look();
        if !running.is_ready {
            return self.look_at_start(signs);
        }
        let verdict = assess(&signs, &self.limits);
        let limit = picture_limit(self.limits.silent, signs.frame_time);
        self.shared.set_picture_limit(limit);
        let before = self.shared.verdict();
        self.shared.set_verdict(verdict);
        if verdict == Liveness::Hung {
            return self.lose(&why_hung(&signs));
        }
        if verdict != before {
            // The picture is marked, or is not any more.
            self.shared.tell(Event::Frame);
        }
        self.tell_verdict(verdict, &signs);
    }

    /// Ends a viewer that hangs before its first picture.
    fn look_at_start(&mut self, signs: SignsOfLife) {
        let Some(running) = &self.viewer else { return };
        let silence = signs.without_heartbeat.min(signs.without_progress);
        if silence >= self.limits.hung.max(MAX_START_SILENCE) {
            self.lose(&format!("silent for {} ms", silence.as_millis()));
        } else if running.started.elapsed() >= MAX_START {
            self.lose(&format!("no picture within {} s", MAX_START.as_secs()));
        }
    }

    /// Tells the program of a picture that is late or lost, and of one that is live again for
    /// longer than [`MIN_LIVE`].
    fn tell_verdict(&mut self, verdict: Liveness, signs: &SignsOfLife) {
        if verdict != Liveness::Live {
            self.live_since = None;
        }
        if verdict == self.told {
            return;
        }
        let age = signs.picture_age.unwrap_or_default().as_millis();
        let event = match verdict {
            Liveness::Live => {
                let since = *self.live_since.get_or_insert_with(Instant::now);
                if since.elapsed() < MIN_LIVE {
                    return;
                }
                Event::Recovered { is_another: false, how: "it goes on".into() }
            }
            Liveness::Late => Event::Late(format!("the picture is of {age} ms ago")),
            _ => Event::Lost(format!("no picture for {age} ms")),
        };
        self.told = verdict;
        self.shared.tell(event);
    }

    /// Ends what is left of a viewer, and sees to the next one.
    fn lose(&mut self, why: &str) {
        let Some(running) = self.viewer.take() else { return };
        self.shared.set_viewer(0, None);
        self.shared.set_verdict(Liveness::Lost);
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
        self.live_since = None;
        if was_ready && std::mem::replace(&mut self.told, Liveness::Lost) != Liveness::Lost {
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

impl Running {
    /// Takes a look at the viewer's signs of life.
    fn look(&mut self) -> SignsOfLife {
        let memory = self.viewer.memory();
        let beats = Beats {
            heartbeat: memory.last_beat(),
            frame: memory.last_turn(),
            frame_time: memory.turn_time(),
            picture_true_at: memory.last_true(),
        };
        self.life.look(beats, now(), Instant::now())
    }
}

/// Reason for which a viewer is ended, in words.
fn why_hung(signs: &SignsOfLife) -> String {
    let (silence, frame) = (signs.without_heartbeat.as_millis(), signs.without_frame.as_millis());
    match signs.activity {
        Activity::Stopped => format!("stopped by a signal for {frame} ms"),
        _ if signs.without_heartbeat >= signs.without_frame => {
            format!("silent for {silence} ms without progress")
        }
        _ => format!("no frame for {frame} ms"),
    }
}
