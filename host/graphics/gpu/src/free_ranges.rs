//! Free byte ranges of a buffer that slices share.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use range_alloc::RangeAllocator;

/// Free byte ranges of one buffer.
pub(crate) struct FreeRanges(Mutex<RangeAllocator<u64>>);

impl FreeRanges {
    pub(crate) fn new(bytes: u64) -> Self {
        Self(Mutex::new(RangeAllocator::new(0..bytes)))
    }

    /// Takes a range of so many bytes; `None` where none is as long.
    pub(crate) fn take(&self, bytes: u64) -> Option<Range<u64>> {
        self.lock().allocate_range(bytes).ok()
    }

    /// Returns the bytes of a range to the buffer.
    pub(crate) fn release(&self, range: Range<u64>) {
        self.lock().free_range(range);
    }

    /// Reports whether no range is taken.
    pub(crate) fn is_whole(&self) -> bool {
        self.lock().is_empty()
    }

    fn lock(&self) -> MutexGuard<'_, RangeAllocator<u64>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
