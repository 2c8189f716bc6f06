//! Metallic-roughness materials and the textures that they name.

use busbar_scene::{AlphaMode, Material, TextureRef, Wrap};
use glam::{Affine2, Mat2, Vec2};

use crate::document::Document;
use crate::error::{ImportError, ImportFault};
use crate::names::clean_name;
use crate::primitives::UvMapping;
use crate::report::Notes;
use crate::scalars::{Real, Reals, Tolerant, Whole};
use crate::schema;
use crate::schema::{MetallicRoughness, SpecularGlossiness, TextureInfo};

/// The materials, and for each of the model's textures the image it shows.
pub(crate) struct Materials {
    pub(crate) materials: Vec<Material>,
    /// Texture coordinates that each material shows.
    pub(crate) uv_mappings: Vec<UvMapping>,
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

/// Converts the materials. One that no shown mesh uses keeps its place, without textures.
pub(crate) fn convert(
    document: &Document<'_>,
    used: &[bool],
    notes: &mut Notes,
) -> Result<Materials, ImportError> {
    let mut converter = Converter {
        document,
        notes,
        texture_of_image: vec![None; document.images.len()],
        images: Vec::new(),
        uv_mappings: Vec::with_capacity(used.len()),
    };
    let mut materials = Vec::with_capacity(used.len());
    for (index, &is_used) in used.iter().enumerate() {
        materials.push(match is_used {
            true => converter.material(index)?,
            false => converter.unused(index),
        });
    }
    let Converter { images, uv_mappings, .. } = converter;
    Ok(Materials { materials, uv_mappings, images })
}

struct Converter<'a> {
    document: &'a Document<'a>,
    notes: &'a mut Notes,
    texture_of_image: Vec<Option<u32>>,
    images: Vec<usize>,
    uv_mappings: Vec<UvMapping>,
}

const COLOR_TEXTURE: &str = "/pbrMetallicRoughness/baseColorTexture";
const ROUGH_TEXTURE: &str = "/pbrMetallicRoughness/metallicRoughnessTexture";
const GLOSSY_TEXTURE: &str = "/extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture";

/// A texture and the coordinates that it is shown by.
type Mapped = (TextureRef, UvMapping);

