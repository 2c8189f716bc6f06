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
    BUSBAR_NO_TIME, BUSBAR_QUALITY_GOOD, BUSBAR_SAMPLE_BUFFERED, BUSBAR_VALUE_NONE, BusbarSample,
};
use busbar_tags::{Backlog, Moment, SourceTime, Update};
use memmap2::MmapRaw;

/// Samples that a ring holds; a power of two.
pub(crate) const RING_SAMPLES: usize = 1 << 18;
/// Samples read before the writer is informed of free room.
const PIECE_SAMPLES: u64 = 1 << 12;
/// Words of one sample: tag and small fields, value, source time, receive time.
const WORDS: usize = 4;
/// Words before the first sample, each counter on a cache line of its own.
const HEADER_WORDS: usize = 32;
/// Samples ever written; the writer's.
const WRITTEN: usize = 0;
/// Samples ever read; the reader's.
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
pub(crate) const RING_BYTES: u64 = ((HEADER_WORDS + RING_SAMPLES * WORDS) * 8) as u64;

/// A sample as it was written, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RawSample {
    pub(crate) sample: BusbarSample,
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

    fn has_value(&self) -> bool {
        self.sample.kind != BUSBAR_VALUE_NONE
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

    /// The words of the sample with this number.
    fn slot(&self, number: u64) -> &[AtomicU64; WORDS] {
        let slot = number as usize & (RING_SAMPLES - 1);
        // SAFETY: as above; these are the words from the header's end to that of the
        // mapping, and a slot is within it whatever its number.
        let slots = unsafe {
            let first = self.0.as_mut_ptr().cast::<u64>().add(HEADER_WORDS);
            std::slice::from_raw_parts(first.cast::<[AtomicU64; WORDS]>(), RING_SAMPLES)
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
    pub(crate) fn write(&mut self, samples: &[BusbarSample], published: Moment) -> bool {
        let room = if self.flush() { 0 } else { self.room() };
        let (now, later) = samples.split_at(samples.len().min(room));
        self.put(now.iter().map(|&sample| RawSample { sample, published }));
        later.iter().for_each(|&sample| self.backlog.push(RawSample { sample, published }));
        self.words.word(DROPPED).store(self.backlog.dropped(), Ordering::Relaxed);
        !self.backlog.is_empty()
    }

    /// Writes what waits, as far as there is room. Returns whether some still waits.
    pub(crate) fn flush(&mut self) -> bool {
        if self.backlog.is_empty() {
            return false;
        }
        let room = self.room();
        let mut backlog = std::mem::take(&mut self.backlog);
        self.put(backlog.drain(room));
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
        RING_SAMPLES.saturating_sub(self.written.wrapping_sub(read) as usize)
    }

    /// Writes samples for which there is room.
    fn put(&mut self, samples: impl Iterator<Item = RawSample>) {
        for RawSample { sample, published } in samples {
            let small = [sample.kind, sample.quality, sample.reason, sample.flags];
            let first = u64::from(sample.tag) | u64::from(u32::from_le_bytes(small)) << 32;
            let values = [first, sample.value, sample.source_time_unix_nanos as u64, published.0];
            for (word, value) in self.words.slot(self.written).iter().zip(values) {
                word.store(value, Ordering::Relaxed);
            }
            self.written = self.written.wrapping_add(1);
        }
        self.words.word(WRITTEN).store(self.written, Ordering::Release);
    }
}

impl RingReader {
    /// Reads from zeroed memory of [`RING_BYTES`] whose size is sealed.
    pub(crate) fn new(memory: &File) -> Result<Self, String> {
        Ok(Self { words: SharedWords::map(memory)?, read: 0 })
    }

    /// Reads the samples written up to now, the oldest first, each with the end of the last pause
    /// of the writer's process. Returns their number: at most [`RING_SAMPLES`], even from a
    /// hostile writer.
    #[inline(always)]
    pub(crate) fn read(&mut self, mut each: impl FnMut(RawSample, Moment)) -> u64 {
        let written = self.words.word(WRITTEN).load(Ordering::Acquire);
        let pause_end = Moment(self.words.word(PAUSE_END).load(Ordering::Relaxed));
        let waiting = written.wrapping_sub(self.read).min(RING_SAMPLES as u64);
        let mut next = written.wrapping_sub(waiting);
        while next != written {
            let piece = written.wrapping_sub(next).min(PIECE_SAMPLES);
            for i in 0..piece {
                each(self.copy(next.wrapping_add(i)), pause_end);
            }
            next = next.wrapping_add(piece);
            self.words.word(READ).store(next, Ordering::Release);
        }
        self.read = written;
        waiting
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
        let [first, value, source_time, published] =
            std::array::from_fn(|word| words[word].load(Ordering::Relaxed));
        let [kind, quality, reason, flags] = ((first >> 32) as u32).to_le_bytes();
        let sample = BusbarSample {
            tag: first as u32,
            kind,
            quality,
            reason,
            flags,
            value,
            source_time_unix_nanos: source_time as i64,
        };
        RawSample { sample, published: Moment(published) }
    }
}

#[cfg(test)]
#[path = "ring_tests.rs"]
mod tests;
