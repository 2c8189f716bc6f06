//! Vulkan behind a safe, small interface: instance, device, memory, pipelines,
//! frames in flight and swapchain.
//!
//! Invariant: no other crate names ash, and nothing here knows a mesh.
//!
//! Work is recorded by a [`Recorder`] and runs on one queue in order. One
//! timeline semaphore counts submissions; a dropped resource lives on until
//! the submission that may still use it has finished.
#![doc = include_str!("../DESIGN.md")]

mod adapter;
mod area;
mod arena;
mod bind_group;
mod buffer;
mod command_slot;
mod compute;
mod deferred_destruction;
mod descriptor_pools;
mod device;
mod draw_command;
mod error;
mod format;
mod free_ranges;
mod fullscreen_pass;
mod gpu;
mod image;
mod indirect_draws;
mod instance;
mod overlay_pass;
mod pass;
mod pass_splitting;
mod pipeline;
mod pipeline_cache;
mod presenter;
mod queue;
mod recorder;
mod sampler;
mod surface;
mod swapchain;
mod transfer;
mod validation;

pub use area::ImageArea;
pub use arena::{BufferArena, BufferSlice};
pub use bind_group::{BindGroup, BindGroupLayout, Binding};
pub use buffer::{Buffer, BufferUsage};
pub use command_slot::{MAX_FRAMES_IN_FLIGHT, MAX_STAGES, StageMillis};
pub use compute::{ComputeDescription, ComputePass, ComputePipeline, Dispatch};
pub use descriptor_pools::BindingKind;
pub use error::{GpuError, RecoveryAction};
pub use format::Format;
pub use gpu::Gpu;
pub use image::{Image, ImageDescription, ImageKind};
pub use overlay_pass::{OverlayDraw, OverlayPass};
pub use pass::{
    ClearColor, DepthStore, DrawCall, DrawCount, LoadOp, RenderPass, RenderTargets, Viewport,
};
pub use pipeline::{
    AttributeKind, Blend, Pipeline, PipelineDescription, ShaderStage, VertexAttribute, VertexBuffer,
};
pub use queue::{GpuOptions, GpuQueue, WindowFrames};
pub use recorder::{Recorder, Submission};
pub use sampler::{AddressMode, Sampler};
pub use surface::WindowHandles;
pub use transfer::{DepthCopy, Download};
pub use validation::ValidationLog;
