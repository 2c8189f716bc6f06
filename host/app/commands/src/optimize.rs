//! Optimization of one model by one plugin: `busbar optimize`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use busbar_geometry::{
    CollapseStacks, Mesh, MeshStatistics, NO_FEATURE, Section, count_components,
};
use busbar_gltf_export::{ExportError, write_glb};
use busbar_gltf_import::{ImportError, ImportLimits, import_file};
use busbar_plugin_host::{LoadRules, PluginError};
use busbar_plugin_process::{Isolation, Optimizer, PluginCatalog, PluginOptions};
use busbar_scene::Model;
use busbar_scene_loader::{StackBuilder, millis_since};
use serde::Serialize;
use thiserror::Error;

/// A model with its stacks, ready to be walked.
pub struct OptimizedModel {
    model: Model,
    stacks: Vec<Arc<CollapseStacks>>,
    imported: Vec<Mesh>,
    build_ms: BTreeMap<String, f64>,
}

/// Error that keeps a model from being optimized.
#[derive(Debug, Error)]
pub enum OptimizeError {
    /// Error of the model file.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// Error of the plugin.
    #[error("{error}\n  remedy: {}", error.remedy())]
    Plugin {
        /// Error that the plugin reports.
        error: PluginError,
    },
    /// The result cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// Statistics of `busbar optimize --stats`, summed over the meshes of the model. Vertices are
/// welded positions.
#[derive(Clone, Debug, Serialize)]
pub struct OptimizeStats {
    /// Simplified proportion that was requested.
    pub theta: f64,
    /// Surviving vertices: V - min(round(theta V), V - components) a mesh.
    pub vertices: u64,
    /// Vertices that a live triangle uses.
    pub vertices_referenced: u64,
    /// Number of live triangles.
    pub triangles: u64,
    /// Connected components of live triangles.
    pub components: u64,
    /// Edges with one live triangle.
    pub border_edges: u64,
    /// Edges with more than two live triangles.
    pub non_manifold_edges: u64,
    /// Euler characteristic of the live mesh.
    pub euler: i64,
    /// Collapses in the sequences.
    pub collapses: u64,
    /// Collapses done at theta.
    pub cursor: u64,
    /// CPU milliseconds a stage.
    pub build_ms: BTreeMap<String, f64>,
    /// Longest chain of ancestors.
    pub max_depth: u32,
    /// Bound on the geometric error at theta, as the optimiser measures it, in
    /// the model's units; the greatest of its meshes.
    pub error: f32,
    /// Bytes that the stacks add to a plain indexed mesh.
    pub bytes: usize,
    /// The model at theta 0.
    pub imported: ImportedStats,
    /// Moves walked by `--round-trip`.
    pub round_trips: u64,
    /// True if every return to theta 0 gave the imported bytes; null if not walked.
    pub lossless: Option<bool>,
}

/// The model at theta 0.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ImportedStats {
    /// Number of imported meshes.
    pub meshes: usize,
    /// Number of welded positions, V.
    pub vertices: u64,
    /// Number of imported triangles.
    pub triangles: u64,
    /// Connected components, in welded positions.
    pub components: u64,
    /// Edges with one triangle.
    pub border_edges: u64,
    /// Euler characteristic of the meshes.
    pub euler: i64,
}

