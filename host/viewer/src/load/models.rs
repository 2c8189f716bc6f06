//! Model files to meshes, and meshes to stacks.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use busbar_config::{Config, ThetaConfig, join_pointer};
use busbar_geometry::Mesh;
use busbar_gltf_import::{ImportError, ImportLimits, Imported, import_file};
use busbar_plugin_process::{Optimizer, Plugin};
use busbar_scene::{Model, ModelIndex, SceneGraph};
use busbar_stack_cache::{Maker, StackCache};
use rayon::prelude::*;

use super::{Faults, LoadProgress, LoadedModel, cache};
use crate::LoadMillis;
use crate::stacks::StackBuilder;

/// The models of a configuration as imported, by name.
pub(super) struct ImportedModels {
    /// In order of name; an empty model where the import failed.
    pub(super) models: Vec<Model>,
    /// Whether each one is usable.
    pub(super) usable: Vec<bool>,
    /// What was skipped, for the log.
    pub(super) notes: Vec<String>,
}

/// Imports all model files, each on a thread of its own.
pub(super) fn import(
    config: &Config,
    folder: &Path,
    progress: &LoadProgress<'_>,
    faults: &mut Faults<'_>,
) -> ImportedModels {
    let done = AtomicUsize::new(0);
    let models: Vec<_> = config.models.values().collect();
    let results: Vec<Result<Imported, ImportError>> = models
        .par_iter()
        .map(|model| {
            let imported = import_file(&folder.join(&model.file), &ImportLimits::default());
            progress("models", done.fetch_add(1, Ordering::Relaxed) + 1, models.len());
            imported
        })
        .collect();
    let mut all = ImportedModels { models: Vec::new(), usable: Vec::new(), notes: Vec::new() };
    for ((name, model), result) in config.models.iter().zip(results) {
        all.usable.push(result.is_ok());
        match result {
            Ok(imported) => {
                let notes = imported.report.notes.iter();
                all.notes.extend(notes.map(|note| format!("model '{name}': {note}")));
                all.models.push(imported.model);
            }
            Err(error) => {
                let pointer = join_pointer(&model.pointer, "file");
                let cause = format!("{}: {}, at {}", model.file, error.fault, error.place);
                faults.add(&pointer, cause, error.fault.remedy());
                all.models.push(Model::default());
            }
        }
    }
    all
}

/// The most triangles of a piece where a mesh is taken apart: enough that its draw
/// calls cost little beside them, and few enough that pieces differ in distance.
const MAX_PIECE_TRIANGLES: u32 = 16_384;

/// What tells results in the order of their errors apart in the cache; its number grows
/// with every change of what they are.
const BY_ERROR: &[u8] = b"by error, 2";

/// The models whose detail, somewhere they are placed, follows the error on the screen.
fn following_error(config: &Config) -> BTreeSet<&String> {
    let follows = |theta: &ThetaConfig| matches!(theta, ThetaConfig::ScreenError { .. });
    let placed = config.scene.iter().filter(|node| node.theta.as_ref().is_some_and(follows));
    let placed: BTreeSet<String> = placed.filter_map(|node| node.model).collect();
    let models = config.models.iter().filter(|(_, model)| follows(&model.theta));
    let placed = config.models.keys().filter(|name| placed.contains(*name));
    models.map(|(name, _)| name).chain(placed).collect()
}

/// Takes the meshes apart whose detail follows the error on the screen, so that each
/// piece has a cursor for its own distance: a site is often drawn as one mesh, and its
/// far end may be coarse while the near one is not.
pub(super) fn take_apart(
    config: &Config,
    imported: &mut ImportedModels,
    graph: Option<&mut SceneGraph>,
) {
    let Some(graph) = graph else { return };
    let following = following_error(config);
    for (index, name) in config.models.keys().enumerate() {
        if !following.contains(name) {
            continue;
        }
        let meshes = &mut imported.models[index].meshes;
        if meshes.iter().all(|mesh| mesh.triangles.len() <= MAX_PIECE_TRIANGLES as usize) {
            continue;
        }
        let whole = std::mem::take(meshes);
        let apart: Vec<_> =
            whole.into_par_iter().map(|mesh| mesh.into_islands(MAX_PIECE_TRIANGLES)).collect();
        let mut pieces = Vec::with_capacity(apart.len());
        for of_mesh in apart {
            let first = meshes.len() as u32;
            meshes.extend(of_mesh);
            pieces.push(first..meshes.len() as u32);
        }
        let boxes: Vec<_> = meshes.iter().map(Mesh::bounds).collect();
        graph.take_apart(ModelIndex(index as u32), &pieces, &boxes);
    }
}

/// The stage of loading that builds stacks.
pub(super) struct Optimising<'a> {
    pub(super) instances: &'a BTreeMap<String, Plugin>,
    pub(super) cache: Option<StackCache>,
    pub(super) progress: &'a LoadProgress<'a>,
    pub(super) millis: &'a mut LoadMillis,
    pub(super) cached_meshes: &'a mut usize,
    pub(super) notes: &'a mut Vec<String>,
}

impl Optimising<'_> {
    /// Builds the stacks of all models.
    pub(super) fn run(
        &mut self,
        config: &Config,
        imported: ImportedModels,
        faults: &mut Faults<'_>,
    ) -> Vec<LoadedModel> {
        let makers = self.makers(config);
        let following = following_error(config);
        let mut loaded = Vec::with_capacity(imported.models.len());
        for ((name, configured), model) in config.models.iter().zip(imported.models) {
            let optimizer = configured.optimizer.as_ref();
            let maker = optimizer.and_then(|name| makers.get(name).copied());
            let built = optimizer
                .and_then(|name| self.instances.get(name))
                .map(Optimizer::of)
                .transpose()
                .and_then(|optimizer| {
                    let by_error = following.contains(name);
                    let maker =
                        maker.map(|maker| if by_error { maker.with(BY_ERROR) } else { maker });
                    let cache = self.cache.as_ref().zip(maker);
                    let optimizer = optimizer.as_ref();
                    let builder = StackBuilder { optimizer, cache, by_error, may_do_without: true };
                    let total = model.meshes.len();
                    builder.build(model.meshes, &|done| {
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
                    if let Some(error) = built.without {
                        let pointer = join_pointer(&configured.pointer, "optimizer");
                        let cause = format!("model '{name}' is shown in full detail: {error}");
                        faults.add_trouble(&pointer, cause, error.remedy());
                    }
                    loaded.push(LoadedModel {
                        name: name.clone(),
                        stacks: built.stacks,
                        materials: model.materials,
                        textures: model.textures,
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

    /// What the results of each optimiser in use are known by in the cache.
    fn makers(&mut self, config: &Config) -> BTreeMap<String, Maker> {
        let mut makers = BTreeMap::new();
        if self.cache.is_none() {
            return makers;
        }
        let used: BTreeSet<&String> =
            config.models.values().filter_map(|model| model.optimizer.as_ref()).collect();
        for name in used {
            let (Some(instance), Some(plugin)) =
                (self.instances.get(name), config.plugins.get(name))
            else {
                continue;
            };
            match cache::maker(instance, &plugin.settings) {
                Ok(maker) => {
                    makers.insert(name.clone(), maker);
                }
                Err(error) => {
                    self.notes.push(format!("results of '{name}' are not cached: {error}"));
                }
            }
        }
        makers
    }
}
