//! Models on the device, and where their cursors stand.

use std::sync::Arc;

use busbar_geometry::CollapseStacks;
use busbar_renderer::{ModelHandle, ModelUpload, Renderer};
use busbar_ui::ModelRow;

use crate::ViewError;
use crate::load::LoadedScene;

/// A model on the device and where its cursors stand.
pub(crate) struct ShownModel {
    pub(crate) handle: ModelHandle,
    pub(crate) theta: f64,
    /// One a mesh.
    pub(crate) cursors: Vec<u32>,
    /// How often the scene shows each mesh.
    uses: Vec<u64>,
    pub(crate) row: ModelRow,
}

impl ShownModel {
    /// Moves the cursors of all meshes to theta.
    pub(crate) fn move_to(&mut self, theta: f64, stacks: &[Arc<CollapseStacks>]) {
        self.theta = theta.clamp(0.0, 1.0);
        self.cursors = stacks.iter().map(|stacks| stacks.cursor_at(self.theta)).collect();
        let entries: u64 = stacks.iter().map(|s| u64::from(s.collapse_count())).sum();
        let done: u64 = self.cursors.iter().map(|&cursor| u64::from(cursor)).sum();
        let live = stacks.iter().zip(&self.cursors).map(|(s, &cursor)| s.live_triangles(cursor));
        self.row.theta = self.theta;
        (self.row.s1, self.row.s2) = (entries - done, done);
        self.row.triangles = live.zip(&self.uses).map(|(live, uses)| live * uses).sum();
    }
}

/// Uploads all models of a scene.
pub(crate) fn upload(
    scene: &LoadedScene,
    renderer: &mut Renderer,
) -> Result<Vec<ShownModel>, ViewError> {
    let mut models = Vec::with_capacity(scene.models.len());
    for (index, model) in scene.models.iter().enumerate() {
        let handle = renderer.upload_model(ModelUpload {
            stacks: &model.stacks,
            materials: &model.materials,
            textures: &model.textures,
        })?;
        let placed = scene.config.scene.iter().filter(|n| n.model.as_ref() == Some(&model.name));
        let row =
            ModelRow { name: model.name.clone(), instances: placed.count(), ..ModelRow::default() };
        let mut uses = vec![0; model.stacks.len()];
        for instance in scene.graph.instances().iter().filter(|i| i.model.0 as usize == index) {
            uses[instance.mesh as usize] += 1;
        }
        let mut shown = ShownModel { handle, theta: 0.0, cursors: Vec::new(), uses, row };
        shown.move_to(scene.models[index].theta, &model.stacks);
        models.push(shown);
    }
    Ok(models)
}
