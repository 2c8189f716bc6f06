//! The pipelines of all passes.

use busbar_gpu::{BindGroupLayout, BindingKind, Blend, Format, Gpu, GpuError, Pipeline};
use busbar_shaders::{GROUND, GROUND_SHADOWED, MASK, MASK_SECTION};

use crate::Quality;
use crate::batch::Batch;
use crate::layer::ready;
use crate::material::GpuMaterial;
use crate::pick::ID_FORMAT;
use crate::recipe::Recipe;
use crate::words::Words;

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

/// What quality and samples ask of pipelines.
#[derive(Clone, Copy)]
struct Asked {
    quality: Quality,
    samples: u32,
}

/// What a picture needs besides pipelines for what is opaque.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Needed {
    pub(crate) section: bool,
    pub(crate) blended: bool,
    pub(crate) wireframe: bool,
    pub(crate) pick: bool,
}

/// Compiled once: what all frames need at start, the rest when something first does.
pub(crate) struct Pipelines {
    asked: Asked,
    whole: Looks,
    section: Option<Looks>,
    /// What shaded pictures are drawn in.
    pub(crate) target: Format,
    /// Whether shaded pictures come as their bytes keep them.
    pub(crate) undecoded: bool,
    /// `None` at low quality.
    pub(crate) ground: Option<Pipeline>,
}

/// Pipelines of all that draws meshes, with a section plane or without.
pub(crate) struct Looks {
    pub(crate) opaque: Shading,
    /// `None` until they are needed.
    pub(crate) blended: Option<Shading>,
    pub(crate) wireframe: Option<Wireframe>,
    pub(crate) pick: Option<Shading>,
    /// `None` unless at high quality.
    pub(crate) shadow: Option<Shading>,
}

/// Pipelines of wireframes.
pub(crate) struct Wireframe {
    pub(crate) fill: Shading,
    /// `None` on a device that cannot draw lines.
    pub(crate) lines: Option<Shading>,
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
    /// Draws the same where vertices bring their colours.
    colored: Option<Pipeline>,
    /// For what is slender.
    slender: Option<Slender>,
}

/// Pipelines that draw what is slender at least a pixel wide.
struct Slender {
    any: Pipeline,
    plain: Pipeline,
}

/// A pipeline for what is drawn.
pub(crate) struct Chosen<'a> {
    /// Among those of the look.
    pub(crate) place: u8,
    pub(crate) pipeline: &'a Pipeline,
    /// Whether it finds out which feature a vertex is of.
    pub(crate) finds_features: bool,
    /// Whether it looks the material up.
    pub(crate) finds_material: bool,
}

impl Shading {
    fn of_one(any: Pipeline) -> Self {
        Self {
            any,
            without_features: None,
            plain: None,
            plain_is_narrow: false,
            colored: None,
            slender: None,
        }
    }

    /// Whether what is slender has pipelines of its own.
    pub(crate) fn widens(&self) -> bool {
        self.slender.is_some()
    }

