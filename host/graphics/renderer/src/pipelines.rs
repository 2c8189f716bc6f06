//! Graphics pipelines of all mesh passes, compiled on first use.

use busbar_gpu::{BindGroupLayout, BindingKind, Blend, Format, Gpu, GpuError, Pipeline};
use busbar_shaders::{GROUND, GROUND_SHADOWED, MASK, MASK_SECTION};

use crate::Quality;
use crate::batch::{Batch, Highlights};
use crate::layer::get_or_create;
use crate::material::GpuMaterial;
use crate::pick::ID_FORMAT;
use crate::pipeline_description::MeshPipelineDescription;
use crate::shader_set::ShaderSet;

/// Layouts of the groups that the shaders name: those of `shaders/common/frame.wgsl`, and
/// of a single texture.
pub(crate) struct Layouts {
    pub(crate) frame: BindGroupLayout,
    pub(crate) features: BindGroupLayout,
    pub(crate) material: BindGroupLayout,
    pub(crate) texture: BindGroupLayout,
}

impl Layouts {
    pub(crate) fn new(gpu: &Gpu, quality: Quality) -> Result<Self, GpuError> {
        use BindingKind::{Sampler, Storage, Texture, Uniform};
        let frame = [Uniform, Storage, Texture, Sampler];
        let of_frame = if quality == Quality::High { &frame[..] } else { &frame[..2] };
        Ok(Self {
            frame: BindGroupLayout::new(gpu, of_frame)?,
            features: BindGroupLayout::new(gpu, &[Storage])?,
            material: BindGroupLayout::new(gpu, &[Uniform, Texture, Sampler, Texture, Sampler])?,
            texture: BindGroupLayout::new(gpu, &[Texture])?,
        })
    }
}

/// Settings of a picture that decide its pipelines.
#[derive(Clone, Copy)]
struct QualitySettings {
    quality: Quality,
    samples: u32,
}

/// Pipelines that a picture needs besides those of opaque meshes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RequiredPipelines {
    pub(crate) section: bool,
    pub(crate) blended: bool,
    pub(crate) wireframe: bool,
    pub(crate) pick: bool,
}

/// Pipelines compiled once: those of all frames at start, others on first use.
pub(crate) struct Pipelines {
    settings: QualitySettings,
    whole: MeshPipelines,
    section: Option<MeshPipelines>,
    /// Colour format of shaded pictures.
    pub(crate) target: Format,
    /// Encoding: whether shaders write sRGB-encoded colours.
    pub(crate) undecoded: bool,
    /// `None` at low quality.
    pub(crate) ground: Option<Pipeline>,
}

/// Pipelines of all that draws meshes, with a section plane or without.
pub(crate) struct MeshPipelines {
    pub(crate) opaque: PipelineVariants,
    /// `None` until they are needed.
    pub(crate) blended: Option<PipelineVariants>,
    pub(crate) wireframe: Option<Wireframe>,
    pub(crate) pick: Option<PipelineVariants>,
    /// `None` unless at high quality.
    pub(crate) shadow: Option<PipelineVariants>,
}

/// Pipelines that draw wireframes.
pub(crate) struct Wireframe {
    pub(crate) fill: PipelineVariants,
    /// `None` on a device that cannot draw lines.
    pub(crate) lines: Option<PipelineVariants>,
}

/// Variants of one pipeline, each the fastest for some meshes.
pub(crate) struct PipelineVariants {
    /// Pipeline that draws every mesh.
    any: Pipeline,
    /// Draws, faster, meshes of which no feature is highlighted.
    without_features: Option<Pipeline>,
    /// Draws, faster still, plain materials (opaque and without textures) where
    /// nothing at all is highlighted.
    plain: Option<Pipeline>,
    /// Restriction of `plain` to single-sided materials without emission.
    plain_is_narrow: bool,
    /// Pipeline of plain materials whose vertices carry their colours.
    colored: Option<Pipeline>,
    /// Pipelines of slender islands, if any.
    slender: Option<SlenderPipelines>,
}

