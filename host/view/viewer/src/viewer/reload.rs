//! A changed configuration in place of the one that is shown.

use std::path::PathBuf;
use std::sync::Arc;

use busbar_site::IndexRemap;

use super::Viewer;
use crate::ViewError;
use crate::freed_memory::release_freed_memory;
use crate::panel_frame::appearance_of;
use crate::pick_queue::PickQueue;
use crate::reload::PreparedReload;
use crate::reload::ReloadCounters;
use crate::site_definition::{SceneDirectory, index_remap, site_definition};
use busbar_camera::Camera;
use busbar_scene_loader::FileVersion;
use busbar_scene_loader::{LoadedScene, ReloadedScene};
use busbar_scene_overlays::chart_of;

impl Viewer {
    /// Applies a prepared reload from the next frame on. Unchanged parts are kept: plugins, values
    /// with their ages, alarm states, models on the device, camera, selection, theta. After an
    /// error all is as before.
    ///
    /// # Errors
    /// Errors of the graphics device, or of a chart or records that cannot be read.
    pub fn apply_reload(&mut self, reload: PreparedReload) -> Result<(), ViewError> {
        let PreparedReload { loaded, started } = reload;
        let ReloadedScene { mut scene, changes, kept, has_same_graph } = loaded;
        let settles = self.target.settles;
        let site = self.site.prepare_reload(site_definition(&scene), started, kept.clone())?;
        let chart = site.replaced_chart().map(|reader| chart_of(&scene, reader, settles));
        let changed = self.renderer.change_options(&self.scene, &scene, !settles);
        if !matches!(changed, Ok(false)) {
            // What was asked of the device before is gone with it.
            self.interaction.picks = PickQueue::default();
        }
        changed?;
        self.renderer.upload_new(&self.scene, &scene)?;
        if has_same_graph {
            // Parts may have moved while it was loaded.
            scene.graph = Arc::clone(&self.scene.graph);
        }
        let remap = index_remap(&self.scene, &scene, has_same_graph);
        let before = std::mem::replace(&mut self.scene, scene);
        self.renderer.remove_replaced(&before, &self.scene);

        if let Some(chart) = chart {
            self.overlays.replace_chart(chart);
        }
        let alarms = self.site.alarms().map(|alarms| Arc::clone(alarms.table().set()));
        let replaced = self.site.apply_reload(site, &remap, &SceneDirectory::new(&self.scene));
        self.alarms.reload(&alarms.unwrap_or_default(), &self.scene, &self.site);
        let is_kept = |name: &str| kept.contains(name);
        self.overlays.layers.reload(&self.site, &self.scene.graph, &is_kept);
        self.carry_view(&before);
        let same_proxies = Arc::ptr_eq(&before.proxies, &self.scene.proxies);
        if !has_same_graph || !same_proxies || before.policies != self.scene.policies {
            self.rebuild_detail(&before, &remap, has_same_graph);
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

    /// Applies changed view settings; all others stay as the operator set them.
    fn carry_view(&mut self, before: &LoadedScene) {
        let (was, is) = (Arc::clone(&before.config), Arc::clone(&self.scene.config));
        let moved = before.graph.world_origin() - self.scene.graph.world_origin();
        self.navigator.shift(moved.as_vec3());
        let camera = |config: &busbar_config::Config| {
            config.view.camera.as_ref().and_then(|name| config.cameras.get(name).cloned())
        };
        if let Some(camera) = camera(&is).filter(|next| camera(&was).as_ref() != Some(next)) {
            self.navigator.jump_to(Camera::from_config(&camera, &self.scene.graph));
        }
        let (was, is) = (&was.view, &is.view);
        let is_live = !self.target.settles;
        self.navigator.configure(is, is_live);
        if (was.theme, was.scale, &was.font) != (is.theme, is.scale, &is.font) {
            self.target.rescale(was.scale, is.scale);
            self.panels.set_appearance(appearance_of(&mut self.scene));
        }
        self.detail.configure(before, &self.scene, is_live);
        self.drawing.configure(before, &self.scene);
    }

    /// Draws other instances than before, or at other levels of detail.
    fn rebuild_detail(&mut self, before: &LoadedScene, remap: &IndexRemap, same_graph: bool) {
        self.detail.rebuild(before, &self.scene, same_graph);
        self.drawing.reset(same_graph);
        if !same_graph {
            self.overlays.reset(&self.scene);
            self.interaction.remap(remap);
        }
    }

    /// Adapts lists and faceplate to the equipment of the present scene.
    fn carry_equipment(&mut self, remap: &IndexRemap) {
        let faceplate = self.equipment.reload(&self.scene, remap);
        let selection = self.interaction.selection().clone();
        self.select(selection);
        self.equipment.keep_trends(faceplate.as_ref(), remap);
    }

    /// Returns the scene that is shown.
    pub fn scene(&self) -> &LoadedScene {
        &self.scene
    }

    /// Returns a clone of the scene for a thread that loads its replacement.
    pub(crate) fn shared_scene(&self) -> LoadedScene {
        self.scene.clone()
    }

    /// Returns the files of the models shown, and the content version of each.
    pub(crate) fn model_files(&self) -> impl Iterator<Item = (PathBuf, FileVersion)> {
        self.scene.model_files()
    }

    /// Returns the counters of configuration reloads.
    pub fn reload_counters(&self) -> &ReloadCounters {
        &self.statistics.reloads
    }

    /// Returns the counters of configuration reloads, to count one.
    pub(crate) fn reload_counters_mut(&mut self) -> &mut ReloadCounters {
        &mut self.statistics.reloads
    }
}
