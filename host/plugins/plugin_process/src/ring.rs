//! Samples through shared memory: one process writes, the other reads.
//!
//! The writer never waits and never overwrites what was not read. What finds no room
//! waits in the writer's own memory, thinned out so that it stays bounded and no tag
//! is forgotten ([`Backlog`]), until the reader has made room.
//!
//! The other process may be hostile and change anything at any time. So the memory is
//! only ever accessed as atomic words, through bounded indices, and copied out before
//! it is looked at.

use std::fs::File;
use std::sync::atomic::{AtomicU64, Ordering};

use busbar_plugin_abi::{
    BUSBAR_NO_TIME, BUSBAR_QUALITY_GOOD, BUSBAR_SAMPLE_BUFFERED, BUSBAR_VALUE_KIND_NONE,
    BUSBAR_VALUE_KIND_TEXT,
};
use busbar_plugin_host::PublishedSample;
use busbar_tags::{Backlog, Moment, SourceTime, Update};
use busbar_types::{MAX_TEXT_BYTES, Text};
use memmap2::MmapRaw;

/// Slots of a ring, a power of two. A sample takes one, and one that is a text takes one more for
/// every [`SLOT_BYTES`] of it.
pub(crate) const RING_SLOTS: usize = 1 << 18;
/// Slots read before the writer is informed of free room.
const PIECE_SLOTS: u64 = 1 << 12;
/// Words of one sample: tag and small fields, value, source time, receive time. The value of a text
/// is its length; its bytes follow.
const WORDS: usize = 4;
/// Bytes of text that a slot holds.
const SLOT_BYTES: usize = WORDS * 8;
/// Words before the first sample, each counter on a cache line of its own.
const HEADER_WORDS: usize = 32;
/// Slots ever written; the writer's.
const WRITTEN: usize = 0;
/// Slots ever read; the reader's.
const READ: usize = 8;
/// Samples that came in no usable batch; the writer's.
const REJECTED: usize = 16;
/// Samples overtaken by later ones of their tags; the writer's.
const DROPPED: usize = 24;
/// End of the last pause of the writer's process; the writer's.
const PAUSE_END: usize = 25;
/// `BUSBAR_ORIGIN_*` of all samples, as the plugin declares it; the writer's.
const ORIGIN: usize = 26;
/// Time that the values are of, nanoseconds since 1970-01-01 UTC, where that is not now;
/// 0 for none. The writer's.
const SCENE_TIME: usize = 27;
/// Bytes of shared memory.
pub(crate) const RING_BYTES: u64 = ((HEADER_WORDS + RING_SLOTS * WORDS) * 8) as u64;

/// A sample as it was written, and when.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RawSample {
    pub(crate) sample: PublishedSample,
    /// Time of publication, on the clock that all processes share.
    pub(crate) published: Moment,
}

/// Words of the shared memory.
struct SharedWords(MmapRaw);

/// The end that a plugin's process writes to. One thread at a time.
pub(crate) struct RingWriter {
    words: SharedWords,
    written: u64,
    backlog: Backlog<RawSample>,
}

/// The end that the host reads.
pub(crate) struct RingReader {
    words: SharedWords,
    read: u64,
}

impl Update for RawSample {
    fn tag(&self) -> u32 {
        self.sample.tag
    }

    fn weight(&self) -> usize {
        slots(&self.sample)
    }

    fn has_value(&self) -> bool {
        self.sample.kind != BUSBAR_VALUE_KIND_NONE
    }

    fn is_good(&self) -> bool {
        self.sample.quality == BUSBAR_QUALITY_GOOD
    }

    fn source_nanos(&self) -> Option<i64> {
        let nanos = self.sample.source_time_unix_nanos;
        (nanos != BUSBAR_NO_TIME).then_some(nanos)
    }

    fn buffered_time(&self) -> Option<i64> {
        self.source_nanos().filter(|_| self.sample.flags & BUSBAR_SAMPLE_BUFFERED != 0)
    }
}

impl SharedWords {
    fn map(memory: &File) -> Result<Self, String> {
        let fault = |error: std::io::Error| format!("shared memory cannot be used: {error}");
        let length = memory.metadata().map_err(fault)?.len();
        if length != RING_BYTES {
            return Err(format!("a ring has {RING_BYTES} bytes, this memory {length}"));
        }
        MmapRaw::map_raw(memory).map(Self).map_err(fault)
    }

    fn word(&self, index: usize) -> &AtomicU64 {
        assert!(index < RING_BYTES as usize / 8);
        // SAFETY: within the mapping, whose length is checked when it is made and
        // sealed; page-aligned; only ever accessed as atomic words, by both sides.
        unsafe { AtomicU64::from_ptr(self.0.as_mut_ptr().cast::<u64>().add(index)) }
    }

