//! A changed configuration in place of the one that is shown.

use std::collections::BTreeMap;
use std::path::PathBuf;

use busbar_config::{PluginConfig, TagConfig};
use busbar_renderer::release_freed_memory;
use busbar_scene_loader::{FileVersion, LoadedModel, ReloadedScene};
use busbar_tags::HandleRemap;

use super::*;
use crate::index_remap::IndexRemap;
use crate::reload::PreparedReload;
use crate::renderer_options;

impl Viewer {
    /// Applies a prepared reload from the next frame on. Unchanged parts are kept: plugins, values
    /// with their ages, alarm states, models on the device, camera, selection, theta. After an
    /// error all is as before.
    ///
    /// # Errors
    /// Errors of the graphics device, or of a chart or records that cannot be read.
    pub fn apply_reload(&mut self, reload: PreparedReload) -> Result<(), ViewError> {
        let PreparedReload { loaded, telemetry, overlays } = reload;
        let ReloadedScene { mut scene, changes, kept, has_same_graph } = loaded;
        let is_kept = |name: &String| kept.contains(name);
        let chart = self.next_chart(&scene, &is_kept)?;
        let records = self.next_records(&scene, &is_kept)?;
        self.change_device(&scene)?;
        self.upload_new(&scene)?;
        if has_same_graph {
            // Parts may have moved while it was loaded.
            scene.graph = Arc::clone(&self.scene.graph);
        }
        let remap = IndexRemap::between(&self.scene, &scene, has_same_graph);
        let mut before = std::mem::replace(&mut self.scene, scene);
        let slots: BTreeSet<Option<u32>> = self.scene.models.iter().map(|m| m.slot).collect();
        let gone = before.models.iter().filter(|model| !slots.contains(&model.slot));
        gone.for_each(|model| self.renderer.remove_model(uploaded_models::handle_of(model)));

        self.chart = chart.unwrap_or_else(|| self.chart.take());
        self.records = records.unwrap_or_else(|| std::mem::take(&mut self.records));
        self.carry_tags(&before, &remap.tags);
        self.carry_alarms(&before);
        self.carry_plugins(&remap, &is_kept, telemetry, overlays);
        self.carry_view(&before);
        let same_proxies = Arc::ptr_eq(&before.proxies, &self.scene.proxies);
        if !has_same_graph || !same_proxies || before.policies != self.scene.policies {
            self.rebuild_lod_cursors(&before, &remap, has_same_graph);
        }
        self.carry_equipment(&remap);
        before.instances.retain(|name, _| !is_kept(name));
        before.instances.values().for_each(Plugin::quit);
        // Waiting for processes is not the frame's business; without a thread it has to be.
        let end = std::thread::Builder::new().name("reload end".into());
        drop(end.spawn(move || {
            drop(before);
            release_freed_memory();
        }));
        tracing::info!("the configuration is loaded again: {changes}");
        Ok(())
    }

    /// The chart, where it is another one than before.
    fn next_chart(
        &self,
        scene: &LoadedScene,
        is_kept: &dyn Fn(&String) -> bool,
    ) -> Result<Option<Option<SceneChart>>, ViewError> {
        let (was, is) = (&self.scene.config.chart, &scene.config.chart);
        let goes_on = is.as_ref().is_none_or(|chart| is_kept(&chart.plugin));
        if was == is && goes_on {
            return Ok(None);
        }
        construction::start_chart(scene, self.settles).map(Some)
    }

    /// The records, where they come from elsewhere than before.
    fn next_records(
        &self,
        scene: &LoadedScene,
        is_kept: &dyn Fn(&String) -> bool,
    ) -> Result<Option<RecordStore>, ViewError> {
        let names = |scene: &LoadedScene| -> Vec<String> {
            scene.config.records.iter().map(|records| records.plugin.clone()).collect()
        };
        if names(&self.scene) == names(scene) && names(scene).iter().all(is_kept) {
            return Ok(None);
        }
        RecordStore::start(scene, self.settles).map(Some)
    }

    /// Uploads the models that the device has not yet. Without a device they come with the
    /// next one.
    fn upload_new(&mut self, scene: &LoadedScene) -> Result<(), ViewError> {
        let there: BTreeSet<Option<u32>> = self.scene.models.iter().map(|m| m.slot).collect();
        self.recovery.run(&mut self.renderer, &self.scene, |renderer| {
            let is_new = |model: &LoadedModel| !there.contains(&model.slot);
            uploaded_models::upload_some(&scene.models, renderer, is_new)
        })?;
        Ok(())
    }

