//! Files of the report's scenes: the paper's scene with its configuration, and the power
//! transformer as one mesh.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use busbar_geometry::{Mesh, RawPrimitive, Section, weld};
use busbar_gltf_export::write_glb;
use busbar_scene::{Material, Model};
use serde_json::{Map, Value, json};
use substation::Station;

use crate::optimise::vertex_arrays;

/// Seed of the station, which is the default of its generator.
const SEED: u64 = 1;

/// Name of the station's model that Figures 6 to 8 show.
const TRANSFORMER: &str = "transformer";

/// Folder of results kept on disk, beside the configuration.
const CACHE: &str = "cache";

/// Least downward component of a normal for a triangle to look down: the cosine of the angle.
const DOWNWARD: f32 = 0.9;

/// Name of the pictures' camera.
pub const OVERVIEW: &str = "overview";

/// Eye of the overview, in metres; target and vertical field of view follow.
pub const OVERVIEW_EYE: [f64; 3] = [92.0, 44.0, -124.0];
/// Target of the overview, in metres.
pub const OVERVIEW_TARGET: [f64; 3] = [2.0, 0.0, -26.0];
/// Vertical field of view of the overview, degrees.
pub const OVERVIEW_FOV_DEGREES: f64 = 42.0;

/// Files and data of the paper's scene.
pub struct PaperScene {
    /// Configuration of the flattened scene.
    pub config: PathBuf,
    /// Model file that the configuration names.
    pub model: PathBuf,
    /// Power transformer as a single mesh.
    pub transformer: SingleMesh,
}

/// Model flattened to one mesh, as the paper treats a model.
#[derive(Clone, Debug)]
pub struct SingleMesh {
    /// Mesh in the model's space.
    pub mesh: Mesh,
    /// Materials by the index that the mesh's sections use.
    pub materials: Vec<Material>,
}

impl PaperScene {
    /// Makes the station and writes the flattened scene to `folder`; plugins
    /// are looked for in `plugins`. The camera path has `steps` cameras.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn make(folder: &Path, plugins: &Path, steps: usize) -> Result<Self> {
        fs::create_dir_all(folder).with_context(|| {
            format!("cannot make {}: name a folder that you may write to", folder.display())
        })?;
        let plugins = plugins.canonicalize().with_context(|| {
            format!("no plugins in {}: build weighted_collapse into it", plugins.display())
        })?;
        // So that the first load finds nothing in it.
        let cache = folder.join(CACHE);
        if cache.exists() {
            fs::remove_dir_all(&cache)
                .with_context(|| format!("cannot empty {}", cache.display()))?;
        }
        let station = Station::generate(SEED)?;
        let flat = station.flatten()?;
        let model = folder.join("paper.glb");
        write(&model, &write_glb(&flat.model)?)?;
        let config = folder.join("paper.json");
        let json = configuration(&plugins.display().to_string(), steps);
        write(&config, serde_json::to_string_pretty(&json)?.as_bytes())?;
        let transformer = station.catalogue.get(TRANSFORMER);
        let transformer = transformer.context("the station has no power transformer")?;
        let transformer = SingleMesh::from_model(&transformer.model)?;
        Ok(Self { config, model, transformer })
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// Returns the name of a camera of the path.
pub fn path_camera(step: usize) -> String {
    format!("path {step:03}")
}

fn configuration(plugins: &str, steps: usize) -> Value {
    let camera = |eye: [f64; 3]| json!({ "eye": eye, "target": OVERVIEW_TARGET, "fov_degrees": OVERVIEW_FOV_DEGREES });
    let mut cameras = Map::new();
    cameras.insert(OVERVIEW.to_owned(), camera(OVERVIEW_EYE));
    for step in 0..steps {
        cameras.insert(path_camera(step), camera(path_eye(step, steps)));
    }
    json!({
        "version": 1,
        "plugin_directories": [plugins],
        "isolation": "none",
        "plugins": { "optimizer": { "plugin": "weighted_collapse" } },
        "models": { "paper": { "file": "paper.glb", "optimizer": "optimizer" } },
        "scene": [{ "id": "S", "model": "paper" }],
        "cache": { "directory": CACHE },
        "cameras": cameras,
        "camera": { "start": OVERVIEW },
        "graphics": { "samples": 4 },
        "window": { "size": [1280, 720] }
    })
}

/// Returns the eye of a camera path once around the station, at the height and distance of the
/// overview.
fn path_eye(step: usize, steps: usize) -> [f64; 3] {
    let [x, y, z] = OVERVIEW_EYE;
    let [target_x, _, target_z] = OVERVIEW_TARGET;
    let (dx, dz) = (x - target_x, z - target_z);
    let (sin, cos) = (TAU * step as f64 / steps as f64).sin_cos();
    [target_x + dx * cos - dz * sin, y, target_z + dx * sin + dz * cos]
}

impl SingleMesh {
    /// Merges the triangles of all nodes into one welded mesh.
    ///
    /// # Errors
    /// When a position is not finite.
    pub fn from_model(model: &Model) -> Result<Self> {
        let mut primitives: Vec<RawPrimitive> = (0..model.materials.len() as u32)
            .map(|index| RawPrimitive { material: Some(index), ..RawPrimitive::default() })
            .collect();
        // For triangles without a material.
        primitives.push(RawPrimitive::default());
        for (node, model_from_node) in model.nodes.iter().zip(model.model_from_nodes()) {
            let Some(mesh) = node.mesh.map(|mesh| &model.meshes[mesh as usize]) else { continue };
            for section in &mesh.sections {
                let slot = section.material.map_or(model.materials.len(), |m| m as usize);
                add_section(&mut primitives[slot], mesh, section, model_from_node.as_mat4());
            }
        }
        primitives.retain(|primitive| !primitive.triangles.is_empty());
        let (mesh, _) = weld(&primitives).context("cannot flatten the transformer")?;
        Ok(Self { mesh, materials: model.materials.clone() })
    }

