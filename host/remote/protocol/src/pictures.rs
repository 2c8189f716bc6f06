//! Pictures in shared memory: a viewer draws, a host program reads, neither waits.
//!
//! Triple buffering: one picture is the writer's, one the reader's, and the third lies between
//! them. It changes hands in one atomic exchange, so that nobody ever sees half a picture. Header
//! words that a crashed viewer left behind are checked before use.

use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use memmap2::MmapRaw;
use rustix::time::{ClockId, clock_gettime};

use crate::memory;
use crate::message::MAX_SIDE;

/// Bytes of a picture at most: 5120 x 2880 pixels fit.
pub const MAX_PICTURE_BYTES: usize = 64 << 20;
/// Bytes of a pixel: blue, green, red, and 255.
pub const PIXEL_BYTES: usize = 4;

const PICTURES: usize = 3;
/// Size of the header before the first picture, bytes; a whole number of pages.
const HEADER_BYTES: usize = 4096;
/// Size of the shared memory, bytes. Pages that no picture touches use no memory.
const MEMORY_BYTES: u64 = (HEADER_BYTES + PICTURES * MAX_PICTURE_BYTES) as u64;
/// Header word with the index of the picture between the two sides, and [`IS_NEW`].
const BETWEEN: usize = 0;
/// Instant of the last beat of the viewer's heartbeat.
const BEAT: usize = 8;
/// Header words with the instant of the values in the picture, and of its last confirmation.
const TRUE_AT: usize = 16;
const CONFIRMED: usize = 24;
/// End of the last turn of the frame loop, and its duration.
const TURN: usize = 32;
const TURN_NANOS: usize = 33;
/// First header word of the first picture's [`PictureInfo`]; those of the others follow.
const INFO: usize = 40;
const INFO_WORDS: usize = 8;
/// Position of the instant of a picture's values among its words.
const INFO_TRUE_AT: usize = 7;
/// Bit that is set while the reader has not taken the picture between the sides.
const IS_NEW: u64 = 4;

/// A part of a picture: x, y, width and height in pixels from the top left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Area {
    /// Column of the left edge.
    pub x: u32,
    /// Row of the top edge.
    pub y: u32,
    /// Number of columns, pixels.
    pub width: u32,
    /// Number of rows, pixels.
    pub height: u32,
}

/// Description of a picture beside its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PictureInfo {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Sequence number, greater by one than that of the previous picture.
    pub sequence: u64,
    /// Damaged area: pixels that may differ from the picture that the reader took before.
    pub damage: Area,
    /// Instant of the values that the picture was drawn of, on the clock of [`now`].
    pub true_at: u64,
}

/// Shared memory of three pictures with their header.
#[derive(Clone)]
pub struct PictureMemory {
    map: Arc<MmapRaw>,
}

/// Writing side of the shared memory, in the viewer.
pub struct PictureWriter {
    memory: PictureMemory,
    own: usize,
    sequence: u64,
    /// Damage accumulated since the last picture that the reader certainly took.
    damage: Area,
    size: [u32; 2],
}

/// Reading side of the shared memory, in the host program.
pub struct PictureReader {
    memory: PictureMemory,
    own: usize,
    info: Option<PictureInfo>,
}

/// Returns the present instant, nanoseconds of the clock since boot, which all processes share.
pub fn now() -> u64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Returns the bytes of a picture of this size; none where it has no pixel or too many.
pub fn picture_bytes([width, height]: [u32; 2]) -> Option<usize> {
    let is_side = |side| (1..=MAX_SIDE).contains(&side);
    let bytes = width as usize * height as usize * PIXEL_BYTES;
    (is_side(width) && is_side(height) && bytes <= MAX_PICTURE_BYTES).then_some(bytes)
}

impl PictureMemory {
    /// Makes memory of a size that nobody can change, and maps it.
    ///
    /// # Errors
    /// The kernel's.
    pub fn create() -> io::Result<(File, Self)> {
        let file = memory::zeroed("pictures", MEMORY_BYTES)?;
        let map = Self::open(&file)?;
        map.word(BETWEEN).store(2, Ordering::Release);
        Ok((file, map))
    }

    /// Maps the memory that [`PictureMemory::create`] made.
    ///
    /// # Errors
    /// The kernel's; memory of another size.
    pub fn open(file: &File) -> io::Result<Self> {
        if file.metadata()?.len() != MEMORY_BYTES {
            return Err(io::Error::other("this is no memory of pictures"));
        }
        Ok(Self { map: Arc::new(MmapRaw::map_raw(file)?) })
    }