    /// The fastest pipeline that will do.
    pub(crate) fn pipeline(
        &self,
        batch: &Batch,
        material: &GpuMaterial,
        is_slender: bool,
    ) -> Chosen<'_> {
        let highlights = batch.highlights;
        let chosen = |place, pipeline, finds_features| Chosen {
            place,
            pipeline,
            finds_features,
            finds_material: true,
        };
        let plain = material.plain && (material.is_narrow() || !self.plain_is_narrow);
        // On its way a vertex is between two colours, which are no numbers.
        let colored = self.colored.as_ref().filter(|_| {
            material.vertex_color.is_some()
                && batch.way.is_none()
                && highlights == Highlights::None
                && !is_slender
        });
        if let Some(colored) = colored {
            return Chosen { finds_material: false, ..chosen(5, colored, false) };
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
        let ground = Recipe {
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
        let asked = Asked { quality, samples };
        Ok(Self {
            asked,
            whole: Making::of(gpu, layouts, asked, false).looks()?,
            section: None,
            target: shown_undecoded(gpu, quality).unwrap_or(color),
            undecoded: shown_undecoded(gpu, quality).is_some(),
            ground,
        })
    }

    /// Compiles what a picture needs and none needed before.
    pub(crate) fn ready(
        &mut self,
        gpu: &Gpu,
        layouts: &Layouts,
        needed: Needed,
    ) -> Result<(), GpuError> {
        let making = Making::of(gpu, layouts, self.asked, needed.section);
        let looks = match needed.section {
            true => ready(&mut self.section, || making.looks())?,
            false => &mut self.whole,
        };
        if needed.blended {
            ready(&mut looks.blended, || making.blended())?;
        }
        if needed.wireframe {
            ready(&mut looks.wireframe, || making.wireframe())?;
        }
        if needed.pick {
            ready(&mut looks.pick, || making.pick())?;
        }
        Ok(())
    }

    /// Those that are ready.
    pub(crate) fn looks(&self, is_section: bool) -> &Looks {
        self.section.as_ref().filter(|_| is_section).unwrap_or(&self.whole)
    }
}

/// The format that low quality draws in, where the picture's has one.
fn shown_undecoded(gpu: &Gpu, quality: Quality) -> Option<Format> {
    gpu.picture_format().undecoded().filter(|_| quality == Quality::Low)
}

/// What pipelines of a look are made from.
struct Making<'a> {
    gpu: &'a Gpu,
    /// The groups that shaded things name.
    groups: [&'a BindGroupLayout; 3],
    words: Words,
    samples: u32,
    /// What [`shown_undecoded`] says.
    undecoded: Option<Format>,
    is_section: bool,
}

impl<'a> Making<'a> {
    fn of(gpu: &'a Gpu, layouts: &'a Layouts, asked: Asked, is_section: bool) -> Self {
        let Asked { quality, samples } = asked;
        let undecoded = shown_undecoded(gpu, quality);
        let words = Words::of(quality, undecoded.is_some(), is_section);
        let groups = [&layouts.frame, &layouts.features, &layouts.material];
        Self { gpu, groups, words, samples, undecoded, is_section }
    }

    /// Those that all frames need.
    fn looks(&self) -> Result<Looks, GpuError> {
        let shadow = self.words.shadow.map(|words| self.shadow(words)).transpose()?;
        Ok(Looks { opaque: self.opaque()?, blended: None, wireframe: None, pick: None, shadow })
    }

    fn opaque(&self) -> Result<Shading, GpuError> {
        let plain = Recipe {
            name: "plain scene",
            vertex: c"plain_vertex_main",
            fragment: Some(c"plain_fragment_main"),
            ..self.scene()
        };
        // A cut asks the material whether it shows both sides.
        let brings_colors = self.undecoded.is_some() && !self.is_section;
        let colored = Recipe {
            name: "colored scene",
            vertex: c"colored_vertex_main",
            groups: &self.groups[..1],
            ..plain
        };
        Ok(Shading {
            any: self.shaded(&self.scene(), Blend::Replace)?,
            without_features: Some(self.shaded(&self.without_features(), Blend::Replace)?),
            plain: Some(self.shaded(&plain, Blend::Replace)?),
            plain_is_narrow: self.undecoded.is_some(),
            colored: brings_colors.then(|| self.shaded(&colored, Blend::Replace)).transpose()?,
            slender: Some(self.slender()?),
        })
    }

    fn blended(&self) -> Result<Shading, GpuError> {
        Ok(Shading {
            any: self.shaded(&self.scene(), Blend::Over)?,
            without_features: Some(self.shaded(&self.without_features(), Blend::Over)?),
            plain: None,
            plain_is_narrow: false,
            colored: None,
            slender: None,
        })
    }