    /// The words of the slot with this number.
    fn slot(&self, number: u64) -> &[AtomicU64; WORDS] {
        let slot = number as usize & (RING_SLOTS - 1);
        // SAFETY: as above; these are the words from the header's end to that of the
        // mapping, and a slot is within it whatever its number.
        let slots = unsafe {
            let first = self.0.as_mut_ptr().cast::<u64>().add(HEADER_WORDS);
            std::slice::from_raw_parts(first.cast::<[AtomicU64; WORDS]>(), RING_SLOTS)
        };
        &slots[slot]
    }
}

impl RingWriter {
    /// Writes into memory that [`RingReader`] made.
    pub(crate) fn new(memory: &File) -> Result<Self, String> {
        let words = SharedWords::map(memory)?;
        let written = words.word(WRITTEN).load(Ordering::Acquire);
        Ok(Self { words, written, backlog: Backlog::default() })
    }

    /// Adds samples, behind those that wait. Returns whether any has to wait, for
    /// [`Self::flush`].
    pub(crate) fn write(
        &mut self,
        samples: impl IntoIterator<Item = PublishedSample>,
        published: Moment,
    ) -> bool {
        let mut room = if self.flush() { 0 } else { self.room() };
        for sample in samples {
            let sample = RawSample { sample, published };
            // What comes after one that waits waits, too.
            match room.checked_sub(slots(&sample.sample)) {
                Some(left) if self.backlog.is_empty() => {
                    room = left;
                    self.put(&sample);
                }
                _ => self.backlog.push(sample),
            }
        }
        self.words.word(WRITTEN).store(self.written, Ordering::Release);
        self.words.word(DROPPED).store(self.backlog.dropped(), Ordering::Relaxed);
        !self.backlog.is_empty()
    }

    /// Writes what waits, as far as there is room. Returns whether some still waits.
    pub(crate) fn flush(&mut self) -> bool {
        if self.backlog.is_empty() {
            return false;
        }
        let mut room = self.room();
        let mut count = 0;
        for sample in self.backlog.iter() {
            let Some(left) = room.checked_sub(slots(&sample.sample)) else { break };
            (room, count) = (left, count + 1);
        }
        let mut backlog = std::mem::take(&mut self.backlog);
        backlog.drain(count).for_each(|sample| self.put(&sample));
        self.words.word(WRITTEN).store(self.written, Ordering::Release);
        self.backlog = backlog;
        !self.backlog.is_empty()
    }

    /// Counts samples that came in no usable batch.
    pub(crate) fn reject(&self, count: u64) {
        self.words.word(REJECTED).fetch_add(count, Ordering::Relaxed);
    }

    /// Reports the end of a pause of this process: later samples may be old.
    pub(crate) fn note_pause(&self, end: Moment) {
        self.words.word(PAUSE_END).store(end.0, Ordering::Relaxed);
    }

    /// Sets the `BUSBAR_ORIGIN_*` flags of all samples, as the plugin declares them.
    pub(crate) fn note_origin(&self, flags: u8) {
        self.words.word(ORIGIN).store(u64::from(flags), Ordering::Relaxed);
    }

    /// Sets the time that the values belong to, where that is not now.
    pub(crate) fn note_scene_time(&self, time: Option<SourceTime>) {
        let nanos = time.map_or(0, |time| time.0);
        self.words.word(SCENE_TIME).store(nanos as u64, Ordering::Relaxed);
    }

    fn room(&self) -> usize {
        let read = self.words.word(READ).load(Ordering::Acquire);
        RING_SLOTS.saturating_sub(self.written.wrapping_sub(read) as usize)
    }

    /// Writes a sample for which there is room. The reader sees it once the count is stored.
    #[inline]
    fn put(&mut self, RawSample { sample, published }: &RawSample) {
        let small = [sample.kind, sample.quality, sample.reason, sample.flags];
        let first = u64::from(sample.tag) | u64::from(u32::from_le_bytes(small)) << 32;
        let length = |text: &Text| text.as_str().len() as u64;
        let value = sample.text.as_ref().map_or(sample.bits, length);
        self.put_slot([first, value, sample.source_time_unix_nanos as u64, published.0]);
        if let Some(text) = &sample.text {
            self.put_text(text);
        }
    }

    #[cold]
    fn put_text(&mut self, text: &Text) {
        for part in text.as_str().as_bytes().chunks(SLOT_BYTES) {
            let mut words = [0; WORDS];
            for (word, bytes) in words.iter_mut().zip(part.chunks(8)) {
                let mut whole = [0; 8];
                whole[..bytes.len()].copy_from_slice(bytes);
                *word = u64::from_le_bytes(whole);
            }
            self.put_slot(words);
        }
    }

