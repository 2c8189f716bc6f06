//! The picture as the program gets it: of the viewer, or marked where it is not live.

use std::time::Duration;

use busbar_protocol::pictures::{Area, PictureInfo, PictureReader, now};

use crate::dead_mark;
use crate::liveness::Liveness;

/// State of a picture: how far it may be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureState {
    /// Picture of current values.
    Live,
    /// Picture of older values, marked; its viewer makes progress, too slowly.
    Late,
    /// Picture of older values, marked; its viewer is silent or gone.
    Dead,
}

/// Pictures of a view's successive viewers.
#[derive(Default)]
pub(crate) struct PictureStream {
    /// Reader of the viewer whose picture was returned last.
    shown: Option<PictureReader>,
    /// Reader of a newer viewer that has no picture yet.
    next: Option<PictureReader>,
    /// Reports whether the viewer that drew the shown picture has ended.
    has_ended: bool,
    /// A copy of what was shown last, marked; empty where it is live.
    marked: Vec<u8>,
    /// State of the picture that was returned last.
    last: Option<PictureState>,
    /// Reports whether the picture that was copied last was live.
    was_live: bool,
}

/// Newest picture, by reference into shared memory or into the marked copy.
pub struct FrameView {
    /// Size, number, and what may differ from what was given before.
    pub info: PictureInfo,
    /// The first pixel: blue, green, red and 255, rows from the top. Stays as it is until the
    /// next is given.
    pub pixels: *const u8,
    /// State of the picture; every state but live has been hatched.
    pub state: PictureState,
    /// Age of what it shows: time since the tag values in it were read.
    pub age: Duration,
    /// Reports whether the picture differs from the one returned before.
    pub is_new: bool,
}

/// Description of a copied picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameCopy {
    /// Size, number, and what may differ from what was copied before.
    pub info: PictureInfo,
    /// State of what was copied last.
    pub state: PictureState,
    /// Reports whether the picture that was copied last is not live.
    pub is_dead: bool,
    /// Age of what it shows: time since the tag values in it were read.
    pub age: Duration,
    /// Reports whether pixels were copied: the picture is new, and its viewer confirms it.
    pub is_new: bool,
}

impl PictureStream {
    /// Attaches the reader of a new viewer; the picture of the previous viewer stays until the new
    /// one has its first.
    pub(crate) fn attach(&mut self, reader: PictureReader) {
        self.next = Some(reader);
    }

    /// The viewer has ended: what it drew is dead.
    pub(crate) fn mark_ended(&mut self) {
        self.next = None;
        self.has_ended = true;
    }

    /// The newest picture, marked where it is older than `silent`; `verdict` is on its viewer.
    /// None before the first.
    pub(crate) fn marked_frame(
        &mut self,
        silent: Duration,
        verdict: Liveness,
    ) -> Option<FrameView> {
        let FrameCopy { mut info, state, age, mut is_new, .. } =
            self.take_newest(silent, verdict)?;
        if self.last.replace(state) != Some(state) {
            info.damage = whole(info);
            is_new = true;
        }
        let shown = self.shown.as_ref()?;
        let (_, mut pixels) = shown.picture()?;
        if state == PictureState::Live {
            self.marked = Vec::new();
        } else {
            if is_new || self.marked.is_empty() {
                shown.copy(&mut self.marked)?;
                dead_mark::mark_dead(&mut self.marked, info.size[0] as usize);
            }
            pixels = self.marked.as_ptr();
        }
        Some(FrameView { info, pixels, state, age, is_new })
    }

    /// Copies the newest picture where its viewer confirms it and it is new. None before the first.
    pub(crate) fn copy(
        &mut self,
        silent: Duration,
        verdict: Liveness,
        pixels: &mut Vec<u8>,
    ) -> Option<FrameCopy> {
        let mut seen = self.take_newest(silent, verdict)?;
        // One that came at the end of its viewer was not copied; there is a whole one after it.
        let was_live = std::mem::replace(&mut self.was_live, seen.state != PictureState::Dead);
        if seen.state == PictureState::Dead {
            seen.is_new = false;
        } else if !was_live {
            seen.info.damage = whole(seen.info);
            seen.is_new = true;
        }
        if seen.is_new {
            self.shown.as_ref()?.copy(pixels)?;
        }
        Some(seen)
    }

    /// Takes the newest picture, and returns its description.
    fn take_newest(&mut self, silent: Duration, verdict: Liveness) -> Option<FrameCopy> {
        let mut is_new = false;
        if self.next.as_mut().is_some_and(PictureReader::take) {
            self.shown = self.next.take();
            self.has_ended = false;
            is_new = true;
        } else if !self.has_ended
            && let Some(shown) = &mut self.shown
        {
            is_new = shown.take();
        }
        let shown = self.shown.as_ref()?;
        let (mut info, _) = shown.picture()?;
        if !is_new {
            info.damage = Area::default();
        }
        let age = age_of(shown.true_at()?);
        let state = match verdict {
            _ if self.has_ended => PictureState::Dead,
            Liveness::Lost | Liveness::Hung => PictureState::Dead,
            _ if age > silent => PictureState::Late,
            _ => PictureState::Live,
        };
        Some(FrameCopy { info, state, is_dead: state != PictureState::Live, age, is_new })
    }
}

