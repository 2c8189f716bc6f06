//! Scene loader: reads a configuration and all it names, without a graphics device.

mod alarms;
mod bindings;
mod cache;
mod device_points;
mod font;
mod hlod;
mod link_check;
mod models;
mod moving_part_check;
mod overlay_check;
mod plugins;
mod reuse;
mod simulation;

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use busbar_audit_log::AuditLogOptions;
use busbar_config::{
    Config, Diagnostic, LogConfig, MetricsConfig, QualityConfig, Section, Severity,
};
use busbar_geometry::CollapseStacks;
use busbar_plugin_host::{OverlayBinding, PluginError, TelemetryTag};
use busbar_plugin_process::{Plugin, PluginCatalog, RunningTelemetry};
use busbar_renderer::{ModelHandle, Quality, RendererOptions};
use busbar_scene::{Material, NodeIndex, SceneGraph, Texture, ThetaPolicy};
use busbar_tags::{TagHandle, TagSet};

pub(crate) use alarms::LoadedAlarms;
pub use device_points::{DevicePointSource, DevicePoints, POINTS_COMMAND};
pub(crate) use hlod::{HlodGroup, MeshProxy, Proxies};
pub use link_check::{CheckedLink, check_links};
pub(crate) use plugins::source_policy;
use reuse::ReusePlan;
pub use reuse::{PreparedReload, ReloadError};
pub use simulation::{SimulatedDevice, SimulatedDevices};

use crate::equipment::EquipmentIndex;
use crate::file_version::FileVersion;
use crate::lod::policy_of;
use crate::moving_parts::MovingParts;
use crate::stack_builder::millis_since;
use crate::{LoadError, LoadMillis};

/// The largest configuration file that is read.
pub const MAX_CONFIG_FILE_BYTES: u64 = busbar_config::MAX_CONFIG_BYTES as u64;

/// Progress callback: stage, steps done, steps in all.
pub type LoadProgress<'a> = dyn Fn(&str, usize, usize) + Sync + 'a;

/// A configuration with everything it names, loaded and checked. Clones share all of it.
#[derive(Clone)]
pub struct LoadedScene {
    pub(crate) config: Arc<Config>,
    /// Base folder of relative paths.
    folder: PathBuf,
    pub(crate) instances: BTreeMap<String, Plugin>,
    /// Models of the configuration, then the proxies.
    pub(crate) models: Vec<LoadedModel>,
    /// Number of placements of each configured model.
    pub(crate) instances_of_models: Vec<usize>,
    pub(crate) graph: Arc<SceneGraph>,
    pub(crate) proxies: Arc<Proxies>,
    pub(crate) tags: Arc<TagSet>,
    pub(crate) bindings: Arc<[Binding]>,
    /// Parts that move, as modelled.
    pub(crate) moving: MovingParts,
    pub(crate) alarms: LoadedAlarms,
    /// The alarm log that the configuration asks for.
    pub(crate) audit_log: Option<AuditLogOptions>,
    /// Names and aliases of the equipment.
    pub(crate) equipment: Arc<EquipmentIndex>,
    /// The font of panels and labels; none for the one built in.
    pub(crate) font: Option<Arc<[u8]>>,
    /// The first node that each tag is bound to.
    nodes_of_tags: Arc<HashMap<TagHandle, NodeIndex>>,
    pub(crate) millis: LoadMillis,
    /// Meshes whose stacks were in the cache.
    pub(crate) cached_meshes: usize,
    /// Folder for compiled pipelines.
    pub(crate) pipeline_cache: Option<PathBuf>,
    notes: Vec<String>,
    /// Failures of plugins that do not prevent the scene from being shown.
    plugin_failures: Vec<Diagnostic>,
}

/// A model ready for upload.
#[derive(Clone, Default)]
pub(crate) struct LoadedModel {
    pub(crate) name: String,
    pub(crate) stacks: Vec<Arc<CollapseStacks>>,
    pub(crate) materials: Arc<[Material]>,
    pub(crate) textures: Arc<[Texture]>,
    /// Slot on the device; none until all models are loaded.
    pub(crate) slot: Option<u32>,
    pub(crate) provenance: ModelProvenance,
}

