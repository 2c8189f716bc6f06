//! Shader sets: SPIR-V modules of the mesh passes by quality and section plane.

use busbar_shaders::{
    LOW, LOW_SECTION, PICK, PICK_SECTION, SCENE, SCENE_SECTION, SCENE_SHADOWED,
    SCENE_SHADOWED_SECTION, SHADOW, SHADOW_SECTION, WIREFRAME, WIREFRAME_SECTION,
};

use crate::Quality;

/// SPIR-V of the passes over meshes.
pub(crate) struct ShaderSet {
    pub(crate) scene: &'static [u32],
    pub(crate) wireframe: &'static [u32],
    pub(crate) pick: &'static [u32],
    /// Shadow-map shader at high quality.
    pub(crate) shadow: Option<&'static [u32]>,
}

impl ShaderSet {
    /// Selects the shaders. `undecoded`: colours are written sRGB encoded.
    pub(crate) fn new(quality: Quality, undecoded: bool, is_section: bool) -> Self {
        let either = |section, whole| if is_section { section } else { whole };
        Self {
            scene: match quality {
                Quality::High => either(SCENE_SHADOWED_SECTION, SCENE_SHADOWED),
                _ if undecoded => either(LOW_SECTION, LOW),
                _ => either(SCENE_SECTION, SCENE),
            },
            wireframe: either(WIREFRAME_SECTION, WIREFRAME),
            pick: either(PICK_SECTION, PICK),
            shadow: (quality == Quality::High).then_some(either(SHADOW_SECTION, SHADOW)),
        }
    }
}
