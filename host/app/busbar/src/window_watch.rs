//! Watchdog of the program's own window: a second process hatches it where its picture is old.
//!
//! A viewer that hangs cannot say so, and X11 shows its last picture for ever. `busbar view`
//! starts `busbar watch-window`, which has nothing but a pipe and a connection to the display: the
//! viewer tells it the instant of the values that are surely on the screen, and where that is too
//! long ago a hatched window of the watcher's own covers the viewer's. The watcher ends with the
//! viewer. Wayland lets no process cover another's window: there the clock of the status bar
//! alone tells a picture that stands still.

use std::io::{self, Write};
use std::os::fd::AsFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use anyhow::anyhow;
use busbar_client::liveness::{
    Liveness, LivenessInstants, LivenessLimits, LivenessMonitor, assess,
};
use busbar_client::{CoverError, WindowCover};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::time::{ClockId, clock_gettime};
use winit::raw_window_handle::{HasWindowHandle, RawWindowHandle};
use winit::window::Window;

/// Subcommand of the program for the watcher.
const COMMAND: &str = "watch-window";
/// Greatest age of the values in an uncovered picture: within a second of them, with a while for
/// the X server to draw.
const MAX_AGE: Duration = Duration::from_millis(950);
/// Time that a picture must stay live before it is uncovered: one that is late again and again
/// does not flash.
const MIN_LIVE: Duration = Duration::from_millis(400);
/// Longest period at which the picture's age is checked.
const CHECK_PERIOD: Duration = Duration::from_millis(50);
/// Limits by which a picture is live; this watchdog ends nothing.
const LIMITS: LivenessLimits = LivenessLimits { silent: MAX_AGE, hung: Duration::MAX };
/// Delay from one start of a watcher to the next; it doubles with each start, up to
/// [`MAX_RESTART_DELAY`], until a watcher has run for [`MIN_RUN`].
const RESTART_DELAY: Duration = Duration::from_secs(1);
const MAX_RESTART_DELAY: Duration = Duration::from_secs(60);
/// Run of a watcher after which its end says nothing of the next one.
const MIN_RUN: Duration = Duration::from_secs(10);
/// Bytes of an instant in the pipe, and instants that are read at once.
const INSTANT_BYTES: usize = size_of::<u64>();
const INSTANTS_AT_ONCE: usize = 512;
/// Wait for the exit status of a watcher whose pipe is closed, and the period of looks at it.
const END_GRACE: Duration = Duration::from_millis(20);
const END_POLL: Duration = Duration::from_millis(2);
/// Environment variables by which systemd would take the watcher for the viewer.
const SYSTEMD_VARIABLES: [&str; 3] = ["NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"];

/// Returns the present instant, nanoseconds of the clock since boot, which advances while the
/// machine sleeps.
pub(crate) fn boot_nanos() -> u64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Returns the id of an X11 window; none on Wayland.
pub(crate) fn x11_id(window: &Window) -> Option<u32> {
    match window.window_handle().ok()?.as_raw() {
        RawWindowHandle::Xlib(handle) => u32::try_from(handle.window).ok(),
        RawWindowHandle::Xcb(handle) => Some(handle.window.get()),
        _ => None,
    }
}

/// Viewer's side: keeps a watcher of its window running, and reports frames to it.
pub(crate) struct WindowWatch {
    window: u32,
    watcher: Option<Watcher>,
    started_at: Option<Instant>,
    /// Delay from the last start to the next one.
    restart_delay: Duration,
    /// Instant of the values in the frame that was presented last: it may not be seen yet.
    presented: Option<u64>,
}

impl WindowWatch {
    /// Prepares the watchdog of an X11 window; none on Wayland.
    pub(crate) fn new(window: &Window) -> Option<Self> {
        let Some(window) = x11_id(window) else {
            tracing::info!(
                "no watcher covers this window where it hangs, for it is no X11 window; its clock \
                 tells a picture that stands still"
            );
            return None;
        };
        Some(Self {
            window,
            watcher: None,
            started_at: None,
            restart_delay: RESTART_DELAY,
            presented: None,
        })
    }

    /// Records a presented frame, by the instant of the values in it. The frame before it is on the
    /// screen then, at the least.
    pub(crate) fn note_frame(&mut self, true_at: u64) {
        let seen = self.presented.replace(true_at);
        self.report(seen);
    }

    /// Records a frame that was not drawn, since the picture presented last agrees with its values
    /// as well. That picture is on the screen once the device has finished it.
    pub(crate) fn note_unchanged(&mut self, true_at: u64, has_finished: bool) {
        if has_finished && self.presented.is_some() {
            self.presented = Some(true_at);
            self.report(self.presented);
        }
    }