impl LoadedModel {
    /// Returns the model's handle on the device.
    pub(crate) fn handle(&self) -> ModelHandle {
        ModelHandle::from_index(self.slot.unwrap_or(u32::MAX))
    }
}

/// Provenance of a model, compared at reload.
#[derive(Clone, Default)]
pub(crate) struct ModelProvenance {
    /// True if the collapses are ordered by error.
    by_error: bool,
    /// True if the optimizer succeeded.
    is_complete: bool,
    /// Version of the model file; files that it references are not checked.
    file: FileVersion,
    /// Range of pieces of each mesh, for a model that was split.
    pieces: Vec<Range<u32>>,
}

/// A tag bound to a node, resolved.
#[derive(Clone, Debug)]
pub(crate) struct Binding {
    pub(crate) tag: TagHandle,
    pub(crate) node: NodeIndex,
    pub(crate) role: String,
}

/// Collector of diagnostics, so that loading continues as far as possible.
pub(crate) struct DiagnosticsCollector<'a> {
    config: &'a Config,
    found: Vec<Diagnostic>,
    /// Failures of plugins, which do not prevent the scene from being shown.
    plugin_failures: Vec<Diagnostic>,
}

impl<'a> DiagnosticsCollector<'a> {
    fn new(config: &'a Config) -> Self {
        Self { config, found: Vec::new(), plugin_failures: Vec::new() }
    }

    /// Adds a plugin's error. An error that the plugin alone caused does not prevent the scene from
    /// being shown.
    pub(crate) fn add_plugin_error(&mut self, pointer: &str, error: &PluginError) {
        if error.is_reported_by_plugin() {
            self.add_plugin_failure(pointer, error.to_string(), error.remedy());
        } else {
            self.add(pointer, error.to_string(), error.remedy());
        }
    }

    fn add_plugin_failure(&mut self, pointer: &str, cause: String, remedy: &str) {
        self.plugin_failures.push(self.config.positions.diagnostic(pointer, cause, remedy));
    }