    /// Records a heartbeat: the viewer's process runs, whatever its frame loop does.
    pub fn beat(&self) {
        self.word(BEAT).store(now(), Ordering::Release);
    }

    /// Returns the instant of the last heartbeat, on the clock of [`now`]; 0 before the first.
    pub fn last_beat(&self) -> u64 {
        self.word(BEAT).load(Ordering::Acquire)
    }

    /// Records that the frame loop finished a turn, with a new picture or without.
    pub fn note_turn(&self, took: Duration) {
        let nanos = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.word(TURN_NANOS).store(nanos, Ordering::Relaxed);
        self.word(TURN).store(now(), Ordering::Release);
    }

    /// Returns the end of the frame loop's last turn, on the clock of [`now`]; 0 before the first.
    pub fn last_turn(&self) -> u64 {
        self.word(TURN).load(Ordering::Acquire)
    }

    /// Returns the duration of the frame loop's last turn.
    pub fn turn_time(&self) -> Duration {
        Duration::from_nanos(self.word(TURN_NANOS).load(Ordering::Relaxed))
    }

    /// Returns the instant of the values that the picture shows, on the clock of [`now`].
    pub fn last_true(&self) -> u64 {
        self.word(TRUE_AT).load(Ordering::Acquire)
    }

    /// Returns the instant at which the viewer last published or confirmed a picture, on the clock
    /// of [`now`].
    pub fn last_confirmed(&self) -> u64 {
        self.word(CONFIRMED).load(Ordering::Acquire)
    }

    /// Confirms that the picture shown still agrees with the values of the instant `at`.
    pub fn confirm(&self, at: u64) {
        self.word(TRUE_AT).store(at, Ordering::Release);
        self.word(CONFIRMED).store(now(), Ordering::Release);
    }

    fn word(&self, index: usize) -> &AtomicU64 {
        assert!(index < HEADER_BYTES / size_of::<u64>());
        // SAFETY: within the header, page-aligned; only ever accessed as atomic words.
        unsafe { AtomicU64::from_ptr(self.map.as_mut_ptr().cast::<u64>().add(index)) }
    }

    /// Returns the first byte of a picture; [`MAX_PICTURE_BYTES`] follow.
    fn pixels(&self, picture: usize) -> *mut u8 {
        assert!(picture < PICTURES);
        // SAFETY: within the mapping, whose size is checked and sealed.
        unsafe { self.map.as_mut_ptr().add(HEADER_BYTES + picture * MAX_PICTURE_BYTES) }
    }

    fn info_words(&self, picture: usize) -> [&AtomicU64; INFO_WORDS] {
        std::array::from_fn(|i| self.word(INFO + picture * INFO_WORDS + i))
    }

    /// Puts a picture between the sides, and takes the one that lay there. Returns its index, and
    /// whether it was new.
    fn exchange(&self, picture: usize, is_new: bool) -> (usize, bool) {
        let put = picture as u64 | if is_new { IS_NEW } else { 0 };
        let got = self.word(BETWEEN).swap(put, Ordering::AcqRel);
        ((got & 3) as usize, got & IS_NEW != 0)
    }
}

impl PictureWriter {
    /// Creates the writer; each memory has one.
    pub fn new(memory: PictureMemory) -> Self {
        Self { memory, own: 0, sequence: 0, damage: Area::default(), size: [0; 2] }
    }

    /// Returns the memory that the writer fills.
    pub fn memory(&self) -> &PictureMemory {
        &self.memory
    }

    /// Publishes a picture that `fill` writes, drawn of values at the instant `at`.
    /// `changed` is what differs from the one before.
    ///
    /// # Errors
    /// A size that has no room.
    pub fn publish(
        &mut self,
        size: [u32; 2],
        changed: Area,
        at: u64,
        fill: impl FnOnce(&mut [u8]),
    ) -> io::Result<()> {
        let bytes =
            picture_bytes(size).ok_or_else(|| io::Error::other("a picture without room"))?;
        // SAFETY: the writer's own picture: the reader reaches it only after the exchange
        // below, and `own` is another one by then.
        fill(unsafe { std::slice::from_raw_parts_mut(self.memory.pixels(self.own), bytes) });
        let whole = Area { x: 0, y: 0, width: size[0], height: size[1] };
        let before = std::mem::replace(&mut self.size, size);
        self.damage = if before == size { self.damage.union(changed) } else { whole };
        self.sequence += 1;
        let Area { x, y, width, height } = self.damage;
        let pairs = [size[0], size[1], x, y, width, height].map(u64::from);
        let words = self.memory.info_words(self.own);
        words[0].store(self.sequence, Ordering::Relaxed);
        words[1..].iter().zip(pairs).for_each(|(word, n)| word.store(n, Ordering::Relaxed));
        words[INFO_TRUE_AT].store(at, Ordering::Relaxed);
        let (own, was_new) = self.memory.exchange(self.own, true);
        // Only now: a reader that still has the picture before must not take this for its own.
        self.memory.confirm(at);
        self.own = own;
        if !was_new {
            // The one before was taken: only what came after it is damage from here on.
            self.damage = if before == size { changed } else { whole };
        }
        Ok(())
    }
}

