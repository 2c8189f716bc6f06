//! Thread that covers the host program's X11 window while the picture in it is not live.
//!
//! It judges by itself, and is neither the thread that watches the viewer nor one of the
//! program's: a callback that takes long does not leave an old picture uncovered.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use jiff::{SignedDuration, Timestamp, tz::TimeZone};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::events::Event;
use crate::liveness::Liveness;
use crate::pictures::age_of;
use crate::shared::Shared;
use crate::window_cover::{CoverError, WindowCover};

/// Period of looks at the picture's age.
const SAMPLE_PERIOD: Duration = Duration::from_millis(25);
/// Time that a picture must stay live before it is uncovered: one that is late again and again
/// does not flash.
pub(crate) const MIN_LIVE: Duration = Duration::from_millis(400);
/// Delay between tries to reach the display.
const RETRY_PERIOD: Duration = Duration::from_secs(1);
/// Bytes that are read of a viewer's environment.
const MAX_ENVIRONMENT_BYTES: u64 = 1 << 20;

/// State of the cover of one window.
pub(crate) struct CoverThread {
    shared: Arc<Shared>,
    window: u32,
    silent: Duration,
    cover: Option<WindowCover>,
    /// Instant of the next attempt to reach the display, without a cover.
    due: Instant,
    has_reported: bool,
    decision: CoverDecision,
}

impl CoverThread {
    pub(crate) fn new(shared: Arc<Shared>, window: u32, silent: Duration) -> Self {
        let (due, decision) = (Instant::now(), CoverDecision::default());
        Self { shared, window, silent, cover: None, due, has_reported: false, decision }
    }

    /// Covers and uncovers until the view is closed or the window has gone.
    pub(crate) fn run(mut self) {
        while !self.shared.is_closing() {
            if let Err(CoverError::Gone) = self.step() {
                return;
            }
            self.wait();
        }
    }

    fn step(&mut self) -> Result<(), CoverError> {
        if self.cover.is_none() && Instant::now() >= self.due {
            self.open();
        }
        let picture =
            PictureAge { true_at: self.shared.picture_true_at(), verdict: self.shared.verdict() };
        let limit = self.shared.picture_limit(self.silent);
        let text = self.decision.text(picture, limit, Instant::now());
        match (&mut self.cover, text) {
            (Some(cover), Some(text)) => cover.show(&text),
            (Some(cover), None) => cover.hide(),
            (None, _) => Ok(()),
        }
    }

    /// Reaches the display: the program's own, else that which the viewer was started with.
    fn open(&mut self) {
        let own = WindowCover::open(None, self.window);
        let opened = own.or_else(|error| {
            let viewer = self.shared.viewer_id.load(Ordering::Acquire);
            let display = display_of(viewer).ok_or(error)?;
            WindowCover::open(Some(&display), self.window)
        });
        match opened {
            Ok(cover) => self.cover = Some(cover),
            Err(why) => {
                self.due = Instant::now() + RETRY_PERIOD;
                // Not before there is something to cover.
                if self.decision.since.is_some() && !std::mem::replace(&mut self.has_reported, true)
                {
                    let words = format!("an old picture in the window is not covered: {why}");
                    self.shared.push_event(Event::Error(words));
                }
            }
        }
    }

    fn wait(&self) {
        let timeout = Timespec { tv_sec: 0, tv_nsec: SAMPLE_PERIOD.as_nanos() as i64 };
        let descriptors = self.cover.as_ref().map(WindowCover::descriptor);
        let mut polled: Vec<_> =
            descriptors.iter().map(|descriptor| PollFd::new(descriptor, PollFlags::IN)).collect();
        // Interrupted is as good as awake.
        let _ = poll(&mut polled, Some(&timeout));
    }
}

/// Age and liveness of the picture in the window.
#[derive(Clone, Copy, Debug)]
struct PictureAge {
    /// Instant of the values in it; none without a viewer, or before its first picture.
    true_at: Option<u64>,
    verdict: Liveness,
}

/// Decision whether a window is covered, and with which text.
#[derive(Debug, Default)]
struct CoverDecision {
    /// Last instant at which the picture in the window was true, by the wall clock; none before
    /// the first picture.
    since: Option<Timestamp>,
    /// Text of the cover while there is one.
    text: Option<String>,
    /// Since when the picture has been live without a pause.
    live_since: Option<Instant>,
}

