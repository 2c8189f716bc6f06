//! Materials on the device: uniforms, textures, samplers and their bind groups.

use std::collections::HashMap;
use std::sync::{Arc, Weak};

use busbar_gpu::{
    AddressMode, BindGroup, BindGroupLayout, Binding, BufferUsage, Format, GpuQueue, Image,
    Recorder, Sampler,
};
use busbar_scene::{AlphaMode, Material, Texture, TextureRef, Wrap};
use busbar_shaders::{MaterialUniform, vertex_color};

use crate::RenderError;
use crate::targets::srgb_from_linear;

/// Materials without textures that are kept in mind to be shared.
const MAX_SHARED_MATERIALS: usize = 4096;

/// Share of a metal's colour that low quality keeps, as `METAL` of the shader.
const LOW_METAL: f32 = 0.45;

/// A material ready to draw with.
pub(crate) struct GpuMaterial {
    pub(crate) group: Arc<BindGroup>,
    /// Number of the bind group, in order of creation.
    pub(crate) number: u32,
    pub(crate) blends: bool,
    pub(crate) double_sided: bool,
    /// Nothing behind it is seen.
    pub(crate) opaque: bool,
    /// Opaque and without textures.
    pub(crate) plain: bool,
    /// Emission: whether the material emits light.
    pub(crate) emits: bool,
    /// Vertex colour in place of texture coordinates, so that the material need not be bound.
    pub(crate) vertex_color: Option<[f32; 2]>,
}

impl GpuMaterial {
    /// Reports whether the material is single-sided and without emission.
    pub(crate) fn is_narrow(&self) -> bool {
        !self.double_sided && !self.emits
    }
}

/// Samplers, layout and shared bind groups of all materials.
pub(crate) struct MaterialResources {
    layout: BindGroupLayout,
    samplers: HashMap<[Wrap; 2], Sampler>,
    /// Bind groups of materials without textures, by their uniform: models often share them.
    untextured: HashMap<Vec<u8>, (u32, Weak<BindGroup>)>,
    /// Groups that there ever were.
    made: u32,
    /// Stands in where a material has no texture.
    white: Image,
    /// Vertex colours: whether vertices carry the colours of plain materials.
    colors_vertices: bool,
}

impl MaterialResources {
    pub(crate) fn new(
        queue: &mut GpuQueue,
        layout: BindGroupLayout,
        colors_vertices: bool,
    ) -> Result<Self, RenderError> {
        let wraps = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
        let mut samplers = HashMap::new();
        for u in wraps {
            for v in wraps {
                samplers.insert([u, v], Sampler::new(queue.gpu(), [u, v].map(address_mode))?);
            }
        }
        let mut recorder = queue.begin_transfer()?;
        let white = recorder.upload_texture("white", Format::Rgba8Linear, [1, 1], &[255; 4])?;
        recorder.submit_and_wait()?;
        Ok(Self { layout, samplers, untextured: HashMap::new(), made: 0, white, colors_vertices })
    }

    /// Uploads materials and the textures they use. The last one returned is
    /// the default material.
    pub(crate) fn upload(
        &mut self,
        recorder: &mut Recorder<'_>,
        materials: &[Material],
        textures: &[Texture],
    ) -> Result<Vec<GpuMaterial>, RenderError> {
        let mut uploaded = TextureUploads { textures, images: HashMap::new() };
        let default = Material::default();
        (0..)
            .zip(materials.iter().chain([&default]))
            .map(|(index, material)| self.upload_one(recorder, &mut uploaded, index, material))
            .collect()
    }

    fn upload_one(
        &mut self,
        recorder: &mut Recorder<'_>,
        textures: &mut TextureUploads<'_>,
        index: u32,
        material: &Material,
    ) -> Result<GpuMaterial, RenderError> {
        let is_textured =
            material.base_color_texture.is_some() || material.metallic_roughness_texture.is_some();
        let uniform = uniform_of(material);
        let bytes = bytemuck::bytes_of(&uniform);
        let shared = || {
            let (number, group) = self.untextured.get(bytes)?;
            Some((*number, group.upgrade()?))
        };
        let found = if is_textured { None } else { shared() };
        let (number, group) = match found {
            Some(found) => found,
            None => {
                let group = Arc::new(self.group(recorder, textures, (index, material), bytes)?);
                self.made += 1;
                if !is_textured {
                    self.share(bytes, &group);
                }
                (self.made, group)
            }
        };
        let mut made = GpuMaterial {
            group,
            number,
            blends: material.alpha == AlphaMode::Blend,
            double_sided: material.double_sided,
            emits: material.emissive != [0.0; 3],
            opaque: material.alpha == AlphaMode::Opaque,
            plain: material.alpha == AlphaMode::Opaque && !is_textured,
            vertex_color: None,
        };
        if self.colors_vertices && made.plain && made.is_narrow() {
            let [red, green, blue, _] = uniform.encoded_color;
            made.vertex_color = Some(vertex_color([red, green, blue]));
        }
        Ok(made)
    }

