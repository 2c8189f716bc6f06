//! Loading: the stages from a configuration file to a scene, with every fault on the way.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use busbar_audit_log::AuditLogOptions;
use busbar_config::{Config, Section, Severity};
use busbar_lod::Proxies;

use crate::config_file::{config_folder, read_config};
use crate::diagnostics::{DiagnosticsCollector, LoadError};
use crate::equipment::EquipmentIndex;
use crate::loaded_model::{LoadMillis, LoadProgress, LoadedModel};
use crate::loaded_scene::LoadedScene;
use crate::mesh_splitting::split_meshes;
use crate::moving_parts::MovingPartTable;
use crate::reuse::ReusePlan;
use crate::stack_builder::millis_since;
use crate::{
    alarms, bindings, font, mesh_cache, models, moving_part_check, plugins, theta_policies,
};

impl LoadedScene {
    /// Loads a configuration and everything it names. Plugins are created, but
    /// nothing connects and no device is used. A plugin that dies or fails by itself
    /// in its own process is a remark: it is started again while the scene is shown,
    /// with its tags bad, and a model whose optimiser failed is shown in full detail.
    ///
    /// # Errors
    /// Every fault of the file, of the files it names, and of what it asks of plugins.
    pub fn load(path: &Path, progress: &LoadProgress<'_>) -> Result<Self, LoadError> {
        let start = Instant::now();
        progress("configuration", 0, 1);
        let config = read_config(path)?;
        let millis = LoadMillis::from([("config".into(), millis_since(start))]);
        Self::assemble(path, config, millis, &ReusePlan::none(), progress)
    }

    /// Loads what a configuration names, except for what can be reused.
    pub(crate) fn assemble(
        path: &Path,
        config: Config,
        mut millis: LoadMillis,
        reuse: &ReusePlan<'_>,
        progress: &LoadProgress<'_>,
    ) -> Result<Self, LoadError> {
        let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
        let folder = config_folder(path);
        let mut faults = DiagnosticsCollector::new(&config);
        faults.found.clone_from(&config.warnings);
        // Beside each other: starting the processes of plugins is mostly waiting.
        progress("plugins and models", 0, 1);
        let mut import_faults = DiagnosticsCollector::new(&config);
        let mut notes = Vec::new();
        let is_new = |name: &String| reuse.model(name).is_none();
        let cache = config.models.keys().any(is_new);
        let cache = cache.then(|| mesh_cache::open(&config.cache, &folder, &mut notes)).flatten();
        let at_hand = (reuse, cache.as_ref());
        let ((instances, plugin_millis), (mut imported, import_millis)) = rayon::join(
            || timed(|| plugins::create(&config, &folder, reuse, &mut faults)),
            || timed(|| models::import(&config, &folder, at_hand, progress, &mut import_faults)),
        );
        faults.found.append(&mut import_faults.found);
        millis.insert("plugins".into(), plugin_millis);
        millis.insert("import".into(), import_millis);

        let start = Instant::now();
        let known = reuse.scene().filter(|_| reuse.has_same_graph());
        let graph = known.map(|scene| Arc::clone(&scene.graph)).or_else(|| {
            let mut graph = bindings::place(&config, &imported, &mut faults);
            split_meshes(&config, &mut imported, graph.as_mut());
            graph.map(Arc::new)
        });
        let placed = graph.as_deref();
        let tags = bindings::tags(&config, &mut faults);
        let same_tags = reuse.scene().filter(|scene| scene.tags.specs() == tags.specs());
        let tags = same_tags.map_or_else(|| Arc::new(tags), |scene| Arc::clone(&scene.tags));
        let bindings = bindings::resolve(&config, placed, &imported, &mut faults);
        let mut nodes_of_tags = HashMap::new();
        for binding in &bindings {
            nodes_of_tags.entry(binding.tag).or_insert(binding.node);
        }
        moving_part_check::check(&config, &imported, &mut faults);
        let alarms =
            alarms::resolve(&config, &tags, placed, &imported, &nodes_of_tags, &mut faults);
        let same_names = known.filter(|_| !reuse.touches(Section::Equipment));
        let equipment = same_names.map(|scene| Arc::clone(&scene.equipment)).or_else(|| {
            let equipment = EquipmentIndex::new(placed?, &config.equipment, |id, equipment| {
                // What is to blame is told where it is looked for.
                let pointer = &equipment.pointer;
                placed.map(|graph| {
                    bindings::find(&config, graph, &imported, id, pointer, &mut faults)
                });
            });
            Some(Arc::new(equipment))
        });
        let font = font::load(&config, &folder, &mut faults);
        millis.insert("scene".into(), millis_since(start));

        plugins::check_capabilities(&config, &instances, tags.specs(), reuse, &mut faults);
        notes.append(&mut imported.notes);
        let fatal = faults.found.iter().any(|d| d.severity == Severity::Error);
        let mut cached_meshes = 0;
        let mut pipeline_cache = reuse.scene().and_then(|scene| scene.pipeline_cache.clone());
        let mut models = if fatal {
            Vec::new()
        } else {
            pipeline_cache =
                cache.as_ref().map(|cache| cache.directory().to_owned()).or(pipeline_cache);
            let mut stage = models::OptimizationStage {
                instances: &instances,
                cache,
                progress,
                millis: &mut millis,
                cached_meshes: &mut cached_meshes,
                notes: &mut notes,
            };
            stage.run(&config, imported, &mut faults)
        };

        plugins::report_crashed_plugins(&config, &instances, &mut faults);
        let mut plugin_failures = faults.plugin_failures;
        plugin_failures.sort_by_key(|d| (d.line, d.column));
        let mut diagnostics = faults.found;
        diagnostics.sort_by_key(|d| (d.line, d.column));
        let errors = diagnostics.iter().any(|d| d.severity == Severity::Error);
        match graph {
            Some(graph) if !errors => {
                let start = Instant::now();
                let policies = theta_policies::of_instances(&config);
                let proxies = match known.filter(|scene| *scene.policies == policies) {
                    Some(scene) => {
                        models.extend_from_slice(&scene.models[scene.model_count()..]);
                        Arc::clone(&scene.proxies)
                    }
                    None => {
                        let sources: Vec<_> = models.iter().map(LoadedModel::source).collect();
                        let (proxies, built) = Proxies::build(&graph, &policies, &sources);
                        models.extend(built.into_iter().map(LoadedModel::from_proxy));
                        Arc::new(proxies)
                    }
                };
                reuse.give_slots(&mut models);
                millis.insert("proxies".into(), millis_since(start));
                let instances_of_models = count_placed(&config);
                let audit_log = audit_log_of(&config, &folder);
                let moving_parts = Arc::new(MovingPartTable::new(&config, &graph));
                let mut config = config.loaded();
                config.warnings = diagnostics;
                Ok(Self {
                    config: Arc::new(config),
                    folder,
                    instances,
                    models,
                    instances_of_models,
                    graph,
                    proxies,
                    policies: Arc::new(policies),
                    tags,
                    bindings: bindings.into(),
                    moving_parts,
                    alarms,
                    audit_log,
                    equipment: equipment.unwrap_or_default(),
                    font: font.map(Arc::from),
                    nodes_of_tags: Arc::new(nodes_of_tags),
                    millis,
                    cached_meshes,
                    pipeline_cache,
                    notes,
                    plugin_failures,
                })
            }
            _ => {
                diagnostics.extend(plugin_failures);
                diagnostics.sort_by_key(|d| (d.line, d.column));
                Err(faulty(diagnostics))
            }
        }
    }