impl PictureReader {
    /// Creates the reader; each memory has one.
    pub fn new(memory: PictureMemory) -> Self {
        Self { memory, own: 1, info: None }
    }

    /// The memory it reads.
    pub fn memory(&self) -> &PictureMemory {
        &self.memory
    }

    /// Takes the newest picture, if there is one that was not taken; whether there is.
    pub fn take(&mut self) -> bool {
        if self.memory.word(BETWEEN).load(Ordering::Acquire) & IS_NEW == 0 {
            return false;
        }
        let (own, _) = self.memory.exchange(self.own, false);
        if own >= PICTURES {
            self.info = None;
            return false;
        }
        self.own = own;
        self.info = self.read_info();
        self.info.is_some()
    }

    /// The picture taken last: what is said of it, and its pixels from the top left, row by
    /// row, blue first. They stay as they are until the next is taken.
    pub fn picture(&self) -> Option<(PictureInfo, *const u8)> {
        self.info.map(|info| (info, self.memory.pixels(self.own).cast_const()))
    }

    /// Copies the pixels of the picture taken last; what is said of it.
    pub fn copy(&self, pixels: &mut Vec<u8>) -> Option<PictureInfo> {
        let (info, first) = self.picture()?;
        let bytes = picture_bytes(info.size)?;
        // SAFETY: the reader's own picture, which the viewer has let go of, and that many bytes
        // fit. Were it to write there all the same, it would be seen in the picture and
        // nowhere else.
        let own = unsafe { std::slice::from_raw_parts(first, bytes) };
        pixels.clear();
        pixels.extend_from_slice(own);
        Some(info)
    }

    /// Instant of the values that the picture taken last shows: that it was drawn of, or a later
    /// one at which the viewer found it to be the same. None before the first.
    pub fn true_at(&self) -> Option<u64> {
        let own = self.info?.true_at;
        let confirmed = self.memory.last_true();
        // One that was published since may be what was confirmed.
        let is_newest = self.memory.word(BETWEEN).load(Ordering::Acquire) & IS_NEW == 0;
        Some(if is_newest { own.max(confirmed) } else { own })
    }

    /// Reads the description of a picture; none where its words are invalid.
    fn read_info(&self) -> Option<PictureInfo> {
        let [sequence, rest @ .., true_at] =
            self.memory.info_words(self.own).map(|w| w.load(Ordering::Relaxed));
        let rest = rest.map(|number| u32::try_from(number).unwrap_or(u32::MAX));
        let [width, height, x, y, columns, rows] = rest;
        picture_bytes([width, height])?;
        let (x, y) = (x.min(width), y.min(height));
        let damage = Area { x, y, width: columns.min(width - x), height: rows.min(height - y) };
        Some(PictureInfo { size: [width, height], sequence, damage, true_at })
    }
}

impl Area {
    /// Reports whether the area has no pixel.
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// The least area around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        if self.is_empty() {
            return other;
        }
        if other.is_empty() {
            return self;
        }
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = (self.x + self.width).max(other.x + other.width);
        let bottom = (self.y + self.height).max(other.y + other.height);
        Self { x, y, width: right - x, height: bottom - y }
    }

    /// The least area around all pixels in which two pictures of one size differ.
    pub fn from_difference(before: &[u8], after: &[u8], width: u32) -> Self {
        let stride = width as usize * PIXEL_BYTES;
        let mut area = Self::default();
        for (y, (one, other)) in before.chunks(stride).zip(after.chunks(stride)).enumerate() {
            let differs = |(a, b): (&[u8], &[u8])| a != b;
            if one == other {
                continue;
            }
            let pixels = || one.chunks(PIXEL_BYTES).zip(other.chunks(PIXEL_BYTES));
            let first = pixels().position(differs).unwrap_or(0) as u32;
            let last = pixels().rposition(differs).unwrap_or(0) as u32;
            let row = Self { x: first, y: y as u32, width: last + 1 - first, height: 1 };
            area = area.union(row);
        }
        area
    }
}

#[cfg(test)]
mod tests;