    /// Keeps the group made last in mind.
    fn share(&mut self, uniform: &[u8], group: &Arc<BindGroup>) {
        if self.untextured.len() == MAX_SHARED_MATERIALS {
            self.untextured.retain(|_, (_, group)| group.strong_count() > 0);
        }
        if self.untextured.len() < MAX_SHARED_MATERIALS {
            self.untextured.insert(uniform.to_vec(), (self.made, Arc::downgrade(group)));
        }
    }

    fn group(
        &self,
        recorder: &mut Recorder<'_>,
        textures: &mut TextureUploads<'_>,
        (index, material): (u32, &Material),
        uniform: &[u8],
    ) -> Result<BindGroup, RenderError> {
        let uniform = recorder.upload_buffer("material", BufferUsage::Uniform, uniform)?;
        let mut bound = |texture, format| {
            Ok::<_, RenderError>(match texture {
                None => (self.white.clone(), [Wrap::Repeat; 2]),
                Some(TextureRef { texture, wrap }) => {
                    (textures.get(recorder, index, texture, format)?, wrap)
                }
            })
        };
        let (color, color_wrap) = bound(material.base_color_texture, Format::Rgba8Srgb)?;
        let (rough, rough_wrap) = bound(material.metallic_roughness_texture, Format::Rgba8Linear)?;
        let bindings = [
            Binding::Buffer(&uniform),
            Binding::Texture(&color),
            Binding::Sampler(&self.samplers[&color_wrap]),
            Binding::Texture(&rough),
            Binding::Sampler(&self.samplers[&rough_wrap]),
        ];
        Ok(BindGroup::new(&self.layout, &bindings)?)
    }
}

/// Textures of one upload, each made once for each format it is used in.
struct TextureUploads<'a> {
    textures: &'a [Texture],
    images: HashMap<(u32, Format), Image>,
}

impl TextureUploads<'_> {
    fn get(
        &mut self,
        recorder: &mut Recorder<'_>,
        material: u32,
        index: u32,
        format: Format,
    ) -> Result<Image, RenderError> {
        if let Some(image) = self.images.get(&(index, format)) {
            return Ok(image.clone());
        }
        let texture =
            self.textures.get(index as usize).ok_or_else(|| RenderError::BadReference {
                place: format!("material {material}"),
                what: "texture",
                index,
                count: self.textures.len(),
            })?;
        let Texture { width, height, rgba8 } = texture;
        let (width, height, bytes) = (*width, *height, rgba8.len());
        if u64::from(width) * u64::from(height) * 4 != bytes as u64 || bytes == 0 {
            return Err(RenderError::BadTexture { index, width, height, bytes });
        }
        let image = recorder.upload_texture("texture", format, [width, height], rgba8)?;
        self.images.insert((index, format), image.clone());
        Ok(image)
    }
}

fn uniform_of(material: &Material) -> MaterialUniform {
    let (alpha_cutoff, alpha_used) = match material.alpha {
        AlphaMode::Opaque => (0.0, 0.0),
        AlphaMode::Mask(cutoff) => (cutoff, 1.0),
        AlphaMode::Blend => (0.0, 1.0),
    };
    let [r, g, b] = material.emissive;
    let metallic = material.metallic.clamp(0.0, 1.0);
    let kept = 1.0 + metallic * (LOW_METAL - 1.0);
    let [red, green, blue, _] = material.base_color.map(|c| srgb_from_linear(c * kept));
    MaterialUniform {
        base_color: material.base_color,
        emissive: [r, g, b, f32::from(u8::from(material.double_sided))],
        encoded_color: [red, green, blue, 0.0],
        metallic,
        roughness: material.roughness.clamp(0.0, 1.0),
        alpha_cutoff,
        alpha_used,
    }
}

fn address_mode(wrap: Wrap) -> AddressMode {
    match wrap {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::Clamp => AddressMode::Clamp,
        Wrap::Mirror => AddressMode::Mirror,
    }
}
