//! Test meshes of the comparison.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use busbar_geometry::{Bounds, Mesh, Section};
use busbar_gltf_import::{ImportLimits, import_file};
use busbar_scene::Model;
use glam::{Mat3, Mat4, Vec3};

use crate::levels::ply;
use crate::scene::Scene;

/// Prefix of the switchgear in the pictured bay, whose wires reach far beyond it.
const BAY: &str = "=S12D1Q3-Q";
/// Direction towards the eye, in pictures.
const DIRECTION: Vec3 = Vec3::new(-0.52, 0.36, -0.78);
/// Viewing direction for the bay: along the yard, so that no other bay is in front.
const BAY_DIRECTION: Vec3 = Vec3::new(-0.75, 0.45, -0.5);

/// Test mesh with its options.
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) mesh: Mesh,
    /// Flag for subjects that the bars are judged on.
    pub(crate) is_judged: bool,
    /// Contact sheet of the subject, if it has one: name, clipped part, direction towards the eye.
    pub(crate) sheet: Option<(&'static str, Bounds, Vec3)>,
}

/// Loads the meshes of this project, those of `files` last; a quick run omits the large ones.
pub(crate) fn all(
    scene: &Scene,
    files: &[std::path::PathBuf],
    quick: bool,
) -> Result<Vec<Subject>> {
    let transformer = merged(&demo_model::power_transformer()?);
    let bounds = transformer.bounds().context("the transformer is empty")?;
    let mut subjects = vec![
        Subject {
            sheet: Some(("transformer", bounds, DIRECTION)),
            ..Subject::judged("transformer", transformer)
        },
        Subject::judged("breaker (CAD-like)", merged(&corpus::breaker()?)),
    ];
    if !quick {
        subjects.push(Subject::judged("bushing (scan-like)", merged(&corpus::scan()?)));
        let bay = scene.bounds_of(BAY).with_context(|| format!("the station has no bay {BAY}"))?;
        subjects.push(Subject {
            sheet: Some(("bay", bay, BAY_DIRECTION)),
            ..Subject::judged("substation", scene.mesh.clone())
        });
    }
    for file in files {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        subjects.push(Subject { is_judged: false, ..Subject::judged(&name, load(file)?) });
    }
    Ok(subjects)
}

/// Loads a scan from elsewhere, which the bars are judged on too.
pub(crate) fn scan(file: &Path) -> Result<Subject> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    Ok(Subject::judged(&format!("{name} (scan)"), load(file)?))
}

fn load(file: &Path) -> Result<Mesh> {
    let is_ply = file.extension().is_some_and(|extension| extension == "ply");
    let read = || match is_ply {
        true => ply::read(file),
        false => Ok(merged(&import_file(file, &ImportLimits::default())?.model)),
    };
    let mesh = read().with_context(|| format!("cannot take {} as a mesh", file.display()))?;
    ensure!(!mesh.triangles.is_empty(), "{} has no triangle", file.display());
    Ok(mesh)
}

impl Subject {
    fn judged(name: &str, mesh: Mesh) -> Self {
        Self { name: name.to_owned(), mesh, is_judged: true, sheet: None }
    }
}

/// Merges all meshes of a model, placed by its nodes, into one.
fn merged(model: &Model) -> Mesh {
    let mut all = Mesh::default();
    for (node, model_from_node) in model.nodes.iter().zip(model.model_from_nodes()) {
        if let Some(mesh) = node.mesh.and_then(|mesh| model.meshes.get(mesh as usize)) {
            append(&mut all, mesh, model_from_node.as_mat4());
        }
    }
    all
}

fn append(all: &mut Mesh, mesh: &Mesh, model_from_mesh: Mat4) {
    let normals = Mat3::from_mat4(model_from_mesh.inverse()).transpose();
    let (positions, wedges) = (all.positions.len() as u32, all.wedges.len() as u32);
    let (sections, triangles) = (all.sections.len() as u32, all.triangles.len() as u32);
    all.positions.extend(mesh.positions.iter().map(|&p| model_from_mesh.transform_point3(p)));
    all.wedges.position.extend(mesh.wedges.position.iter().map(|p| p + positions));
    all.wedges.normal.extend(mesh.wedges.normal.iter().map(|&n| (normals * n).normalize_or_zero()));
    all.wedges.uv.extend(&mesh.wedges.uv);
    all.wedges.section.extend(mesh.wedges.section.iter().map(|s| s + sections));
    all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|wedge| wedge + wedges)));
    all.sections.extend(mesh.sections.iter().map(|section| Section {
        first_triangle: section.first_triangle + triangles,
        ..section.clone()
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_merged_model_has_all_that_is_shown() {
        let model = demo_model::disconnector_pole().unwrap();
        let meshes = model.nodes.iter().filter_map(|node| model.meshes.get(node.mesh? as usize));
        let (positions, triangles) = meshes.fold((0, 0), |(positions, triangles), mesh| {
            (positions + mesh.positions.len(), triangles + mesh.triangles.len())
        });
        let mesh = merged(&model);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (positions, triangles));
        let covered: u32 = mesh.sections.iter().map(|section| section.triangle_count).sum();
        assert_eq!(covered as usize, triangles);
        assert!(mesh.wedges.section.iter().all(|&s| (s as usize) < mesh.sections.len()));
    }
}
