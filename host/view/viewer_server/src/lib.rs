//! The view of a host program: commands come from another process, events go back.
//!
//! The host program's library starts this process and passes it a socket and the shared memory of
//! pictures. Closing the socket ends the process. No call waits for the host program; a stopped or
//! slow one costs a bounded amount of memory.
#![doc = include_str!("../DESIGN.md")]

mod change_reporter;
mod channel;
mod commands;
mod heartbeat;
mod input;
mod offscreen;
mod wire_types;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub use busbar_protocol::message::Target;
use busbar_protocol::message::{Command, PROTOCOL_VERSION, StartParameters, ViewerMessage};
use busbar_protocol::pictures::{self, PictureMemory};

use busbar_scene_loader::{LoadError, LoadedScene};
use busbar_viewer::Viewer;
use busbar_viewer::reload::{BackgroundLoad, ReloadOutcome};

use change_reporter::ChangeReporter;
use channel::Channel;
use heartbeat::Heartbeat;

/// Duration of a turn of the frame loop from which a window's frame is waited for before it is
/// confirmed: frames in flight are then too old to be taken for shown.
const SLOW_ITERATION: Duration = Duration::from_millis(80);

/// The host program's end.
pub struct ViewerServer {
    channel: Channel,
    begin: StartParameters,
    memory: Option<PictureMemory>,
    change_reporter: ChangeReporter,
    reloading: Option<BackgroundLoad>,
    /// Path of the configuration that is being loaded.
    reload_path: String,
    /// Path of a reload requested meanwhile.
    next_reload: Option<String>,
    is_visible: bool,
    iteration: LoopIteration,
    _heartbeat: Heartbeat,
}

/// One iteration of the frame loop.
struct LoopIteration {
    began: Instant,
    /// Start of the iteration on the clock since boot, nanoseconds. Every tag value in its frame is
    /// read later.
    began_at_boot_nanos: u64,
    /// True if the window shows the frame, so that its picture dates from `began_at_boot_nanos`.
    is_presented: bool,
}

impl LoopIteration {
    fn begin() -> Self {
        Self { began: Instant::now(), began_at_boot_nanos: pictures::now(), is_presented: false }
    }
}

/// Requests of the host program that the frame loop itself must perform.
#[derive(Default)]
pub struct FrameRequests {
    /// The size wanted, pixels.
    pub size: Option<[u32; 2]>,
    /// Pointer and keyboard events over an offscreen picture.
    pub input: Vec<Command>,
    /// True if any command arrived, so that a frame is due now.
    pub is_due: bool,
}

impl ViewerServer {
    /// Takes the host program's socket, which is standard input, and its first message.
    ///
    /// # Errors
    /// A text: no such socket, or a host program of another release.
    pub fn accept() -> Result<Self, String> {
        let (channel, begin, memory) = Channel::accept()?;
        if begin.version != PROTOCOL_VERSION {
            return Err(format!(
                "the host program's library speaks version {} of the protocol, this viewer \
                 {PROTOCOL_VERSION}; install both from one release",
                begin.version
            ));
        }
        Ok(Self {
            channel,
            begin,
            _heartbeat: Heartbeat::start(&memory),
            memory: Some(memory),
            change_reporter: ChangeReporter::default(),
            reloading: None,
            reload_path: String::new(),
            next_reload: None,
            is_visible: true,
            iteration: LoopIteration::begin(),
        })
    }

    /// Returns the target of the picture.
    pub fn target(&self) -> Target {
        self.begin.target
    }