    /// Records a step while the window is not mapped, and shows nothing that could be old.
    pub(crate) fn note_unmapped(&mut self, now: u64) {
        self.presented = None;
        self.report(Some(now));
    }

    /// Tells the watcher the instant of the values that are on the screen; starts a watcher where
    /// there is none.
    fn report(&mut self, seen: Option<u64>) {
        if self.watcher.is_none() {
            self.start_if_due();
        }
        let (Some(watcher), Some(seen)) = (&mut self.watcher, seen) else { return };
        if let Err(error) = watcher.send(seen) {
            let how = watcher.ending().unwrap_or_else(|| error.to_string());
            self.watcher = None;
            if self.started_at.is_some_and(|at| at.elapsed() >= MIN_RUN) {
                self.restart_delay = RESTART_DELAY;
            }
            tracing::warn!(
                "the watcher of the window has ended ({how}); another is started within {} s",
                self.restart_delay.as_secs()
            );
        }
    }

    fn start_if_due(&mut self) {
        if let Some(at) = self.started_at {
            if at.elapsed() < self.restart_delay {
                return;
            }
            self.restart_delay = (self.restart_delay * 2).min(MAX_RESTART_DELAY);
        }
        self.started_at = Some(Instant::now());
        match Watcher::start(self.window) {
            Ok(watcher) => self.watcher = Some(watcher),
            Err(error) => tracing::warn!("nothing watches the window: {error}"),
        }
    }
}

/// Process of a watcher; it ends when its pipe is closed.
struct Watcher {
    pipe: Option<ChildStdin>,
    process: Child,
}

impl Watcher {
    fn start(window: u32) -> io::Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        command.arg(COMMAND).arg(window.to_string());
        for variable in SYSTEMD_VARIABLES {
            command.env_remove(variable);
        }
        command.stdin(Stdio::piped()).stdout(Stdio::null());
        // What a terminal stops is the viewer, and not who tells of it.
        let mut process = command.process_group(0).spawn()?;
        let pipe = process.stdin.take();
        if let Some(pipe) = &pipe {
            // A watcher that does not read holds up no frame.
            rustix::fs::fcntl_setfl(pipe, OFlags::NONBLOCK)?;
        }
        Ok(Self { pipe, process })
    }

    /// Waits a moment for the end of the process; returns its exit status in words.
    fn ending(&mut self) -> Option<String> {
        self.pipe = None;
        let start = Instant::now();
        while start.elapsed() < END_GRACE {
            if let Ok(Some(status)) = self.process.try_wait() {
                return Some(status.to_string());
            }
            std::thread::sleep(END_POLL);
        }
        None
    }

    /// Sends the instant of the values on the screen.
    fn send(&mut self, true_at: u64) -> io::Result<()> {
        let Some(pipe) = &mut self.pipe else { return Ok(()) };
        // A pipe takes so few bytes whole or not at all.
        match pipe.write(&true_at.to_le_bytes()) {
            Err(error) if error.kind() != io::ErrorKind::WouldBlock => Err(error),
            _ => Ok(()),
        }
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.pipe = None;
        // One that a signal stopped would not end by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Runs `busbar watch-window`: covers a window while its picture is old, until the viewer ends.
pub(crate) fn run(window: u32) -> anyhow::Result<ExitCode> {
    let mut cover = match WindowCover::open(None, window) {
        Ok(cover) => cover,
        Err(error) => return Err(anyhow!("{error}")),
    };
    let mut pipe = InstantPipe { true_at: boot_nanos(), rest: Vec::new() };
    let mut viewer = LivenessMonitor::new(parent(), Instant::now());
    let mut decision = CoverDecision::default();
    loop {
        let (now, at) = (Instant::now(), pipe.true_at);
        let beats = LivenessInstants {
            heartbeat: at,
            frame: at,
            picture_true_at: at,
            ..LivenessInstants::default()
        };
        let signs = viewer.sample(beats, boot_nanos(), now);
        let age = signs.picture_age.unwrap_or_default();
        let covered = match decision.cover(assess(&signs, &LIMITS), now) {
            None => cover.hide(),
            Some(words) => cover.show(&format!("{words} FOR {} S", age.as_secs())),
        };
        match covered {
            Ok(()) => {}
            // The window has gone, and the viewer goes with it.
            Err(CoverError::Gone) => return Ok(ExitCode::SUCCESS),
            Err(error) => return Err(anyhow!("{error}")),
        }
        let left = MAX_AGE.saturating_sub(age) + Duration::from_millis(1);
        let timeout = if cover.is_shown() { CHECK_PERIOD } else { left.min(CHECK_PERIOD) };
        let timeout = Timespec { tv_sec: 0, tv_nsec: i64::from(timeout.subsec_nanos()) };
        let (stdin, display) = (io::stdin(), cover.descriptor());
        let mut waited = [
            PollFd::from_borrowed_fd(stdin.as_fd(), PollFlags::IN),
            PollFd::from_borrowed_fd(display, PollFlags::IN),
        ];
        // Interrupted is as good as awake.
        let _ = poll(&mut waited, Some(&timeout));
        let is_readable = !waited[0].revents().is_empty();
        if is_readable && !pipe.read(|room| Ok(rustix::io::read(&stdin, room)?))? {
            return Ok(ExitCode::SUCCESS);
        }
    }
}

/// Process that started this one: the viewer.
fn parent() -> u32 {
    rustix::process::getppid().map_or(0, |id| id.as_raw_pid().unsigned_abs())
}

/// Decision whether the window is covered.
#[derive(Debug, Default)]
struct CoverDecision {
    is_covered: bool,
    live_since: Option<Instant>,
}

impl CoverDecision {
    /// Decides anew; returns the text to cover the window with, or none.
    fn cover(&mut self, liveness: Liveness, now: Instant) -> Option<&'static str> {
        if liveness.is_live() {
            let live_since = *self.live_since.get_or_insert(now);
            self.is_covered &= now.saturating_duration_since(live_since) < MIN_LIVE;
        } else {
            (self.is_covered, self.live_since) = (true, None);
        }
        let is_slow = matches!(liveness, Liveness::Live | Liveness::Late);
        self.is_covered.then_some(if is_slow { "DISPLAY LATE" } else { "NO LIVE PICTURE" })
    }
}