/// Pipelines that draw slender islands at least a pixel wide.
struct SlenderPipelines {
    any: Pipeline,
    plain: Pipeline,
}

/// Pipeline selected for a section.
pub(crate) struct SelectedPipeline<'a> {
    /// Among those of the look.
    pub(crate) place: u8,
    pub(crate) pipeline: &'a Pipeline,
    /// Feature lookup: whether the shader reads the feature of a vertex.
    pub(crate) reads_features: bool,
    /// Material lookup: whether the shader reads the material.
    pub(crate) reads_material: bool,
}

impl PipelineVariants {
    fn single(any: Pipeline) -> Self {
        Self {
            any,
            without_features: None,
            plain: None,
            plain_is_narrow: false,
            colored: None,
            slender: None,
        }
    }

    /// Reports whether slender islands have pipelines of their own.
    pub(crate) fn has_slender(&self) -> bool {
        self.slender.is_some()
    }

    /// Selects the fastest pipeline that draws a section correctly.
    pub(crate) fn pipeline(
        &self,
        batch: &Batch,
        material: &GpuMaterial,
        is_slender: bool,
    ) -> SelectedPipeline<'_> {
        let highlights = batch.highlights;
        let chosen = |place, pipeline, reads_features| SelectedPipeline {
            place,
            pipeline,
            reads_features,
            reads_material: true,
        };
        let plain = material.plain && (material.is_narrow() || !self.plain_is_narrow);
        // On its way a vertex is between two colours, which are no numbers.
        let colored = self.colored.as_ref().filter(|_| {
            material.vertex_color.is_some()
                && batch.morph.is_none()
                && highlights == Highlights::None
                && !is_slender
        });
        if let Some(colored) = colored {
            return SelectedPipeline { reads_material: false, ..chosen(5, colored, false) };
        }
        if let Some(slender) = self.slender.as_ref().filter(|_| is_slender) {
            return match (highlights, plain) {
                (Highlights::None, true) => chosen(3, &slender.plain, false),
                _ => chosen(4, &slender.any, true),
            };
        }
        let without_features = || Some(chosen(1, self.without_features.as_ref()?, false));
        let faster = match (highlights, plain) {
            (Highlights::None, true) => {
                self.plain.as_ref().map(|plain| chosen(0, plain, false)).or_else(without_features)
            }
            (Highlights::OfFeatures, _) => None,
            _ => without_features(),
        };
        faster.unwrap_or_else(|| chosen(2, &self.any, true))
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
        let ground = MeshPipelineDescription {
            name: "ground",
            words: if quality == Quality::High { GROUND_SHADOWED } else { GROUND },
            vertex: c"vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &[&layouts.frame],
        };
        let ground = match quality {
            Quality::Low => None,
            _ => Some(ground.compile(gpu, Some(color), samples, Blend::Over, false)?),
        };
        let settings = QualitySettings { quality, samples };
        Ok(Self {
            settings,
            whole: PipelineBuilder::new(gpu, layouts, settings, false).mesh_pipelines()?,
            section: None,
            target: shown_undecoded(gpu, quality).unwrap_or(color),
            undecoded: shown_undecoded(gpu, quality).is_some(),
            ground,
        })
    }

    /// Compiles the pipelines that a picture needs and no earlier one needed.
    pub(crate) fn ensure(
        &mut self,
        gpu: &Gpu,
        layouts: &Layouts,
        needed: RequiredPipelines,
    ) -> Result<(), GpuError> {
        let builder = PipelineBuilder::new(gpu, layouts, self.settings, needed.section);
        let mesh_pipelines = match needed.section {
            true => get_or_create(&mut self.section, || builder.mesh_pipelines())?,
            false => &mut self.whole,
        };
        if needed.blended {
            get_or_create(&mut mesh_pipelines.blended, || builder.blended())?;
        }
        if needed.wireframe {
            get_or_create(&mut mesh_pipelines.wireframe, || builder.wireframe())?;
        }
        if needed.pick {
            get_or_create(&mut mesh_pipelines.pick, || builder.pick())?;
        }
        Ok(())
    }

    /// Returns the pipelines compiled so far.
    pub(crate) fn mesh_pipelines(&self, is_section: bool) -> &MeshPipelines {
        self.section.as_ref().filter(|_| is_section).unwrap_or(&self.whole)
    }
}

