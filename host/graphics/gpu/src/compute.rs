//! Compute pipelines, passes and dispatches.

use std::sync::Arc;

use ash::vk;

use crate::deferred_destruction::DiscardedObject;
use crate::device::Device;
use crate::error::vulkan_error;
use crate::pipeline::ShaderModule;
use crate::{BindGroup, BindGroupLayout, Gpu, GpuError, Recorder, ShaderStage};

/// Bytes of constants that every device takes (Vulkan 1.3, table 53, required limits).
const MAX_CONSTANT_BYTES: usize = 128;

/// Workgroups that every device runs along one axis (Vulkan 1.3, required limits).
const MAX_WORKGROUPS: u32 = 65_535;

/// A compute pipeline to make.
pub struct ComputeDescription<'a> {
    /// Name shown in messages.
    pub name: &'a str,
    /// Compute shader and entry point.
    pub stage: ShaderStage<'a>,
    /// Layouts of the groups, numbered from 0.
    pub groups: &'a [&'a BindGroupLayout],
    /// Bytes of the constants that come with each dispatch; a multiple of 4, at most 128.
    pub constant_bytes: usize,
}

/// Compiled compute pipeline and its layout.
pub struct ComputePipeline {
    device: Arc<Device>,
    raw: vk::Pipeline,
    layout: vk::PipelineLayout,
    groups: Vec<BindGroupLayout>,
    constant_bytes: usize,
}

impl ComputePipeline {
    /// Compiles a compute pipeline.
    ///
    /// # Errors
    /// When its constants are too many, or memory runs out.
    pub fn new(gpu: &Gpu, description: &ComputeDescription<'_>) -> Result<Self, GpuError> {
        let constant_bytes = description.constant_bytes;
        if constant_bytes > MAX_CONSTANT_BYTES || !constant_bytes.is_multiple_of(4) {
            return Err(GpuError::Misuse("constants of a size that no device need take"));
        }
        let device = Arc::clone(gpu.device());
        let layouts: Vec<_> = description.groups.iter().map(|group| group.raw()).collect();
        let constants = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(constant_bytes as u32)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&layouts)
            .push_constant_ranges(&constants[..usize::from(constant_bytes > 0)]);
        // SAFETY: the layouts belong to this device.
        let layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .map_err(vulkan_error("creating a pipeline layout"))?;
        // Owns the layout from here on.
        let mut pipeline = Self {
            device,
            raw: vk::Pipeline::null(),
            layout,
            groups: description.groups.iter().map(|&group| group.clone()).collect(),
            constant_bytes,
        };
        pipeline.raw = pipeline.compile(&description.stage)?;
        pipeline.device.name(pipeline.raw, description.name);
        pipeline.device.name(pipeline.layout, description.name);
        Ok(pipeline)
    }

    fn compile(&self, stage: &ShaderStage<'_>) -> Result<vk::Pipeline, GpuError> {
        let module = ShaderModule::new(&self.device, stage.words)?;
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(module.stage(vk::ShaderStageFlags::COMPUTE, stage.entry))
            .layout(self.layout);
        // SAFETY: all that `info` points to lives until the call returns; the shader
        // comes from naga's validated output. One info gives one pipeline.
        unsafe {
            self.device.raw.create_compute_pipelines(self.device.pipeline_cache(), &[info], None)
        }
        .map(|pipelines| pipelines[0])
        .map_err(|(_, code)| vulkan_error("compiling a pipeline")(code))
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        self.device.discard(DiscardedObject::Pipeline(self.raw, self.layout));
    }
}

/// Dispatch of workgroups to a compute pipeline.
pub struct Dispatch<'a> {
    /// Pipeline that is dispatched.
    pub pipeline: &'a ComputePipeline,
    /// The groups that the pipeline's layout asks for.
    pub groups: &'a [&'a BindGroup],
    /// Push constants of the dispatch.
    pub constants: &'a [u8],
    /// Number of workgroups, at most 65,535.
    pub workgroups: u32,
}

/// Compute pass of independent dispatches. Their writes are visible to draws and later passes once
/// the pass is dropped.
pub struct ComputePass<'r> {
    recorder: &'r Recorder<'r>,
}

impl Recorder<'_> {
    /// Begins a compute pass, after all draws that read what it may overwrite.
    pub fn compute_pass(&mut self, name: &str) -> ComputePass<'_> {
        self.begin_label(name);
        let recorder: &Recorder<'_> = self;
        let drawn = vk::MemoryBarrier2::default()
            .src_stage_mask(
                vk::PipelineStageFlags2::VERTEX_INPUT | vk::PipelineStageFlags2::FRAGMENT_SHADER,
            )
            .dst_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER);
        recorder.barriers(&[], &[drawn]);
        ComputePass { recorder }
    }
}

impl ComputePass<'_> {
    /// Records a dispatch of workgroups.
    ///
    /// # Errors
    /// When groups, constants or their number do not fit the pipeline.
    pub fn dispatch(&mut self, dispatch: &Dispatch<'_>) -> Result<(), GpuError> {
        let Dispatch { pipeline, groups, constants, workgroups } = *dispatch;
        let layouts = pipeline.groups.iter().map(BindGroupLayout::raw);
        let fits = layouts.eq(groups.iter().map(|group| group.layout()))
            && constants.len() == pipeline.constant_bytes
            && (1..=MAX_WORKGROUPS).contains(&workgroups);
        if !fits {
            return Err(GpuError::Misuse("a dispatch that does not fit its pipeline"));
        }
        let sets: Vec<_> = groups.iter().map(|group| group.raw()).collect();
        let (commands, device) = (self.recorder.commands(), &self.recorder.device().raw);
        let (point, layout) = (vk::PipelineBindPoint::COMPUTE, pipeline.layout);
        // SAFETY: the commands are being recorded, outside any pass that draws; all that
        // is bound belongs to this device and lives until the submission is done; what
        // shaders touch beyond a buffer is left alone, by robust buffer access.
        unsafe {
            device.cmd_bind_pipeline(commands, point, pipeline.raw);
            device.cmd_bind_descriptor_sets(commands, point, layout, 0, &sets, &[]);
            if !constants.is_empty() {
                let stages = vk::ShaderStageFlags::COMPUTE;
                device.cmd_push_constants(commands, layout, stages, 0, constants);
            }
            device.cmd_dispatch(commands, workgroups, 1, 1);
        }
        Ok(())
    }
}

impl Drop for ComputePass<'_> {
    fn drop(&mut self) {
        let written = vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
            .dst_stage_mask(
                vk::PipelineStageFlags2::VERTEX_INPUT
                    | vk::PipelineStageFlags2::FRAGMENT_SHADER
                    | vk::PipelineStageFlags2::COMPUTE_SHADER,
            )
            .dst_access_mask(
                vk::AccessFlags2::VERTEX_ATTRIBUTE_READ
                    | vk::AccessFlags2::SHADER_STORAGE_READ
                    | vk::AccessFlags2::SHADER_STORAGE_WRITE,
            );
        self.recorder.barriers(&[], &[written]);
        self.recorder.end_label();
    }
}
