//! Loaded scene: a configuration with everything it names, loaded and checked.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use busbar_audit_log::AuditLogOptions;
use busbar_config::{Config, Diagnostic, LogConfig, MetricsConfig, Section, Severity};
use busbar_geometry::CollapseStacks;
use busbar_lod::{InstancePolicies, Proxies, ProxyModel, SourceModel};
use busbar_plugin_host::{OverlayBinding, TelemetryTag};
use busbar_plugin_process::{Plugin, RunningTelemetry};
use busbar_scene::{Material, NodeIndex, SceneGraph, Texture};
use busbar_tags::{TagHandle, TagSet};

use crate::alarms::{self, LoadedAlarms};
use crate::bindings;
use crate::config_file::{config_folder, read_config};
use crate::diagnostics::{DiagnosticsCollector, LoadError};
use crate::equipment::EquipmentIndex;
use crate::file_version::FileVersion;
use crate::moving_parts::MovingPartTable;
use crate::reuse::ReusePlan;
use crate::stack_builder::millis_since;
use crate::{font, mesh_cache, models, moving_part_check, plugins, theta_policies};

/// Milliseconds of loading by stage.
pub type LoadMillis = BTreeMap<String, f64>;

/// Progress callback: stage, steps done, steps in all.
pub type LoadProgress<'a> = dyn Fn(&str, usize, usize) + Sync + 'a;

/// A configuration with everything it names, loaded and checked. Clones share all of it.
#[derive(Clone)]
pub struct LoadedScene {
    /// Valid configuration, without the positions of its values.
    pub config: Arc<Config>,
    /// Base folder of relative paths.
    pub(crate) folder: PathBuf,
    /// Plugin instances by their names; none of them has been started on its duties.
    pub instances: BTreeMap<String, Plugin>,
    /// Models of the configuration, then the proxies.
    pub models: Vec<LoadedModel>,
    /// Number of placements of each configured model.
    pub instances_of_models: Vec<usize>,
    /// Placed nodes and mesh instances.
    pub graph: Arc<SceneGraph>,
    /// Proxy meshes of groups and of repeated meshes.
    pub proxies: Arc<Proxies>,
    /// Theta policies of all mesh instances.
    pub policies: Arc<InstancePolicies>,
    /// Tags in the order of their handles.
    pub tags: Arc<TagSet>,
    /// Bindings of tags to nodes.
    pub bindings: Arc<[Binding]>,
    /// Parts that move, as modelled.
    pub moving_parts: Arc<MovingPartTable>,
    /// Alarms with their equipment.
    pub alarms: LoadedAlarms,
    /// The alarm log that the configuration asks for.
    pub audit_log: Option<AuditLogOptions>,
    /// Names and aliases of the equipment.
    pub equipment: Arc<EquipmentIndex>,
    /// The font of panels and labels; none for the one built in.
    pub font: Option<Arc<[u8]>>,
    /// The first node that each tag is bound to.
    nodes_of_tags: Arc<HashMap<TagHandle, NodeIndex>>,
    /// Milliseconds of loading by stage.
    pub millis: LoadMillis,
    /// Meshes whose stacks were in the cache.
    pub cached_meshes: usize,
    /// Folder for compiled pipelines.
    pub pipeline_cache: Option<PathBuf>,
    notes: Vec<String>,
    /// Failures of plugins that do not prevent the scene from being shown.
    plugin_failures: Vec<Diagnostic>,
}

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
    fn from_proxy(ProxyModel { stacks, materials }: ProxyModel) -> Self {
        Self { stacks, materials, ..Self::default() }
    }

    /// Returns the meshes with their appearance, as proxies are made of them.
    fn source(&self) -> SourceModel<'_> {
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

/// A tag bound to a node, resolved.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Tag that is bound.
    pub tag: TagHandle,
    /// Node that the tag is bound to.
    pub node: NodeIndex,
    /// Role of the tag at the node, as overlays know it.
    pub role: String,
}

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
            models::split_meshes(&config, &mut imported, graph.as_mut());
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

    /// Warnings, what plugins did wrong by themselves, and what the import skipped.
    pub fn remarks(&self, file: &Path) -> Vec<String> {
        let file = file.display().to_string();
        let failure = |failure: &Diagnostic| {
            Diagnostic { severity: Severity::Warning, ..failure.clone() }.render(&file)
        };
        let warnings = self.config.warnings.iter().map(|warning| warning.render(&file));
        let plugin_failures = self.plugin_failures.iter().map(failure);
        warnings.chain(plugin_failures).chain(self.notes.iter().cloned()).collect()
    }

    /// Returns the meshes of all models, those of proxies last.
    pub fn meshes(&self) -> Vec<&[Arc<CollapseStacks>]> {
        self.models.iter().map(|model| model.stacks.as_slice()).collect()
    }

    /// The files of the configuration's models, and which content of each was read.
    pub fn model_files(&self) -> impl Iterator<Item = (PathBuf, FileVersion)> {
        let models = self.config.models.values().zip(&self.models);
        models.map(|(model, loaded)| (self.folder.join(&model.file), loaded.provenance.file))
    }

    /// The log file that the configuration asks for, and where it is.
    pub fn log(&self) -> Option<(PathBuf, &LogConfig)> {
        let log = self.config.log.as_ref()?;
        Some((self.folder.join(&log.file), log))
    }

    /// Returns the configured endpoint of metrics.
    pub fn metrics(&self) -> Option<MetricsConfig> {
        self.config.metrics
    }

    /// Returns the number of configured models.
    pub fn model_count(&self) -> usize {
        self.config.models.len()
    }

    /// Size of the picture that the configuration asks for, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.config.view.size
    }

    /// The equipment that a tag is bound to first.
    pub fn node_of(&self, tag: TagHandle) -> Option<String> {
        self.nodes_of_tags.get(&tag).map(|&node| self.graph.node(node).id())
    }

    /// The tags that a plugin serves, if it is to serve: a source of alarms does without any.
    pub fn served_tags(&self, name: &str, plugin: &Plugin) -> Option<Vec<TelemetryTag>> {
        let tags = plugins::telemetry_tags(&self.config, self.tags.specs(), name);
        let has_alarms = plugins::has_alarms(&self.config, name);
        let serves = !tags.is_empty() || has_alarms && RunningTelemetry::has_telemetry(plugin);
        serves.then_some(tags)
    }

    /// The bindings that an overlay gets.
    pub fn overlay_bindings(&self, overlay: &str) -> Vec<OverlayBinding> {
        let roles = self.config.plugins.get(overlay).map_or(&[][..], |plugin| &plugin.roles);
        bindings::for_overlay(self, roles)
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

