//! Loaded models: meshes with collapse stacks, materials, and where they came from.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use busbar_geometry::CollapseStacks;
use busbar_lod::{ProxyModel, SourceModel};
use busbar_scene::{Material, Texture};

use crate::file_version::FileVersion;

/// Milliseconds of loading by stage.
pub type LoadMillis = BTreeMap<String, f64>;

/// Progress callback: stage, steps done, steps in all.
pub type LoadProgress<'a> = dyn Fn(&str, usize, usize) + Sync + 'a;

/// A model ready for upload.
#[derive(Clone, Default)]
pub struct LoadedModel {
    /// Name in the configuration; empty for proxies.
    pub name: String,
    /// Collapse stacks of the meshes.
    pub stacks: Vec<Arc<CollapseStacks>>,
    /// Materials of the meshes' sections.
    pub materials: Arc<[Material]>,
    /// Textures of the materials.
    pub textures: Arc<[Texture]>,
    /// Number that no other loaded model has, nor one of the scene before; none until all models
    /// are loaded.
    pub slot: Option<u32>,
    pub(crate) provenance: ModelProvenance,
}

impl LoadedModel {
    /// Creates a model of proxy meshes.
    pub(crate) fn from_proxy(ProxyModel { stacks, materials }: ProxyModel) -> Self {
        Self { stacks, materials, ..Self::default() }
    }

    /// Returns the meshes with their appearance, as proxies are made of them.
    pub(crate) fn source(&self) -> SourceModel<'_> {
        SourceModel { stacks: &self.stacks, materials: &self.materials, textures: &self.textures }
    }
}

/// Provenance of a model, compared at reload.
#[derive(Clone, Default)]
pub(crate) struct ModelProvenance {
    /// True if the collapses are ordered by error.
    pub(crate) by_error: bool,
    /// True if the optimizer succeeded.
    pub(crate) is_complete: bool,
    /// Version of the model file; files that it references are not checked.
    pub(crate) file: FileVersion,
    /// Range of pieces of each mesh, for a model that was split.
    pub(crate) pieces: Vec<Range<u32>>,
}
