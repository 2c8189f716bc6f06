//! Reuse at a configuration reload: unchanged plugins, models and nodes are neither loaded nor
//! started again.

use std::collections::{BTreeMap, BTreeSet};

use busbar_config::{Changes, Config, Section, TagConfig};
use busbar_plugin_process::Plugin;
use busbar_scene::{ModelIndex, ModelParts};

use crate::loaded_model::LoadedModel;
use crate::loaded_scene::LoadedScene;
use crate::plugin_duties;
use crate::theta_policies::screen_error_models;

/// Reusable parts of the previous scene, if there is one.
pub(crate) struct ReusePlan<'a>(Option<PreviousScene<'a>>);

struct PreviousScene<'a> {
    scene: &'a LoadedScene,
    changes: &'a Changes,
    /// Plugins that are kept.
    plugins: BTreeSet<String>,
    /// Unchanged models with their previous indices.
    models: BTreeMap<String, usize>,
    has_same_graph: bool,
}

impl<'a> ReusePlan<'a> {
    /// Creates a plan that reuses nothing.
    pub(crate) fn none() -> Self {
        Self(None)
    }

    /// Creates a plan that reuses nothing of a previous scene.
    pub(crate) fn none_of(scene: &'a LoadedScene, changes: &'a Changes) -> Self {
        let (plugins, models) = (BTreeSet::new(), BTreeMap::new());
        Self(Some(PreviousScene { scene, changes, plugins, models, has_same_graph: false }))
    }

    /// Finds what a changed configuration leaves as it is.
    pub(crate) fn new(scene: &'a LoadedScene, config: &Config, changes: &'a Changes) -> Self {
        let names = scene.instances.keys();
        let is_plugin_kept = |name: &&String| {
            !changes.affect(Section::PluginRules) && is_plugin_kept(&scene.config, config, name)
        };
        let plugins = names.filter(is_plugin_kept).cloned().collect();
        let following = screen_error_models(config);
        let edited: BTreeSet<String> = scene.edited_models().into_iter().collect();
        let numbered = scene.config.models.keys().zip(0..);
        let models: BTreeMap<String, usize> = numbered
            .filter(|(name, index)| {
                let provenance = &scene.models[*index].provenance;
                provenance.is_complete
                    && !edited.contains(*name)
                    && provenance.by_error == following.contains(name)
                    && is_same_model(&scene.config, config, name)
            })
            .map(|(name, index)| (name.clone(), index))
            .collect();
        let has_same_graph = !changes.affect(Section::Scene)
            && models.keys().eq(config.models.keys())
            && models.len() == scene.config.models.len();
        Self(Some(PreviousScene { scene, changes, plugins, models, has_same_graph }))
    }

    /// Returns the previous scene.
    pub(crate) fn scene(&self) -> Option<&'a LoadedScene> {
        self.0.as_ref().map(|before| before.scene)
    }

    /// Reports whether a section of the configuration has changed.
    pub(crate) fn touches(&self, section: Section) -> bool {
        self.0.as_ref().is_none_or(|before| before.changes.affect(section))
    }

    /// Reports whether nodes and models are unchanged.
    pub(crate) fn has_same_graph(&self) -> bool {
        self.0.as_ref().is_some_and(|before| before.has_same_graph)
    }

    /// Returns the names of the plugins that are kept.
    pub(crate) fn into_kept_plugins(self) -> BTreeSet<String> {
        self.0.map(|before| before.plugins).unwrap_or_default()
    }

    /// Returns a plugin that is kept.
    pub(crate) fn plugin(&self, name: &str) -> Option<&'a Plugin> {
        let before = self.0.as_ref().filter(|before| before.plugins.contains(name))?;
        before.scene.instances.get(name)
    }

    /// Returns an unchanged model.
    pub(crate) fn model(&self, name: &str) -> Option<(&'a LoadedModel, ModelParts)> {
        let before = self.0.as_ref()?;
        let index = *before.models.get(name)?;
        let parts = before.scene.graph.model_parts(ModelIndex(index as u32));
        Some((&before.scene.models[index], parts))
    }

    /// Assigns free device slots to new models; models of the previous scene keep theirs until they
    /// are removed.
    pub(crate) fn give_slots(&self, models: &mut [LoadedModel]) {
        let before = self.scene().map_or(&[][..], |scene| &scene.models);
        let taken: BTreeSet<u32> = before.iter().filter_map(|model| model.slot).collect();
        let mut free = (0..).filter(|slot| !taken.contains(slot));
        for model in models.iter_mut().filter(|model| model.slot.is_none()) {
            model.slot = free.next();
        }
    }
}

/// Reports whether a plugin's settings and duties are unchanged.
fn is_plugin_kept(before: &Config, after: &Config, name: &str) -> bool {
    before.plugins.get(name) == after.plugins.get(name)
        && plugin_duties::serves(before, name) == plugin_duties::serves(after, name)
        && served_tag_properties(before, name).eq(served_tag_properties(after, name))
        && plugin_duties(before, name) == plugin_duties(after, name)
        && (!plugin_duties(after, name)[0]
            || overlay_inputs(before, name).eq(overlay_inputs(after, name)))
}

/// Returns the tags that a plugin serves, with the properties it receives.
fn served_tag_properties<'a>(
    config: &'a Config,
    name: &'a str,
) -> impl Iterator<Item = (&'a String, impl PartialEq + 'a)> {
    config.tags.iter().filter_map(move |(id, tag)| {
        let source = tag.source().filter(|source| source.plugin == name)?;
        Some((id, (tag.value_type, tag.freshness_millis, &source.address)))
    })
}

/// Returns the duties of a plugin: overlay, records, chart, model optimizer, alarms,
/// notifications.
fn plugin_duties(config: &Config, name: &str) -> [bool; 6] {
    [
        config.overlays.iter().any(|overlay| overlay.plugin == name),
        config.records.iter().any(|records| records.plugin == name),
        config.chart.as_ref().is_some_and(|chart| chart.plugin == name),
        config.models.values().any(|model| model.optimizer.as_deref() == Some(name)),
        plugin_duties::has_alarms(config, name),
        plugin_duties::tells_of_alarms(config, name),
    ]
}

/// Returns the bindings that an overlay receives.
fn overlay_inputs<'a>(config: &'a Config, name: &str) -> impl Iterator<Item = impl PartialEq + 'a> {
    let roles = config.plugins.get(name).map_or(&[][..], |plugin| &plugin.roles);
    let bindings = config.bindings.iter();
    let own = bindings.filter(|of| roles.is_empty() || roles.contains(&of.role));
    own.map(|binding| {
        let told = |tag: &'a TagConfig| (tag.value_type, tag.limits, &tag.name, &tag.unit);
        (&binding.tag, &binding.node, &binding.role, config.tags.get(&binding.tag).map(told))
    })
}

/// Reports whether a model is unchanged, except for its theta.
fn is_same_model(before: &Config, after: &Config, name: &str) -> bool {
    let (Some(was), Some(is)) = (before.models.get(name), after.models.get(name)) else {
        return false;
    };
    let optimizer = |config: &Config| {
        let plugin = config.plugins.get(is.optimizer.as_ref()?)?;
        Some((plugin.plugin.clone(), plugin.settings.clone(), plugin.sha256.clone()))
    };
    (&was.file, &was.scene, &was.optimizer, &was.moving_parts)
        == (&is.file, &is.scene, &is.optimizer, &is.moving_parts)
        && optimizer(before) == optimizer(after)
}