    /// Returns the mesh without the triangles that look down: its shells have borders. Models often
    /// leave out undersides that nobody sees.
    ///
    /// # Errors
    /// When a position is not finite.
    pub fn without_undersides(&self) -> Result<Self> {
        let mut primitives = vertex_arrays(&self.mesh);
        for primitive in &mut primitives {
            let positions = &primitive.positions;
            primitive.triangles.retain(|t| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                (b - a).cross(c - a).normalize_or_zero().y > -DOWNWARD
            });
        }
        let (mesh, _) = weld(&primitives).context("cannot open the transformer")?;
        Ok(Self { mesh, materials: self.materials.clone() })
    }

    /// Returns the same triangles with a position of its own for every wedge, as vertex arrays come
    /// from a file. Every seam of normals is then a border.
    pub fn split(&self) -> Self {
        let mut mesh = self.mesh.clone();
        let wedges = &mut mesh.wedges;
        mesh.positions = wedges.position.iter().map(|&p| mesh.positions[p as usize]).collect();
        wedges.position = (0..mesh.positions.len() as u32).collect();
        Self { mesh, materials: self.materials.clone() }
    }
}

fn add_section(into: &mut RawPrimitive, mesh: &Mesh, section: &Section, place: glam::Mat4) {
    let mut renumbered: HashMap<u32, u32> = HashMap::new();
    let first = section.first_triangle as usize;
    for corners in &mesh.triangles[first..first + section.triangle_count as usize] {
        let triangle = corners.map(|wedge| {
            *renumbered.entry(wedge).or_insert_with(|| {
                let w = wedge as usize;
                let position = mesh.positions[mesh.wedges.position[w] as usize];
                into.positions.push(place.transform_point3(position));
                into.normals.push(place.transform_vector3(mesh.wedges.normal[w]));
                into.positions.len() as u32 - 1
            })
        });
        into.triangles.push(triangle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_goes_once_around_at_one_height() {
        let distance = |eye: [f64; 3]| {
            ((eye[0] - OVERVIEW_TARGET[0]).powi(2) + (eye[2] - OVERVIEW_TARGET[2]).powi(2)).sqrt()
        };
        let eyes: Vec<_> = (0..60).map(|step| path_eye(step, 60)).collect();
        assert_eq!(eyes[0], OVERVIEW_EYE);
        assert!(eyes.iter().all(|&eye| (distance(eye) - distance(eyes[0])).abs() < 1e-9));
        assert!((eyes[30][0] - (2.0 * OVERVIEW_TARGET[0] - eyes[0][0])).abs() < 1e-9);
    }

    #[test]
    fn the_transformer_keeps_its_triangles_as_one_mesh() {
        let station = Station::generate(SEED).unwrap();
        let entry = station.catalogue.get(TRANSFORMER).unwrap();
        let single = SingleMesh::from_model(&entry.model).unwrap();
        assert_eq!(single.mesh.triangles.len(), entry.counts.triangles);
        assert!(single.mesh.positions.len() <= entry.counts.vertices);
        let open = single.without_undersides().unwrap();
        assert!(open.mesh.triangles.len() < single.mesh.triangles.len());
        assert!(open.mesh.triangles.len() > single.mesh.triangles.len() / 2);
        let split = single.split();
        assert_eq!(split.mesh.positions.len(), single.mesh.wedges.len());
        let corners = |mesh: &Mesh| {
            let corner =
                |&t: &[u32; 3]| mesh.corner_positions(t).map(|p| mesh.positions[p as usize]);
            mesh.triangles.iter().map(corner).collect::<Vec<_>>()
        };
        assert_eq!(corners(&split.mesh), corners(&single.mesh));
    }
}