impl Converter<'_> {
    fn material(&mut self, index: usize) -> Result<Material, ImportError> {
        let place = |field: &str| format!("/materials/{index}{field}");
        let material: schema::Material<'_> = self.document.materials.parse(index, || place(""))?;
        let alpha = alpha_mode(&material).ok_or_else(|| {
            ImportFault::Invalid("unknown alpha mode".into()).at(place("/alphaMode"))
        })?;
        self.note_left_out(&material);
        let emissive = emissive_of(&material);
        let extensions = material.extensions.as_ref();
        let glossy = extensions.and_then(|extensions| extensions.specular_glossiness.as_ref());
        let surface = match glossy {
            Some(glossy) => self.convert_glossy(glossy),
            None => Surface::new(material.pbr_metallic_roughness.as_ref()),
        };
        let [color, rough] = match glossy {
            Some(_) => [GLOSSY_TEXTURE, ROUGH_TEXTURE],
            None => [COLOR_TEXTURE, ROUGH_TEXTURE],
        };
        let color = self.texture(surface.color_texture, || place(color))?;
        let rough = self.texture(surface.rough_texture, || place(rough))?;
        // A vertex has one pair of coordinates.
        let mapping = color.or(rough).map_or_else(UvMapping::default, |(_, mapping)| mapping);
        let is_shown = rough.is_none_or(|(_, other)| other == mapping);
        if !is_shown {
            self.notes.add("roughness texture ignored: its coordinates are not the colour's");
        }
        self.uv_mappings.push(mapping);
        Ok(Material {
            name: material.name.as_deref().map(clean_name).unwrap_or_default(),
            base_color: surface.color.map(unit),
            base_color_texture: color.map(|(texture, _)| texture),
            metallic: unit(surface.metallic),
            roughness: unit(surface.roughness),
            metallic_roughness_texture: rough.filter(|_| is_shown).map(|(texture, _)| texture),
            emissive,
            double_sided: material.double_sided.0,
            alpha,
        })
    }

    /// Converts a material that nobody shows: whatever is at fault in it does no harm.
    fn unused(&mut self, index: usize) -> Material {
        self.uv_mappings.push(UvMapping::default());
        let material: schema::Material<'_> =
            self.document.materials.parse(index, String::new).unwrap_or_default();
        let surface = Surface::new(material.pbr_metallic_roughness.as_ref());
        Material {
            name: material.name.as_deref().map(clean_name).unwrap_or_default(),
            base_color: surface.color.map(unit),
            base_color_texture: None,
            metallic: unit(surface.metallic),
            roughness: unit(surface.roughness),
            metallic_roughness_texture: None,
            emissive: emissive_of(&material),
            double_sided: material.double_sided.0,
            alpha: alpha_mode(&material).unwrap_or_default(),
        }
    }

    fn note_left_out(&mut self, material: &schema::Material<'_>) {
        let maps = [
            (material.normal_texture.is_some(), "normal texture ignored"),
            (material.occlusion_texture.is_some(), "occlusion texture ignored"),
            (material.emissive_texture.is_some(), "emissive texture ignored, and what it lights"),
        ];
        for (present, note) in maps {
            self.notes.add_many(note, present.into());
        }
    }

    /// Converts a specular-glossiness surface (KHR_materials_pbrSpecularGlossiness): what reflects
    /// much and scatters little is a metal.
    fn convert_glossy(&mut self, glossy: &SpecularGlossiness) -> Surface {
        let diffuse = glossy.diffuse_factor.map_or([1.0; 4], |factor| factor.0);
        let glossiness = glossy.glossiness_factor.map_or(1.0, |factor| factor.0);
        self.notes.add("specular-glossiness material converted to metallic-roughness");
        let textured =
            glossy.diffuse_texture.is_some() || glossy.specular_glossiness_texture.is_some();
        if glossy.specular_glossiness_texture.is_some() {
            self.notes.add("specular-glossiness texture ignored");
        }
        let (color, metallic) = match glossy.specular_factor {
            Some(Reals(specular)) if !textured => metal_of(diffuse, specular),
            _ => (diffuse, 0.0),
        };
        Surface {
            color,
            color_texture: glossy.diffuse_texture,
            metallic,
            roughness: 1.0 - glossiness.clamp(0.0, 1.0),
            rough_texture: None,
        }
    }

    fn texture(
        &mut self,
        info: Option<TextureInfo>,
        place: impl Fn() -> String,
    ) -> Result<Option<Mapped>, ImportError> {
        let Some(info) = info else { return Ok(None) };
        let document = self.document;
        let index = info.index.index();
        let texture: schema::Texture = document.textures.parse(index, || place() + "/index")?;
        let Some(image) = source_of(&texture) else {
            self.notes.add("texture ignored: it names no image");
            return Ok(None);
        };
        let source_place = || format!("/textures/{index}/source");
        document.images.require(image.index(), source_place)?;
        let wrap = match texture.sampler {
            None => [Wrap::Repeat; 2],
            Some(sampler) => {
                let place = || format!("/textures/{index}/sampler");
                let sampler: schema::Sampler = document.samplers.parse(sampler.index(), place)?;
                [sampler.wrap_s, sampler.wrap_t].map(|mode| self.wrap(mode))
            }
        };
        let texture = *self.texture_of_image[image.index()].get_or_insert_with(|| {
            self.images.push(image.index());
            self.images.len() as u32 - 1
        });
        let transform = info.extensions.and_then(|extensions| extensions.transform);
        let set = transform.and_then(|t| t.tex_coord).or(info.tex_coord).unwrap_or_default().0;
        let mapping = UvMapping { set, transform: transform.map(|t| uv_transform(&t)) };
        let transform = mapping.transform.filter(|t| *t != Affine2::IDENTITY && t.is_finite());
        Ok(Some((TextureRef { texture, wrap }, UvMapping { transform, ..mapping })))
    }

    /// Converts a wrapping mode (glTF 2.0, section 5.26); OpenGL's older `GL_CLAMP` too.
    fn wrap(&mut self, mode: Option<Whole>) -> Wrap {
        match mode.map_or(10497, |mode| mode.0) {
            10496 | 33069 | 33071 => Wrap::Clamp,
            10497 => Wrap::Repeat,
            33648 => Wrap::Mirror,
            _ => {
                self.notes.add("unknown wrapping mode: the texture is repeated");
                Wrap::Repeat
            }
        }
    }
}

/// Colour and reflection of a surface, as metallic-roughness materials have them.
struct Surface {
    color: [f32; 4],
    color_texture: Option<TextureInfo>,
    metallic: f32,
    roughness: f32,
    rough_texture: Option<TextureInfo>,
}

