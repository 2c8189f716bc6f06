//! The picture as the program gets it: of the viewer, or marked dead.

use std::time::Duration;

use busbar_protocol::pictures::{Area, Numbers, PictureReader, now};

use crate::hatch;

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
    /// Whether the one given last was dead.
    was_dead: bool,
}

/// What is given.
pub struct Given {
    /// Size, number, and what may differ from what was given before.
    pub numbers: Numbers,
    /// The first pixel: blue, green, red and 255, rows from the top. Stays as it is until the
    /// next is given.
    pub pixels: *const u8,
    /// Whether nobody stands by it: it has been hatched.
    pub is_dead: bool,
    /// How long ago it was true.
    pub age: Duration,
    /// Whether it differs from what was given before.
    pub is_new: bool,
}

/// What is said of a picture that is copied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Copied {
    /// Size, number, and what may differ from what was copied before.
    pub numbers: Numbers,
    /// Whether nobody stands by what was copied last.
    pub is_dead: bool,
    /// How long ago that was true.
    pub age: Duration,
    /// Whether it was copied: it is live, and differs from what was copied before.
    pub is_new: bool,
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

    /// The newest picture; dead where the viewer did not stand by it for `silent`. None
    /// before the first.
    pub(crate) fn give(&mut self, silent: Duration) -> Option<Given> {
        let Copied { mut numbers, is_dead, age, mut is_new } = self.look(silent)?;
        if std::mem::replace(&mut self.was_dead, is_dead) != is_dead {
            numbers.damage = whole(numbers);
            is_new = true;
        }
        let shown = self.shown.as_ref()?;
        let (_, mut pixels) = shown.picture()?;
        if !is_dead {
            self.marked = Vec::new();
        } else {
            if is_new || self.marked.is_empty() {
                shown.copy(&mut self.marked)?;
                hatch::mark_dead(&mut self.marked, numbers.size[0] as usize);
            }
            pixels = self.marked.as_ptr();
        }
        Some(Given { numbers, pixels, is_dead, age, is_new })
    }

    /// Copies the newest picture where it is live and new. None before the first.
    pub(crate) fn copy(&mut self, silent: Duration, pixels: &mut Vec<u8>) -> Option<Copied> {
        let mut seen = self.look(silent)?;
        // One that came at the end of its viewer was not copied; there is a whole one after it.
        self.was_dead |= seen.is_dead;
        if seen.is_dead {
            seen.is_new = false;
        } else if std::mem::take(&mut self.was_dead) {
            seen.numbers.damage = whole(seen.numbers);
            seen.is_new = true;
        }
        if seen.is_new {
            self.shown.as_ref()?.copy(pixels)?;
        }
        Some(seen)
    }

    /// Takes the newest picture; what is said of it.
    fn look(&mut self, silent: Duration) -> Option<Copied> {
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
        let (mut numbers, _) = shown.picture()?;
        if !is_new {
            numbers.damage = Area::default();
        }
        let since = |then: u64| Duration::from_nanos(now().saturating_sub(then));
        let memory = shown.memory();
        let is_dead = self.is_gone || since(memory.last_confirmed()) > silent;
        Some(Copied { numbers, is_dead, age: since(memory.last_true()), is_new })
    }
}

fn whole(numbers: Numbers) -> Area {
    let [width, height] = numbers.size;
    Area { x: 0, y: 0, width, height }
}
