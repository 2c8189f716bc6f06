//! Graphics pipelines: description and compilation.

use std::ffi::CStr;
use std::sync::Arc;

use ash::vk;

use crate::deferred_destruction::DiscardedObject;
use crate::device::Device;
use crate::error::vulkan_error;
use crate::format::sample_flag;
use crate::{BindGroup, BindGroupLayout, Format, Gpu, GpuError};

/// One shader entry point.
#[derive(Clone, Copy)]
pub struct ShaderStage<'a> {
    /// SPIR-V words of the module.
    pub words: &'a [u32],
    /// Name of the entry point.
    pub entry: &'a CStr,
}

/// Blending of a fragment with the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// Paints over a finished picture: its alpha is premultiplied, bytes are
    /// blended undecoded, and there is no depth.
    PremultipliedAlpha,
    /// Replaces the colour of the target.
    Replace,
    /// Replaces it in as many of a pixel's samples as its alpha says, a single one in any case,
    /// and leaves its alpha.
    AlphaToCoverage,
    /// Covers it by its alpha, and leaves depth alone.
    Over,
    /// Multiplies the colour of the target.
    Multiply,
}

/// A pipeline to make. Triangles; counter-clockwise is the front; reverse-Z.
pub struct PipelineDescription<'a> {
    /// Name shown in messages.
    pub name: &'a str,
    /// Vertex shader and entry point.
    pub vertex: ShaderStage<'a>,
    /// Fragment shader; `None` for depth-only passes without discard.
    pub fragment: Option<ShaderStage<'a>>,
    /// Layouts of the vertex buffers, in the order in which they are bound.
    pub vertex_buffers: &'a [VertexBuffer<'a>],
    /// Layouts of the groups, numbered from 0.
    pub groups: &'a [&'a BindGroupLayout],
    /// Format of the colour target; none where depth alone is drawn.
    pub color: Option<Format>,
    /// Number of samples a pixel.
    pub samples: u32,
    /// Blending of fragments with the target.
    pub blend: Blend,
    /// Draws edges instead of faces; needs [`Gpu::can_draw_lines`].
    pub lines: bool,
    /// For [`crate::Recorder::fullscreen_pass`]: there is no depth.
    pub screen: bool,
}

/// Layout of one vertex buffer.
#[derive(Clone, Copy, Debug)]
pub struct VertexBuffer<'a> {
    /// Bytes from one element to the next.
    pub stride: u32,
    /// An element an instance rather than a vertex.
    pub per_instance: bool,
    /// Attributes that a shader reads of an element.
    pub attributes: &'a [VertexAttribute],
}

/// Vertex attribute at one location.
#[derive(Clone, Copy, Debug)]
pub struct VertexAttribute {
    /// Location in the shader.
    pub location: u32,
    /// Kind of its numbers.
    pub kind: AttributeKind,
    /// Bytes from the start of the element.
    pub offset: u32,
}

/// Numbers of a vertex attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttributeKind {
    /// Two 32-bit floats each.
    Float2,
    /// Four 32-bit floats each.
    Float4,
    /// Four bytes, read as 0 to 1.
    Unorm4,
    /// Four unsigned 32-bit integers.
    Uint4,
}

impl AttributeKind {
    fn vk(self) -> vk::Format {
        match self {
            Self::Float2 => vk::Format::R32G32_SFLOAT,
            Self::Float4 => vk::Format::R32G32B32A32_SFLOAT,
            Self::Unorm4 => vk::Format::R8G8B8A8_UNORM,
            Self::Uint4 => vk::Format::R32G32B32A32_UINT,
        }
    }
}

/// Compiled graphics pipeline and its layout.
pub struct Pipeline {
    device: Arc<Device>,
    pub(crate) raw: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) color: Option<Format>,
    pub(crate) samples: u32,
    pub(crate) screen: bool,
    pub(crate) groups: Vec<BindGroupLayout>,
}

impl Pipeline {
    /// Reports whether bind groups match its layout.
    pub(crate) fn accepts_groups(&self, groups: &[&BindGroup]) -> bool {
        let layouts = self.groups.iter().map(BindGroupLayout::raw);
        layouts.eq(groups.iter().map(|group| group.layout()))
    }

    /// Compiles a graphics pipeline.
    ///
    /// # Errors
    /// When lines are asked for and not possible, or memory runs out.
    pub fn new(gpu: &Gpu, description: &PipelineDescription<'_>) -> Result<Self, GpuError> {
        if description.lines && !gpu.can_draw_lines() {
            return Err(GpuError::Misuse("lines on a device that cannot draw them"));
        }
        let device = Arc::clone(gpu.device());
        let layouts: Vec<_> = description.groups.iter().map(|group| group.raw()).collect();
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
        // SAFETY: the layouts belong to this device.
        let layout = unsafe { device.raw.create_pipeline_layout(&info, None) }
            .map_err(vulkan_error("creating a pipeline layout"))?;
        // Owns the layout from here on.
        let mut pipeline = Self {
            device,
            raw: vk::Pipeline::null(),
            layout,
            color: description.color,
            samples: description.samples,
            screen: description.screen,
            groups: description.groups.iter().map(|&group| group.clone()).collect(),
        };
        pipeline.raw = pipeline.compile(description)?;
        pipeline.device.name(pipeline.raw, description.name);
        pipeline.device.name(pipeline.layout, description.name);
        Ok(pipeline)
    }

    /// Returns how many bind groups its shaders take.
    pub fn group_count(&self) -> usize {
        self.groups.len()
    }

