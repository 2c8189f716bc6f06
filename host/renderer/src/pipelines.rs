//! The pipelines of all passes.

use std::ffi::CStr;

use busbar_gpu::{
    BindGroupLayout, BindingKind, Blend, Format, Gpu, GpuError, Pipeline, PipelineDescription,
    ShaderStage,
};
use busbar_shaders::{PICK, SCENE, Vertex, WIREFRAME};

use crate::pick::ID_FORMAT;

/// Floats of [`Vertex`]'s position, normal and texture coordinate.
const VERTEX_FLOATS: [u32; 3] = [3, 3, 2];

/// Layouts of the three groups that `shaders/common/frame.wgsl` names.
pub(crate) struct Layouts {
    pub(crate) frame: BindGroupLayout,
    pub(crate) features: BindGroupLayout,
    pub(crate) material: BindGroupLayout,
}

impl Layouts {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        use BindingKind::{Sampler, Storage, Texture, Uniform};
        Ok(Self {
            frame: BindGroupLayout::new(gpu, &[Uniform, Storage, Storage])?,
            features: BindGroupLayout::new(gpu, &[Storage])?,
            material: BindGroupLayout::new(gpu, &[Uniform, Texture, Sampler, Texture, Sampler])?,
        })
    }
}

/// Compiled once, at start.
pub(crate) struct Pipelines {
    pub(crate) opaque: Pipeline,
    pub(crate) blended: Pipeline,
    pub(crate) wire_fill: Pipeline,
    /// `None` on a device that cannot draw lines.
    pub(crate) wire_lines: Option<Pipeline>,
    pub(crate) pick: Pipeline,
}

impl Pipelines {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        color: Format,
        samples: u32,
    ) -> Result<Self, GpuError> {
        let shaded = [&layouts.frame, &layouts.features, &layouts.material];
        let plain = [&layouts.frame, &layouts.features];
        let scene = Recipe {
            name: "scene",
            words: SCENE,
            vertex: c"vertex_main",
            fragment: c"fragment_main",
            groups: &shaded,
        };
        let fill = Recipe {
            name: "wireframe fill",
            words: WIREFRAME,
            vertex: c"fill_vertex",
            fragment: c"fill_fragment",
            groups: &plain,
        };
        let lines = Recipe {
            name: "wireframe lines",
            vertex: c"line_vertex",
            fragment: c"line_fragment",
            ..fill
        };
        let pick = Recipe { name: "pick", words: PICK, ..scene };
        let wire_lines = gpu
            .can_draw_lines()
            .then(|| lines.compile(gpu, color, samples, Blend::Replace, true))
            .transpose()?;
        Ok(Self {
            opaque: scene.compile(gpu, color, samples, Blend::Replace, false)?,
            blended: scene.compile(gpu, color, samples, Blend::Over, false)?,
            wire_fill: fill.compile(gpu, color, samples, Blend::Replace, false)?,
            wire_lines,
            pick: pick.compile(gpu, ID_FORMAT, 1, Blend::Replace, false)?,
        })
    }
}

/// The shaders of a pipeline and what they read.
#[derive(Clone, Copy)]
struct Recipe<'a> {
    name: &'a str,
    words: &'a [u32],
    vertex: &'a CStr,
    fragment: &'a CStr,
    groups: &'a [&'a BindGroupLayout],
}

impl Recipe<'_> {
    fn compile(
        &self,
        gpu: &Gpu,
        color: Format,
        samples: u32,
        blend: Blend,
        lines: bool,
    ) -> Result<Pipeline, GpuError> {
        Pipeline::new(
            gpu,
            &PipelineDescription {
                name: self.name,
                vertex: ShaderStage { words: self.words, entry: self.vertex },
                fragment: ShaderStage { words: self.words, entry: self.fragment },
                vertex_bytes: size_of::<Vertex>() as u32,
                attribute_floats: &VERTEX_FLOATS,
                groups: self.groups,
                color,
                samples,
                blend,
                lines,
            },
        )
    }
}
