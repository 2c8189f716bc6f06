//! Optimisation of meshes to collapse stacks, through the plugin as a viewer loads it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use busbar_geometry::{CollapseStacks, Mesh, RawPrimitive, weld};
use busbar_plugin_host::{Catalog, MeshOptimizer};
use serde_json::Value;

/// Plugin that implements the paper.
const PLUGIN: &str = "weighted_collapse";

/// Optimiser plugin with the paper's method.
pub struct Optimiser {
    plugin: MeshOptimizer,
}

impl Optimiser {
    /// Loads the plugin from a folder, with its own settings.
    ///
    /// # Errors
    /// When it is missing or does not load.
    pub fn load(folder: &Path) -> Result<Self> {
        let folders: [PathBuf; 1] = [std::path::absolute(folder)?];
        let plugin = Catalog::discover(&folders)
            .create(PLUGIN, PLUGIN, &Value::Object(serde_json::Map::new()))
            .and_then(MeshOptimizer::from_instance)
            .with_context(|| {
                format!("no plugin {PLUGIN} in {}: build it there", folder.display())
            })?;
        Ok(Self { plugin })
    }

    /// Builds the collapse stacks of a mesh.
    ///
    /// # Errors
    /// Errors that the plugin reports.
    pub fn stacks(&self, mesh: Mesh) -> Result<Arc<CollapseStacks>> {
        let optimised = self.plugin.optimize(&mesh, |_| true)?;
        Ok(Arc::new(CollapseStacks::build(mesh, &optimised.sequence)))
    }
}

/// Measures the milliseconds of welding, which an import does among other things: the same mesh,
/// split into vertex arrays, is welded again.
///
/// # Errors
/// When the mesh cannot be welded.
pub fn weld_millis(mesh: &Mesh) -> Result<f64> {
    let primitives = vertex_arrays(mesh);
    let started = Instant::now();
    let (welded, _) = weld(&primitives)?;
    let millis = started.elapsed().as_secs_f64() * 1e3;
    anyhow::ensure!(welded.positions.len() == mesh.positions.len(), "welding lost positions");
    Ok(millis)
}

/// Splits a mesh into one primitive a section, as a file holds them.
pub(crate) fn vertex_arrays(mesh: &Mesh) -> Vec<RawPrimitive> {
    let wedges = &mesh.wedges;
    let mut place = vec![u32::MAX; wedges.len()];
    let section = |section: &busbar_geometry::Section| {
        let mut primitive = RawPrimitive { material: section.material, ..RawPrimitive::default() };
        let first = section.first_triangle as usize;
        for corners in &mesh.triangles[first..first + section.triangle_count as usize] {
            let triangle = corners.map(|wedge| {
                let w = wedge as usize;
                if place[w] == u32::MAX {
                    place[w] = primitive.positions.len() as u32;
                    primitive.positions.push(mesh.positions[wedges.position[w] as usize]);
                    primitive.normals.push(wedges.normal[w]);
                    primitive.uvs.push(wedges.uv[w]);
                    primitive.features.extend(mesh.features.get(wedges.position[w] as usize));
                }
                place[w]
            });
            primitive.triangles.push(triangle);
        }
        primitive
    };
    mesh.sections.iter().map(section).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    pub(crate) fn vertex_arrays_weld_to_the_mesh_they_came_from() {
        let triangle = |x: f32, material| RawPrimitive {
            positions: vec![Vec3::ZERO, Vec3::Y, Vec3::new(x, 0.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            material: Some(material),
            ..RawPrimitive::default()
        };
        let (mesh, _) = weld(&[triangle(-1.0, 0), triangle(1.0, 1)]).unwrap();
        assert_eq!(weld(&vertex_arrays(&mesh)).unwrap().0, mesh);
        assert!(weld_millis(&mesh).unwrap() >= 0.0);
    }
}
