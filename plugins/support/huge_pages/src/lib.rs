//! Huge pages under large blocks of memory (madvise(2), `MADV_HUGEPAGE`), while the system
//! gives them fast: for the heap of the host, and for large arrays of plugins.
//!
//! What touches hundreds of megabytes once spends up to a third of its time on faulting them in
//! by 4 KiB. Where memory is in pieces, or a virtual machine has given what it had free back to
//! its host, it is the other way round: a huge page takes milliseconds, while small ones are at
//! hand. So some are timed, and once two in a row were slow, this process asks for no more.
//!
//! Invariants: nothing here allocates, as an allocator calls it; no content changes but by the
//! caller's own hand.

use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

/// Least size of a block that certainly contains a huge page, bytes.
pub const LARGE_BLOCK_BYTES: usize = 4 << 20;
/// Size of a huge page on x86-64, and on `AArch64` with pages of 4 KiB.
pub const HUGE_PAGE_BYTES: usize = 2 << 20;

/// Time from which a huge page is slow: far longer than small pages in its place take.
const SLOW: Duration = Duration::from_millis(2);
/// Consecutive slow huge pages after which no more are requested.
const MAX_SLOW_PAGES: u8 = 2;
/// Sampling rate: one huge page in so many is timed, for a block's capacity may never be touched.
const TIMED: usize = 8;

/// Observed speed of huge pages in this process.
static SPEED: Speed = Speed::new();

/// Reports whether huge pages are worth requesting under a block of this size.
pub fn are_worth(bytes: usize) -> bool {
    bytes >= LARGE_BLOCK_BYTES && !SPEED.is_slow()
}

/// Requests huge pages where they lie wholly within a block, and times some behind its used part.
/// `touch` receives the first byte of each of those, and must write to it. Returns whether they
/// were slow: then the rest of the block is without them.
pub fn ask(block: *mut u8, bytes: usize, used_bytes: usize, touch: impl Fn(*mut u8)) -> bool {
    ask_timed(&SPEED, block, bytes, used_bytes, |page| {
        let start = cpu_time();
        touch(page);
        cpu_time().saturating_sub(start)
    })
}

fn ask_timed(
    speed: &Speed,
    block: *mut u8,
    bytes: usize,
    used_bytes: usize,
    time: impl Fn(*mut u8) -> Duration,
) -> bool {
    let pages = Pages::within(block, bytes);
    pages.advise(PageSize::Huge);
    let used = (block.addr() + used_bytes).saturating_sub(pages.start.addr());
    let mut page = used.next_multiple_of(HUGE_PAGE_BYTES);
    while page < pages.bytes {
        let is_fast = speed.note(time(pages.start.wrapping_add(page)));
        // After a slow one, the next tells whether that was by chance.
        page += if is_fast { TIMED * HUGE_PAGE_BYTES } else { HUGE_PAGE_BYTES };
        if speed.is_slow() {
            pages.from(page).advise(PageSize::Small);
            return true;
        }
    }
    false
}

/// Number of consecutive huge pages that were slow.
struct Speed(AtomicU8);

impl Speed {
    const fn new() -> Self {
        Self(AtomicU8::new(0))
    }

    fn is_slow(&self) -> bool {
        self.0.load(Ordering::Relaxed) >= MAX_SLOW_PAGES
    }

    /// Records the time of one page; returns whether it was fast.
    fn note(&self, took: Duration) -> bool {
        if took < SLOW {
            self.0.store(0, Ordering::Relaxed);
            return true;
        }
        self.0.fetch_add(1, Ordering::Relaxed);
        false
    }
}

/// Page size requested from now on; existing pages stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageSize {
    /// Pages of 2 MiB.
    Huge,
    /// Pages of 4 KiB.
    Small,
}

/// Part of a memory block that is whole huge pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pages {
    start: *mut u8,
    bytes: usize,
}

impl Pages {
    /// Returns the whole huge pages within a block.
    pub fn within(block: *mut u8, bytes: usize) -> Self {
        let before = block.align_offset(HUGE_PAGE_BYTES).min(bytes);
        let whole = (bytes - before) & !(HUGE_PAGE_BYTES - 1);
        Self { start: block.wrapping_add(before), bytes: whole }
    }

    /// Returns the pages without those before an offset.
    fn from(self, before: usize) -> Self {
        let bytes = self.bytes.saturating_sub(before);
        Self { start: self.start.wrapping_add(before), bytes }
    }