    pub(crate) fn add(
        &mut self,
        pointer: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.found.push(self.config.positions.diagnostic(pointer, cause, remedy));
    }
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
    fn assemble(
        path: &Path,
        config: Config,
        mut millis: LoadMillis,
        reuse: &ReusePlan<'_>,
        progress: &LoadProgress<'_>,
    ) -> Result<Self, LoadError> {
        let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
        let folder = folder_of(path);
        let mut faults = DiagnosticsCollector {
            found: config.warnings.clone(),
            ..DiagnosticsCollector::new(&config)
        };
        // Beside each other: starting the processes of plugins is mostly waiting.
        progress("plugins and models", 0, 1);
        let mut import_faults = DiagnosticsCollector::new(&config);
        let mut notes = Vec::new();
        let is_new = |name: &String| reuse.model(name).is_none();
        let cache = config.models.keys().any(is_new);
        let cache = cache.then(|| cache::open(&config.cache, &folder, &mut notes)).flatten();
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
                let policies = policies_of(&config);
                let proxies = match known.filter(|scene| scene.policies() == policies) {
                    Some(scene) => {
                        models.extend_from_slice(&scene.models[scene.model_count()..]);
                        Arc::clone(&scene.proxies)
                    }
                    None => Arc::new(hlod::build(&graph, &policies, &mut models)),
                };
                reuse.give_slots(&mut models);
                millis.insert("proxies".into(), millis_since(start));
                let instances_of_models = count_placed(&config);
                let audit_log = audit_log_of(&config, &folder);
                let moving = MovingParts::new(&config, &graph);
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
                    tags,
                    bindings: bindings.into(),
                    moving,
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

    /// The theta policies of the configuration's models.
    pub(crate) fn policies(&self) -> Vec<ThetaPolicy> {
        policies_of(&self.config)
    }

    /// The files of the configuration's models, and which content of each was read.
    pub(crate) fn model_files(&self) -> impl Iterator<Item = (PathBuf, FileVersion)> {
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
    pub(crate) fn model_count(&self) -> usize {
        self.config.models.len()
    }

    /// Size of the picture that the configuration asks for, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.config.view.size
    }

    /// Returns the renderer options of the configuration. An open quality becomes `Low` on a
    /// software rasterizer, except in headless views.
    pub fn renderer_options(&self) -> RendererOptions {
        let view = &self.config.view;
        let quality = match view.quality {
            Some(QualityConfig::Low) => Quality::Low,
            Some(QualityConfig::Medium) | None => Quality::Medium,
            Some(QualityConfig::High) => Quality::High,
        };
        let with_samples = |quality: Quality| (quality, view.samples.unwrap_or(quality.samples()));
        let (quality, samples) = with_samples(quality);
        let on_software_rasterizer = view.quality.is_none().then(|| with_samples(Quality::Low));
        RendererOptions { quality, samples, on_software_rasterizer, validation: false }
    }

    /// The equipment that a tag is bound to first.
    pub(crate) fn node_of(&self, tag: TagHandle) -> Option<String> {
        self.nodes_of_tags.get(&tag).map(|&node| self.graph.node(node).id())
    }

    /// The tags that a plugin serves, if it is to serve: a source of alarms does without any.
    pub(crate) fn served_tags(&self, name: &str, plugin: &Plugin) -> Option<Vec<TelemetryTag>> {
        let tags = plugins::telemetry_tags(&self.config, self.tags.specs(), name);
        let has_alarms = plugins::has_alarms(&self.config, name);
        let serves = !tags.is_empty() || has_alarms && RunningTelemetry::has_telemetry(plugin);
        serves.then_some(tags)
    }

    /// The bindings that an overlay gets.
    pub(crate) fn overlay_bindings(&self, overlay: &str) -> Vec<OverlayBinding> {
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

fn policies_of(config: &Config) -> Vec<ThetaPolicy> {
    config.models.values().map(|model| policy_of(&model.theta)).collect()
}

/// Runs some work and returns its result with the time in milliseconds.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    (work(), millis_since(start))
}

/// Makes the catalogue of plugins that a configuration's directories hold.
///
/// # Errors
/// When the configuration itself cannot be read or names no usable key.
pub fn plugin_catalog(path: &Path) -> Result<PluginCatalog, LoadError> {
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let config = read_config(path)?;
    let mut faults = DiagnosticsCollector::new(&config);
    let catalog = plugins::catalog(&config, &folder_of(path), &mut faults);
    catalog.ok_or_else(|| faulty(faults.found))
}

/// The folder that relative paths of a configuration start from, absolute.
fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
}

/// Reads a configuration without checking the files it names.
fn read_config(path: &Path) -> Result<Config, LoadError> {
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let text = read_text(path).map_err(|fault| faulty(vec![fault]))?;
    busbar_config::parse(&text).map_err(faulty)
}

fn read_text(path: &Path) -> Result<String, Diagnostic> {
    let fault = |cause: String, remedy: &str| Diagnostic {
        severity: Severity::Error,
        line: 1,
        column: 1,
        pointer: String::new(),
        cause,
        remedy: remedy.into(),
    };
    let unreadable = |error: std::io::Error| {
        fault(format!("cannot read the configuration: {error}"), "check the path and its rights")
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(fault("it is not a regular file".into(), "name a JSON file"));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(MAX_CONFIG_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_CONFIG_FILE_BYTES {
        let cause = format!("it is larger than {MAX_CONFIG_FILE_BYTES} bytes");
        return Err(fault(cause, "name a configuration file, or split it"));
    }
    String::from_utf8(bytes).map_err(|_| fault("it is not UTF-8 text".into(), "save it as UTF-8"))
}
