//! Model files to meshes, and meshes to stacks.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use busbar_config::{Config, ModelSceneConfig, join_pointer};
use busbar_gltf_import::{
    ImportError, ImportFault, ImportOptions, MeshCache, SceneChoice, import_file_with,
};
use busbar_plugin_process::{Optimizer, Plugin};
use busbar_scene::{Model, ModelParts};
use busbar_stack_cache::{OptimizerDigest, StackCache};
use rayon::prelude::*;

use crate::diagnostics::DiagnosticsCollector;
use crate::file_version::{FileVersion, version};
use crate::loaded_model::{LoadMillis, LoadProgress, LoadedModel, ModelProvenance};
use crate::mesh_cache::{self, WeldedMeshCache};
use crate::mesh_splitting::scales_of_pieces;
use crate::reuse::ReusePlan;
use crate::stack_builder::StackBuilder;
use crate::theta_policies::screen_error_models;

/// The models of a configuration, before their stacks are built.
pub(crate) struct ImportedModels {
    /// Models in order of name.
    pub(crate) models: Vec<ModelSource>,
    /// Ranges of pieces of each mesh, by the index of a model that was split.
    pub(crate) pieces: BTreeMap<usize, Vec<Range<u32>>>,
    /// Remarks on skipped content, for the log.
    pub(crate) notes: Vec<String>,
}

/// Source of a model.
pub(crate) enum ModelSource {
    /// Newly imported model with its file's version.
    New(Box<Model>, FileVersion),
    /// Model of the previous scene.
    Known(Box<LoadedModel>, ModelParts),
    /// Model whose file cannot be imported, as a fault says.
    Failed,
}

impl ModelSource {
    /// Returns the parts that the model adds to a scene.
    pub(crate) fn parts(&self) -> ModelParts {
        match self {
            Self::New(model, _) => ModelParts::from_model(model),
            Self::Known(_, parts) => parts.clone(),
            Self::Failed => ModelParts::from_model(&Model::default()),
        }
    }
}

/// Imports the model files that are not known, each on a thread of its own.
pub(crate) fn import(
    config: &Config,
    folder: &Path,
    (reuse, cache): (&ReusePlan<'_>, Option<&StackCache>),
    progress: &LoadProgress<'_>,
    faults: &mut DiagnosticsCollector<'_>,
) -> ImportedModels {
    let kept = cache.map(WeldedMeshCache::new);
    let keeper = kept.as_ref().map(|kept| kept as &dyn MeshCache);
    let done = AtomicUsize::new(0);
    let models: Vec<_> = config.models.iter().collect();
    let results: Vec<Result<(ModelSource, Vec<String>), ImportError>> = models
        .par_iter()
        .map(|(name, model)| {
            if let Some((known, parts)) = reuse.model(name) {
                return Ok((ModelSource::Known(Box::new(known.clone()), parts), Vec::new()));
            }
            let file = folder.join(&model.file);
            // Before it is read: an edit meanwhile is news.
            let read = version(&file);
            let scene = model.scene.as_ref().map(scene_choice);
            let options = ImportOptions { limits: None, scene: scene.as_ref(), cache: keeper };
            let imported = import_file_with(&file, options);
            progress("models", done.fetch_add(1, Ordering::Relaxed) + 1, models.len());
            imported.map(|imported| {
                (ModelSource::New(Box::new(imported.model), read), imported.report.notes)
            })
        })
        .collect();
    let notes = kept.map_or_else(Vec::new, WeldedMeshCache::into_notes);
    let mut all = ImportedModels { models: Vec::new(), pieces: BTreeMap::new(), notes };
    for ((name, model), result) in models.into_iter().zip(results) {
        match result {
            Ok((source, notes)) => {
                all.notes.extend(notes.iter().map(|note| format!("model '{name}': {note}")));
                all.models.push(source);
            }
            Err(error) => {
                let is_of_scene = matches!(error.fault, ImportFault::NoScene { .. });
                let key = if is_of_scene { "scene" } else { "file" };
                let pointer = join_pointer(&model.pointer, key);
                let cause = format!("{}: {}, at {}", model.file, error.fault, error.place);
                faults.add(&pointer, cause, error.fault.remedy());
                all.models.push(ModelSource::Failed);
            }
        }
    }
    all
}

fn scene_choice(scene: &ModelSceneConfig) -> SceneChoice {
    match scene {
        ModelSceneConfig::Name(name) => SceneChoice::Name(name.clone()),
        ModelSceneConfig::Index(index) => SceneChoice::Index(*index),
    }
}

/// Cache digest part of results ordered by error; its number grows with every change of the order.
const BY_ERROR: &[u8] = b"by error, 5";

/// The stage of loading that builds stacks.
pub(crate) struct OptimizationStage<'a> {
    pub(crate) instances: &'a BTreeMap<String, Plugin>,
    pub(crate) cache: Option<StackCache>,
    pub(crate) progress: &'a LoadProgress<'a>,
    pub(crate) millis: &'a mut LoadMillis,
    pub(crate) cached_meshes: &'a mut usize,
    pub(crate) notes: &'a mut Vec<String>,
}