    fn compile(&self, description: &PipelineDescription<'_>) -> Result<vk::Pipeline, GpuError> {
        let vertex = ShaderModule::new(&self.device, description.vertex.words)?;
        let fragment = description
            .fragment
            .map(|stage| {
                Ok::<_, GpuError>((ShaderModule::new(&self.device, stage.words)?, stage.entry))
            })
            .transpose()?;
        let mut stages = vec![vertex.stage(vk::ShaderStageFlags::VERTEX, description.vertex.entry)];
        stages.extend(
            fragment.iter().map(|(of, entry)| of.stage(vk::ShaderStageFlags::FRAGMENT, entry)),
        );
        let (bindings, attributes) = vertex_input(description.vertex_buffers);
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport =
            vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let polygon_mode =
            if description.lines { vk::PolygonMode::LINE } else { vk::PolygonMode::FILL };
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(polygon_mode)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(sample_flag(description.samples))
            .alpha_to_coverage_enable(
                description.blend == Blend::AlphaToCoverage && description.samples > 1,
            );
        let paints = description.blend == Blend::PremultipliedAlpha;
        let has_depth = !paints && !description.screen;
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(has_depth)
            .depth_write_enable(has_depth && writes_depth(description.blend))
            .depth_compare_op(vk::CompareOp::GREATER_OR_EQUAL);
        let colors: Vec<_> =
            description.color.map(|format| attachment_format(format, paints)).into_iter().collect();
        let attachments = vec![blend_state(description.blend); colors.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic_states = [
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::FRONT_FACE,
        ];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let depth_format = if has_depth { Format::Depth32.vk() } else { vk::Format::UNDEFINED };
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&colors)
            .depth_attachment_format(depth_format);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering);
        // SAFETY: all that `info` points to lives until the call returns; the
        // shaders come from naga's validated output. One info gives one
        // pipeline.
        unsafe {
            self.device.raw.create_graphics_pipelines(self.device.pipeline_cache(), &[info], None)
        }
        .map(|pipelines| pipelines[0])
        .map_err(|(_, code)| vulkan_error("compiling a pipeline")(code))
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        self.device.discard(DiscardedObject::Pipeline(self.raw, self.layout));
    }
}

/// Returns the attachment format of a target: without sRGB decoding for overlays.
fn attachment_format(format: Format, paints: bool) -> vk::Format {
    format.undecoded().filter(|_| paints).unwrap_or(format).vk()
}

fn vertex_input(
    buffers: &[VertexBuffer<'_>],
) -> (Vec<vk::VertexInputBindingDescription>, Vec<vk::VertexInputAttributeDescription>) {
    let binding_of = |(binding, buffer): (u32, &VertexBuffer<'_>)| {
        let rate = match buffer.per_instance {
            true => vk::VertexInputRate::INSTANCE,
            false => vk::VertexInputRate::VERTEX,
        };
        let description = vk::VertexInputBindingDescription::default();
        description.binding(binding).stride(buffer.stride).input_rate(rate)
    };
    let attributes_of = |(binding, buffer): (u32, &VertexBuffer<'_>)| {
        let attribute = move |attribute: &VertexAttribute| {
            vk::VertexInputAttributeDescription::default()
                .binding(binding)
                .location(attribute.location)
                .format(attribute.kind.vk())
                .offset(attribute.offset)
        };
        buffer.attributes.iter().map(attribute).collect::<Vec<_>>()
    };
    let bindings = (0..).zip(buffers).map(binding_of).collect();
    (bindings, (0..).zip(buffers).flat_map(attributes_of).collect())
}

/// Reports whether fragments write depth.
fn writes_depth(blend: Blend) -> bool {
    matches!(blend, Blend::Replace | Blend::AlphaToCoverage)
}

fn blend_state(blend: Blend) -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    let (color, alpha) = match blend {
        Blend::Replace | Blend::AlphaToCoverage | Blend::Over => (
            [Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA],
            [Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA],
        ),
        Blend::Multiply => ([Factor::ZERO, Factor::SRC_COLOR], [Factor::ZERO, Factor::ONE]),
        Blend::PremultipliedAlpha => {
            ([Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA], [Factor::ONE_MINUS_DST_ALPHA, Factor::ONE])
        }
    };
    vk::PipelineColorBlendAttachmentState {
        blend_enable: (!writes_depth(blend)).into(),
        src_color_blend_factor: color[0],
        dst_color_blend_factor: color[1],
        color_blend_op: vk::BlendOp::ADD,
        src_alpha_blend_factor: alpha[0],
        dst_alpha_blend_factor: alpha[1],
        alpha_blend_op: vk::BlendOp::ADD,
        color_write_mask: match blend {
            Blend::AlphaToCoverage => vk::ColorComponentFlags::RGBA & !vk::ColorComponentFlags::A,
            _ => vk::ColorComponentFlags::RGBA,
        },
    }
}

/// A shader module, needed only while a pipeline is compiled.
pub(crate) struct ShaderModule<'d> {
    device: &'d Device,
    raw: vk::ShaderModule,
}

impl<'d> ShaderModule<'d> {
    pub(crate) fn new(device: &'d Device, words: &[u32]) -> Result<Self, GpuError> {
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words are naga's validated output.
        let raw = unsafe { device.raw.create_shader_module(&info, None) }
            .map_err(vulkan_error("loading a shader"))?;
        Ok(Self { device, raw })
    }

    pub(crate) fn stage<'a>(
        &self,
        stage: vk::ShaderStageFlags,
        entry: &'a CStr,
    ) -> vk::PipelineShaderStageCreateInfo<'a> {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(self.raw).name(entry)
    }
}

impl Drop for ShaderModule<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines keep nothing of the modules they were compiled from.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}
