//! Command buffer of one frame in flight, with timestamp queries of its stages.

use std::cell::RefCell;
use std::sync::Arc;

use ash::vk;

use crate::GpuError;
use crate::device::Device;
use crate::error::vulkan_error;
use crate::indirect_draws::IndirectCommands;

/// Frames that may be in the making at once: one drawn by the GPU, one
/// recorded by the CPU.
pub const MAX_FRAMES_IN_FLIGHT: usize = 2;

/// Stages of a submission whose time is taken; those after have none of their own.
pub const MAX_STAGES: usize = 7;

/// Timestamps a slot writes at most: its begin, after each stage, and its end.
const TIMESTAMPS: usize = MAX_STAGES + 2;

/// GPU times of the stages of a frame, by name, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageMillis([Option<(&'static str, f64)>; MAX_STAGES]);

impl StageMillis {
    /// Iterates over the stages in order.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.0.iter().flatten().copied()
    }
}

/// A command buffer that is recorded, submitted and recorded again.
pub(crate) struct CommandSlot {
    device: Arc<Device>,
    pub(crate) pool: vk::CommandPool,
    pub(crate) commands: vk::CommandBuffer,
    queries: vk::QueryPool,
    /// Stages of the last submission that have ended.
    stages: Vec<&'static str>,
    /// GPU time and stages of the parts that were submitted before.
    earlier_parts: (f64, Vec<(&'static str, f64)>),
    /// Indirect draw commands of the slot.
    pub(crate) indirect: RefCell<IndirectCommands>,
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
            stages: Vec::new(),
            earlier_parts: (0.0, Vec::new()),
            indirect: RefCell::default(),
            value: 0,
        };
        let raw = &slot.device.raw;
        let pool = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(slot.device.adapter.queue_family);
        // SAFETY: the device has this queue family.
        slot.pool = unsafe { raw.create_command_pool(&pool, None) }
            .map_err(vulkan_error("creating a command pool"))?;
        let commands = vk::CommandBufferAllocateInfo::default()
            .command_pool(slot.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is this slot's; one is asked for, one comes.
        slot.commands = unsafe { raw.allocate_command_buffers(&commands) }
            .map_err(vulkan_error("allocation_error commands"))?[0];
        slot.device.name(slot.pool, "frame");
        slot.device.name(slot.commands, "frame");
        if slot.device.adapter.has_timestamps {
            let queries = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(TIMESTAMPS as u32);
            // SAFETY: the device lives.
            slot.queries = unsafe { raw.create_query_pool(&queries, None) }
                .map_err(vulkan_error("creating timestamps"))?;
            slot.device.name(slot.queries, "timestamps");
        }
        Ok(slot)
    }

    pub(crate) fn begin(&mut self) -> Result<(), GpuError> {
        self.earlier_parts.0 = 0.0;
        self.earlier_parts.1.clear();
        self.begin_commands()
    }

    /// Begins the next part of a submission, once the last one is finished.
    pub(crate) fn resume(&mut self) -> Result<(), GpuError> {
        if let Some((millis, stages)) = self.elapsed_millis()? {
            self.earlier_parts = (millis, stages.iter().collect());
        }
        self.begin_commands()
    }

    fn begin_commands(&mut self) -> Result<(), GpuError> {
        self.stages.clear();
        self.indirect.get_mut().restart();
        let raw = &self.device.raw;
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last submission is finished, so its commands and
        // queries are free to be used again.
        unsafe {
            raw.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .map_err(vulkan_error("reusing commands"))?;
            raw.begin_command_buffer(self.commands, &info)
                .map_err(vulkan_error("beginning a frame"))?;
            if self.queries != vk::QueryPool::null() {
                raw.cmd_reset_query_pool(self.commands, self.queries, 0, TIMESTAMPS as u32);
            }
        }
        self.stamp(0);
        Ok(())
    }

    /// Ends a stage: the commands since the last stage, or since the beginning.
    pub(crate) fn end_stage(&mut self, name: &'static str) {
        if self.earlier_parts.1.len() + self.stages.len() < MAX_STAGES {
            self.stages.push(name);
            self.stamp(self.stages.len() as u32);
        }
    }

    pub(crate) fn end(&self) -> Result<(), GpuError> {
        self.stamp(self.stages.len() as u32 + 1);
        // SAFETY: the commands are being recorded.
        unsafe { self.device.raw.end_command_buffer(self.commands) }
            .map_err(vulkan_error("ending a frame"))
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

    /// Returns the GPU time of the finished last submission, all parts of it, and of each of its
    /// stages.
    pub(crate) fn elapsed_millis(&self) -> Result<Option<(f64, StageMillis)>, GpuError> {
        if self.value == 0 || self.queries == vk::QueryPool::null() {
            return Ok(None);
        }
        let mut ticks = [0_u64; TIMESTAMPS];
        let written = self.stages.len() + 2;
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: so many queries were written by a finished submission.
        let read = unsafe {
            let ticks = &mut ticks[..written];
            self.device.raw.get_query_pool_results(self.queries, 0, ticks, flags)
        };
        match read {
            Ok(()) => {
                let period_nanos = f64::from(self.device.adapter.limits.timestamp_period);
                let between = |from: usize, to: usize| {
                    ticks[to].saturating_sub(ticks[from]) as f64 * period_nanos / 1e6
                };
                let (before, of_before) = &self.earlier_parts;
                let own = (0..).zip(&self.stages).map(|(i, &name)| (name, between(i, i + 1)));
                let all = of_before.iter().copied().chain(own);
                let mut stages = StageMillis::default();
                stages.0.iter_mut().zip(all).for_each(|(place, stage)| *place = Some(stage));
                Ok(Some((before + between(0, written - 1), stages)))
            }
            Err(vk::Result::NOT_READY) => Ok(None),
            Err(code) => Err(vulkan_error("reading timestamps")(code)),
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