/// Reading end of the pipe: the newest instant that came whole.
struct InstantPipe {
    true_at: u64,
    /// Bytes of an incomplete instant.
    rest: Vec<u8>,
}

impl InstantPipe {
    /// Reads instants; returns false once the viewer has ended.
    fn read(&mut self, read: impl FnOnce(&mut [u8]) -> io::Result<usize>) -> io::Result<bool> {
        let mut room = [0; INSTANTS_AT_ONCE * INSTANT_BYTES];
        let count = match read(&mut room) {
            Ok(0) => return Ok(false),
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(true),
            Err(error) => return Err(error),
        };
        self.rest.extend_from_slice(&room[..count]);
        let whole = self.rest.len() / INSTANT_BYTES * INSTANT_BYTES;
        for bytes in self.rest.drain(..whole).as_slice().chunks_exact(INSTANT_BYTES) {
            let instant = bytes.try_into().map_or(0, u64::from_le_bytes);
            self.true_at = self.true_at.max(instant.min(boot_nanos()));
        }
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_is_late_is_covered_at_once_and_seen_again_once_it_stays_live() {
        let (mut decision, start) = (CoverDecision::default(), Instant::now());
        assert_eq!(decision.cover(Liveness::Live, start), None);
        assert_eq!(decision.cover(Liveness::Late, start), Some("DISPLAY LATE"));
        assert_eq!(decision.cover(Liveness::Lost, start), Some("NO LIVE PICTURE"));
        assert_eq!(decision.cover(Liveness::Hung, start), Some("NO LIVE PICTURE"));
        assert!(decision.cover(Liveness::Live, start).is_some());
        assert!(decision.cover(Liveness::Live, start + MIN_LIVE / 2).is_some());
        assert!(decision.cover(Liveness::Late, start + MIN_LIVE / 2).is_some());
        assert!(decision.cover(Liveness::Live, start + MIN_LIVE).is_some(), "it begins anew");
        assert_eq!(decision.cover(Liveness::Live, start + MIN_LIVE * 2), None);
    }

    #[test]
    fn the_newest_whole_instant_counts_and_none_of_the_future() {
        let mut pipe = InstantPipe { true_at: 5, rest: Vec::new() };
        let mut take = |bytes: &[u8]| {
            let read = |room: &mut [u8]| {
                room[..bytes.len()].copy_from_slice(bytes);
                Ok(bytes.len())
            };
            (pipe.read(read).unwrap(), pipe.true_at)
        };
        let bytes: Vec<u8> = [7_u64, 9, 8].iter().flat_map(|at| at.to_le_bytes()).collect();
        assert_eq!(take(&bytes[..3]), (true, 5));
        assert_eq!(take(&bytes[3..17]), (true, 9));
        assert_eq!(take(&bytes[17..]), (true, 9));
        let (goes_on, at) = take(&u64::MAX.to_le_bytes());
        assert!(goes_on && at <= boot_nanos());
        assert!(!take(&[]).0, "the viewer has ended");
    }
}
