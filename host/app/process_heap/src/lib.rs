//! Process allocator: huge pages, a single glibc arena, and memory kept for software rasterizers.
//!
//! Blocks of 4 MiB and more ask for huge pages. A program that shows a scene loads within one heap,
//! in which each stage takes what the stage before it freed. What is free is given back once the
//! first frame is drawn. One huge page in eight is timed. Where two in a row take 2 ms and more, no
//! more are asked for.
//!
//! Invariant: a program chooses it. Libraries know nothing of it but a function that gives free
//! memory back, where a program hands them one.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use busbar_huge_pages::{self as huge_pages, PageSize, Pages};

/// Memory that a frame of a million triangles takes, and more.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const KEPT_BYTES: libc::c_int = 512 << 20;
/// Blocks up to this size come from the heap; the most that glibc takes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const HEAP_BLOCK_BYTES: libc::c_int = 32 << 20;

/// Bytes of a scene of a million triangles with its first frame.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const FIRST_HEAP_BYTES: libc::c_int = 384 << 20;
/// Size of the first block, which makes the heap grow, bytes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const FIRST_BLOCK_BYTES: usize = 1 << 20;
/// Default top padding of glibc, bytes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const TOP_PAD_BYTES: libc::c_int = 128 << 10;

/// Configures a single heap for all threads, under huge pages, that keeps freed memory: for a
/// program that loads one scene and shows it. Each stage of loading reuses what the one before it
/// freed. A software rasterizer takes a frame's triangles from the heap, in its own library: by
/// default glibc may return that memory after each frame and fault it in again in the next, up to
/// two fifths of a frame. To be called first of all; call [`release_freed_memory`] once the first
/// frame is drawn.
pub fn configure_allocator() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: mallopt sets numbers that malloc reads, under its own lock; sbrk says where the
    // heap ends, and moves nothing; the block is freed once.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
        libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT_BYTES);
        libc::mallopt(libc::M_MMAP_THRESHOLD, HEAP_BLOCK_BYTES);
        libc::mallopt(libc::M_TOP_PAD, FIRST_HEAP_BYTES);
        let block = libc::malloc(FIRST_BLOCK_BYTES).cast::<u8>();
        libc::mallopt(libc::M_TOP_PAD, TOP_PAD_BYTES);
        let bytes = (libc::sbrk(0) as usize).saturating_sub(block as usize);
        // A block that is none of the heap's is not below its end, or far below.
        if !block.is_null() && bytes <= 2 * FIRST_HEAP_BYTES as usize {
            let pages = Pages::within(block, bytes);
            pages.advise(PageSize::Huge);
            HEAP.0.store(pages.start().addr(), Ordering::Relaxed);
            HEAP.1.store(pages.bytes(), Ordering::Relaxed);
        }
        libc::free(block.cast());
    }
}

/// Returns free heap memory to the system. Where frames keep what they free, the memory of an
/// unloaded scene would stay for ever, in the arena of each loading thread. Takes milliseconds, and
/// the next frame faults in what it needs.
pub fn release_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: it frees what malloc holds free, under its own locks.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// System allocator that asks for huge pages under large blocks (madvise(2), `MADV_HUGEPAGE`).
/// Loading touches hundreds of megabytes once. Without huge pages from the system, faulting them in
/// by 4 KiB took a tenth of a start.
///
/// It asks as long as that is faster. Where memory is in pieces, or where a virtual machine
/// has given what it had free back to its host, a huge page takes milliseconds, while small
/// ones are at hand: a start from nothing then took 1.0 s with huge pages, 0.7 without.
pub struct HugePageAllocator;

// SAFETY: the system's heap does it all; what is said of its memory changes neither its
// content nor whose it is.
unsafe impl GlobalAlloc for HugePageAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise; nothing is in the block yet.
        unsafe { advised(System.alloc(layout), 0, layout.size()) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above, but for zeros.
        unsafe { advised(System.alloc_zeroed(layout), 0, layout.size()) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        // SAFETY: the caller's promise; nothing is in what the block grew by.
        unsafe {
            advised(System.realloc(block, layout, new_size), layout.size().min(new_size), new_size)
        }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise; it came from there.
        unsafe { System.dealloc(block, layout) }
    }
}

/// Address and length of the single heap under huge pages.
static HEAP: (AtomicUsize, AtomicUsize) = (AtomicUsize::new(0), AtomicUsize::new(0));

/// Asks for huge pages where they lie wholly within a large block, while they are fast; once
/// they are not, the one heap goes without them too.
///
/// # Safety
/// `block` is null or has this many bytes; from `used_bytes` on there is nothing in it, or
/// zeros.
unsafe fn advised(block: *mut u8, used_bytes: usize, bytes: usize) -> *mut u8 {
    if block.is_null() || !huge_pages::are_worth(bytes) {
        return block;
    }
    let touch = |page: *mut u8| {
        // SAFETY: it lies within the block, where nothing is, or a zero as this is.
        unsafe { page.write_volatile(0) }
    };
    if huge_pages::ask(block, bytes, used_bytes, touch) {
        let heap = std::ptr::without_provenance_mut(HEAP.0.load(Ordering::Relaxed));
        Pages::within(heap, HEAP.1.load(Ordering::Relaxed)).advise(PageSize::Small);
    }
    block
}

#[cfg(test)]
mod tests {
    use std::slice;

    use super::*;
    use huge_pages::{HUGE_PAGE_BYTES, LARGE_BLOCK_BYTES};

    #[test]
    fn blocks_of_all_sizes_keep_what_is_in_them_as_they_grow_and_shrink() {
        for align in [1, 16, 64, 2 * HUGE_PAGE_BYTES] {
            let sizes = [LARGE_BLOCK_BYTES - 1, LARGE_BLOCK_BYTES, 5 * HUGE_PAGE_BYTES + 7];
            for (size, next) in sizes.iter().flat_map(|&a| sizes.map(|b| (a, b))) {
                let layout = Layout::from_size_align(size, align).unwrap();
                let pattern: Vec<u8> = (0..size).map(|place| (place % 251) as u8).collect();
                let kept = size.min(next);
                // SAFETY: each block is used within its size and freed once, by its layout.
                unsafe {
                    let block = HugePageAllocator.alloc_zeroed(layout);
                    assert_eq!(block.align_offset(align), 0);
                    let bytes = slice::from_raw_parts_mut(block, size);
                    assert!(bytes.iter().all(|&byte| byte == 0));
                    bytes.copy_from_slice(&pattern);
                    let block = HugePageAllocator.realloc(block, layout, next);
                    assert!(slice::from_raw_parts(block, kept) == &pattern[..kept]);
                    HugePageAllocator.dealloc(block, Layout::from_size_align(next, align).unwrap());
                }
            }
        }
    }
}