    /// Carries over the values of tags with an unchanged source.
    fn carry_tags(&mut self, before: &LoadedScene, remap: &HandleRemap) {
        let (was, is) = (&before.config.tags, &self.scene.config.tags);
        let (was_plugins, are_plugins) = (&before.config.plugins, &self.scene.config.plugins);
        let same_origin = |id: &String| {
            let origin = |tag: &TagConfig| (tag.origin.clone(), tag.scale);
            let device = |plugins, tag| source_device(plugins, tag);
            was.get(id).map(origin) == is.get(id).map(origin)
                && was.get(id).map(|tag| device(was_plugins, tag))
                    == is.get(id).map(|tag| device(are_plugins, tag))
        };
        let specs = before.tags.specs();
        let all_same = remap.is_identity() && specs.iter().all(|spec| same_origin(&spec.id));
        if all_same && Arc::ptr_eq(&before.tags, &self.scene.tags) {
            return;
        }
        let own: Vec<Option<u32>> = specs
            .iter()
            .zip(0..)
            .map(|(spec, old)| remap.index(old).filter(|_| same_origin(&spec.id)))
            .collect();
        let own = HandleRemap::new(own.into_iter());
        let mut tags = construction::table_of(&self.scene);
        tags.inherit(&self.tags, &own);
        self.tags = tags;
        self.host_intake = HostIntake::for_scene(&self.scene);
        self.events.renumber(&own);
        let history = std::mem::replace(&mut self.history, selection::history_of(&self.scene));
        self.history.inherit(history, &own);
    }

    fn carry_alarms(&mut self, before: &LoadedScene) {
        let is_live = !self.settles;
        self.alarms = match self.alarms.take() {
            Some(alarms) => alarms.into_reloaded(before, &self.scene, is_live, wall_clock()),
            None => AlarmService::new(&self.scene, is_live, wall_clock()),
        };
        if let Some(alarms) = &mut self.alarms {
            alarms.set_operator(&self.operator);
            if self.has_host {
                alarms.set_host();
            }
        }
    }

    fn carry_plugins(
        &mut self,
        remap: &IndexRemap,
        is_kept: &dyn Fn(&String) -> bool,
        telemetry: Vec<busbar_plugin_process::RunningTelemetry>,
        mut overlays: std::collections::BTreeMap<String, busbar_plugin_process::RunningOverlay>,
    ) {
        self.telemetry.retain(|telemetry| is_kept(&telemetry.name().to_owned()));
        self.telemetry.iter_mut().for_each(|telemetry| telemetry.remap_tags(&remap.tags));
        self.telemetry.extend(telemetry.into_iter().map(TelemetryInstance::new));
        let mut shown = std::mem::take(&mut self.overlays);
        for overlay in &self.scene.config.overlays {
            let name = &overlay.plugin;
            let was = shown.iter().position(|shown| shown.overlay.name() == name);
            let was = was.map(|index| shown.swap_remove(index));
            let next = match (overlays.remove(name), was) {
                (Some(running), was) => {
                    let mut next = OverlayInstance::new(running);
                    was.into_iter().for_each(|was| next.inherit(was));
                    next
                }
                (None, Some(mut was)) => {
                    was.remap_indices(remap, &self.scene.graph);
                    was
                }
                (None, None) => continue,
            };
            self.overlays.push(next);
        }
    }

    /// Applies changed view settings; all others stay as the operator set them.
    fn carry_view(&mut self, before: &LoadedScene) {
        let (was, is) = (Arc::clone(&before.config), Arc::clone(&self.scene.config));
        let camera = |config: &busbar_config::Config| {
            config.view.camera.as_ref().and_then(|name| config.cameras.get(name).cloned())
        };
        if let Some(camera) = camera(&is).filter(|next| camera(&was).as_ref() != Some(next)) {
            self.navigator.jump_to(Camera::from_config(&camera));
        }
        let (was, is) = (&was.view, &is.view);
        self.navigator.configure(is, !self.settles);
        if (was.theme, was.scale, &was.font) != (is.theme, is.scale, &is.font) {
            if !self.in_window {
                let pixels = self.screen.size() * was.scale;
                self.screen = Rect::from_min_size(Pos2::ZERO, pixels / is.scale);
            }
            self.panels.set_appearance(construction::appearance_of(&mut self.scene));
        }
        if was.section != is.section {
            self.section = is.section.map(environment::section_of);
        }
        if was.theta_scale != is.theta_scale {
            self.lod_cursors.set_scale(is.theta_scale);
        }
        self.lod_cursors.set_morph_seconds(is.morph_seconds);
        if was.target_frame_millis != is.target_frame_millis {
            self.frame_budget = FrameBudget::new(is.target_frame_millis.filter(|_| !self.settles));
        }
        self.environment = Environment::new(is, self.scene.graph.bounds());
    }