impl CoverDecision {
    /// Decides anew; none leaves the window uncovered.
    fn text(&mut self, picture: PictureAge, silent: Duration, now: Instant) -> Option<String> {
        let age = picture.true_at.map(age_of);
        let is_lost = matches!(picture.verdict, Liveness::Lost | Liveness::Hung);
        let is_live = !is_lost && age.is_some_and(|age| age <= silent);
        if is_live {
            let live_since = *self.live_since.get_or_insert(now);
            if self.text.is_none() || now.saturating_duration_since(live_since) >= MIN_LIVE {
                self.text = None;
                self.since = age.and_then(instant_before_now).or(self.since);
            }
            return self.text.clone();
        }
        self.live_since = None;
        // Before the first picture there is nothing old to be seen.
        let drawn = age.map(|age| instant_before_now(age).unwrap_or_else(Timestamp::now));
        self.since = self.since.or(drawn);
        let since = self.since?.to_zoned(TimeZone::system()).strftime("%H:%M:%S").to_string();
        self.text = Some(match picture.verdict {
            Liveness::Late | Liveness::Live => format!("DISPLAY LATE SINCE {since}"),
            _ => format!("NO LIVE PICTURE SINCE {since}"),
        });
        self.text.clone()
    }
}

fn instant_before_now(age: Duration) -> Option<Timestamp> {
    Timestamp::now().checked_sub(SignedDuration::try_from(age).ok()?).ok()
}

/// Display that a process was started with.
fn display_of(process: u32) -> Option<String> {
    use std::io::Read;
    let mut bytes = Vec::new();
    let file = std::fs::File::open(format!("/proc/{process}/environ")).ok()?;
    file.take(MAX_ENVIRONMENT_BYTES).read_to_end(&mut bytes).ok()?;
    let value = bytes.split(|byte| *byte == 0).find_map(|entry| entry.strip_prefix(b"DISPLAY="))?;
    String::from_utf8(value.to_vec()).ok()
}

#[cfg(test)]
mod tests {
    use busbar_protocol::pictures::now;

    use super::*;

    const SILENT: Duration = Duration::from_millis(500);

    /// A picture whose values were read so many milliseconds ago.
    fn picture(age: u64, verdict: Liveness) -> PictureAge {
        PictureAge { true_at: Some(now() - age * 1_000_000), verdict }
    }

    #[test]
    fn an_old_picture_is_covered_and_a_live_one_is_not() {
        let (mut decision, start) = (CoverDecision::default(), Instant::now());
        let none = PictureAge { true_at: None, verdict: Liveness::Late };
        assert_eq!(decision.text(none, SILENT, start), None, "there is nothing to cover");
        assert_eq!(decision.text(picture(0, Liveness::Live), SILENT, start), None);
        let late = decision.text(picture(600, Liveness::Late), SILENT, start).unwrap();
        assert!(late.starts_with("DISPLAY LATE SINCE "), "{late}");
        let lost = decision.text(picture(900, Liveness::Lost), SILENT, start).unwrap();
        assert!(lost.starts_with("NO LIVE PICTURE SINCE "), "{lost}");
        // It is of when the picture was live last, for as long as it is not.
        assert_eq!(lost.rsplit(' ').next(), late.rsplit(' ').next());
        // The viewer has gone, and the next one has no picture yet.
        let gone = PictureAge { true_at: None, verdict: Liveness::Lost };
        assert!(decision.text(gone, SILENT, start).is_some());
    }

    #[test]
    fn a_picture_that_was_never_live_is_covered() {
        let (mut decision, start) = (CoverDecision::default(), Instant::now());
        assert!(decision.text(picture(700, Liveness::Late), SILENT, start).is_some());
        let (mut decision, future) = (CoverDecision::default(), now() + 1_000_000_000_000);
        let wrong = PictureAge { true_at: Some(future), verdict: Liveness::Live };
        assert!(decision.text(wrong, SILENT, start).is_some());
    }

    #[test]
    fn a_stopped_viewer_is_covered_before_its_picture_is_old() {
        let (mut decision, start) = (CoverDecision::default(), Instant::now());
        assert_eq!(decision.text(picture(0, Liveness::Live), SILENT, start), None);
        assert!(decision.text(picture(300, Liveness::Lost), SILENT, start).is_some());
    }

    #[test]
    fn a_picture_that_is_late_again_and_again_does_not_flash() {
        let (mut decision, start) = (CoverDecision::default(), Instant::now());
        let live = || picture(100, Liveness::Live);
        assert_eq!(decision.text(live(), SILENT, start), None);
        assert!(decision.text(picture(600, Liveness::Late), SILENT, start).is_some());
        assert!(decision.text(live(), SILENT, start).is_some());
        assert!(decision.text(live(), SILENT, start + MIN_LIVE / 2).is_some());
        assert!(decision.text(picture(600, Liveness::Late), SILENT, start).is_some());
        assert!(decision.text(live(), SILENT, start + MIN_LIVE).is_some(), "it begins anew");
        assert_eq!(decision.text(live(), SILENT, start + MIN_LIVE * 2), None);
    }
}
