//! The thread that has the viewer: starts it, talks to it, notices its end, starts it again.

use std::ffi::OsString;
use std::process::Child;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_protocol::message::{HostMessage, ViewerMessage};
use busbar_protocol::pictures::now;
use busbar_protocol::progress::Activity;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::cover_thread::MIN_LIVE;
use crate::events::Event;
use crate::liveness::{
    Liveness, LivenessInstants, LivenessLimits, LivenessMonitor, LivenessSample, assess,
    picture_limit,
};
use crate::restarts::Restarts;
use crate::shared::{Shared, clear, lock};
use crate::viewer_process::{ViewerProcess, ending};

/// Period at which a viewer's signs of life are sampled.
const SAMPLE_PERIOD: Duration = Duration::from_millis(25);
/// Period of samples while the program does not want to see the picture: none is marked then.
const UNSEEN_SAMPLE_PERIOD: Duration = Duration::from_millis(100);
/// Longest time from a viewer's start to its first picture: optimizers may have much to do.
const MAX_START: Duration = Duration::from_secs(300);
/// The longest time without heartbeat and progress before the first picture: a process that
/// starts may have to wait for the disk and the processor.
const MAX_START_SILENCE: Duration = Duration::from_secs(10);
/// Greatest number of killed viewers that have not exited yet; at this number, none is started.
const MAX_DYING: usize = 8;
/// Longest wait for the end of a viewer when a view is closed.
const CLOSE_GRACE: Duration = Duration::from_secs(2);

pub(crate) struct Supervisor {
    shared: Arc<Shared>,
    program: OsString,
    limits: LivenessLimits,
    restarts: Restarts,
    viewer: Option<RunningViewer>,
    /// Instant of the next start, while no viewer runs.
    due: Instant,
    dying: Vec<Child>,
    /// Liveness of the picture that the program was last told: live, late or lost.
    reported: Liveness,
    /// Since when the picture has been live without a pause.
    live_since: Option<Instant>,
    /// Since when the program has wanted to see the picture; none while it does not.
    seen_since: Option<Instant>,
    was_ever_ready: bool,
}

struct RunningViewer {
    viewer: ViewerProcess,
    life: LivenessMonitor,
    started: Instant,
    is_ready: bool,
    /// Reports whether the viewer gave the reason for its end.
    has_reported_reason: bool,
}

