//! A command buffer of one frame in flight, and the time it takes.

use std::sync::Arc;

use ash::vk;

use crate::GpuError;
use crate::device::Device;
use crate::error::at;

/// Timestamps a slot writes: begin and end.
const TIMESTAMPS: u32 = 2;

/// A command buffer that is recorded, submitted and recorded again.
pub(crate) struct CommandSlot {
    device: Arc<Device>,
    pub(crate) pool: vk::CommandPool,
    pub(crate) commands: vk::CommandBuffer,
    queries: vk::QueryPool,
    /// The last submission; 0 before the first.
    pub(crate) value: u64,
}

impl CommandSlot {
    pub(crate) fn new(device: Arc<Device>) -> Result<Self, GpuError> {
        let mut slot = Self {
            device,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            queries: vk::QueryPool::null(),
            value: 0,
        };
        let raw = &slot.device.raw;
        let pool = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(slot.device.adapter.queue_family);
        // SAFETY: the device has this queue family.
        slot.pool = unsafe { raw.create_command_pool(&pool, None) }
            .map_err(at("creating a command pool"))?;
        let commands = vk::CommandBufferAllocateInfo::default()
            .command_pool(slot.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is this slot's; one is asked for, one comes.
        slot.commands = unsafe { raw.allocate_command_buffers(&commands) }
            .map_err(at("allocating commands"))?[0];
        slot.device.name(slot.pool, "frame");
        slot.device.name(slot.commands, "frame");
        if slot.device.adapter.has_timestamps {
            let queries = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(TIMESTAMPS);
            // SAFETY: the device lives.
            slot.queries = unsafe { raw.create_query_pool(&queries, None) }
                .map_err(at("creating timestamps"))?;
            slot.device.name(slot.queries, "timestamps");
        }
        Ok(slot)
    }

    pub(crate) fn begin(&self) -> Result<(), GpuError> {
        let raw = &self.device.raw;
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last submission is finished, so its commands and
        // queries are free to be used again.
        unsafe {
            raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .map_err(at("reusing commands"))?;
            raw.begin_command_buffer(self.commands, &info).map_err(at("beginning a frame"))?;
            if self.queries != vk::QueryPool::null() {
                raw.cmd_reset_query_pool(self.commands, self.queries, 0, TIMESTAMPS);
            }
        }
        self.stamp(0);
        Ok(())
    }

    pub(crate) fn end(&self) -> Result<(), GpuError> {
        self.stamp(1);
        // SAFETY: the commands are being recorded.
        unsafe { self.device.raw.end_command_buffer(self.commands) }.map_err(at("ending a frame"))
    }

    fn stamp(&self, query: u32) {
        if self.queries == vk::QueryPool::null() {
            return;
        }
        // SAFETY: the commands are being recorded, outside any pass; the query
        // was reset in them.
        unsafe {
            self.device.raw.cmd_write_timestamp2(
                self.commands,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                self.queries,
                query,
            );
        }
    }

    /// How long the finished last submission took.
    pub(crate) fn elapsed_millis(&self) -> Result<Option<f64>, GpuError> {
        if self.value == 0 || self.queries == vk::QueryPool::null() {
            return Ok(None);
        }
        let mut ticks = [0_u64; TIMESTAMPS as usize];
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: both queries were written by a finished submission.
        let read =
            unsafe { self.device.raw.get_query_pool_results(self.queries, 0, &mut ticks, flags) };
        match read {
            Ok(()) => {
                let period_nanos = f64::from(self.device.adapter.limits.timestamp_period);
                Ok(Some(ticks[1].saturating_sub(ticks[0]) as f64 * period_nanos / 1e6))
            }
            Err(vk::Result::NOT_READY) => Ok(None),
            Err(code) => Err(at("reading timestamps")(code)),
        }
    }
}

impl Drop for CommandSlot {
    fn drop(&mut self) {
        // A hung device keeps its commands; the device reports it.
        if let Err(error) = self.device.wait(self.value, "closing the device")
            && !matches!(error, GpuError::DeviceLost(_))
        {
            return;
        }
        // SAFETY: the slot's last submission is finished or lost; nulls are
        // ignored.
        unsafe {
            self.device.raw.destroy_query_pool(self.queries, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}