/// Returns the time since an instant of the clock since boot. An instant in the future comes of a
/// faulty viewer, and counts as infinitely old.
pub(crate) fn age_of(true_at: u64) -> Duration {
    now().checked_sub(true_at).map_or(Duration::MAX, Duration::from_nanos)
}

fn whole(info: PictureInfo) -> Area {
    let [width, height] = info.size;
    Area { x: 0, y: 0, width, height }
}

#[cfg(test)]
mod tests {
    use busbar_protocol::pictures::{PictureMemory, PictureWriter};

    use super::*;

    const SILENT: Duration = Duration::from_millis(500);

    fn frames() -> (PictureWriter, PictureStream) {
        let (file, memory) = PictureMemory::create().unwrap();
        let mut frames = PictureStream::default();
        frames.attach(PictureReader::new(memory));
        (PictureWriter::new(PictureMemory::open(&file).unwrap()), frames)
    }

    /// Publishes a picture of one colour whose values were read so long ago.
    fn publish(writer: &mut PictureWriter, age: Duration) {
        let area = Area { x: 0, y: 0, width: 64, height: 64 };
        let true_at = now() - age.as_nanos() as u64;
        let red = |pixels: &mut [u8]| {
            pixels.chunks_exact_mut(4).for_each(|pixel| pixel.copy_from_slice(&[0, 0, 200, 255]));
        };
        writer.publish([64, 64], area, true_at, red).unwrap();
    }

    /// Reports whether what was given is the marked copy and not the viewer's own pixels.
    fn is_marked(frames: &PictureStream, given: &FrameView) -> bool {
        let is_grey = frames.marked.chunks(4).all(|pixel| pixel[0] == pixel[2]);
        !frames.marked.is_empty() && given.pixels == frames.marked.as_ptr() && is_grey
    }

    #[test]
    fn a_picture_that_comes_late_is_not_live_for_having_come() {
        let (mut writer, mut frames) = frames();
        publish(&mut writer, Duration::from_millis(4500));
        let given = frames.marked_frame(SILENT, Liveness::Live).unwrap();
        assert_eq!(given.state, PictureState::Late);
        assert!(given.age >= Duration::from_millis(4500), "{:?}", given.age);
        assert!(is_marked(&frames, &given));
        publish(&mut writer, Duration::from_millis(10));
        let given = frames.marked_frame(SILENT, Liveness::Live).unwrap();
        assert_eq!(
            (given.state, is_marked(&frames, &given), given.is_new),
            (PictureState::Live, false, true)
        );
        // The same picture, later, and nobody stands by it.
        std::thread::sleep(SILENT);
        let given = frames.marked_frame(SILENT, Liveness::Late).unwrap();
        assert_eq!(
            (given.state, is_marked(&frames, &given), given.is_new),
            (PictureState::Late, true, true)
        );
        assert_eq!(given.info.damage, whole(given.info));
        // It still shows what is so.
        writer.memory().confirm(now());
        assert_eq!(frames.marked_frame(SILENT, Liveness::Live).unwrap().state, PictureState::Live);
    }

    #[test]
    fn a_picture_of_a_viewer_that_is_lost_is_dead_at_once() {
        let (mut writer, mut frames) = frames();
        publish(&mut writer, Duration::ZERO);
        let given = frames.marked_frame(SILENT, Liveness::Lost).unwrap();
        assert_eq!((given.state, is_marked(&frames, &given)), (PictureState::Dead, true));
        assert_eq!(frames.marked_frame(SILENT, Liveness::Live).unwrap().state, PictureState::Live);
        frames.mark_ended();
        assert_eq!(frames.marked_frame(SILENT, Liveness::Live).unwrap().state, PictureState::Dead);
    }

    #[test]
    fn an_instant_in_the_future_makes_no_picture_young() {
        let (mut writer, mut frames) = frames();
        let area = Area { x: 0, y: 0, width: 8, height: 8 };
        writer.publish([8, 8], area, now() + 1_000_000_000_000, |_| {}).unwrap();
        let given = frames.marked_frame(SILENT, Liveness::Live).unwrap();
        assert_eq!((given.state, given.age), (PictureState::Late, Duration::MAX));
    }

    #[test]
    fn late_pictures_are_copied_and_dead_ones_are_not() {
        let (mut writer, mut frames) = frames();
        let mut pixels = Vec::new();
        publish(&mut writer, Duration::ZERO);
        let copied = frames.copy(SILENT, Liveness::Live, &mut pixels).unwrap();
        assert_eq!((copied.state, copied.is_new), (PictureState::Live, true));
        publish(&mut writer, Duration::from_secs(2));
        let copied = frames.copy(SILENT, Liveness::Late, &mut pixels).unwrap();
        let expected = (PictureState::Late, true, true);
        assert_eq!((copied.state, copied.is_new, copied.is_dead), expected);
        publish(&mut writer, Duration::ZERO);
        let copied = frames.copy(SILENT, Liveness::Lost, &mut pixels).unwrap();
        assert_eq!((copied.state, copied.is_new), (PictureState::Dead, false));
        let copied = frames.copy(SILENT, Liveness::Live, &mut pixels).unwrap();
        assert_eq!(copied.info.damage, whole(copied.info));
        assert_eq!((copied.state, copied.is_new), (PictureState::Live, true));
    }
}