    /// Loads like [`LoadedScene::load`], but plugin failures count as faults, and the alarm log is
    /// checked.
    ///
    /// # Errors
    /// Every fault of the file, of the files it names, of the plugins, and of the alarm log.
    pub fn check(path: &Path, progress: &LoadProgress<'_>) -> Result<Self, LoadError> {
        let mut scene = Self::load(path, progress)?;
        scene.check_audit_log(path)?;
        scene.check_overlays(path)?;
        if scene.plugin_failures.is_empty() {
            return Ok(scene);
        }
        let mut diagnostics = scene.config.warnings.clone();
        diagnostics.extend(scene.plugin_failures.iter().cloned());
        diagnostics.sort_by_key(|d| (d.line, d.column));
        Err(LoadError { file: path.to_owned(), diagnostics })
    }

    /// Checks that the alarm log can be opened, without writing. An unusable log is a failure; a
    /// damaged one gives a remark.
    fn check_audit_log(&mut self, path: &Path) -> Result<(), LoadError> {
        let Some(rules) = &self.audit_log else { return Ok(()) };
        match busbar_audit_log::inspect(rules) {
            Ok(remarks) => {
                let told = |remark| format!("warning: the audit log: {remark}");
                self.notes.extend(remarks.into_iter().map(told));
            }
            Err(error) => {
                // What is loaded has no positions any more.
                let config = read_config(path)?;
                let mut faults = DiagnosticsCollector::new(&config);
                let text = error.to_string();
                let (cause, remedy) = text.rsplit_once("; ").unwrap_or((&text, ""));
                faults.add_plugin_failure(
                    "/alarm_handling/log_directory",
                    cause.to_owned(),
                    remedy,
                );
                self.plugin_failures.append(&mut faults.plugin_failures);
            }
        }
        Ok(())
    }
}

/// The alarm log that a configuration asks for.
fn audit_log_of(config: &Config, folder: &Path) -> Option<AuditLogOptions> {
    let handling = &config.alarm_handling;
    let placed = |path: &Option<String>| path.as_ref().map(|path| folder.join(path));
    Some(AuditLogOptions {
        directory: placed(&handling.log_directory)?,
        max_file_bytes: u64::from(handling.log_megabytes) * 1_000_000,
        max_files: handling.log_files,
        key_file: placed(&handling.log_key_file),
        anchor_file: placed(&handling.log_anchor_file),
    })
}

fn count_placed(config: &Config) -> Vec<usize> {
    let mut placed: HashMap<String, usize> = HashMap::new();
    for name in config.scene.iter().filter_map(|node| node.model) {
        *placed.entry(name).or_default() += 1;
    }
    config.models.keys().map(|name| placed.get(name).copied().unwrap_or(0)).collect()
}

/// Runs some work and returns its result with the time in milliseconds.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    (work(), millis_since(start))
}