    #[inline]
    fn put_slot(&mut self, values: [u64; WORDS]) {
        for (word, value) in self.words.slot(self.written).iter().zip(values) {
            word.store(value, Ordering::Relaxed);
        }
        self.written = self.written.wrapping_add(1);
    }
}

/// Slots that a sample takes.
#[inline]
fn slots(sample: &PublishedSample) -> usize {
    let text = sample.text.as_ref().map_or(0, |text| text.as_str().len());
    1 + text.div_ceil(SLOT_BYTES)
}

impl RingReader {
    /// Reads from zeroed memory of [`RING_BYTES`] whose size is sealed.
    pub(crate) fn new(memory: &File) -> Result<Self, String> {
        Ok(Self { words: SharedWords::map(memory)?, read: 0 })
    }

    /// Reads the samples written up to now, the oldest first, each with the end of the last pause
    /// of the writer's process. Reads at most [`RING_SLOTS`] slots, even from a hostile writer.
    #[inline(always)]
    pub(crate) fn read(&mut self, mut each: impl FnMut(RawSample, Moment)) {
        let written = self.words.word(WRITTEN).load(Ordering::Acquire);
        let pause_end = Moment(self.words.word(PAUSE_END).load(Ordering::Relaxed));
        let waiting = written.wrapping_sub(self.read).min(RING_SLOTS as u64);
        let mut next = written.wrapping_sub(waiting);
        let mut told = next;
        while next != written {
            let mut sample = self.copy(next);
            next = next.wrapping_add(1);
            if sample.sample.kind == BUSBAR_VALUE_KIND_TEXT {
                let left = written.wrapping_sub(next);
                let (text, slots) = self.copy_text(next, sample.sample.bits, left);
                (sample.sample.text, sample.sample.bits) = (text, 0);
                next = next.wrapping_add(slots);
            }
            each(sample, pause_end);
            if next.wrapping_sub(told) >= PIECE_SLOTS {
                told = next;
                self.words.word(READ).store(next, Ordering::Release);
            }
        }
        self.words.word(READ).store(written, Ordering::Release);
        self.read = written;
    }

    /// Copies a text whose bytes begin at a slot, and returns it with the slots that it takes. A
    /// text that the writer left incomplete is none; it takes the slots that are `left` at most.
    #[cold]
    fn copy_text(&self, first: u64, len: u64, left: u64) -> (Option<Text>, u64) {
        let slots = len.div_ceil(SLOT_BYTES as u64);
        if len > MAX_TEXT_BYTES as u64 || slots > left {
            return (None, slots.min(left));
        }
        let slot = |number: u64| self.words.slot(first.wrapping_add(number)).iter();
        let words = (0..slots).flat_map(slot).map(|word| word.load(Ordering::Relaxed));
        let mut bytes: Vec<u8> = words.flat_map(u64::to_le_bytes).collect();
        bytes.truncate(len as usize);
        (Some(Text::from_utf8_lossy(&bytes)), slots)
    }

    /// `BUSBAR_ORIGIN_*` of all samples, as the plugin declares it.
    pub(crate) fn origin(&self) -> u8 {
        self.words.word(ORIGIN).load(Ordering::Acquire) as u8
    }

    /// Time that the values are of, where that is not now.
    pub(crate) fn scene_time(&self) -> Option<SourceTime> {
        let nanos = self.words.word(SCENE_TIME).load(Ordering::Relaxed) as i64;
        (nanos != 0).then_some(SourceTime(nanos))
    }

    /// Returns the writer's count of overtaken samples.
    pub(crate) fn dropped(&self) -> u64 {
        self.words.word(DROPPED).load(Ordering::Relaxed)
    }

    /// Samples that the writer counted as unusable.
    pub(crate) fn rejected(&self) -> u64 {
        self.words.word(REJECTED).load(Ordering::Relaxed)
    }

    #[inline]
    fn copy(&self, number: u64) -> RawSample {
        let words = self.words.slot(number);
        let [first, bits, source_time, published] =
            std::array::from_fn(|word| words[word].load(Ordering::Relaxed));
        let [kind, quality, reason, flags] = ((first >> 32) as u32).to_le_bytes();
        let sample = PublishedSample {
            tag: first as u32,
            kind,
            quality,
            reason,
            flags,
            bits,
            source_time_unix_nanos: source_time as i64,
            text: None,
        };
        RawSample { sample, published: Moment(published) }
    }
}

#[cfg(test)]
#[path = "ring_tests.rs"]
mod tests;