impl OptimizedModel {
    /// Imports a model and runs the plugin on each of its meshes.
    ///
    /// # Errors
    /// Errors of the model file or of the plugin.
    pub fn build(
        file: &Path,
        plugin_directories: &[PathBuf],
        plugin: &str,
        settings: &serde_json::Value,
        done: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, OptimizeError> {
        let rules = LoadRules::default();
        let optimizer = PluginCatalog::discover(plugin_directories, &rules, Isolation::Process)
            .create(plugin, plugin, settings, &PluginOptions::default())
            .and_then(|plugin| Optimizer::from_plugin(&plugin))?;
        let start = Instant::now();
        let mut model = import_file(file, &ImportLimits::default())?.model;
        let import_millis = millis_since(start);
        let scales = model.mesh_scales();
        let imported = std::mem::take(&mut model.meshes);
        let total = imported.len();
        // Not from a cache: what this command reports is what the work takes.
        let builder = StackBuilder {
            optimizer: Some(&optimizer),
            cache: None,
            by_error: false,
            allows_failure: false,
        };
        let built = builder.build(imported.clone(), &scales, &|meshes| done(meshes, total))?;
        let mut build_ms = built.millis;
        build_ms.insert("import".into(), import_millis);
        Ok(Self { model, stacks: built.stacks, imported, build_ms })
    }

    /// Returns the statistics at a theta.
    pub fn stats(&self, theta: f64) -> OptimizeStats {
        let mut live = MeshStatistics::default();
        let mut full = MeshStatistics::default();
        let mut all_components = 0;
        for (stacks, imported) in self.stacks.iter().zip(&self.imported) {
            let cursor = stacks.cursor_for_theta(theta);
            live = live
                + MeshStatistics::from_resolved(&stacks.resolve(cursor), stacks.surviving(cursor));
            full = full + MeshStatistics::from_resolved(&stacks.resolve(0), stacks.surviving(0));
            let topology = imported.topology();
            let count = topology.positions.len() as u32;
            all_components += u64::from(count_components(count, &topology.triangles).all);
        }
        OptimizeStats {
            theta,
            vertices: live.vertices,
            vertices_referenced: live.vertices_referenced,
            triangles: live.triangles,
            components: live.components,
            border_edges: live.border_edges,
            non_manifold_edges: live.non_manifold_edges,
            euler: live.euler_characteristic(),
            collapses: self.stacks.iter().map(|s| u64::from(s.collapse_count())).sum(),
            cursor: self.stacks.iter().map(|s| u64::from(s.cursor_for_theta(theta))).sum(),
            build_ms: self.build_ms.clone(),
            max_depth: self.stacks.iter().map(|s| s.max_depth()).max().unwrap_or(0),
            error: self
                .stacks
                .iter()
                .map(|s| s.error_at(s.cursor_for_theta(theta)))
                .fold(0.0, f32::max),
            bytes: self.stacks.iter().map(|s| s.static_bytes()).sum(),
            imported: ImportedStats {
                meshes: self.stacks.len(),
                vertices: full.vertices,
                triangles: full.triangles,
                components: all_components,
                border_edges: full.border_edges,
                euler: full.euler_characteristic(),
            },
            round_trips: 0,
            lossless: None,
        }
    }

    /// Walks `count` random thetas and, from each, back to 0. Whether every
    /// return gave the imported mesh, byte for byte (positions, normals and
    /// texture coordinates of every corner, and the ranges of sections), and
    /// every mesh on the way was the one that redoing the collapses gives.
    pub fn round_trip(&self, count: u64, done: &dyn Fn(u64)) -> bool {
        let imported: Vec<Vec<u8>> = self.imported.iter().map(full_bytes).collect();
        let mut random = SplitMix(0x0b05_ba12);
        for trip in 0..count {
            let theta = random.unit();
            for (stacks, imported) in self.stacks.iter().zip(&imported) {
                let cursor = stacks.cursor_for_theta(theta);
                if !stacks.resolve(cursor).position_triangles().eq(redo(stacks, cursor)) {
                    return false;
                }
                let back = stacks.resolve(0);
                let whole =
                    stacks.mesh().sections.iter().zip(&back.sections).all(|(full, back)| {
                        *back == (full.first_triangle..full.first_triangle + full.triangle_count)
                    });
                if !whole || corner_bytes(stacks.mesh(), &back.triangles) != *imported {
                    return false;
                }
            }
            done(trip + 1);
        }
        true
    }

    /// The model at theta as GLB bytes.
    ///
    /// # Errors
    /// A model that is too large for the format.
    pub fn write(&self, theta: f64) -> Result<Vec<u8>, OptimizeError> {
        let mut model = self.model.clone();
        model.meshes = self.stacks.iter().map(|stacks| mesh_at(stacks, theta)).collect();
        Ok(write_glb(&model)?)
    }
}

impl From<PluginError> for OptimizeError {
    fn from(error: PluginError) -> Self {
        Self::Plugin { error }
    }
}

/// The live mesh of stacks at theta.
fn mesh_at(stacks: &CollapseStacks, theta: f64) -> Mesh {
    let resolved = stacks.resolve(stacks.cursor_for_theta(theta));
    let full = stacks.mesh();
    let sections = full.sections.iter().zip(&resolved.sections).map(|(section, range)| Section {
        material: section.material,
        first_triangle: range.start,
        triangle_count: range.end - range.start,
    });
    Mesh {
        positions: full.positions.clone(),
        wedges: full.wedges.clone(),
        sections: sections.collect(),
        features: full.features.clone(),
        triangles: resolved.triangles,
    }
}

/// The live triangles after `cursor` collapses, without parents or death
/// indices: each corner follows the entries done, and what degenerates goes.
fn redo(stacks: &CollapseStacks, cursor: u32) -> impl Iterator<Item = [u32; 3]> + '_ {
    let mesh = stacks.mesh();
    let mut stands_for: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    // Backwards, so that where a kept position went itself is known already.
    for (removed, kept) in stacks.collapses().take(cursor as usize).rev() {
        stands_for[removed as usize] = stands_for[kept as usize];
    }
    mesh.triangles
        .iter()
        .map(move |&t| mesh.corner_positions(t).map(|p| stands_for[p as usize]))
        .filter(|[a, b, c]| a != b && b != c && c != a)
}

fn full_bytes(mesh: &Mesh) -> Vec<u8> {
    corner_bytes(mesh, &mesh.triangles)
}

/// The data of every corner, in order, however positions are numbered: welding
/// makes their coordinates and feature their identity.
fn corner_bytes(mesh: &Mesh, triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(triangles.len() * 3 * 40);
    for &wedge in triangles.iter().flatten() {
        let wedge = wedge as usize;
        let position = mesh.wedges.position[wedge];
        let numbers = mesh.positions[position as usize]
            .to_array()
            .into_iter()
            .chain(mesh.wedges.normal[wedge].to_array())
            .chain(mesh.wedges.uv[wedge].to_array());
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        let feature = mesh.features.get(position as usize).copied().unwrap_or(NO_FEATURE);
        bytes.extend(feature.to_le_bytes());
        bytes.extend(mesh.wedges.section[wedge].to_le_bytes());
    }
    bytes
}

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): seeded, so that every walk is
/// the same.
struct SplitMix(u64);

impl SplitMix {
    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