    fn wireframe(&self) -> Result<Wireframe, GpuError> {
        let fill = Recipe {
            name: "wireframe fill",
            words: self.words.wireframe,
            vertex: c"fill_vertex",
            fragment: Some(c"fill_fragment"),
            groups: &self.groups[..2],
        };
        let lines = Recipe {
            name: "wireframe lines",
            vertex: c"line_vertex",
            fragment: Some(c"line_fragment"),
            ..fill
        };
        let color = self.gpu.picture_format();
        let wired = |recipe: &Recipe<'_>, lines| {
            recipe.compile(self.gpu, Some(color), self.samples, Blend::Replace, lines)
        };
        let can_draw_lines = self.gpu.can_draw_lines();
        let lines = can_draw_lines.then(|| wired(&lines, true)).transpose()?;
        let fill = Shading::of_one(wired(&fill, false)?);
        Ok(Wireframe { fill, lines: lines.map(Shading::of_one) })
    }

    fn pick(&self) -> Result<Shading, GpuError> {
        let scene = self.scene();
        let pick = Recipe { name: "pick", words: self.words.pick, vertex: c"vertex_main", ..scene };
        let compiled = pick.compile(self.gpu, Some(ID_FORMAT), 1, Blend::Replace, false)?;
        Ok(Shading::of_one(compiled))
    }

    /// With several samples a pixel, what is widened covers as many of them as it would cover
    /// of the pixel; with one sample it covers it.
    fn slender(&self) -> Result<Slender, GpuError> {
        let compile = |name, vertex, fragment| {
            let recipe = Recipe { name, vertex, fragment: Some(fragment), ..self.scene() };
            self.shaded(&recipe, Blend::Cover)
        };
        let (any, plain) = (c"slender_vertex_main", c"plain_slender_vertex_main");
        Ok(Slender {
            any: compile("slender scene", any, c"slender_fragment_main")?,
            plain: compile("plain slender scene", plain, c"plain_slender_fragment_main")?,
        })
    }

    /// What the sun sees: depth, with holes where materials have them.
    fn shadow(&self, words: &[u32]) -> Result<Shading, GpuError> {
        let with_holes = Recipe {
            name: "shadow",
            words,
            vertex: c"vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &self.groups,
        };
        let plain = Recipe {
            name: "plain shadow",
            vertex: c"plain_vertex_main",
            fragment: self.is_section.then_some(c"plain_fragment_main"),
            ..with_holes
        };
        let depth = |recipe: &Recipe<'_>| recipe.compile(self.gpu, None, 1, Blend::Replace, false);
        Ok(Shading {
            any: depth(&with_holes)?,
            without_features: None,
            plain: Some(depth(&plain)?),
            plain_is_narrow: false,
            colored: None,
            slender: None,
        })
    }

    fn scene(&self) -> Recipe<'_> {
        Recipe {
            name: "scene",
            words: self.words.scene,
            vertex: c"feature_vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &self.groups,
        }
    }

    fn without_features(&self) -> Recipe<'_> {
        Recipe { name: "scene without features", vertex: c"vertex_main", ..self.scene() }
    }

    fn shaded(&self, recipe: &Recipe<'_>, blend: Blend) -> Result<Pipeline, GpuError> {
        let format = self.undecoded.unwrap_or(self.gpu.picture_format());
        recipe.compile(self.gpu, Some(format), self.samples, blend, false)
    }
}

/// What draws the mask of outlines.
pub(crate) struct MaskShading {
    pub(crate) faces: Shading,
    /// `None` on a device that cannot draw lines.
    pub(crate) edges: Option<Shading>,
}

impl MaskShading {
    pub(crate) fn new(gpu: &Gpu, layouts: &Layouts, is_section: bool) -> Result<Self, GpuError> {
        let Layouts { frame, features, material, texture } = layouts;
        let recipe = Recipe {
            name: "outline mask",
            words: if is_section { MASK_SECTION } else { MASK },
            vertex: c"vertex_main",
            fragment: Some(c"fragment_main"),
            groups: &[frame, features, material, texture],
        };
        let compile = |lines| recipe.compile(gpu, Some(ID_FORMAT), 1, Blend::Replace, lines);
        let edges = gpu.can_draw_lines().then(|| compile(true)).transpose()?;
        Ok(Self { faces: Shading::of_one(compile(false)?), edges: edges.map(Shading::of_one) })
    }
}
