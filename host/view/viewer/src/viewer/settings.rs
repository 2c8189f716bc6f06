//! Settings of a view: selection, cameras, level of detail, section, size.

use busbar_renderer::SectionPlane;
use busbar_scene::NodeIndex;
use egui::RawInput;

use super::Viewer;
use crate::ViewError;
use crate::frame_statistics::FrameStageMillis;
use busbar_camera::Camera;

impl Viewer {
    /// Returns the egui context that platform glue feeds.
    pub fn egui_context(&self) -> &egui::Context {
        self.panels.context()
    }

    /// Shows the panels, or labels alone; the band over a scene that is not live stays.
    pub fn set_panels_shown(&mut self, shown: bool) {
        self.panels.set_shown(shown);
    }

    /// Selects a piece of equipment by its id or an alias, and opens its faceplate;
    /// whether there is one.
    pub fn select_equipment(&mut self, id: &str) -> bool {
        let found = self.scene.equipment.find(&self.scene.graph, id);
        self.select(found);
        found.is_some()
    }

    /// Selects nodes; the faceplate is that of the one, if it is one.
    pub(super) fn select(&mut self, nodes: impl IntoIterator<Item = NodeIndex>) {
        self.interaction.select(nodes);
        self.equipment.follow_selection(self.interaction.selection(), &self.scene, &self.site);
    }

    /// Returns the CPU time of parts of the last frame.
    pub fn stage_millis(&self) -> FrameStageMillis {
        self.statistics.stages
    }

    /// Sets the size of the window, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.renderer.get_mut().resize(size);
    }

    /// Uses a camera of the configuration.
    ///
    /// # Errors
    /// [`ViewError::UnknownCamera`] for a name that is not configured.
    pub fn use_camera(&mut self, name: &str) -> Result<(), ViewError> {
        let cameras = &self.scene.config.cameras;
        let camera = cameras.get(name).ok_or_else(|| ViewError::UnknownCamera {
            wanted: name.to_owned(),
            known: cameras.keys().cloned().collect(),
        })?;
        self.navigator.jump_to(Camera::from_config(camera, &self.scene.graph));
        Ok(())
    }

    /// Looks from `eye` at `target`, world space in metres, with the angle of
    /// the camera before.
    pub fn look_from(&mut self, eye: [f32; 3], target: [f32; 3]) {
        let [eye, target] =
            [eye, target].map(|point| self.scene.graph.point_from_world(point.map(f64::from)));
        let camera = self.navigator.camera().moved_to(eye, target);
        self.navigator.jump_to(camera);
    }

    /// Sets theta of every model, 0 to 1, instead of what their policies choose.
    pub fn set_theta(&mut self, theta: f64) {
        for model in 0..self.scene.model_count() {
            self.detail.set_manual_theta(model, Some(theta));
        }
    }

    /// Lets policies choose the theta of every model again.
    pub fn use_policies(&mut self) {
        for model in 0..self.scene.model_count() {
            self.detail.set_manual_theta(model, None);
        }
    }

    /// Sets the factor on every theta that a policy chooses: 0 shows all in
    /// full detail; at most [`MAX_THETA_SCALE`](busbar_config::MAX_THETA_SCALE).
    pub fn set_theta_scale(&mut self, scale: f64) {
        self.detail.set_scale(scale);
    }

    /// Sets whether a frame waits until every instance is shown at its wanted theta. Headless views
    /// wait, so that a picture does not depend on timing. In a window an instance keeps its mesh
    /// until the new one is ready.
    pub fn set_settles(&mut self, settles: bool) {
        self.target.settles = settles;
        self.site.set_settles(settles);
    }

    /// Lets changes of detail take so long, by degrees; 0 seconds shows them at once.
    /// Where frames settle they do not wait.
    pub fn set_morph_seconds(&mut self, seconds: f64) {
        self.detail.set_morph_seconds(seconds);
    }

    /// Cuts away what lies before a plane, or shows all again.
    pub fn set_section(&mut self, section: Option<SectionPlane>) {
        self.drawing.section = section;
    }

    /// Draws edges instead of surfaces.
    pub fn set_wireframe(&mut self, wireframe: bool) {
        self.drawing.wireframe = wireframe;
    }

    /// Returns the input for a frame of a view without a window.
    pub fn headless_input(&self, seconds: f64) -> RawInput {
        self.target.headless_input(seconds, self.scene.config.view.scale)
    }
}
