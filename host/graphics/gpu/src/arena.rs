//! Buffer arena: slices of a few large buffers, so that neighbouring draws bind once.

use std::ops::Range;
use std::sync::{Arc, Weak};

use crate::deferred_destruction::DiscardedObject;
use crate::device::Device;
use crate::free_ranges::FreeRanges;
use crate::{Buffer, BufferUsage, GpuError};

/// Bytes of one block; a larger slice gets a block of its own. Software rasterizers take blocks
/// from host memory as they are filled.
const BLOCK_BYTES: u64 = 16 << 20;

/// Slices begin at multiples of this: any of them may be a storage buffer (Vulkan 1.3, limit
/// of `minStorageBufferOffsetAlignment`).
const ALIGNMENT: u64 = 256;

/// Arena that suballocates slices of one usage from large buffers.
pub struct BufferArena {
    name: &'static str,
    usage: BufferUsage,
    blocks: Vec<Arc<Block>>,
    /// Blocks that there ever were.
    made: u32,
}

/// A buffer that slices share.
struct Block {
    number: u32,
    buffer: Buffer,
    free: Arc<FreeRanges>,
}

impl BufferArena {
    /// Makes an empty arena; `usage` is one that a [`Recorder`](crate::Recorder) fills.
    pub fn new(name: &'static str, usage: BufferUsage) -> Self {
        Self { name, usage, blocks: Vec::new(), made: 0 }
    }

    pub(crate) fn allocate(
        &mut self,
        device: &Arc<Device>,
        bytes: u64,
    ) -> Result<BufferSlice, GpuError> {
        let needed = bytes.max(1).next_multiple_of(ALIGNMENT);
        let found = self
            .blocks
            .iter()
            .find_map(|block| BufferSlice::allocate(device, block, needed, bytes));
        if let Some(slice) = found {
            return Ok(slice);
        }
        let size = needed.max(BLOCK_BYTES);
        let block = Arc::new(Block {
            number: self.made,
            buffer: Buffer::on(device, self.name, self.usage, size)?,
            free: Arc::new(FreeRanges::new(size)),
        });
        let slice = BufferSlice::allocate(device, &block, needed, bytes);
        self.blocks.push(block);
        self.made += 1;
        slice.ok_or(GpuError::Misuse("a slice that does not fit a block of its size"))
    }

    /// Releases empty blocks, but for one of the ordinary size.
    pub fn trim(&mut self) {
        let mut spare = false;
        self.blocks.retain(|block| {
            let is_spare = block.is_empty() && block.buffer.size() == BLOCK_BYTES && !spare;
            spare |= is_spare;
            is_spare || !block.is_empty()
        });
    }
}

impl Block {
    fn is_empty(&self) -> bool {
        self.free.is_whole()
    }
}

/// A part of a buffer; clones share it. It lives until the GPU is done with it.
#[derive(Clone)]
pub struct BufferSlice {
    // At hand: each draw of each frame asks.
    block: Arc<Block>,
    offset: u64,
    size: u64,
    /// Reserved range, shared by clones.
    #[expect(dead_code, reason = "its end is what matters")]
    part: Arc<SliceRange>,
}

/// Reservation of bytes in a block, released on drop.
struct SliceRange {
    device: Arc<Device>,
    free: Weak<FreeRanges>,
    /// Reserved bytes, rounded up to the alignment.
    range: Range<u64>,
}

impl BufferSlice {
    fn allocate(device: &Arc<Device>, block: &Arc<Block>, needed: u64, size: u64) -> Option<Self> {
        let range = block.free.take(needed)?;
        let (device, free, offset) = (Arc::clone(device), Arc::downgrade(&block.free), range.start);
        let part = Arc::new(SliceRange { device, free, range });
        Some(Self { block: Arc::clone(block), offset, size, part })
    }

    /// Returns the buffer that the slice is a part of.
    pub fn buffer(&self) -> &Buffer {
        &self.block.buffer
    }

    /// Returns the number of its buffer within the arena.
    pub fn block(&self) -> u32 {
        self.block.number
    }

    /// Returns its offset in the buffer, bytes.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Returns the size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Reports whether the processor sees the memory directly. Software rasterizers and unified
    /// memory allow it.
    pub fn is_host_visible(&self) -> bool {
        self.buffer().is_host_visible()
    }

    /// Passes the uploaded bytes to `read`. Memory of a graphics card may be slow to read.
    ///
    /// # Errors
    /// When it is not in sight.
    pub fn read_with(&self, read: impl FnOnce(&[u8])) -> Result<(), GpuError> {
        let start = self.offset();
        self.buffer().read_with(start..start + self.size(), read)
    }
}

