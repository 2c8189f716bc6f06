//! The picture as the program gets it: of the viewer, or marked dead.

use busbar_protocol::pictures::{Area, Numbers, PictureReader, bytes_of, now};

use crate::abi::{BUSBAR_VIEW_DEAD, BUSBAR_VIEW_LIVE};
use crate::hatch;

const NANOS_PER_MILLI: u64 = 1_000_000;

/// The pictures of a view's viewers, one after the other.
#[derive(Default)]
pub(crate) struct Frames {
    /// Of the viewer whose picture was given last.
    shown: Option<PictureReader>,
    /// Of one that came after it and has no picture yet.
    next: Option<PictureReader>,
    /// Whether the viewer that drew it has ended.
    is_gone: bool,
    /// A copy of what was shown last, marked; empty where it is live.
    marked: Vec<u8>,
    state: u32,
}

/// What is given.
pub(crate) struct Given {
    pub(crate) numbers: Numbers,
    pub(crate) pixels: *const u8,
    pub(crate) state: u32,
    pub(crate) age_millis: u32,
    /// Whether it differs from what was given before.
    pub(crate) is_new: bool,
}

impl Frames {
    /// From here on another viewer draws; what the one before drew stays until that has
    /// something to show.
    pub(crate) fn follow(&mut self, reader: PictureReader) {
        self.next = Some(reader);
    }

    /// The viewer has ended: what it drew is dead.
    pub(crate) fn let_go(&mut self) {
        self.next = None;
        self.is_gone = true;
    }

    /// The newest picture; dead where the viewer did not stand by it for `silent_millis`. None before the
    /// first.
    pub(crate) fn give(&mut self, silent_millis: u64) -> Option<Given> {
        let mut is_new = false;
        if self.next.as_mut().is_some_and(PictureReader::take) {
            self.shown = self.next.take();
            self.is_gone = false;
            is_new = true;
        } else if !self.is_gone
            && let Some(shown) = &mut self.shown
        {
            is_new = shown.take();
        }
        let shown = self.shown.as_ref()?;
        let (mut numbers, mut pixels) = shown.picture()?;
        let (memory, now) = (shown.memory(), now());
        let age_nanos = now.saturating_sub(memory.last_true());
        let silence = now.saturating_sub(memory.last_confirmed());
        let is_dead = self.is_gone || silence > silent_millis * NANOS_PER_MILLI;
        let state = if is_dead { BUSBAR_VIEW_DEAD } else { BUSBAR_VIEW_LIVE };
        let has_turned = std::mem::replace(&mut self.state, state) != state;
        let [width, height] = numbers.size;
        if !is_new {
            numbers.damage = Area::default();
        }
        if has_turned {
            numbers.damage = Area { x: 0, y: 0, width, height };
        }
        if !is_dead {
            self.marked = Vec::new();
        } else {
            if is_new || self.marked.is_empty() {
                let bytes = bytes_of(numbers.size)?;
                // SAFETY: the reader's own picture, which the viewer has let go of. Were it
                // to write there all the same, it would be seen in the picture and nowhere else.
                let copy = unsafe { std::slice::from_raw_parts(pixels, bytes) };
                self.marked.clear();
                self.marked.extend_from_slice(copy);
                hatch::mark_dead(&mut self.marked, width as usize);
            }
            pixels = self.marked.as_ptr();
        }
        let age_millis = u32::try_from(age_nanos / NANOS_PER_MILLI).unwrap_or(u32::MAX);
        let is_new = is_new || has_turned;
        Some(Given { numbers, pixels, state: self.state, age_millis, is_new })
    }
}