impl OptimizationStage<'_> {
    /// Builds the stacks of all models.
    pub(crate) fn run(
        &mut self,
        config: &Config,
        mut imported: ImportedModels,
        faults: &mut DiagnosticsCollector<'_>,
    ) -> Vec<LoadedModel> {
        let optimizer_digests = self.optimizer_digests(config);
        let following = screen_error_models(config);
        let mut loaded = Vec::with_capacity(imported.models.len());
        for (((name, configured), source), index) in
            config.models.iter().zip(imported.models).zip(0..)
        {
            let (model, file) = match source {
                ModelSource::New(model, file) => (*model, file),
                ModelSource::Known(known, _) => {
                    loaded.push(*known);
                    continue;
                }
                ModelSource::Failed => continue,
            };
            let by_error = following.contains(name);
            let pieces = imported.pieces.remove(&index).unwrap_or_default();
            let scales = match pieces.is_empty() {
                true => model.mesh_scales(),
                false => scales_of_pieces(&model, &pieces),
            };
            let optimizer = configured.optimizer.as_ref();
            let optimizer_digest = optimizer.and_then(|name| optimizer_digests.get(name).copied());
            let built = optimizer
                .and_then(|name| self.instances.get(name))
                .map(Optimizer::from_plugin)
                .transpose()
                .and_then(|optimizer| {
                    let optimizer_digest = optimizer_digest.map(|optimizer_digest| {
                        if by_error {
                            optimizer_digest.with_part(BY_ERROR)
                        } else {
                            optimizer_digest
                        }
                    });
                    let cache = self.cache.as_ref().zip(optimizer_digest);
                    let optimizer = optimizer.as_ref();
                    let builder = StackBuilder { optimizer, cache, by_error, allows_failure: true };
                    let total = model.meshes.len();
                    builder.build(model.meshes, &scales, &|done| {
                        (self.progress)(&format!("collapse stacks of {name}"), done, total);
                    })
                });
            match built {
                Ok(built) => {
                    for (stage, spent) in built.millis {
                        *self.millis.entry(stage).or_default() += spent;
                    }
                    *self.cached_meshes += built.cached;
                    self.notes.extend(built.notes);
                    let is_complete = built.optimizer_failure.is_none();
                    if let Some(error) = built.optimizer_failure {
                        let pointer = join_pointer(&configured.pointer, "optimizer");
                        let cause = format!("model '{name}' is shown in full detail: {error}");
                        faults.add_plugin_failure(&pointer, cause, error.remedy());
                    }
                    loaded.push(LoadedModel {
                        name: name.clone(),
                        stacks: built.stacks,
                        materials: model.materials.into(),
                        textures: model.textures.into(),
                        slot: None,
                        provenance: ModelProvenance { by_error, is_complete, file, pieces },
                    });
                }
                Err(error) => {
                    let pointer = join_pointer(&configured.pointer, "optimizer");
                    faults.add(&pointer, error.to_string(), error.remedy());
                }
            }
        }
        loaded
    }

    /// Returns the cache digest of each optimizer in use.
    fn optimizer_digests(&mut self, config: &Config) -> BTreeMap<String, OptimizerDigest> {
        let mut optimizer_digests = BTreeMap::new();
        if self.cache.is_none() {
            return optimizer_digests;
        }
        let used: BTreeSet<&String> =
            config.models.values().filter_map(|model| model.optimizer.as_ref()).collect();
        for name in used {
            let (Some(instance), Some(plugin)) =
                (self.instances.get(name), config.plugins.get(name))
            else {
                continue;
            };
            match mesh_cache::optimizer_digest(instance, &plugin.settings) {
                Ok(optimizer_digest) => {
                    optimizer_digests.insert(name.clone(), optimizer_digest);
                }
                Err(error) => {
                    self.notes.push(format!("results of '{name}' are not cached: {error}"));
                }
            }
        }
        optimizer_digests
    }
}
