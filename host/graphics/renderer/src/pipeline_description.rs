//! Pipeline descriptions of mesh passes and full-screen passes.

use std::ffi::CStr;

use busbar_gpu::{
    AttributeKind, BindGroupLayout, Blend, Format, Gpu, GpuError, Pipeline, PipelineDescription,
    ShaderStage, VertexAttribute, VertexBuffer,
};
use busbar_shaders::{Attribute, Instance, Vertex};

/// Compiles a full-screen pipeline with one fragment shader.
pub(crate) fn screen_pipeline(
    gpu: &Gpu,
    (name, words, fragment): (&str, &[u32], &CStr),
    groups: &[&BindGroupLayout],
    (color, blend): (Format, Blend),
) -> Result<Pipeline, GpuError> {
    Pipeline::new(
        gpu,
        &PipelineDescription {
            name,
            vertex: ShaderStage { words, entry: c"screen_main" },
            fragment: Some(ShaderStage { words, entry: fragment }),
            vertex_buffers: &[],
            groups,
            color: Some(color),
            samples: 1,
            blend,
            lines: false,
            screen: true,
        },
    )
}

/// Shaders of a mesh pipeline and their bind groups.
#[derive(Clone, Copy)]
pub(crate) struct MeshPipelineDescription<'a> {
    pub(crate) name: &'a str,
    pub(crate) words: &'a [u32],
    pub(crate) vertex: &'a CStr,
    pub(crate) fragment: Option<&'a CStr>,
    pub(crate) groups: &'a [&'a BindGroupLayout],
}

impl MeshPipelineDescription<'_> {
    pub(crate) fn compile(
        &self,
        gpu: &Gpu,
        color: Option<Format>,
        samples: u32,
        blend: Blend,
        lines: bool,
    ) -> Result<Pipeline, GpuError> {
        let vertex = Vertex::ATTRIBUTES.map(attribute);
        let instance = Instance::ATTRIBUTES.map(attribute);
        let buffer = |stride: usize, per_instance, attributes| VertexBuffer {
            stride: stride as u32,
            per_instance,
            attributes,
        };
        Pipeline::new(
            gpu,
            &PipelineDescription {
                name: self.name,
                vertex: ShaderStage { words: self.words, entry: self.vertex },
                fragment: self.fragment.map(|entry| ShaderStage { words: self.words, entry }),
                vertex_buffers: &[
                    buffer(size_of::<Vertex>(), false, &vertex),
                    buffer(size_of::<Instance>(), true, &instance),
                ],
                groups: self.groups,
                color,
                samples,
                blend,
                lines,
                screen: false,
            },
        )
    }
}

fn attribute(attribute: Attribute) -> VertexAttribute {
    let kind = if attribute.whole { AttributeKind::Uint4 } else { AttributeKind::Float4 };
    VertexAttribute { location: attribute.location, kind, offset: attribute.offset }
}
