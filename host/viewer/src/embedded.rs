//! The view of a host program: commands come from another process, events go back.
//!
//! The host program's library starts this process, hands it a socket and the memory of
//! pictures, and ends it by closing the socket. Nothing here waits for the host program:
//! one that is stopped or slow costs a bounded amount of memory.

mod channel;
mod commands;
mod heartbeat;
mod input;
mod offscreen;
mod watch;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub use busbar_protocol::message::Target;
use busbar_protocol::message::{Command, PROTOCOL_VERSION, StartParameters, ViewerMessage};
use busbar_protocol::pictures::{self, PictureMemory};

use crate::reload::{Loading, Outcome};
use crate::{LoadError, LoadedScene, Viewer};
use channel::Channel;
use heartbeat::Heartbeat;
use watch::Watch;

/// Duration of a turn of the frame loop from which a window's frame is waited for before it is
/// confirmed: frames in flight are then too old to be taken for shown.
const SLOW_TURN: Duration = Duration::from_millis(80);

/// The host program's end.
pub struct Embedded {
    channel: Channel,
    begin: StartParameters,
    memory: Option<PictureMemory>,
    watch: Watch,
    reloading: Option<Loading>,
    /// What is being loaded.
    reload_path: String,
    /// Asked for meanwhile.
    next_reload: Option<String>,
    is_visible: bool,
    turn: Turn,
    _heartbeat: Heartbeat,
}

/// One turn of the frame loop.
struct Turn {
    began: Instant,
    /// Its beginning on the clock since boot: no tag value in its frame is read before.
    began_at: u64,
    /// Tells whether the window shows its frame, so that the picture is of `began_at`.
    is_true: bool,
}

impl Turn {
    fn begin() -> Self {
        Self { began: Instant::now(), began_at: pictures::now(), is_true: false }
    }
}

/// What the loop around a view has to do itself.
#[derive(Default)]
pub struct Pass {
    /// The size wanted, pixels.
    pub size: Option<[u32; 2]>,
    /// What pointer and keyboard did over an offscreen picture.
    pub input: Vec<Command>,
    /// Whether anything was asked, so that a frame is due now.
    pub is_due: bool,
}

impl Embedded {
    /// Takes the host program's socket, which is standard input, and its first message.
    ///
    /// # Errors
    /// In words: no such socket, or a host program of another release.
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
            watch: Watch::default(),
            reloading: None,
            reload_path: String::new(),
            next_reload: None,
            is_visible: true,
            turn: Turn::begin(),
        })
    }

    /// Where the picture goes.
    pub fn target(&self) -> Target {
        self.begin.target
    }

    /// Its size at first, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.begin.size
    }

    /// Whether panels are wanted.
    pub fn has_panels(&self) -> bool {
        self.begin.panels
    }

    /// Whether anybody can see the picture.
    pub fn is_visible(&self) -> bool {
        self.is_visible
    }

    /// Calls this whenever a command came, from a thread of its own.
    pub fn set_waker(&self, wake: impl Fn() + Send + 'static) {
        self.channel.set_waker(wake);
    }

    /// Loads the configuration.
    ///
    /// # Errors
    /// The configuration's faults; the host program has been told.
    pub fn load(&mut self) -> Result<LoadedScene, LoadError> {
        let path = PathBuf::from(&self.begin.config);
        LoadedScene::load(&path, &|_, _, _| {}).inspect_err(|error| {
            self.fail(&error.to_string());
        })
    }

    /// Tells why there is no view at all, before the process ends.
    pub fn fail(&mut self, why: &str) {
        self.channel.tell([ViewerMessage::Failed(why.to_owned())]);
        self.channel.flush_last();
    }

    /// Opens a view with `open`, with alarms and panels as the host program has them.
    ///
    /// # Errors
    /// As `open`; the host program has been told.
    pub fn open<E: std::fmt::Display>(
        &mut self,
        open: impl FnOnce() -> Result<Viewer, E>,
    ) -> Result<Viewer, E> {
        let mut viewer = open().inspect_err(|error| self.fail(&error.to_string()))?;
        self.settle_in(&mut viewer);
        Ok(viewer)
    }

    fn settle_in(&mut self, viewer: &mut Viewer) {
        viewer.set_operator(&self.begin.operator);
        viewer.set_panels_shown(self.begin.panels);
        viewer.set_host();
        viewer.restore_alarms(&watch::standings_of(&self.begin.alarms));
        self.watch = Watch::default();
    }

    /// Notes that a frame is drawn; with `is_true`, that the window shows it. The end of the turn
    /// ([`Embedded::report`]) confirms it.
    pub fn beat(&mut self, is_true: bool) {
        self.turn.is_true = is_true;
    }

    /// Tells the library that the frame loop goes on, and of which instant the picture is.
    fn finish_turn(&mut self, viewer: &mut Viewer) {
        let Some(memory) = &self.memory else { return };
        let Turn { began, began_at, is_true } = self.turn;
        if is_true && (began.elapsed() < SLOW_TURN || viewer.finish_frame()) {
            memory.confirm(began_at);
        }
        self.turn.is_true = false;
        memory.note_turn(began.elapsed());
    }

    /// Does what the host program asked since, as far as the view can; the rest is the
    /// loop's. None when the host program has let go: the process ends.
    pub fn obey(&mut self, viewer: &mut Viewer) -> Option<Pass> {
        self.turn = Turn::begin();
        let mut pass = Pass::default();
        for command in self.channel.take()? {
            pass.is_due = true;
            match command {
                Command::Resize(size) => pass.size = Some(size),
                Command::SetVisible(is_visible) => self.is_visible = is_visible,
                Command::Pointer(_) | Command::Key(_) => pass.input.push(command),
                Command::Reload(path) => self.next_reload = Some(path),
                command => {
                    if let Err(why) = commands::perform(viewer, command) {
                        self.channel.tell([ViewerMessage::Refused(why)]);
                    }
                }
            }
        }
        self.step_reload(viewer);
        Some(pass)
    }

    /// Begins to load what is asked for, and shows it once it is there without fault.
    fn step_reload(&mut self, viewer: &mut Viewer) {
        if self.reloading.is_none()
            && let Some(path) = self.next_reload.take()
        {
            let begun = Loading::begin(viewer, Path::new(&path), Instant::now(), || {});
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
            Outcome::Refused(why) => self.refuse_reload(&why),
            Outcome::Shown | Outcome::Same => {
                // Numbers of alarms and tags may be others now.
                self.watch = Watch::default();
                self.begin.config.clone_from(&self.reload_path);
                self.channel.tell([ViewerMessage::Reloaded { config: self.reload_path.clone() }]);
            }
        }
    }

    fn refuse_reload(&mut self, why: &str) {
        let path = &self.reload_path;
        let words = format!("'{path}' is not shown, the scene before stays: {why}");
        self.channel.tell([ViewerMessage::Refused(words)]);
    }

    /// Tells the host program what a frame changed.
    pub fn report(&mut self, viewer: &mut Viewer) {
        self.finish_turn(viewer);
        let happened = self.watch.look(viewer);
        self.channel.tell(happened);
        self.channel.flush();
    }

    /// Tells of a new picture in shared memory.
    fn report_picture(&mut self) {
        self.channel.tell([ViewerMessage::PictureReady]);
    }

    /// Tells why the picture is not of now, if it is not.
    pub fn report_trouble(&mut self, trouble: &str) {
        if trouble.is_empty() {
            return;
        }
        self.channel.tell([ViewerMessage::Refused(trouble.to_owned())]);
    }
}
