//! Quads of an instance each: mesh, pipelines and colours of lines, faces and planes.

use busbar_gpu::{
    AttributeKind, BindGroup, BindGroupLayout, Blend, Buffer, BufferUsage, DrawCall, Format, Gpu,
    GpuError, Pipeline, PipelineDescription, Recorder, ShaderStage, VertexAttribute, VertexBuffer,
};

/// Corners of every quad: along, and across.
const CORNERS: [[f32; 2]; 4] = [[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]];
const TRIANGLES: [u32; 6] = [0, 1, 2, 0, 2, 3];
/// The quad that every instance is.
pub(crate) struct QuadMesh {
    corners: Buffer,
    indices: Buffer,
}

impl QuadMesh {
    pub(crate) fn new(recorder: &mut Recorder<'_>) -> Result<Self, GpuError> {
        let corners = bytemuck::cast_slice(&CORNERS);
        let corners = recorder.upload_buffer("polyline corners", BufferUsage::Vertex, corners)?;
        let indices = bytemuck::cast_slice(&TRIANGLES);
        let indices = recorder.upload_buffer("polyline indices", BufferUsage::Index, indices)?;
        Ok(Self { corners, indices })
    }

    /// Makes a draw call of so many instances.
    pub(crate) fn draw<'a>(
        &'a self,
        pipeline: &'a Pipeline,
        groups: &'a [&'a BindGroup],
        (instances, count): (&'a Buffer, u32),
    ) -> DrawCall<'a> {
        DrawCall {
            pipeline,
            groups,
            vertices: &self.corners,
            vertex_offset: 0,
            first_vertex: 0,
            instances,
            indices: &self.indices,
            index_range: 0..TRIANGLES.len() as u32,
            instance_range: 0..count,
            cull_back: false,
            mirrored: false,
        }
    }
}

/// Converts an sRGB colour to the target's encoding (IEC 61966-2-1).
pub(crate) fn target_color(color: [u8; 3], undecoded: bool) -> [f32; 3] {
    color.map(|byte| {
        let value = f32::from(byte) / 255.0;
        match (undecoded, value <= 0.04045) {
            (true, _) => value,
            (false, true) => value / 12.92,
            (false, false) => ((value + 0.055) / 1.055).powf(2.4),
        }
    })
}

/// Shader and instance layout of a quad pipeline.
pub(crate) struct QuadShader {
    pub(crate) name: &'static str,
    pub(crate) words: &'static [u32],
    pub(crate) vertex: &'static std::ffi::CStr,
    pub(crate) fragment: &'static std::ffi::CStr,
    /// Bytes of an instance, which consists of vectors of four floats.
    pub(crate) bytes: usize,
}

const VECTOR_BYTES: usize = size_of::<[f32; 4]>();

/// Compiles the pipeline of a kind of quad.
pub(crate) fn quad_pipeline(
    gpu: &Gpu,
    groups: &[&BindGroupLayout],
    (color, samples): (Format, u32),
    kind: &QuadShader,
) -> Result<Pipeline, GpuError> {
    let corner = [VertexAttribute { location: 0, kind: AttributeKind::Float2, offset: 0 }];
    let vectors: Vec<_> = (0..kind.bytes / VECTOR_BYTES)
        .map(|index| VertexAttribute {
            location: 1 + index as u32,
            kind: AttributeKind::Float4,
            offset: (index * VECTOR_BYTES) as u32,
        })
        .collect();
    let buffer = |stride: usize, per_instance, attributes| VertexBuffer {
        stride: stride as u32,
        per_instance,
        attributes,
    };
    Pipeline::new(
        gpu,
        &PipelineDescription {
            name: kind.name,
            vertex: ShaderStage { words: kind.words, entry: kind.vertex },
            fragment: Some(ShaderStage { words: kind.words, entry: kind.fragment }),
            vertex_buffers: &[
                buffer(size_of::<[f32; 2]>(), false, &corner),
                buffer(kind.bytes, true, &vectors),
            ],
            groups,
            color: Some(color),
            samples,
            blend: Blend::Over,
            lines: false,
            screen: false,
        },
    )
}