impl Drop for SliceRange {
    fn drop(&mut self) {
        self.device.discard(DiscardedObject::Range(self.free.clone(), self.range.clone()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GpuOptions, GpuQueue};

    fn open() -> GpuQueue {
        GpuQueue::headless(&GpuOptions { validation: true, ..GpuOptions::default() }).unwrap()
    }

    fn upload(queue: &mut GpuQueue, arena: &mut BufferArena, bytes: usize) -> BufferSlice {
        let mut recorder = queue.begin_transfer().unwrap();
        let slice = recorder.upload_slice(arena, &vec![7; bytes]).unwrap();
        recorder.submit_and_wait().unwrap();
        slice
    }

    fn overlaps(a: &BufferSlice, b: &BufferSlice) -> bool {
        let [a_range, b_range] = [a, b].map(|slice| slice.offset..slice.offset + slice.size);
        a.block() == b.block() && a_range.start < b_range.end && b_range.start < a_range.end
    }

    #[test]
    fn slices_share_blocks_never_overlap_and_are_used_again() {
        let mut queue = open();
        let log = queue.gpu().validation_log();
        let mut arena = BufferArena::new("vertices", BufferUsage::Vertex);
        let mut slices: Vec<BufferSlice> = Vec::new();
        let mut sizes = (1..).map(|i: usize| i * 7919 % 300_000);
        for round in 0..6 {
            for _ in 0..20 {
                let bytes = sizes.next().unwrap();
                let slice = upload(&mut queue, &mut arena, bytes);
                assert_eq!((slice.size(), slice.offset() % ALIGNMENT), (bytes as u64, 0));
                assert!(!slices.iter().any(|other| overlaps(other, &slice)), "round {round}");
                slices.push(slice);
            }
            let mut number = 0;
            slices.retain(|_| {
                number += 1;
                number % 3 != round % 3
            });
        }
        assert_eq!(arena.made, 1, "what was dropped is used again");
        drop(slices);
        queue.free_memory().unwrap();
        assert!(arena.blocks[0].is_empty());
        drop((arena, queue));
        assert_eq!(log.messages(), Vec::<String>::new());
    }

    /// A software rasteriser's memory is in sight, a graphics card's need not be.
    #[test]
    fn bytes_arrive_whether_device_memory_is_in_sight_or_not() {
        let options = GpuOptions { validation: true, ..GpuOptions::default() };
        let mut queue = GpuQueue::headless(&options).unwrap();
        let log = queue.gpu().validation_log();
        let mut arena = BufferArena::new("counts", BufferUsage::ComputeReadback);
        let mut recorder = queue.begin_transfer().unwrap();
        let bytes = |slice: u8| vec![slice; 1000 * usize::from(slice)];
        let slices: Vec<BufferSlice> =
            (1..4).map(|slice| recorder.upload_slice(&mut arena, &bytes(slice)).unwrap()).collect();
        let single =
            recorder.upload_buffer("one", BufferUsage::ComputeReadback, &bytes(9)).unwrap();
        let is_host_visible = single.is_host_visible();
        assert!(is_host_visible || !recorder.gpu().is_software());
        for (number, slice) in (1..).zip(&slices) {
            assert_eq!(slice.is_host_visible(), is_host_visible);
            let mut seen = Vec::new();
            let read = slice.read_with(|bytes| seen.extend_from_slice(bytes));
            assert_eq!(read.is_ok(), is_host_visible);
            assert!(!is_host_visible || seen == bytes(number));
        }
        let all = recorder.download_buffer(slices[0].buffer()).unwrap();
        let one = recorder.download_buffer(&single).unwrap();
        recorder.submit_and_wait().unwrap();
        let all = all.contents().unwrap();
        for (slice, number) in slices.iter().zip(1..) {
            let start = slice.offset() as usize;
            assert_eq!(all[start..start + slice.size() as usize], bytes(number));
        }
        assert_eq!(one.contents().unwrap(), bytes(9));
        drop((slices, single, arena, queue));
        assert_eq!(log.messages(), Vec::<String>::new());
    }

    #[test]
    fn large_slices_have_blocks_of_their_own_which_go_with_them() {
        let mut queue = open();
        let mut arena = BufferArena::new("vertices", BufferUsage::Vertex);
        let small = upload(&mut queue, &mut arena, 100);
        let large = upload(&mut queue, &mut arena, BLOCK_BYTES as usize + 1);
        assert_ne!(small.block(), large.block());
        arena.trim();
        assert_eq!(arena.blocks.len(), 2);
        drop(large);
        queue.free_memory().unwrap();
        arena.trim();
        assert_eq!(arena.blocks.len(), 1);
        drop(small);
        queue.free_memory().unwrap();
        arena.trim();
        assert_eq!(arena.blocks.len(), 1, "one of the ordinary size is kept");
        // What outlives its arena holds its block.
        let last = upload(&mut queue, &mut arena, 5);
        drop(arena);
        assert_eq!(last.buffer().size(), BLOCK_BYTES);
        drop(last);
        queue.free_memory().unwrap();
    }
}
