//! Model files to meshes, and meshes to stacks.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use busbar_config::{Config, join_pointer};
use busbar_gltf_import::{ImportError, ImportLimits, Imported, import_file};
use busbar_plugin_host::{Instance, MeshOptimizer};
use busbar_scene::Model;
use rayon::prelude::*;

use super::{Faults, LoadProgress, LoadedModel};
use crate::{LoadMillis, stacks};

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

/// Builds the stacks of all models.
pub(super) fn optimise(
    config: &Config,
    imported: ImportedModels,
    instances: &BTreeMap<String, Arc<Instance>>,
    progress: &LoadProgress<'_>,
    millis: &mut LoadMillis,
    faults: &mut Faults<'_>,
) -> Vec<LoadedModel> {
    let mut loaded = Vec::with_capacity(imported.models.len());
    for ((name, configured), model) in config.models.iter().zip(imported.models) {
        let instance = configured.optimizer.as_ref().and_then(|name| instances.get(name));
        let total = model.meshes.len();
        let built = instance
            .map(|instance| MeshOptimizer::of(instance.clone()))
            .transpose()
            .and_then(|optimizer| {
                stacks::build(model.meshes, optimizer.as_ref(), &|done| {
                    progress(&format!("collapse stacks of {name}"), done, total);
                })
            });
        match built {
            Ok(built) => {
                for (stage, spent) in built.millis {
                    *millis.entry(stage).or_default() += spent;
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
