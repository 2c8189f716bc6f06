//! Definition of the site by a loaded scene; equipment numbers of the site are node indices here.

use std::sync::Arc;

use busbar_plugin_host::PluginError;
use busbar_plugin_process::{RunningOverlay, RunningTelemetry};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_scene_overlays::{node_of, number_of};
use busbar_site::{
    EquipmentDirectory, EquipmentNumber, IndexRemap, SiteDefinition, StartedPlugins,
};
use busbar_tags::HandleRemap;

use busbar_scene_loader::EquipmentIndex;
use busbar_scene_loader::{LoadedScene, source_policy};

/// Directory of the equipment in a scene, by id or alias.
pub(crate) struct SceneDirectory<'a> {
    graph: &'a SceneGraph,
    names: &'a EquipmentIndex,
}

impl<'a> SceneDirectory<'a> {
    /// Returns the directory of a scene.
    pub(crate) fn new(scene: &'a LoadedScene) -> Self {
        Self { graph: &scene.graph, names: &scene.equipment }
    }
}

impl EquipmentDirectory for SceneDirectory<'_> {
    fn find(&self, id: &str) -> Option<EquipmentNumber> {
        self.names.find(self.graph, id).map(number_of)
    }

    fn path(&self, equipment: EquipmentNumber) -> Vec<String> {
        let node = node_of(equipment);
        if node.0 as usize >= self.graph.node_count() {
            return Vec::new();
        }
        let above = |node: &NodeIndex| self.graph.node(*node).parent();
        let nodes = std::iter::successors(Some(node), above);
        let mut ids: Vec<String> =
            nodes.map(|node| self.graph.node(node).id().to_string()).collect();
        ids.reverse();
        ids
    }
}

/// Returns the definition of a scene's site.
pub(crate) fn site_definition(scene: &LoadedScene) -> SiteDefinition {
    let numbers = scene.alarms.nodes.iter().map(|node| node.map(number_of));
    SiteDefinition {
        config: Arc::clone(&scene.config),
        tags: Arc::clone(&scene.tags),
        bound_tags: scene.bindings.iter().map(|binding| binding.tag).collect(),
        alarms: Arc::clone(&scene.alarms.set),
        alarm_templates: Arc::clone(&scene.alarms.templates),
        alarm_equipment: numbers.collect(),
        audit_log: scene.audit_log.clone(),
        plugins: scene.instances.clone(),
    }
}

/// Starts the selected overlays of a scene on their bindings, and the selected telemetry plugins on
/// their tags.
///
/// # Errors
/// A plugin that cannot start.
pub(crate) fn start_plugins(
    scene: &LoadedScene,
    is_selected: &dyn Fn(&str) -> bool,
) -> Result<StartedPlugins, PluginError> {
    let mut started = StartedPlugins::default();
    let selected = || scene.instances.iter().filter(|(name, _)| is_selected(name));
    for (name, plugin) in selected() {
        if scene.config.overlays.iter().any(|overlay| overlay.plugin == *name) {
            let bindings = scene.overlay_bindings(name);
            started.overlays.insert(name.clone(), RunningOverlay::configure(plugin, bindings)?);
        }
    }
    for (name, plugin) in selected() {
        if let Some(tags) = scene.served_tags(name, plugin) {
            let policy = source_policy(&scene.config, name);
            started.telemetry.push(RunningTelemetry::start(plugin, &tags, policy)?);
        }
    }
    Ok(started)
}

/// Builds the map from the numbers of one scene to those of another; with the same nodes it maps
/// tags alone.
pub(crate) fn index_remap(
    before: &LoadedScene,
    after: &LoadedScene,
    same_nodes: bool,
) -> IndexRemap {
    let tags = match Arc::ptr_eq(&before.tags, &after.tags) {
        true => HandleRemap::default(),
        false => HandleRemap::between_tag_sets(&before.tags, &after.tags),
    };
    let nodes = match same_nodes {
        true => HandleRemap::default(),
        false => {
            let ids = (0..before.graph.node_count() as u32)
                .map(|index| before.graph.node(NodeIndex(index)).id());
            let found: Vec<Option<u32>> = ids.map(|id| Some(after.graph.find(&id)?.0)).collect();
            HandleRemap::new(found.into_iter())
        }
    };
    IndexRemap::new(tags, nodes)
}

/// Returns the present index of a node; none if the node is gone.
pub(crate) fn remapped(remap: &IndexRemap, node: NodeIndex) -> Option<NodeIndex> {
    remap.equipment(number_of(node)).map(node_of)
}
