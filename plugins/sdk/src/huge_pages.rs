//! Huge pages under large blocks (madvise(2), `MADV_HUGEPAGE`), while the system gives them
//! fast: as `host/gpu/src/heap.rs` has them for the host.

use std::mem::MaybeUninit;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

/// From here on a block has a huge page within it.
const LARGE_BLOCK_BYTES: usize = 4 << 20;
/// Of x86-64, and of `AArch64` with pages of 4 KiB.
const HUGE_PAGE_BYTES: usize = 2 << 20;

/// Far longer than small pages in place of a huge one take.
const SLOW: Duration = Duration::from_millis(2);
/// Slow ones, one after the other, after which no more are asked for.
const MAX_SLOW_PAGES: u8 = 2;
/// One huge page in so many is timed: what a block has room for may never be touched.
const TIMED: usize = 8;

static SLOW_PAGES: AtomicU8 = AtomicU8::new(0);

/// Asks the system for huge pages under a large block of memory that was just made, and gives
/// the block back as it was. Work on a great mesh touches hundreds of megabytes once, and
/// faulting them in by 4 KiB can take a third of its time.
///
/// Where free memory is in pieces, or a virtual machine has given it back to its host, it is the
/// other way round: a huge page takes milliseconds. So some are timed, and where they are slow
/// this does nothing any more.
pub fn on_huge_pages<T>(mut block: Vec<T>) -> Vec<T> {
    let bytes = block.capacity() * size_of::<T>();
    if bytes < LARGE_BLOCK_BYTES || are_slow() {
        return block;
    }
    let (first, within) = whole_pages(block.as_mut_ptr().cast(), bytes);
    advise((first, within), Wanted::Huge);
    let mut page = 0;
    while page < within {
        let start = cpu_time();
        let byte = first.wrapping_add(page).cast::<MaybeUninit<u8>>();
        // SAFETY: it lies within the block, which is ours alone. It is written as it was, set
        // or not.
        unsafe { byte.write_volatile(byte.read_volatile()) };
        if note(cpu_time().saturating_sub(start)) {
            let rest = first.wrapping_add(page + HUGE_PAGE_BYTES);
            advise((rest, within.saturating_sub(page + HUGE_PAGE_BYTES)), Wanted::Small);
            break;
        }
        // After a slow one, the next tells whether that was by chance.
        let is_slow = SLOW_PAGES.load(Ordering::Relaxed) > 0;
        page += if is_slow { HUGE_PAGE_BYTES } else { TIMED * HUGE_PAGE_BYTES };
    }
    block
}

fn are_slow() -> bool {
    SLOW_PAGES.load(Ordering::Relaxed) >= MAX_SLOW_PAGES
}

/// Notes how long one took. Whether that makes them too slow.
fn note(took: Duration) -> bool {
    if took < SLOW {
        SLOW_PAGES.store(0, Ordering::Relaxed);
        return false;
    }
    SLOW_PAGES.fetch_add(1, Ordering::Relaxed) + 1 >= MAX_SLOW_PAGES
}

/// The part of a block that is whole huge pages: where it begins, and its bytes.
fn whole_pages(block: *mut u8, bytes: usize) -> (*mut u8, usize) {
    let before = block.align_offset(HUGE_PAGE_BYTES).min(bytes);
    (block.wrapping_add(before), (bytes - before) & !(HUGE_PAGE_BYTES - 1))
}

enum Wanted {
    Huge,
    Small,
}

/// Says what pages are wanted under memory of this process; what is there stays.
fn advise((start, bytes): (*mut u8, usize), wanted: Wanted) {
    #[cfg(target_os = "linux")]
    if bytes > 0 {
        let advice = match wanted {
            Wanted::Huge => libc::MADV_HUGEPAGE,
            Wanted::Small => libc::MADV_NOHUGEPAGE,
        };
        // SAFETY: neither advice changes content; a system that knows no huge pages refuses,
        // and nothing is lost.
        unsafe { libc::madvise(start.cast(), bytes, advice) };
    }
}

/// What this thread took of the processor, the system's work for it included.
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
    use super::*;

    #[test]
    fn blocks_of_all_sizes_keep_what_is_in_them() {
        for count in [0, 1, LARGE_BLOCK_BYTES - 1, LARGE_BLOCK_BYTES, 41 * HUGE_PAGE_BYTES + 7] {
            let block: Vec<u8> = (0..count).map(|place| (place % 251) as u8).collect();
            let mut told = on_huge_pages(block.clone());
            assert!(told == block);
            told.push(1);
            assert_eq!(told.len(), count + 1);
        }
        assert!(on_huge_pages(Vec::<u64>::with_capacity(1 << 20)).is_empty());
    }

    #[test]
    fn whole_pages_lie_within_their_block() {
        for start in [0, 1, HUGE_PAGE_BYTES - 1, HUGE_PAGE_BYTES, HUGE_PAGE_BYTES + 16] {
            for bytes in [0, 5, HUGE_PAGE_BYTES, 3 * HUGE_PAGE_BYTES - 1, 5 * HUGE_PAGE_BYTES] {
                let start = HUGE_PAGE_BYTES + start;
                let block = std::ptr::without_provenance_mut::<u8>(start);
                let (first, within) = whole_pages(block, bytes);
                assert!(first.addr() >= start && first.addr() + within <= start + bytes);
                assert_eq!(within % HUGE_PAGE_BYTES, 0);
                assert!(within == 0 || first.addr() % HUGE_PAGE_BYTES == 0);
                assert!(start + bytes - first.addr() - within < HUGE_PAGE_BYTES);
            }
        }
    }

    #[test]
    fn two_slow_pages_in_a_row_are_too_many() {
        let fast = Duration::from_micros(90);
        assert!(!note(SLOW) && !note(fast) && !note(SLOW) && !are_slow());
        assert!(note(SLOW) && are_slow());
        // Tests may share a process.
        SLOW_PAGES.store(0, Ordering::Relaxed);
    }
}
