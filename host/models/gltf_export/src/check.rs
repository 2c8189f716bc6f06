//! Model validation before anything is written, so that writing only indexes.

use busbar_geometry::{Mesh, NO_FEATURE};
use busbar_scene::{Model, TextureRef};

use crate::ExportError;
use crate::features::MAX_FEATURE_ID;

pub(crate) fn check(model: &Model) -> Result<(), ExportError> {
    for (index, mesh) in model.meshes.iter().enumerate() {
        check_mesh(index, mesh, model.materials.len())?;
        check_features(index, mesh, model.feature_names(index).len())?;
    }
    check_materials(model)?;
    check_textures(model)?;
    check_nodes(model)
}

fn check_mesh(index: usize, mesh: &Mesh, materials: usize) -> Result<(), ExportError> {
    let place = || format!("mesh {index}");
    let wedges = &mesh.wedges;
    if [wedges.normal.len(), wedges.uv.len()] != [wedges.len(); 2] {
        return Err(ExportError::WedgeArrays { mesh: index });
    }
    for &position in &wedges.position {
        within(place, "position", position.into(), mesh.positions.len())?;
    }
    for &wedge in mesh.triangles.as_flattened() {
        within(place, "wedge", wedge.into(), wedges.len())?;
    }
    for section in &mesh.sections {
        if let Some(material) = section.material {
            within(place, "material", material.into(), materials)?;
        }
        let end = u64::from(section.first_triangle) + u64::from(section.triangle_count);
        if end > 0 {
            within(place, "triangle", end - 1, mesh.triangles.len())?;
        }
    }
    finite(mesh.positions.iter().all(|p| p.is_finite()), || format!("a position of mesh {index}"))?;
    finite(wedges.normal.iter().all(|n| n.is_finite()), || format!("a normal of mesh {index}"))?;
    finite(wedges.uv.iter().all(|uv| uv.is_finite()), || format!("a UV of mesh {index}"))
}

fn check_features(index: usize, mesh: &Mesh, names: usize) -> Result<(), ExportError> {
    let (found, expected) = (mesh.features.len(), mesh.positions.len());
    if found != 0 && found != expected {
        return Err(ExportError::Features { mesh: index, found, expected });
    }
    // Without names any id may be used, but one is kept for "none".
    let count = if names == 0 { MAX_FEATURE_ID as usize } else { names };
    if count > MAX_FEATURE_ID as usize {
        return Err(ExportError::TooManyFeatures { mesh: index, count });
    }
    for &feature in mesh.features.iter().filter(|&&feature| feature != NO_FEATURE) {
        within(|| format!("mesh {index}"), "feature", feature.into(), count)?;
    }
    Ok(())
}

fn check_materials(model: &Model) -> Result<(), ExportError> {
    for (index, material) in model.materials.iter().enumerate() {
        let place = || format!("material {index}");
        for TextureRef { texture, .. } in
            [material.base_color_texture, material.metallic_roughness_texture].into_iter().flatten()
        {
            within(place, "texture", texture.into(), model.textures.len())?;
        }
        let cutoff = match material.alpha {
            busbar_scene::AlphaMode::Mask(cutoff) => cutoff,
            _ => 0.0,
        };
        let factors = [material.metallic, material.roughness, cutoff];
        let mut values = factors.iter().chain(&material.base_color).chain(&material.emissive);
        finite(values.all(|v| v.is_finite()), || format!("a factor of material {index}"))?;
    }
    Ok(())
}

fn check_textures(model: &Model) -> Result<(), ExportError> {
    for (texture, image) in model.textures.iter().enumerate() {
        let (width, height, bytes) = (image.width, image.height, image.rgba8.len());
        let needed = u128::from(width) * u128::from(height) * 4;
        if needed == 0 || needed != bytes as u128 {
            return Err(ExportError::TextureSize { texture, width, height, bytes });
        }
    }
    Ok(())
}

fn check_nodes(model: &Model) -> Result<(), ExportError> {
    for (index, node) in model.nodes.iter().enumerate() {
        if let Some(parent) = node.parent.filter(|&p| p as usize >= index) {
            return Err(ExportError::ParentOrder { node: index, parent });
        }
        if let Some(mesh) = node.mesh {
            within(|| format!("node {index}"), "mesh", mesh.into(), model.meshes.len())?;
        }
        finite(node.parent_from_node.is_finite(), || format!("the matrix of node {index}"))?;
    }
    Ok(())
}

fn within(
    place: impl Fn() -> String,
    what: &'static str,
    index: u64,
    count: usize,
) -> Result<(), ExportError> {
    if index < count as u64 {
        return Ok(());
    }
    Err(ExportError::Reference { place: place(), what, index, count })
}

fn finite(is_finite: bool, place: impl Fn() -> String) -> Result<(), ExportError> {
    if is_finite { Ok(()) } else { Err(ExportError::NotFinite { place: place() }) }
}
