//! Samples through shared memory: one process writes, the other reads.
//!
//! The writer never waits: when the ring is full it overwrites the oldest
//! samples, which the reader notices and counts. Two counters, of samples ever
//! written, make that safe (a seqlock in the manner of H.-J. Boehm, "Can Seqlocks
//! Get Along With Programming Language Memory Models?", MSPC 2012): the writer
//! moves `reserved` before it touches slots and `written` after; the reader
//! copies a piece of what is written, then throws it away if it has been reserved
//! again.
//!
//! The other process may be hostile and change anything at any time. So the
//! memory is only ever accessed as atomic words, through bounded indices, and
//! copied out before it is looked at.

use std::fs::File;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use busbar_plugin_abi::BusbarSample;
use memmap2::MmapRaw;

/// Samples that a ring holds; a power of two.
pub(crate) const RING_SAMPLES: usize = 1 << 18;
/// Samples that are copied before a look at whether they were overwritten.
const PIECE_SAMPLES: usize = 1 << 12;
/// Pieces of one reading, those that were overwritten among them.
const MAX_PIECES: usize = 2 * RING_SAMPLES / PIECE_SAMPLES;
/// Words of one sample: tag and small fields, value, source time, receive time.
const WORDS: usize = 4;
/// Words before the first sample, each counter on a cache line of its own.
const HEADER_WORDS: usize = 32;
const RESERVED: usize = 0;
const WRITTEN: usize = 8;
const REJECTED: usize = 16;
/// Bytes of shared memory.
pub(crate) const RING_BYTES: u64 = ((HEADER_WORDS + RING_SAMPLES * WORDS) * 8) as u64;

/// A sample as it was written, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RawSample {
    pub(crate) sample: BusbarSample,
    /// Nanoseconds of the monotonic clock that all processes share.
    pub(crate) monotonic_nanos: u64,
}

/// The shared words.
struct Words(MmapRaw);

/// The end that a plugin's process writes to. One thread at a time.
pub(crate) struct RingWriter {
    words: Words,
    written: u64,
}

/// The end that the host reads.
pub(crate) struct RingReader {
    words: Words,
    read: u64,
    dropped: u64,
}

impl Words {
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
    fn slot(&self, number: u64) -> [&AtomicU64; WORDS] {
        let slot = number as usize & (RING_SAMPLES - 1);
        std::array::from_fn(|word| self.word(HEADER_WORDS + slot * WORDS + word))
    }
}

impl RingWriter {
    /// Writes into memory that [`RingReader`] made.
    pub(crate) fn new(memory: &File) -> Result<Self, String> {
        let words = Words::map(memory)?;
        let written = words.word(WRITTEN).load(Ordering::Acquire);
        Ok(Self { words, written })
    }

    /// Adds samples, over the oldest ones where there is no room; returns how
    /// many stay.
    pub(crate) fn write(&mut self, samples: &[BusbarSample], monotonic_nanos: u64) -> usize {
        let skipped = samples.len().saturating_sub(RING_SAMPLES);
        let end = self.written + samples.len() as u64;
        self.words.word(RESERVED).store(end, Ordering::Relaxed);
        // No slot is seen changed by who does not see it reserved.
        fence(Ordering::Release);
        for (number, sample) in (self.written + skipped as u64..).zip(&samples[skipped..]) {
            let small = [sample.kind, sample.quality, sample.reason, 0];
            let first = u64::from(sample.tag) | u64::from(u32::from_le_bytes(small)) << 32;
            let values =
                [first, sample.value, sample.source_time_unix_nanos as u64, monotonic_nanos];
            for (word, value) in self.words.slot(number).into_iter().zip(values) {
                word.store(value, Ordering::Relaxed);
            }
        }
        self.words.word(WRITTEN).store(end, Ordering::Release);
        self.written = end;
        samples.len() - skipped
    }

    /// Counts samples that came in no usable batch.
    pub(crate) fn reject(&self, count: u64) {
        self.words.word(REJECTED).fetch_add(count, Ordering::Relaxed);
    }
}

impl RingReader {
    /// Reads from zeroed memory of [`RING_BYTES`] whose size is sealed.
    pub(crate) fn new(memory: &File) -> Result<Self, String> {
        Ok(Self { words: Words::map(memory)?, read: 0, dropped: 0 })
    }

    /// Copies what was written since the last call, the oldest first, at most
    /// [`RING_SAMPLES`]. A writer that overtakes this while it reads makes it go on in
    /// the middle of the ring: the newest samples come through, however fast it is.
    pub(crate) fn read(&mut self) -> Vec<RawSample> {
        let mut samples = Vec::new();
        let mut written = self.words.word(WRITTEN).load(Ordering::Acquire);
        // More than a ring: overwritten. Whatever a hostile writer puts there,
        // no more than a ring is read.
        self.keep(written, RING_SAMPLES);
        for _ in 0..MAX_PIECES {
            let count = written.wrapping_sub(self.read).min(PIECE_SAMPLES as u64);
            if count == 0 || samples.len() + count as usize > RING_SAMPLES {
                break;
            }
            let before = samples.len();
            samples.extend((0..count).map(|i| self.copy(self.read.wrapping_add(i))));
            fence(Ordering::Acquire);
            let reserved = self.words.word(RESERVED).load(Ordering::Relaxed);
            // Slots from `reserved - RING_SAMPLES` backwards may have changed meanwhile.
            let overtaken = reserved.wrapping_sub(self.read) > RING_SAMPLES as u64;
            if overtaken {
                samples.truncate(before);
                self.dropped = self.dropped.saturating_add(count);
            }
            self.read = self.read.wrapping_add(count);
            if overtaken {
                written = self.words.word(WRITTEN).load(Ordering::Acquire);
                self.keep(written, RING_SAMPLES / 2);
            }
        }
        samples
    }

    /// Gives up all but the newest samples that wait.
    fn keep(&mut self, written: u64, count: usize) {
        let lost = written.wrapping_sub(self.read).saturating_sub(count as u64);
        self.read = self.read.wrapping_add(lost);
        self.dropped = self.dropped.saturating_add(lost);
    }

    /// Samples lost because they were not read in time.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Samples that the writer counted as unusable.
    pub(crate) fn rejected(&self) -> u64 {
        self.words.word(REJECTED).load(Ordering::Relaxed)
    }

    fn copy(&self, number: u64) -> RawSample {
        let [first, value, source_time, monotonic_nanos] =
            self.words.slot(number).map(|word| word.load(Ordering::Relaxed));
        let [kind, quality, reason, reserved] = ((first >> 32) as u32).to_le_bytes();
        let sample = BusbarSample {
            tag: first as u32,
            kind,
            quality,
            reason,
            reserved,
            value,
            source_time_unix_nanos: source_time as i64,
        };
        RawSample { sample, monotonic_nanos }
    }
}

#[cfg(test)]
#[path = "ring_tests.rs"]
mod tests;