    /// Returns the initial size of the picture, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.begin.size
    }

    /// Reports whether the host program wants panels.
    pub fn has_panels(&self) -> bool {
        self.begin.panels
    }

    /// Reports whether the picture is visible to anybody.
    pub fn is_visible(&self) -> bool {
        self.is_visible
    }

    /// Calls this whenever a command came, from a thread of its own.
    pub fn set_waker(&self, wake: impl Fn() + Send + 'static) {
        self.channel.set_waker(wake);
    }

    /// Loads the configuration that the host program names.
    ///
    /// # Errors
    /// Faults of the configuration, which are reported to the host program, too.
    pub fn load(&mut self) -> Result<LoadedScene, LoadError> {
        let path = PathBuf::from(&self.begin.config);
        LoadedScene::load(&path, &|_, _, _| {}).inspect_err(|error| {
            self.report_failure(&error.to_string());
        })
    }

    /// Reports that there is no view, before the process ends.
    pub fn report_failure(&mut self, why: &str) {
        self.channel.queue([ViewerMessage::Failed(why.to_owned())]);
        self.channel.flush_last();
    }

    /// Opens a view with `open`, with alarms and panels as the host program has them.
    ///
    /// # Errors
    /// Errors of `open`, which are reported to the host program, too.
    pub fn open_viewer<E: std::fmt::Display>(
        &mut self,
        open: impl FnOnce() -> Result<Viewer, E>,
    ) -> Result<Viewer, E> {
        let mut viewer = open().inspect_err(|error| self.report_failure(&error.to_string()))?;
        self.prepare_viewer(&mut viewer);
        Ok(viewer)
    }

    fn prepare_viewer(&mut self, viewer: &mut Viewer) {
        viewer.set_operator(&self.begin.operator);
        viewer.set_panels_shown(self.begin.panels);
        viewer.attach_host_program();
        viewer.restore_alarms(&change_reporter::standings_of(&self.begin.alarms));
        self.change_reporter = ChangeReporter::default();
    }

    /// Notes that a frame is drawn; with `is_presented`, that the window shows it. The end of the turn
    /// ([`ViewerServer::report_changes`]) confirms it.
    pub fn note_frame_drawn(&mut self, is_presented: bool) {
        self.iteration.is_presented = is_presented;
    }

    /// Confirms the picture's instant in shared memory, and the duration of the iteration.
    fn finish_iteration(&mut self, viewer: &mut Viewer) {
        let Some(memory) = &self.memory else { return };
        let LoopIteration { began, began_at_boot_nanos, is_presented } = self.iteration;
        if is_presented && (began.elapsed() < SLOW_ITERATION || viewer.finish_frame()) {
            memory.confirm(began_at_boot_nanos);
        }
        self.iteration.is_presented = false;
        memory.note_turn(began.elapsed());
    }

    /// Executes the host program's commands as far as the view can; the others are returned for the
    /// frame loop. None once the host program is gone: the process ends.
    pub fn apply_commands(&mut self, viewer: &mut Viewer) -> Option<FrameRequests> {
        self.iteration = LoopIteration::begin();
        let mut requests = FrameRequests::default();
        for command in self.channel.take()? {
            requests.is_due = true;
            match command {
                Command::Resize(size) => requests.size = Some(size),
                Command::SetVisible(is_visible) => self.is_visible = is_visible,
                Command::Pointer(_) | Command::Key(_) => requests.input.push(command),
                Command::Reload(path) => self.next_reload = Some(path),
                command => {
                    if let Err(why) = commands::perform(viewer, command) {
                        self.channel.queue([ViewerMessage::Refused(why)]);
                    }
                }
            }
        }
        self.step_reload(viewer);
        Some(requests)
    }

    /// Starts a requested reload, and applies it once it has loaded without fault.
    fn step_reload(&mut self, viewer: &mut Viewer) {
        if self.reloading.is_none()
            && let Some(path) = self.next_reload.take()
        {
            let begun = BackgroundLoad::begin(viewer, Path::new(&path), Instant::now(), || {});
            self.reload_path = path;
            match begun {
                Ok(loading) => self.reloading = Some(loading),
                Err(error) => return self.refuse_reload(&error.to_string()),
            }
        }
        let Some(outcome) = self.reloading.as_ref().and_then(|loading| loading.step(viewer)) else {
            return;
        };
        self.reloading = None;
        match outcome {
            ReloadOutcome::Refused(why) => self.refuse_reload(&why),
            ReloadOutcome::Shown | ReloadOutcome::Same => {
                // Numbers of alarms and tags may be others now.
                self.change_reporter = ChangeReporter::default();
                self.begin.config.clone_from(&self.reload_path);
                self.channel.queue([ViewerMessage::Reloaded { config: self.reload_path.clone() }]);
            }
        }
    }

    fn refuse_reload(&mut self, why: &str) {
        let path = &self.reload_path;
        let words = format!("'{path}' is not shown, the scene before stays: {why}");
        self.channel.queue([ViewerMessage::Refused(words)]);
    }

    /// Reports the changes of a frame to the host program.
    pub fn report_changes(&mut self, viewer: &mut Viewer) {
        self.finish_iteration(viewer);
        let happened = self.change_reporter.collect_changes(viewer);
        self.channel.queue(happened);
        self.channel.flush();
    }

    /// Reports a new picture in shared memory.
    fn report_picture(&mut self) {
        self.channel.queue([ViewerMessage::PictureReady]);
    }

    /// Reports the reason why the picture is outdated.
    pub fn report_trouble(&mut self, trouble: &str) {
        if trouble.is_empty() {
            return;
        }
        self.channel.queue([ViewerMessage::Refused(trouble.to_owned())]);
    }
}