impl Surface {
    fn new(material: Option<&MetallicRoughness>) -> Self {
        let default = MetallicRoughness::default();
        let material = material.unwrap_or(&default);
        Self {
            color: material.base_color_factor.map_or([1.0; 4], |factor| factor.0),
            color_texture: material.base_color_texture,
            metallic: material.metallic_factor.map_or(1.0, |Real(factor)| factor),
            roughness: material.roughness_factor.map_or(1.0, |Real(factor)| factor),
            rough_texture: material.metallic_roughness_texture,
        }
    }
}

/// Returns the image of a texture: its own, which every viewer reads, or that of an extension.
fn source_of(texture: &schema::Texture) -> Option<Whole> {
    texture.source.or_else(|| texture.extensions.as_ref()?.source())
}

/// Converts KHR_texture_transform: scale, then rotate counter-clockwise as seen in UV space with
/// v down, then offset.
fn uv_transform(transform: &schema::TextureTransform) -> Affine2 {
    let vector =
        |value: Option<Reals<2>>, default| value.map_or(default, |value| Vec2::from_array(value.0));
    let (sin, cos) = transform.rotation.map_or(0.0, |angle| angle.0).sin_cos();
    let scale = vector(transform.scale, Vec2::ONE);
    let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
    let linear = rotation * Mat2::from_diagonal(scale);
    Affine2::from_mat2_translation(linear, vector(transform.offset, Vec2::ZERO))
}

/// Reflection of a dielectric at right angles (glTF 2.0, appendix B.3.5).
const DIELECTRIC: f32 = 0.04;

/// Finds base colour and metal of a surface by its diffuse and specular colours, as the
/// conversion in the appendix of KHR_materials_pbrSpecularGlossiness does.
fn metal_of(diffuse: [f32; 4], specular: [f32; 3]) -> ([f32; 4], f32) {
    let brightness = |[r, g, b]: [f32; 3]| (0.299 * r * r + 0.587 * g * g + 0.114 * b * b).sqrt();
    let [r, g, b, alpha] = diffuse;
    let strongest = specular.into_iter().fold(0.0, f32::max).min(1.0);
    let scattered = 1.0 - strongest;
    let (dark, bright) = (brightness([r, g, b]), brightness(specular));
    let metallic = if bright < DIELECTRIC {
        0.0
    } else {
        let linear = dark * scattered / (1.0 - DIELECTRIC) + bright - 2.0 * DIELECTRIC;
        let root = (linear * linear - 4.0 * DIELECTRIC * (DIELECTRIC - bright)).max(0.0).sqrt();
        ((root - linear) / (2.0 * DIELECTRIC)).clamp(0.0, 1.0)
    };
    let color = std::array::from_fn(|i| {
        let of_diffuse = diffuse[i] * scattered / (1.0 - DIELECTRIC) / (1.0 - metallic).max(1e-6);
        let of_specular = (specular[i] - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-6);
        let share = metallic * metallic;
        (of_diffuse + (of_specular - of_diffuse) * share).clamp(0.0, 1.0)
    });
    let [r, g, b]: [f32; 3] = color;
    ([r, g, b, alpha], metallic)
}

/// Returns the emitted light, factor times strength. That of a texture is in the picture that is left out: without it,
/// none.
fn emissive_of(material: &schema::Material<'_>) -> [f32; 3] {
    let factor = material.emissive_factor.filter(|_| material.emissive_texture.is_none());
    let extension = material.extensions.as_ref().and_then(|of| of.emissive_strength.as_ref());
    let strength = extension.and_then(|Tolerant(of)| of.as_ref()?.emissive_strength);
    let strength = strength.map_or(1.0, |Real(of)| of);
    let light = |factor: f32| (factor.max(0.0) * strength.max(0.0)).min(f32::MAX);
    // A factor of zero is dark, however strong.
    factor.map_or([0.0; 3], |Reals(of)| of.map(|e| if e > 0.0 { light(e) } else { 0.0 }))
}

/// Converts the alpha mode; exporters write it in any case.
fn alpha_mode(material: &schema::Material<'_>) -> Option<AlphaMode> {
    let cutoff = material.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
    let mode = material.alpha_mode.as_deref().unwrap_or("OPAQUE").to_ascii_uppercase();
    match mode.as_str() {
        "OPAQUE" => Some(AlphaMode::Opaque),
        "MASK" => Some(AlphaMode::Mask(unit(cutoff))),
        "BLEND" => Some(AlphaMode::Blend),
        _ => None,
    }
}

/// Clamps to 0..1. JSON has no NaN, and numbers too large for `f32` read infinite.
fn unit(value: f32) -> f32 {
    value.clamp(0.0, 1.0)
}
