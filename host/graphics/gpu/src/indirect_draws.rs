//! Indirect draws: many draw calls in a buffer become one command.

use std::sync::Arc;

use ash::vk;

use crate::device::Device;
use crate::draw_command::{COMMAND_BYTES, IndirectCommand};
use crate::{Buffer, BufferUsage, GpuError};

/// Draw calls that one buffer holds.
const CALLS_PER_BUFFER: usize = 4096;

/// Buffers of one submission; further calls are drawn one by one.
const MAX_BUFFERS: usize = 64;

/// The calls of one submission.
#[derive(Default)]
pub(crate) struct IndirectCommands {
    buffers: Vec<Buffer>,
    /// Calls that are taken, counted over all buffers.
    taken: usize,
}

impl IndirectCommands {
    /// Restarts at the first buffer, once the last submission is finished.
    pub(crate) fn restart(&mut self) {
        self.taken = 0;
    }

    /// Writes commands one after the other, as many as one buffer has room for. Returns buffer,
    /// offset and count, or `None` where there is no room at all.
    pub(crate) fn write(
        &mut self,
        device: &Arc<Device>,
        calls: &[IndirectCommand],
    ) -> Result<Option<(vk::Buffer, u64, usize)>, GpuError> {
        let (index, start) = (self.taken / CALLS_PER_BUFFER, self.taken % CALLS_PER_BUFFER);
        if index == MAX_BUFFERS {
            return Ok(None);
        }
        if index == self.buffers.len() {
            let bytes = CALLS_PER_BUFFER as u64 * u64::from(COMMAND_BYTES);
            self.buffers.push(Buffer::on(device, "draw calls", BufferUsage::HostIndirect, bytes)?);
        }
        let count = calls.len().min(CALLS_PER_BUFFER - start);
        let offset = start * size_of::<IndirectCommand>();
        self.buffers[index].write_at(offset, bytemuck::cast_slice(&calls[..count]))?;
        self.taken += count;
        Ok(Some((self.buffers[index].raw(), offset as u64, count)))
    }
}
