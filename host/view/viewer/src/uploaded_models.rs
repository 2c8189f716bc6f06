//! Models on the device, and what the panels say of them.

use busbar_lod::{MeshCursor, ModelDetail, MorphBudget};
use busbar_renderer::{
    MAX_MORPHED_BYTES, MeshAtCursor, ModelHandle, ModelUpload, RenderError, Renderer, VERTEX_BYTES,
};
use busbar_scene_loader::{LoadedModel, LoadedScene};
use busbar_ui::ModelRow;

/// Vertex memory that the renderer has for morphs.
pub(crate) const MORPH_BUDGET: MorphBudget =
    MorphBudget { max_bytes: MAX_MORPHED_BYTES, vertex_bytes: VERTEX_BYTES };

/// A model on the device.
pub(crate) struct UploadedModel {
    pub(crate) handle: ModelHandle,
    pub(crate) row: ModelRow,
}

impl UploadedModel {
    /// Notes what its instances come to.
    pub(crate) fn set_detail(&mut self, detail: &ModelDetail) {
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

/// Returns the handle of a model on the device.
pub(crate) fn handle_of(model: &LoadedModel) -> ModelHandle {
    ModelHandle::from_index(model.slot.unwrap_or(u32::MAX))
}

/// Uploads all models of a scene, in place of whatever is there.
pub(crate) fn upload(scene: &LoadedScene, renderer: &mut Renderer) -> Result<usize, RenderError> {
    renderer.remove_all_models();
    upload_some(&scene.models, renderer, |_| true)
}

/// Uploads the selected models to their slots; returns their number.
pub(crate) fn upload_some(
    models: &[LoadedModel],
    renderer: &mut Renderer,
    is_selected: impl Fn(&LoadedModel) -> bool,
) -> Result<usize, RenderError> {
    let mut count = 0;
    for model in models.iter().filter(|model| is_selected(model)) {
        let LoadedModel { stacks, materials, textures, .. } = model;
        renderer.upload_model_at(handle_of(model), ModelUpload { stacks, materials, textures })?;
        count += 1;
    }
    Ok(count)
}

/// Returns the models of a scene without level-of-detail counts.
pub(crate) fn without_details(scene: &LoadedScene) -> Vec<UploadedModel> {
    // Proxies are placed by no configuration.
    let counts = scene.instances_of_models.iter().copied().chain(std::iter::repeat(0));
    let shown = |(model, instances): (&LoadedModel, usize)| {
        let row = ModelRow { name: model.name.clone(), instances, ..ModelRow::default() };
        UploadedModel { handle: handle_of(model), row }
    };
    scene.models.iter().zip(counts).map(shown).collect()
}

/// A place as the renderer names it.
pub(crate) fn mesh_at_cursor(models: &[UploadedModel], place: MeshCursor) -> MeshAtCursor {
    let model = models[place.model].handle;
    MeshAtCursor { model, mesh: place.mesh as u32, cursor: place.cursor }
}