    /// Makes the device anew where a configuration wants it otherwise. Where that cannot be,
    /// it is made as it was.
    fn change_device(&mut self, next: &LoadedScene) -> Result<(), ViewError> {
        let is_live = !self.settles;
        let wanted = |scene: &LoadedScene| {
            let options = construction::options_of(renderer_options(scene), is_live);
            (options, construction::device_choice(scene))
        };
        let (options, choice) = wanted(next);
        if !self.renderer.set_options(options, choice) {
            return Ok(());
        }
        // What was asked of the device before is gone with it.
        self.pick_queue = PickQueue::default();
        if let Err(error) = self.recovery.renew(&mut self.renderer, &self.scene) {
            let (options, choice) = wanted(&self.scene);
            self.renderer.set_options(options, choice);
            if let Err(lost) = self.recovery.renew(&mut self.renderer, &self.scene) {
                self.recovery.mark_lost(lost)?;
            }
            return Err(error.into());
        }
        Ok(())
    }

    /// Draws other instances than before, or at other levels of detail.
    fn rebuild_lod_cursors(&mut self, before: &LoadedScene, remap: &IndexRemap, same_graph: bool) {
        let scene = &self.scene;
        let scale = scene.config.view.theta_scale;
        let mut lod_cursors = LodCursors::new(
            &scene.graph,
            &scene.meshes(),
            &scene.policies,
            &scene.proxies,
            scale,
            uploaded_models::MORPH_BUDGET,
        );
        lod_cursors.set_morph_seconds(scene.config.view.morph_seconds);
        lod_cursors.inherit(&self.lod_cursors, same_graph, |model| {
            let name = &scene.models.get(model)?.name;
            before.config.models.keys().position(|known| known == name)
        });
        self.lod_cursors = lod_cursors;
        self.models = uploaded_models::without_details(scene);
        self.triangles_full = construction::full_triangles(scene);
        self.scene_draw_list = SceneDrawList::default();
        if same_graph {
            return;
        }
        self.moving_parts = MovingParts::new(Arc::clone(&scene.moving_parts));
        self.selection = self.selection.iter().filter_map(|node| remap.node(*node)).collect();
        self.pick_queue = PickQueue::default();
        (self.hovered, self.last_view, self.camera_rests) = (None, None, false);
        (self.labelled, self.hidden_labels) = (Vec::new(), BTreeSet::new());
        (self.highlights, self.outlines) = (Highlights::default(), Outlines::default());
        (self.overlay_geometry, self.states) = (OverlayGeometry::default(), Vec::new());
        if let Some(chart) = &mut self.chart {
            chart.find_equipment(&scene.graph);
        }
    }

    /// Lists and faceplate of what equipment there is now.
    fn carry_equipment(&mut self, remap: &IndexRemap) {
        let scene = &self.scene;
        self.node_attachments = NodeAttachments::new(scene);
        let tree =
            EquipmentTree::new(&scene.graph, &scene.equipment, &self.node_attachments.nodes());
        let old = std::mem::replace(&mut self.equipment_tree, tree);
        self.equipment_tree.search(old.query(), &scene.graph, &scene.equipment);
        self.equipment_tree.inherit(&old, |node| remap.node(node));
        self.tag_filter = self.tag_filter.for_scene(scene);
        let faceplate = self.faceplate.take();
        let selection = std::mem::take(&mut self.selection);
        self.select(selection);
        if let (Some(now), Some(before)) = (&mut self.faceplate, &faceplate) {
            now.keep_trends(before, &remap.tags);
        }
    }

    /// Returns the scene that is shown.
    pub fn scene(&self) -> &LoadedScene {
        &self.scene
    }

    /// Returns a clone of the scene for a thread that loads its replacement.
    pub(crate) fn shared_scene(&self) -> LoadedScene {
        self.scene.clone()
    }

    /// The files of the models shown, and which content of each it is.
    pub(crate) fn model_files(&self) -> impl Iterator<Item = (PathBuf, FileVersion)> {
        self.scene.model_files()
    }

    /// Returns the counters of configuration reloads.
    pub fn reload_counters(&self) -> &ReloadCounters {
        &self.reloads
    }

    pub(crate) fn reload_counters_mut(&mut self) -> &mut ReloadCounters {
        &mut self.reloads
    }
}

/// Settings that decide on the device that a tag's values come from; `None` where no plugin
/// brings them.
fn source_device<'a>(
    plugins: &'a BTreeMap<String, PluginConfig>,
    tag: &TagConfig,
) -> Option<(&'a str, &'a serde_json::Value)> {
    let plugin = plugins.get(&tag.source()?.plugin)?;
    Some((&plugin.plugin, &plugin.settings))
}
