//! A changed configuration in place of the one that is shown.

use std::path::PathBuf;

use busbar_renderer::release_freed_memory;
use busbar_site::{IndexRemap, StartedPlugins};

use super::*;
use crate::file_version::FileVersion;
use crate::load::PreparedReload;
use crate::site_definition::{index_remap, remapped, site_definition};

impl Viewer {
    /// Applies a prepared reload from the next frame on. Unchanged parts are kept: plugins, values
    /// with their ages, alarm states, models on the device, camera, selection, theta. After an
    /// error all is as before.
    ///
    /// # Errors
    /// Errors of the graphics device, or of a chart or records that cannot be read.
    pub fn apply_reload(&mut self, reload: PreparedReload) -> Result<(), ViewError> {
        let PreparedReload { mut scene, changes, kept, telemetry, overlays, has_same_graph } =
            reload;
        let started = StartedPlugins { telemetry, overlays };
        let site = self.site.prepare_reload(site_definition(&scene), started, kept.clone())?;
        let chart = site.replaced_chart();
        let chart = chart.map(|reader| construction::chart_of(&scene, reader, self.settles));
        self.change_device(&scene)?;
        self.upload_new(&scene)?;
        if has_same_graph {
            // Parts may have moved while it was loaded.
            scene.graph = Arc::clone(&self.scene.graph);
        }
        let remap = index_remap(&self.scene, &scene, has_same_graph);
        let before = std::mem::replace(&mut self.scene, scene);
        let slots: BTreeSet<Option<u32>> = self.scene.models.iter().map(|m| m.slot).collect();
        let gone = before.models.iter().filter(|model| !slots.contains(&model.slot));
        gone.for_each(|model| self.renderer.remove_model(model.handle()));

        self.chart = chart.unwrap_or_else(|| self.chart.take());
        let replaced = self.site.apply_reload(site, &remap, &SceneDirectory::new(&self.scene));
        self.alarms.reload(&before.alarms.set, &self.scene, &self.site);
        self.layers.reload(&self.site, &self.scene.graph, &|name| kept.contains(name));
        self.carry_view(&before);
        let same_proxies = Arc::ptr_eq(&before.proxies, &self.scene.proxies);
        if !has_same_graph || !same_proxies || before.policies() != self.scene.policies() {
            self.rebuild_lod_cursors(&before, &remap, has_same_graph);
        }
        self.carry_equipment(&remap);
        // Waiting for processes is not the frame's business; without a thread it has to be.
        let end = std::thread::Builder::new().name("reload end".into());
        drop(end.spawn(move || {
            drop((replaced, before));
            release_freed_memory();
        }));
        tracing::info!("the configuration is loaded again: {changes}");
        Ok(())
    }

    /// Uploads the models that the device has not yet. Without a device they come with the
    /// next one.
    fn upload_new(&mut self, scene: &LoadedScene) -> Result<(), ViewError> {
        let there: BTreeSet<Option<u32>> = self.scene.models.iter().map(|m| m.slot).collect();
        self.recovery.run(&mut self.renderer, &self.scene, |renderer| {
            let is_new = |model: &crate::load::LoadedModel| !there.contains(&model.slot);
            uploaded_models::upload_some(&scene.models, renderer, is_new)
        })?;
        Ok(())
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
            let options = construction::options_of(scene.renderer_options(), is_live);
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
        let policies = scene.policies();
        let mut lod_cursors =
            LodCursors::new(&scene.graph, &scene.models, policies, &scene.proxies, scale);
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
        self.moving_parts = scene.moving.clone();
        self.selection = self.selection.iter().filter_map(|node| remapped(remap, *node)).collect();
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
        self.equipment_tree.inherit(&old, |node| remapped(remap, node));
        self.tag_filter = self.tag_filter.for_scene(scene);
        let faceplate = self.faceplate.take();
        let selection = std::mem::take(&mut self.selection);
        self.select(selection);
        if let (Some(now), Some(before)) = (&mut self.faceplate, &faceplate) {
            now.keep_trends(before, remap.tags());
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