impl Supervisor {
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
            reported: Liveness::Live,
            live_since: None,
            seen_since: Some(Instant::now()),
            was_ever_ready: false,
        }
    }

    /// Supervises viewers until the view is closed.
    pub(crate) fn run(mut self) {
        while !self.shared.is_closing() {
            self.dying.retain_mut(|child| matches!(child.try_wait(), Ok(None)));
            if self.viewer.is_none() && Instant::now() >= self.due && self.dying.len() < MAX_DYING {
                self.start();
            }
            self.wait();
            if let Err(why) = self.exchange_messages() {
                self.handle_loss(&why);
            }
            self.check_liveness();
            self.shared.notify_listener();
        }
        self.close();
    }

    fn start(&mut self) {
        let desired = lock(&self.shared.desired).clone();
        lock(&self.shared.outbox).reset(&desired);
        match ViewerProcess::start(&self.program, &desired) {
            Ok((viewer, reader)) => {
                lock(&self.shared.frames).attach(reader);
                self.shared.set_viewer(viewer.id(), Some(viewer.memory().clone()));
                let started = Instant::now();
                let life = LivenessMonitor::new(viewer.id(), started);
                let (is_ready, has_reported_reason) = (false, false);
                self.viewer =
                    Some(RunningViewer { viewer, life, started, is_ready, has_reported_reason });
            }
            Err(why) => {
                self.shared.push_event(Event::Error(why));
                self.due = Instant::now() + self.restarts.note(Instant::now());
            }
        }
    }

    /// Waits until a message arrives, the socket takes more bytes, or the next sample is due.
    fn wait(&self) {
        let timeout = match (&self.viewer, self.due.saturating_duration_since(Instant::now())) {
            (None, left) if self.dying.is_empty() => left,
            (None, left) => left.clamp(Duration::from_millis(1), SAMPLE_PERIOD),
            (Some(_), _) if self.seen_since.is_none() => UNSEEN_SAMPLE_PERIOD,
            (Some(_), _) => SAMPLE_PERIOD,
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
        clear(&self.shared.wakes);
    }

    /// Sends what waits and takes what came.
    fn exchange_messages(&mut self) -> Result<(), String> {
        let Some(running) = &mut self.viewer else { return Ok(()) };
        let shared = &self.shared;
        running.viewer.send(|| lock(&shared.outbox).pop().map(HostMessage::Command));
        let mut messages = Vec::new();
        let heard = running.viewer.receive(|message| messages.push(message));
        for message in messages {
            self.take(message);
        }
        heard
    }

    fn take(&mut self, message: ViewerMessage) {
        let shared = &self.shared;
        let event = match message {
            ViewerMessage::Ready { device } => return self.note_ready(device),
            ViewerMessage::Reloaded { config } => {
                // The viewer shows it with its own state: the rest is reported anew.
                let mut desired = lock(&shared.desired);
                desired.config.clone_from(&config);
                lock(&shared.outbox).reset(&desired);
                Event::Reloaded(config)
            }
            ViewerMessage::PictureReady => Event::Frame,
            ViewerMessage::Picked(id) => Event::Picked(id.unwrap_or_default()),
            ViewerMessage::Hovered(id) => Event::Hovered(id.unwrap_or_default()),
            ViewerMessage::CameraMoved(pose) => {
                lock(&shared.desired).note_pose(pose);
                Event::Camera(pose)
            }
            ViewerMessage::Alarm(snapshot) => {
                lock(&shared.desired).note_alarm(&snapshot);
                Event::Alarm(snapshot)
            }
            ViewerMessage::AlarmRequested { alarm, action } => {
                Event::AlarmRequested { alarm, action }
            }
            ViewerMessage::Quality(snapshot) => Event::Quality(snapshot),
            ViewerMessage::Verdict(snapshot) => Event::Verdict(snapshot),
            ViewerMessage::Plugin { plugin, state } => Event::Plugin { plugin, state },
            ViewerMessage::Refused(words) => Event::Error(words),
            ViewerMessage::Failed(words) => {
                if let Some(running) = &mut self.viewer {
                    running.has_reported_reason = true;
                }
                Event::Failed(words)
            }
        };
        shared.push_event(event);
    }

    fn note_ready(&mut self, device: String) {
        if let Some(running) = &mut self.viewer {
            running.is_ready = true;
        }
        self.reported = Liveness::Live;
        self.shared.push_event(match std::mem::replace(&mut self.was_ever_ready, true) {
            true => Event::Recovered { is_another: true, how: device },
            false => Event::Ready { device },
        });
    }

    /// Assesses the viewer's signs of life, and ends a viewer that hangs.
    fn check_liveness(&mut self) {
        let Some(running) = &mut self.viewer else { return };
        let signs = running.sample();
        if !running.is_ready {
            return self.check_startup(signs);
        }
        let verdict = assess(&signs, &self.limits);
        let limit = picture_limit(self.limits.silent, signs.frame_time);
        self.shared.set_picture_limit(limit);
        self.follow_visibility();
        let before = self.shared.verdict();
        self.shared.set_verdict(verdict);
        if verdict == Liveness::Hung {
            return self.handle_loss(&why_hung(&signs));
        }
        if verdict != before {
            // The picture is marked, or is not any more.
            self.shared.push_event(Event::Frame);
        }
        self.report_verdict(verdict, &signs);
    }

    /// Follows whether the program wants to see the picture.
    fn follow_visibility(&mut self) {
        let is_visible = lock(&self.shared.desired).is_visible;
        self.seen_since = match self.seen_since {
            Some(since) if is_visible => Some(since),
            _ => is_visible.then(Instant::now),
        };
    }

    /// Ends a viewer that hangs before its first picture.
    fn check_startup(&mut self, signs: LivenessSample) {
        let Some(running) = &self.viewer else { return };
        let silence = signs.without_heartbeat.min(signs.without_progress);
        if silence >= self.limits.hung.max(MAX_START_SILENCE) {
            self.handle_loss(&format!("silent for {} ms", silence.as_millis()));
        } else if running.started.elapsed() >= MAX_START {
            self.handle_loss(&format!("no picture within {} s", MAX_START.as_secs()));
        }
    }

    /// Reports a picture that became late or lost, and one that has been live again for longer than
    /// [`MIN_LIVE`].
    fn report_verdict(&mut self, verdict: Liveness, signs: &LivenessSample) {
        if verdict != Liveness::Live {
            self.live_since = None;
        }
        if verdict == self.reported {
            return;
        }
        // A picture that nobody wants to see is not drawn, and takes its time to be of now again.
        let limit = picture_limit(self.limits.silent, signs.frame_time);
        if verdict == Liveness::Late && self.seen_since.is_none_or(|since| since.elapsed() < limit)
        {
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
        self.reported = verdict;
        self.shared.push_event(event);
    }

    /// Ends what is left of a viewer, and sees to the next one.
    fn handle_loss(&mut self, why: &str) {
        let Some(running) = self.viewer.take() else { return };
        self.shared.set_viewer(0, None);
        self.shared.set_verdict(Liveness::Lost);
        lock(&self.shared.frames).mark_ended();
        let was_ready = running.is_ready;
        let has_reported_reason = running.has_reported_reason;
        let mut child = running.viewer.into_child();
        let why = match child.try_wait() {
            Ok(Some(status)) => ending(status),
            _ => {
                self.dying.push(child);
                why.to_owned()
            }
        };
        self.due = Instant::now() + self.restarts.note(Instant::now());
        // One that was never there is no loss; why is reported by an error.
        self.live_since = None;
        if was_ready && std::mem::replace(&mut self.reported, Liveness::Lost) != Liveness::Lost {
            self.shared.push_event(Event::Lost(why));
            self.shared.push_event(Event::Frame);
        } else if !has_reported_reason {
            self.shared.push_event(Event::Error(format!("the viewer: {why}")));
        }
    }

    /// Waits for the viewer to end by itself, so that operators' actions reach the disk; kills it
    /// where it does not.
    fn close(&mut self) {
        self.dying.extend(self.viewer.take().map(|running| running.viewer.detach()));
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

impl RunningViewer {
    /// Samples the viewer's signs of life.
    fn sample(&mut self) -> LivenessSample {
        let memory = self.viewer.memory();
        let beats = LivenessInstants {
            heartbeat: memory.last_beat(),
            frame: memory.last_turn(),
            frame_time: memory.turn_time(),
            picture_true_at: memory.last_true(),
        };
        self.life.sample(beats, now(), Instant::now())
    }
}

/// Reason for which a viewer is ended, in words.
fn why_hung(signs: &LivenessSample) -> String {
    let (silence, frame) = (signs.without_heartbeat.as_millis(), signs.without_frame.as_millis());
    match signs.activity {
        Activity::Stopped => format!("stopped by a signal for {frame} ms"),
        _ if signs.without_heartbeat >= signs.without_frame => {
            format!("silent for {silence} ms without progress")
        }
        _ => format!("no frame for {frame} ms"),
    }
}