/// Returns the format that low quality draws in, where the picture's has one.
fn shown_undecoded(gpu: &Gpu, quality: Quality) -> Option<Format> {
    gpu.picture_format().undecoded().filter(|_| quality == Quality::Low)
}

/// Builder of the mesh pipelines of one quality.
struct PipelineBuilder<'a> {
    gpu: &'a Gpu,
    /// The groups that shaded things name.
    groups: [&'a BindGroupLayout; 3],
    shaders: ShaderSet,
    samples: u32,
    /// Format that [`shown_undecoded`] returns.
    undecoded: Option<Format>,
    is_section: bool,
}

impl<'a> PipelineBuilder<'a> {
    fn new(
        gpu: &'a Gpu,
        layouts: &'a Layouts,
        settings: QualitySettings,
        is_section: bool,
    ) -> Self {
        let QualitySettings { quality, samples } = settings;
        let undecoded = shown_undecoded(gpu, quality);
        let shaders = ShaderSet::new(quality, undecoded.is_some(), is_section);
        let groups = [&layouts.frame, &layouts.features, &layouts.material];
        Self { gpu, groups, shaders, samples, undecoded, is_section }
    }

    /// Builds the pipelines that all frames need.
    fn mesh_pipelines(&self) -> Result<MeshPipelines, GpuError> {
        let shadow = self.shaders.shadow.map(|words| self.shadow(words)).transpose()?;
        Ok(MeshPipelines {
            opaque: self.opaque()?,
            blended: None,
            wireframe: None,
            pick: None,
            shadow,
        })
    }

    fn opaque(&self) -> Result<PipelineVariants, GpuError> {
        let plain = MeshPipelineDescription {
            name: "plain scene",
            vertex: c"plain_vertex_main",
            fragment: Some(c"plain_fragment_main"),
            ..self.scene()
        };
        // A cut asks the material whether it shows both sides.
        let brings_colors = self.undecoded.is_some() && !self.is_section;
        let colored = MeshPipelineDescription {
            name: "colored scene",
            vertex: c"colored_vertex_main",
            groups: &self.groups[..1],
            ..plain
        };
        Ok(PipelineVariants {
            any: self.shaded(&self.scene(), Blend::Replace)?,
            without_features: Some(self.shaded(&self.without_features(), Blend::Replace)?),
            plain: Some(self.shaded(&plain, Blend::Replace)?),
            plain_is_narrow: self.undecoded.is_some(),
            colored: brings_colors.then(|| self.shaded(&colored, Blend::Replace)).transpose()?,
            slender: Some(self.slender()?),
        })
    }

    fn blended(&self) -> Result<PipelineVariants, GpuError> {
        Ok(PipelineVariants {
            any: self.shaded(&self.scene(), Blend::Over)?,
            without_features: Some(self.shaded(&self.without_features(), Blend::Over)?),
            plain: None,
            plain_is_narrow: false,
            colored: None,
            slender: None,
        })
    }

