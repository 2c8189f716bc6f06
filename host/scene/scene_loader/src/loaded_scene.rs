//! Loaded scene: a configuration with everything it names, loaded and checked.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use busbar_alarms::{AlarmSet, AlarmTemplate};
use busbar_audit_log::AuditLogOptions;
use busbar_config::{Config, Diagnostic, LogConfig, MetricsConfig, Severity};
use busbar_geometry::CollapseStacks;
use busbar_lod::{InstancePolicies, Proxies};
use busbar_plugin_process::Plugin;
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::{TagHandle, TagSet};

use crate::equipment::EquipmentIndex;
use crate::file_version::{FileVersion, version};
use crate::loaded_model::{LoadMillis, LoadedModel};
use crate::moving_parts::MovingPartTable;

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
    pub(crate) nodes_of_tags: Arc<HashMap<TagHandle, NodeIndex>>,
    /// Milliseconds of loading by stage.
    pub millis: LoadMillis,
    /// Meshes whose stacks were in the cache.
    pub cached_meshes: usize,
    /// Folder for compiled pipelines.
    pub pipeline_cache: Option<PathBuf>,
    pub(crate) notes: Vec<String>,
    /// Failures of plugins that do not prevent the scene from being shown.
    pub(crate) plugin_failures: Vec<Diagnostic>,
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

    /// Returns the models whose files have changed. A missing file counts as being replaced; its
    /// model stays.
    pub(crate) fn edited_models(&self) -> Vec<String> {
        let files = self.config.models.keys().zip(self.model_files());
        let is_edited = |path: &Path, read| version(path).is_some_and(|now| Some(now) != read);
        let edited = files.filter(|(_, (path, read))| is_edited(path, *read));
        edited.map(|(name, _)| name.clone()).collect()
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
}

/// The alarms of a scene, and where they show.
#[derive(Clone, Debug, Default)]
pub struct LoadedAlarms {
    /// Alarms in the order of their handles.
    pub set: Arc<AlarmSet>,
    /// Alarms on all equipment that an overlay judges, in the order of their ids.
    pub templates: Arc<[AlarmTemplate]>,
    /// The equipment of each alarm.
    pub nodes: Arc<[Option<NodeIndex>]>,
}
