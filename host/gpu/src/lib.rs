//! Vulkan behind a safe, small interface: instance, device, memory, pipelines,
//! frames in flight and swapchain.
//!
//! Invariant: no other crate names ash, and nothing here knows a mesh.
//!
//! Work is recorded by a [`Recorder`] and runs on one queue in order. One
//! timeline semaphore counts submissions; a dropped resource lives on until
//! the submission that may still use it has finished.

mod adapter;
mod area;
mod arena;
mod bind;
mod buffer;
mod compute;
mod device;
mod error;
mod format;
mod garbage;
mod gpu;
mod heap;
mod image;
mod indirect;
mod instance;
mod paint;
mod pass;
mod pipeline;
mod pipeline_cache;
mod presenter;
mod recorder;
mod rounds;
mod sampler;
mod screen;
mod slot;
mod surface;
mod swapchain;
mod transfer;
mod validation;

pub use area::Area;
pub use arena::{Arena, Slice};
pub use bind::{BindGroup, BindGroupLayout, Binding, BindingKind};
pub use buffer::{Buffer, BufferUsage};
pub use compute::{ComputeDescription, ComputePass, ComputePipeline, Dispatch};
pub use error::{Cure, GpuError};
pub use format::Format;
pub use gpu::{Gpu, GpuOptions, MAX_FRAMES_IN_FLIGHT};
pub use heap::{LargePages, give_back_freed_memory, load_within_one_heap};
pub use image::{Image, ImageDescription, ImageKind};
pub use paint::{Paint, PaintPass};
pub use pass::{ClearColor, DepthAfter, Draw, DrawCount, Pass, Start, Targets, Viewport};
pub use pipeline::{
    AttributeKind, Blend, Pipeline, PipelineDescription, ShaderStage, VertexAttribute, VertexBuffer,
};
pub use recorder::{Recorder, Submission};
pub use sampler::{AddressMode, Sampler};
pub use slot::{MAX_STAGES, StageMillis};
pub use surface::WindowHandles;
pub use transfer::{DepthCopy, Download};
pub use validation::ValidationLog;
