//! Models on the device, and what the panels say of them.

use busbar_renderer::{MeshAtCursor, ModelHandle, ModelUpload, RenderError, Renderer};
use busbar_ui::ModelRow;

use crate::cursors::{ModelDetail, Place};
use crate::load::{LoadedModel, LoadedScene};

/// A model on the device.
pub(crate) struct ShownModel {
    pub(crate) handle: ModelHandle,
    pub(crate) row: ModelRow,
}

impl ShownModel {
    /// Notes what its instances come to.
    pub(crate) fn note(&mut self, detail: &ModelDetail) {
        let ModelDetail { theta, by_policy, s1, s2, triangles } = *detail;
        self.row = ModelRow {
            name: std::mem::take(&mut self.row.name),
            instances: self.row.instances,
            theta,
            by_policy,
            s1,
            s2,
            triangles,
        };
    }
}

/// Uploads all models of a scene, in place of whatever is there.
pub(crate) fn upload(scene: &LoadedScene, renderer: &mut Renderer) -> Result<usize, RenderError> {
    renderer.remove_all_models();
    upload_some(&scene.models, renderer, |_| true)
}

/// Uploads those models that are wanted, each to its place; how many.
pub(crate) fn upload_some(
    models: &[LoadedModel],
    renderer: &mut Renderer,
    is_wanted: impl Fn(&LoadedModel) -> bool,
) -> Result<usize, RenderError> {
    let mut count = 0;
    for model in models.iter().filter(|model| is_wanted(model)) {
        let LoadedModel { stacks, materials, textures, .. } = model;
        renderer.upload_model_at(model.handle(), ModelUpload { stacks, materials, textures })?;
        count += 1;
    }
    Ok(count)
}

/// The models of a scene, with nothing said of them yet.
pub(crate) fn shown(scene: &LoadedScene) -> Vec<ShownModel> {
    // Proxies are placed by no configuration.
    let counts = scene.instances_of_models.iter().copied().chain(std::iter::repeat(0));
    let shown = |(model, instances): (&LoadedModel, usize)| {
        let row = ModelRow { name: model.name.clone(), instances, ..ModelRow::default() };
        ShownModel { handle: model.handle(), row }
    };
    scene.models.iter().zip(counts).map(shown).collect()
}

/// A place as the renderer names it.
pub(crate) fn on_device(models: &[ShownModel], place: Place) -> MeshAtCursor {
    let model = models[place.model].handle;
    MeshAtCursor { model, mesh: place.mesh as u32, cursor: place.cursor }
}
