//! Metallic-roughness materials and the textures that they name.

use busbar_scene::{AlphaMode, Material, TextureRef, Wrap};
use gltf::json::texture::{Info, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{self, Root};

use crate::error::{ImportError, ImportFault, item};
use crate::extensions::Extensions;
use crate::names::clean_name;
use crate::report::Notes;

/// The materials, and for each of the model's textures the image it shows.
pub(crate) struct Materials {
    pub(crate) materials: Vec<Material>,
    pub(crate) images: Vec<usize>,
}

impl Materials {
    /// Drops placeholder textures of roughness and metal: a placeholder says nothing of either.
    pub(crate) fn drop_roughness_textures(&mut self, placeholders: &[bool]) {
        for material in &mut self.materials {
            let is_lost = |of: &TextureRef| placeholders.get(of.texture as usize) == Some(&true);
            material.metallic_roughness_texture =
                material.metallic_roughness_texture.filter(|of| !is_lost(of));
        }
    }
}

pub(crate) fn convert(
    root: &Root,
    extensions: &Extensions,
    notes: &mut Notes,
) -> Result<Materials, ImportError> {
    let mut converter = Converter {
        root,
        extensions,
        notes,
        texture_of_image: vec![None; root.images.len()],
        images: Vec::new(),
    };
    let materials: Result<_, _> =
        (0..root.materials.len()).map(|index| converter.material(index)).collect();
    Ok(Materials { materials: materials?, images: converter.images })
}

struct Converter<'a> {
    root: &'a Root,
    extensions: &'a Extensions,
    notes: &'a mut Notes,
    texture_of_image: Vec<Option<u32>>,
    images: Vec<usize>,
}

impl Converter<'_> {
    fn material(&mut self, index: usize) -> Result<Material, ImportError> {
        let material = &self.root.materials[index];
        let pbr = &material.pbr_metallic_roughness;
        let here = |field: &str| format!("/materials/{index}{field}");
        let pbr_here = |field: &str| here(&format!("/pbrMetallicRoughness{field}"));
        self.note_left_out(material);
        let alpha = alpha_mode(material).ok_or_else(|| {
            ImportFault::Invalid("unknown alpha mode".into()).at(here("/alphaMode"))
        })?;
        // The file's light is in the picture that is left out: without it, none.
        let emissive = match material.emissive_texture {
            Some(_) => [0.0; 3],
            None => material.emissive_factor.0,
        };
        let converted = Material {
            name: material.name.as_deref().map(clean_name).unwrap_or_default(),
            base_color: pbr.base_color_factor.0.map(unit),
            base_color_texture: self
                .texture(pbr.base_color_texture.as_ref(), || pbr_here("/baseColorTexture"))?,
            metallic: unit(pbr.metallic_factor.0),
            roughness: unit(pbr.roughness_factor.0),
            metallic_roughness_texture: self
                .texture(pbr.metallic_roughness_texture.as_ref(), || {
                    pbr_here("/metallicRoughnessTexture")
                })?,
            emissive: emissive.map(|e| e.clamp(0.0, f32::MAX)),
            double_sided: material.double_sided,
            alpha,
        };
        Ok(converted)
    }

    fn note_left_out(&mut self, material: &json::Material) {
        let maps = [
            (material.normal_texture.is_some(), "normal texture ignored"),
            (material.occlusion_texture.is_some(), "occlusion texture ignored"),
            (material.emissive_texture.is_some(), "emissive texture ignored, and what it lights"),
        ];
        for (present, note) in maps {
            self.notes.add_many(note, present.into());
        }
    }

    fn texture(
        &mut self,
        info: Option<&Info>,
        place: impl Fn() -> String,
    ) -> Result<Option<TextureRef>, ImportError> {
        let Some(info) = info else { return Ok(None) };
        let index = info.index.value();
        let texture = item(&self.root.textures, index, "texture", || place() + "/index")?;
        if info.tex_coord != 0 {
            self.notes.add("texture ignored: only TEXCOORD_0 is read");
            return Ok(None);
        }
        // `gltf::json` says "no source" so.
        let own = Some(texture.source.value()).filter(|&source| source != u32::MAX as usize);
        let Some(image) = own.or_else(|| self.extensions.basis_source(index)) else {
            self.notes.add("texture ignored: its image is of an unsupported extension");
            return Ok(None);
        };
        item(&self.root.images, image, "image", || format!("/textures/{index}/source"))?;
        let wrap = match texture.sampler {
            None => [Wrap::Repeat; 2],
            Some(sampler) => {
                let place = || format!("/textures/{index}/sampler");
                let sampler_index = sampler.value();
                let sampler = item(&self.root.samplers, sampler_index, "sampler", place)?;
                wraps(sampler).ok_or_else(|| {
                    let fault = ImportFault::Invalid("unknown wrapping mode".into());
                    fault.at(format!("/samplers/{sampler_index}"))
                })?
            }
        };
        let texture = *self.texture_of_image[image].get_or_insert_with(|| {
            self.images.push(image);
            self.images.len() as u32 - 1
        });
        Ok(Some(TextureRef { texture, wrap }))
    }
}

fn alpha_mode(material: &json::Material) -> Option<AlphaMode> {
    let cutoff = material.alpha_cutoff.unwrap_or_default().0;
    match material.alpha_mode {
        Checked::Valid(json::material::AlphaMode::Opaque) => Some(AlphaMode::Opaque),
        Checked::Valid(json::material::AlphaMode::Mask) => Some(AlphaMode::Mask(unit(cutoff))),
        Checked::Valid(json::material::AlphaMode::Blend) => Some(AlphaMode::Blend),
        Checked::Invalid => None,
    }
}

fn wraps(sampler: &Sampler) -> Option<[Wrap; 2]> {
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::Repeat) => Some(Wrap::Repeat),
        Checked::Valid(WrappingMode::ClampToEdge) => Some(Wrap::Clamp),
        Checked::Valid(WrappingMode::MirroredRepeat) => Some(Wrap::Mirror),
        Checked::Invalid => None,
    };
    Some([wrap(sampler.wrap_s)?, wrap(sampler.wrap_t)?])
}

/// Clamps to 0..1. JSON has no NaN, and numbers too large for `f32` read infinite.
fn unit(value: f32) -> f32 {
    value.clamp(0.0, 1.0)
}
