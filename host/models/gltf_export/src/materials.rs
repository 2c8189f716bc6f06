//! Material export: materials, textures, samplers and embedded images.

use busbar_scene::{AlphaMode, Material, Model, Texture, TextureRef, Wrap};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use crate::ExportError;
use crate::binary::Binary;
use crate::document::{self, Document, Image, PbrMetallicRoughness, Sampler, TextureInfo};
use crate::extensions::{EMISSIVE_STRENGTH, EmissiveStrength, MaterialExtensions};

const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

/// Gives each image, sampler and texture one place in the file.
pub(crate) struct MaterialWriter<'a> {
    model: &'a Model,
    document: &'a mut Document,
    binary: &'a mut Binary,
    image_of_texture: Vec<Option<u32>>,
    samplers: Vec<[Wrap; 2]>,
    refs: Vec<TextureRef>,
}

impl<'a> MaterialWriter<'a> {
    /// Writes all materials, in order, with their textures and images.
    pub(crate) fn write(
        model: &'a Model,
        document: &'a mut Document,
        binary: &'a mut Binary,
    ) -> Result<(), ExportError> {
        let mut writer = Self {
            model,
            document,
            binary,
            image_of_texture: vec![None; model.textures.len()],
            samplers: Vec::new(),
            refs: Vec::new(),
        };
        for material in &model.materials {
            let written = writer.material(material)?;
            writer.document.materials.push(written);
        }
        Ok(())
    }

    fn material(&mut self, material: &Material) -> Result<document::Material, ExportError> {
        let (alpha_mode, alpha_cutoff) = match material.alpha {
            AlphaMode::Opaque => ("OPAQUE", None),
            AlphaMode::Mask(cutoff) => ("MASK", Some(cutoff)),
            AlphaMode::Blend => ("BLEND", None),
        };
        let strength = emissive_strength(material.emissive);
        if strength > 1.0 {
            self.document.use_extension(EMISSIVE_STRENGTH);
        }
        Ok(document::Material {
            name: material.name.clone(),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: material.base_color,
                base_color_texture: self.texture(material.base_color_texture)?,
                metallic_factor: material.metallic,
                roughness_factor: material.roughness,
                metallic_roughness_texture: self.texture(material.metallic_roughness_texture)?,
            },
            emissive_factor: material.emissive.map(|light| light / strength),
            alpha_mode,
            alpha_cutoff,
            double_sided: material.double_sided,
            extensions: (strength > 1.0).then_some(MaterialExtensions {
                emissive_strength: EmissiveStrength { emissive_strength: strength },
            }),
        })
    }

    fn texture(&mut self, texture: Option<TextureRef>) -> Result<Option<TextureInfo>, ExportError> {
        let Some(texture) = texture else {
            return Ok(None);
        };
        if let Some(index) = self.refs.iter().position(|&r| r == texture) {
            return Ok(Some(TextureInfo { index: index as u32 }));
        }
        let source = self.image(texture.texture)?;
        let sampler = self.sampler(texture.wrap);
        self.document.textures.push(document::Texture { sampler, source });
        self.refs.push(texture);
        Ok(Some(TextureInfo { index: self.refs.len() as u32 - 1 }))
    }

    fn image(&mut self, texture: u32) -> Result<u32, ExportError> {
        let index = texture as usize;
        if let Some(image) = self.image_of_texture[index] {
            return Ok(image);
        }
        let png = encode_png(&self.model.textures[index])
            .map_err(|reason| ExportError::Png { texture: index, reason })?;
        let buffer_view = self.binary.embed(png);
        self.document.images.push(Image { buffer_view, mime_type: "image/png" });
        let image = self.document.images.len() as u32 - 1;
        self.image_of_texture[index] = Some(image);
        Ok(image)
    }

    fn sampler(&mut self, wrap: [Wrap; 2]) -> u32 {
        if let Some(index) = self.samplers.iter().position(|&w| w == wrap) {
            return index as u32;
        }
        self.samplers.push(wrap);
        self.document.samplers.push(Sampler {
            mag_filter: LINEAR,
            min_filter: LINEAR_MIPMAP_LINEAR,
            wrap_s: wrap_code(wrap[0]),
            wrap_t: wrap_code(wrap[1]),
        });
        self.samplers.len() as u32 - 1
    }
}

fn encode_png(texture: &Texture) -> Result<Vec<u8>, image::ImageError> {
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(
        &texture.rgba8,
        texture.width,
        texture.height,
        ExtendedColorType::Rgba8,
    )?;
    Ok(png)
}

fn wrap_code(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 10497,
        Wrap::Clamp => 33071,
        Wrap::Mirror => 33648,
    }
}

/// Returns the strength of emitted light: one, or the power of two that keeps the factor within
/// one, so that their product is exact.
fn emissive_strength(emissive: [f32; 3]) -> f32 {
    let brightest = emissive.into_iter().fold(0.0, f32::max);
    let mut strength = 1.0;
    while strength < brightest && strength <= f32::MAX / 4.0 {
        strength *= 2.0;
    }
    strength
}
