//! The materials of proxies.

use std::collections::HashMap;

use busbar_scene::{AlphaMode, Material, Texture, linear_from_srgb};

use super::{GroupMember, SourceModel};

/// The most materials that a proxy may have: each is a draw call.
const MAX_PROXY_MATERIALS: usize = 64;

/// The materials of a proxy: those of its members, each once.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) merged: Vec<Material>,
    /// Merged material index by the indices of model and material.
    known: HashMap<(u32, Option<u32>), u32>,
}

impl Materials {
    /// Returns the material of each section of a member's mesh; `None` beyond the limit.
    pub(super) fn of_sections(&mut self, member: &GroupMember<'_>) -> Option<Vec<u32>> {
        let sections = member.stacks.mesh().sections.iter();
        sections.map(|section| self.of_section(member.model, section.material)).collect()
    }

    /// Returns the material of one section of a model's mesh; `None` beyond the limit.
    pub(super) fn of_section(
        &mut self,
        (model_index, model): (u32, SourceModel<'_>),
        material: Option<u32>,
    ) -> Option<u32> {
        let key = (model_index, material);
        if let Some(&known) = self.known.get(&key) {
            return Some(known);
        }
        let own = material.and_then(|material| model.materials.get(material as usize));
        let far = own.map_or_else(Material::default, |own| seen_from_afar(own, model.textures));
        let known = self.merged.iter().position(|merged| *merged == far);
        if known.is_none() && self.merged.len() >= MAX_PROXY_MATERIALS {
            return None;
        }
        let index = known.unwrap_or_else(|| {
            self.merged.push(far);
            self.merged.len() - 1
        });
        self.known.insert(key, index as u32);
        Some(index as u32)
    }
}

/// A material whose texture is less than a pixel: its mean colour.
fn seen_from_afar(material: &Material, textures: &[Texture]) -> Material {
    let texture = |reference: Option<busbar_scene::TextureRef>| {
        reference.and_then(|reference| textures.get(reference.texture as usize))
    };
    let [r, g, b, a] = texture(material.base_color_texture)
        .map_or([1.0; 4], |texture| mean(texture, linear_from_srgb));
    let color = material.base_color;
    let [_, green, blue, _] = texture(material.metallic_roughness_texture)
        .map_or([1.0; 4], |texture| mean(texture, share));
    let cuts = matches!(material.alpha, AlphaMode::Mask(_));
    Material {
        name: String::new(),
        base_color: [color[0] * r, color[1] * g, color[2] * b, color[3] * a],
        base_color_texture: None,
        metallic: material.metallic * blue,
        roughness: material.roughness * green,
        metallic_roughness_texture: None,
        // What is cut out in part would be there whole or not at all.
        alpha: if cuts && a < 1.0 { AlphaMode::Blend } else { material.alpha },
        ..material.clone()
    }
}

/// The mean of each channel: of colours as `decode` reads a byte, and of alpha.
fn mean(texture: &Texture, decode: fn(u8) -> f32) -> [f32; 4] {
    let values: [f64; 256] = std::array::from_fn(|byte| f64::from(decode(byte as u8)));
    let mut sums = [0.0_f64; 4];
    for &[r, g, b, a] in texture.rgba8.as_chunks::<4>().0 {
        for (sum, byte) in sums.iter_mut().zip([r, g, b]) {
            *sum += values[usize::from(byte)];
        }
        sums[3] += f64::from(share(a));
    }
    let pixels = (texture.rgba8.len() / 4).max(1) as f64;
    sums.map(|sum| (sum / pixels) as f32)
}

/// A byte as 0 to 1.
fn share(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}
