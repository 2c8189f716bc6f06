//! What the CPU writes for the GPU every frame.

use busbar_gpu::{BindGroup, BindGroupLayout, Binding, Buffer, BufferUsage, Gpu};
use busbar_shaders::{FrameUniform, Instance};

use crate::{Frame, RenderError, ground};

/// Instances in one frame.
pub const MAX_INSTANCES: usize = 1_000_000;

/// Highlights of features in one frame. Their buffer stays within the 128 MiB
/// that every Vulkan device lets a shader see.
pub const MAX_FEATURE_HIGHLIGHTS: usize = 4_000_000;

/// Instances and highlights that the first buffers hold.
const FIRST_CAPACITIES: Capacities = Capacities { instances: 256, highlights: 1 };

/// How many elements buffers hold.
#[derive(Clone, Copy)]
struct Capacities {
    instances: usize,
    highlights: usize,
}

/// The buffers of one frame in flight, and the group that binds them.
pub(crate) struct FrameStream {
    uniform: Buffer,
    pub(crate) instances: Buffer,
    highlights: Buffer,
    pub(crate) group: BindGroup,
    capacities: Capacities,
}

impl FrameStream {
    pub(crate) fn new(gpu: &Gpu, layout: &BindGroupLayout) -> Result<Self, RenderError> {
        Self::with_capacities(gpu, layout, FIRST_CAPACITIES)
    }

    fn with_capacities(
        gpu: &Gpu,
        layout: &BindGroupLayout,
        capacities: Capacities,
    ) -> Result<Self, RenderError> {
        let uniform_bytes = size_of::<FrameUniform>() as u64;
        let instance_bytes = (capacities.instances * size_of::<Instance>()) as u64;
        let highlight_bytes = (capacities.highlights * size_of::<[f32; 4]>()) as u64;
        let uniform = Buffer::new(gpu, "frame", BufferUsage::HostUniform, uniform_bytes)?;
        let instances = Buffer::new(gpu, "instances", BufferUsage::HostVertex, instance_bytes)?;
        let highlights =
            Buffer::new(gpu, "feature highlights", BufferUsage::HostStorage, highlight_bytes)?;
        let bindings = [&uniform, &highlights].map(Binding::Buffer);
        let group = BindGroup::new(layout, &bindings)?;
        Ok(Self { uniform, instances, highlights, group, capacities })
    }

    /// Writes a frame; the last one in this stream must be finished.
    pub(crate) fn write(
        &mut self,
        gpu: &Gpu,
        layout: &BindGroupLayout,
        (frame, size): (&Frame<'_>, [u32; 2]),
        instances: &[Instance],
        highlights: &[[f32; 4]],
    ) -> Result<(), RenderError> {
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
        let [ray_corner, ray_right, ray_down] =
            frame.camera.pixel_rays(size).map(|ray| ray.extend(0.0).to_array());
        let [red, green, blue] = frame.background;
        let inverse_square = |distance: f32| (distance * distance).max(f32::MIN_POSITIVE).recip();
        let [ground, ground_phase] = ground::uniforms(frame.ground, frame.camera.eye);
        let uniform = FrameUniform {
            clip_from_world: frame.camera.clip_from_world().to_cols_array_2d(),
            ray_corner,
            ray_right,
            ray_down,
            fog: [red, green, blue, frame.fog_distance.map_or(0.0, inverse_square)],
            ground,
            ground_phase,
        };
        self.uniform.write(bytemuck::bytes_of(&uniform))?;
        self.instances.write(bytemuck::cast_slice(instances))?;
        self.highlights.write(bytemuck::cast_slice(highlights))?;
        Ok(())
    }
}

fn bound(what: &'static str, asked: usize, limit: usize) -> Result<(), RenderError> {
    if asked <= limit {
        return Ok(());
    }
    Err(RenderError::TooMany { what, asked: asked as u64, limit: limit as u64 })
}