    /// Returns the address of the first page.
    pub fn start(self) -> *mut u8 {
        self.start
    }

    /// Returns the length of the pages, bytes.
    pub fn bytes(self) -> usize {
        self.bytes
    }

    /// Requests a page size from the system.
    pub fn advise(self, wanted: PageSize) {
        #[cfg(target_os = "linux")]
        if self.bytes > 0 {
            let advice = match wanted {
                PageSize::Huge => libc::MADV_HUGEPAGE,
                PageSize::Small => libc::MADV_NOHUGEPAGE,
            };
            // SAFETY: neither advice changes content, wherever it is given; a system that knows
            // no huge pages, or nothing at that place, refuses, and nothing is lost.
            unsafe { libc::madvise(self.start.cast(), self.bytes, advice) };
        }
        #[cfg(not(target_os = "linux"))]
        let _ = wanted;
    }
}

/// Returns the CPU time of this thread, the kernel's work for it included.
fn cpu_time() -> Duration {
    #[cfg(target_os = "linux")]
    {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: it writes into a struct of ours.
        unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
        Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
    }
    #[cfg(not(target_os = "linux"))]
    Duration::ZERO
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    const FAST: Duration = Duration::from_micros(90);

    #[test]
    fn whole_pages_lie_within_their_block() {
        for start in [0, 1, HUGE_PAGE_BYTES - 1, HUGE_PAGE_BYTES, HUGE_PAGE_BYTES + 16] {
            for bytes in [0, 5, HUGE_PAGE_BYTES, 3 * HUGE_PAGE_BYTES - 1, 5 * HUGE_PAGE_BYTES] {
                let start = HUGE_PAGE_BYTES + start;
                let pages = Pages::within(std::ptr::without_provenance_mut(start), bytes);
                let (first, within) = (pages.start().addr(), pages.bytes());
                assert!(first >= start && first + within <= start + bytes);
                assert_eq!(within % HUGE_PAGE_BYTES, 0);
                assert!(within == 0 || first % HUGE_PAGE_BYTES == 0);
                assert!(start + bytes - first - within < HUGE_PAGE_BYTES);
            }
        }
    }

    #[test]
    fn two_slow_pages_in_a_row_are_too_many() {
        let speed = Speed::new();
        assert!(!speed.note(SLOW) && speed.note(FAST) && !speed.note(SLOW) && !speed.is_slow());
        assert!(!speed.note(SLOW) && speed.is_slow());
    }

    /// Returns which pages of a block are timed, where they take these times one after the other.
    fn timed(used_bytes: usize, bytes: usize, took: &[Duration]) -> (Vec<usize>, bool) {
        let block = std::ptr::without_provenance_mut::<u8>(HUGE_PAGE_BYTES);
        let offsets = RefCell::new(Vec::new());
        let is_slow = ask_timed(&Speed::new(), block, bytes, used_bytes, |page| {
            let mut offsets = offsets.borrow_mut();
            offsets.push(page.addr() - block.addr());
            took.get(offsets.len() - 1).copied().unwrap_or(FAST)
        });
        let offsets = offsets.into_inner();
        assert!(offsets.iter().all(|&o| o >= used_bytes && o + HUGE_PAGE_BYTES <= bytes));
        (offsets.iter().map(|o| o / HUGE_PAGE_BYTES).collect(), is_slow)
    }

    #[test]
    fn one_page_in_eight_is_timed_and_the_one_after_a_slow_one() {
        let bytes = 20 * HUGE_PAGE_BYTES + 7;
        assert_eq!(timed(0, bytes, &[]), (vec![0, 8, 16], false));
        assert_eq!(timed(0, bytes, &[SLOW]), (vec![0, 1, 9, 17], false));
        assert_eq!(timed(0, bytes, &[SLOW, SLOW]), (vec![0, 1], true));
        assert_eq!(timed(0, bytes, &[SLOW, FAST, SLOW, SLOW]), (vec![0, 1, 9, 10], true));
    }

    #[test]
    fn what_is_used_is_not_touched() {
        let bytes = 20 * HUGE_PAGE_BYTES;
        assert_eq!(timed(1, bytes, &[]), (vec![1, 9, 17], false));
        assert_eq!(timed(HUGE_PAGE_BYTES, bytes, &[]), (vec![1, 9, 17], false));
        assert_eq!(timed(19 * HUGE_PAGE_BYTES + 1, bytes, &[]), (vec![], false));
        assert_eq!(timed(bytes, bytes, &[]), (vec![], false));
    }
}
