//! Extensions of a file: those that are read, those that only refine the look, and those without
//! which it cannot be shown.

use crate::document::{Elements, shortened};
use crate::error::{ImportError, ImportFault};
use crate::report::Notes;
use crate::scalars::Text;

/// Extensions that are read.
const READ: &[&str] = &[
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_structural_metadata",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Beginnings of the names of extensions that refine the look, light the scene, move it or
/// describe it: without them the shapes are the same.
const LOOK_ONLY: &[&str] = &[
    "ADOBE_materials_",
    "CESIUM_primitive_outline",
    "EXT_instance_features",
    "EXT_lights_",
    "EXT_materials_",
    "EXT_texture_",
    "FB_materials_",
    "GODOT_single_root",
    "KHR_animation_",
    "KHR_audio",
    "KHR_environment_map",
    "KHR_interactivity",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_node_",
    "KHR_physics_",
    "KHR_rigid_bodies",
    "KHR_texture_",
    "KHR_xmp",
    "MOZ_",
    "MSFT_lod",
    "MSFT_material_",
    "MSFT_packing_",
    "MSFT_texture_dds",
    "OMI_",
    "VRM",
];

/// Checks the required extensions, and remarks on those that are left out.
pub(crate) fn check(
    required: &Elements<'_>,
    used: &Elements<'_>,
    notes: &mut Notes,
) -> Result<(), ImportError> {
    let mut remarked = Vec::new();
    let mut remark = |name: &str, notes: &mut Notes| {
        // A name in both lists is one extension; what is more is bounded by the remarks.
        if !remarked.iter().any(|known| known == name) && remarked.len() < MAX_NAMES {
            remarked.push(name.to_owned());
            notes.add(format!("extension '{}' ignored: it is not supported", shortened(name)));
        }
    };
    for (list, is_required) in [(required, true), (used, false)] {
        for index in 0..list.len() {
            let Text(Some(name)) = list.parse(index, String::new)? else { continue };
            if READ.contains(&&*name) {
                continue;
            }
            if is_required && !LOOK_ONLY.iter().any(|beginning| name.starts_with(beginning)) {
                let place = format!("/extensionsRequired/{index}");
                return Err(ImportFault::Extension(shortened(&name)).at(place));
            }
            remark(&name, notes);
        }
    }
    Ok(())
}

/// Names of extensions that are remarked on.
const MAX_NAMES: usize = crate::limits::MAX_NOTES;
