//! Transparent huge pages under large arrays.

use std::mem::MaybeUninit;

use busbar_huge_pages as huge_pages;

/// Asks the system for huge pages under a large block of memory that was just made, and gives
/// the block back as it was. Work on a great mesh touches hundreds of megabytes once, and
/// faulting them in by 4 KiB can take a third of its time.
///
/// Where free memory is in pieces, or a virtual machine has given it back to its host, it is the
/// other way round: a huge page takes milliseconds. So some are timed, and where they are slow
/// this does nothing any more.
pub fn on_huge_pages<T>(mut block: Vec<T>) -> Vec<T> {
    let bytes = block.capacity() * size_of::<T>();
    if huge_pages::are_worth(bytes) {
        huge_pages::ask(block.as_mut_ptr().cast(), bytes, 0, |page| {
            let byte = page.cast::<MaybeUninit<u8>>();
            // SAFETY: it lies within the block, which is ours alone. It is written as it was, set
            // or not.
            unsafe { byte.write_volatile(byte.read_volatile()) };
        });
    }
    block
}

#[cfg(test)]
mod tests {
    use super::*;
    use huge_pages::{HUGE_PAGE_BYTES, LARGE_BLOCK_BYTES};

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
}
