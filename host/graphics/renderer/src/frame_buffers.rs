//! Per-frame buffers that the CPU writes: uniform, instances and highlights of each frame in
//! flight.

use busbar_gpu::{BindGroup, BindGroupLayout, Binding, Buffer, BufferUsage, Gpu};
use busbar_shaders::{FrameUniform, Instance};

use crate::RenderError;
use crate::instance_culling::VisibleInstances;

/// Instances in one frame.
pub const MAX_INSTANCES: usize = 1_000_000;

/// Highlights of features in one frame. Their buffer stays within the 128 MiB
/// that every Vulkan device lets a shader see.
pub const MAX_FEATURE_HIGHLIGHTS: usize = 4_000_000;

/// Instances and highlights that the first buffers hold.
const FIRST_CAPACITIES: Capacities = Capacities { instances: 256, highlights: 1 };

/// Capacities of the buffers, in elements.
#[derive(Clone, Copy)]
struct Capacities {
    instances: usize,
    highlights: usize,
}

/// The buffers of one frame in flight, and the group that binds them.
pub(crate) struct FrameBuffers {
    uniform: Buffer,
    pub(crate) instances: Buffer,
    highlights: Buffer,
    pub(crate) group: BindGroup,
    capacities: Capacities,
}

impl FrameBuffers {
    /// Makes the buffers; `more` is bound after them.
    pub(crate) fn new(
        gpu: &Gpu,
        layout: &BindGroupLayout,
        more: &[Binding<'_>],
    ) -> Result<Self, RenderError> {
        Self::with_capacities(gpu, (layout, more), FIRST_CAPACITIES)
    }

    fn with_capacities(
        gpu: &Gpu,
        (layout, more): (&BindGroupLayout, &[Binding<'_>]),
        capacities: Capacities,
    ) -> Result<Self, RenderError> {
        let uniform_bytes = size_of::<FrameUniform>() as u64;
        let instance_bytes = (capacities.instances * size_of::<Instance>()) as u64;
        let highlight_bytes = (capacities.highlights * size_of::<[f32; 4]>()) as u64;
        let uniform = Buffer::new(gpu, "frame", BufferUsage::HostUniform, uniform_bytes)?;
        let instances = Buffer::new(gpu, "instances", BufferUsage::HostVertex, instance_bytes)?;
        let highlights =
            Buffer::new(gpu, "feature highlights", BufferUsage::HostStorage, highlight_bytes)?;
        let own = [&uniform, &highlights].map(Binding::Buffer);
        let bindings: Vec<_> = own.into_iter().chain(more.iter().copied()).collect();
        let group = BindGroup::new(layout, &bindings)?;
        Ok(Self { uniform, instances, highlights, group, capacities })
    }

    /// Writes a frame; the last one in this stream must be finished.
    pub(crate) fn write(
        &mut self,
        gpu: &Gpu,
        layout: (&BindGroupLayout, &[Binding<'_>]),
        uniform: &FrameUniform,
        plan: &VisibleInstances,
    ) -> Result<(), RenderError> {
        let VisibleInstances { instances, feature_highlights: highlights, .. } = plan;
        bound("instances in one frame", instances.len(), MAX_INSTANCES)?;
        bound("features in one frame", highlights.len(), MAX_FEATURE_HIGHLIGHTS)?;
        let Capacities { instances: instance_capacity, highlights: highlight_capacity } =
            self.capacities;
        if instances.len() > instance_capacity || highlights.len() > highlight_capacity {
            let grown = |needed: usize, limit| needed.next_power_of_two().min(limit);
            let capacities = Capacities {
                instances: grown(instances.len().max(instance_capacity), MAX_INSTANCES),
                highlights: grown(highlights.len().max(highlight_capacity), MAX_FEATURE_HIGHLIGHTS),
            };
            *self = Self::with_capacities(gpu, layout, capacities)?;
        }
        self.uniform.write(bytemuck::bytes_of(uniform))?;
        self.write_instances(plan)?;
        self.highlights.write(bytemuck::cast_slice(highlights))?;
        Ok(())
    }

    /// Writes visible instances again, in another order.
    pub(crate) fn write_instances(&self, plan: &VisibleInstances) -> Result<(), RenderError> {
        Ok(self.instances.write(bytemuck::cast_slice(&plan.instances))?)
    }
}

fn bound(what: &'static str, asked: usize, limit: usize) -> Result<(), RenderError> {
    if asked <= limit {
        return Ok(());
    }
    Err(RenderError::TooMany { what, asked: asked as u64, limit: limit as u64 })
}