    fn wireframe(&self) -> Result<Wireframe, GpuError> {
        let fill = MeshPipelineDescription {
            name: "wireframe fill",
            words: self.shaders.wireframe,
            vertex: c"fill_vertex",
            fragment: Some(c"fill_fragment"),
            groups: &self.groups[..2],
        };
        let lines = MeshPipelineDescription {
            name: "wireframe lines",
            vertex: c"line_vertex",
            fragment: Some(c"line_fragment"),
            ..fill
        };
        let color = self.gpu.picture_format();
        let wired = |description: &MeshPipelineDescription<'_>, lines| {
            description.compile(self.gpu, Some(color), self.samples, Blend::Replace, lines)
        };
        let can_draw_lines = self.gpu.can_draw_lines();
        let lines = can_draw_lines.then(|| wired(&lines, true)).transpose()?;
        let fill = PipelineVariants::single(wired(&fill, false)?);
        Ok(Wireframe { fill, lines: lines.map(PipelineVariants::single) })
    }

    fn pick(&self) -> Result<PipelineVariants, GpuError> {
        let scene = self.scene();
        let pick = MeshPipelineDescription {
            name: "pick",
            words: self.shaders.pick,
            vertex: c"vertex_main",
            ..scene
        };
        let compiled = pick.compile(self.gpu, Some(ID_FORMAT), 1, Blend::Replace, false)?;
        Ok(PipelineVariants::single(compiled))
    }

    /// Builds the slender pipelines. With several samples a pixel, coverage follows the true width;
    /// with one sample the pixel is covered.
    fn slender(&self) -> Result<SlenderPipelines, GpuError> {
        let compile = |name, vertex, fragment| {
            let description =
                MeshPipelineDescription { name, vertex, fragment: Some(fragment), ..self.scene() };
            self.shaded(&description, Blend::AlphaToCoverage)
        };
        let (any, plain) = (c"slender_vertex_main", c"plain_slender_vertex_main");
        Ok(SlenderPipelines {
            any: compile("slender scene", any, c"slender_fragment_main")?,
            plain: compile("plain slender scene", plain, c"plain_slender_fragment_main")?,
        })
    }

    /// Builds the shadow pipelines: depth alone, with holes where materials have them.
    fn shadow(&self, words: &[u32]) -> Result<PipelineVariants, GpuError> {
        let with_holes = MeshPipelineDescription {
            name: "shadow",
            words,
            vertex: c"vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &self.groups,
        };
        let plain = MeshPipelineDescription {
            name: "plain shadow",
            vertex: c"plain_vertex_main",
            fragment: self.is_section.then_some(c"plain_fragment_main"),
            ..with_holes
        };
        let depth = |description: &MeshPipelineDescription<'_>| {
            description.compile(self.gpu, None, 1, Blend::Replace, false)
        };
        Ok(PipelineVariants {
            any: depth(&with_holes)?,
            without_features: None,
            plain: Some(depth(&plain)?),
            plain_is_narrow: false,
            colored: None,
            slender: None,
        })
    }

    fn scene(&self) -> MeshPipelineDescription<'_> {
        MeshPipelineDescription {
            name: "scene",
            words: self.shaders.scene,
            vertex: c"feature_vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &self.groups,
        }
    }

    fn without_features(&self) -> MeshPipelineDescription<'_> {
        MeshPipelineDescription {
            name: "scene without features",
            vertex: c"vertex_main",
            ..self.scene()
        }
    }

    fn shaded(
        &self,
        description: &MeshPipelineDescription<'_>,
        blend: Blend,
    ) -> Result<Pipeline, GpuError> {
        let format = self.undecoded.unwrap_or(self.gpu.picture_format());
        description.compile(self.gpu, Some(format), self.samples, blend, false)
    }
}

/// Pipelines of the outline mask.
pub(crate) struct OutlineMaskPipelines {
    pub(crate) faces: PipelineVariants,
    /// `None` on a device that cannot draw lines.
    pub(crate) edges: Option<PipelineVariants>,
}

impl OutlineMaskPipelines {
    pub(crate) fn new(gpu: &Gpu, layouts: &Layouts, is_section: bool) -> Result<Self, GpuError> {
        let Layouts { frame, features, material, texture } = layouts;
        let description = MeshPipelineDescription {
            name: "outline mask",
            words: if is_section { MASK_SECTION } else { MASK },
            vertex: c"vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &[frame, features, material, texture],
        };
        let compile = |lines| description.compile(gpu, Some(ID_FORMAT), 1, Blend::Replace, lines);
        let edges = gpu.can_draw_lines().then(|| compile(true)).transpose()?;
        Ok(Self {
            faces: PipelineVariants::single(compile(false)?),
            edges: edges.map(PipelineVariants::single),
        })
    }
}
