//! The pipelines of all passes.

use std::ffi::CStr;

use busbar_gpu::{
    AttributeKind, BindGroupLayout, BindingKind, Blend, Format, Gpu, GpuError, Pipeline,
    PipelineDescription, ShaderStage, VertexAttribute, VertexBuffer,
};
use busbar_shaders::{Attribute, GROUND, Instance, LOW, PICK, SCENE, Vertex, WIREFRAME};

use crate::Quality;
use crate::material::GpuMaterial;
use crate::pick::ID_FORMAT;

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
            frame: BindGroupLayout::new(gpu, &[Uniform, Storage])?,
            features: BindGroupLayout::new(gpu, &[Storage])?,
            material: BindGroupLayout::new(gpu, &[Uniform, Texture, Sampler, Texture, Sampler])?,
        })
    }
}

/// Compiled once, at start.
pub(crate) struct Pipelines {
    pub(crate) opaque: Shading,
    pub(crate) blended: Shading,
    /// Whether the two above give colours as the picture's bytes keep them.
    pub(crate) undecoded: bool,
    /// `None` at low quality.
    pub(crate) ground: Option<Pipeline>,
    pub(crate) wire_fill: Shading,
    /// `None` on a device that cannot draw lines.
    pub(crate) wire_lines: Option<Shading>,
    pub(crate) pick: Shading,
}

/// What is highlighted of the instances that are drawn together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Highlights {
    None,
    /// Whole instances only.
    OfInstances,
    /// Some feature of some instance.
    OfFeatures,
}

/// Pipelines of one look, each for what it has to look at.
pub(crate) struct Shading {
    /// Draws everything.
    any: Pipeline,
    /// Draws, faster, meshes of which no feature is highlighted.
    without_features: Option<Pipeline>,
    /// Draws, faster still, plain materials (opaque and without textures) where
    /// nothing at all is highlighted.
    plain: Option<Pipeline>,
    /// Whether that shows only fronts, and only what does not shine by itself.
    plain_is_narrow: bool,
}

impl Shading {
    fn of_one(any: Pipeline) -> Self {
        Self { any, without_features: None, plain: None, plain_is_narrow: false }
    }

    /// The fastest pipeline that will do.
    pub(crate) fn pipeline(&self, highlights: Highlights, material: &GpuMaterial) -> &Pipeline {
        let is_narrow = !material.double_sided && !material.emits;
        let plain = material.plain && (is_narrow || !self.plain_is_narrow);
        let faster = match (highlights, plain) {
            (Highlights::None, true) => self.plain.as_ref().or(self.without_features.as_ref()),
            (Highlights::OfFeatures, _) => None,
            _ => self.without_features.as_ref(),
        };
        faster.unwrap_or(&self.any)
    }
}

impl Pipelines {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        quality: Quality,
        samples: u32,
    ) -> Result<Self, GpuError> {
        let color = gpu.picture_format();
        let undecoded = color.undecoded().filter(|_| quality == Quality::Low);
        let shaded = [&layouts.frame, &layouts.features, &layouts.material];
        let unlit = [&layouts.frame, &layouts.features];
        let scene = Recipe {
            name: "scene",
            words: if undecoded.is_some() { LOW } else { SCENE },
            vertex: c"feature_vertex_main",
            fragment: c"fragment_main",
            groups: &shaded,
        };
        let without_features =
            Recipe { name: "scene without features", vertex: c"vertex_main", ..scene };
        let plain = Recipe {
            name: "plain scene",
            vertex: c"plain_vertex_main",
            fragment: c"plain_fragment_main",
            ..scene
        };
        let fill = Recipe {
            name: "wireframe fill",
            words: WIREFRAME,
            vertex: c"fill_vertex",
            fragment: c"fill_fragment",
            groups: &unlit,
        };
        let lines = Recipe {
            name: "wireframe lines",
            vertex: c"line_vertex",
            fragment: c"line_fragment",
            ..fill
        };
        let pick = Recipe { name: "pick", words: PICK, vertex: c"vertex_main", ..scene };
        let ground = Recipe {
            name: "ground",
            words: GROUND,
            vertex: c"vertex_main",
            fragment: c"fragment_main",
            groups: &unlit[..1],
        };
        let shown = undecoded.unwrap_or(color);
        let solid =
            |recipe: &Recipe<'_>| recipe.compile(gpu, shown, samples, Blend::Replace, false);
        let clear = |recipe: &Recipe<'_>| recipe.compile(gpu, shown, samples, Blend::Over, false);
        let wire_lines = gpu
            .can_draw_lines()
            .then(|| lines.compile(gpu, color, samples, Blend::Replace, true))
            .transpose()?;
        Ok(Self {
            opaque: Shading {
                any: solid(&scene)?,
                without_features: Some(solid(&without_features)?),
                plain: Some(solid(&plain)?),
                plain_is_narrow: undecoded.is_some(),
            },
            undecoded: undecoded.is_some(),
            ground: undecoded.is_none().then(|| clear(&ground)).transpose()?,
            blended: Shading {
                any: clear(&scene)?,
                without_features: Some(clear(&without_features)?),
                plain: None,
                plain_is_narrow: false,
            },
            wire_fill: Shading::of_one(fill.compile(gpu, color, samples, Blend::Replace, false)?),
            wire_lines: wire_lines.map(Shading::of_one),
            pick: Shading::of_one(pick.compile(gpu, ID_FORMAT, 1, Blend::Replace, false)?),
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
                fragment: ShaderStage { words: self.words, entry: self.fragment },
                vertex_buffers: &[
                    buffer(size_of::<Vertex>(), false, &vertex),
                    buffer(size_of::<Instance>(), true, &instance),
                ],
                groups: self.groups,
                color,
                samples,
                blend,
                lines,
            },
        )
    }
}

fn attribute(attribute: Attribute) -> VertexAttribute {
    let kind = if attribute.whole { AttributeKind::Uint4 } else { AttributeKind::Float4 };
    VertexAttribute { location: attribute.location, kind, offset: attribute.offset }
}
