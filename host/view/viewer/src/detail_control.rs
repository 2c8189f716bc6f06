//! Control of the level of detail: cursors of all instances within a frame-time budget.

use std::collections::BTreeSet;

use busbar_config::MAX_THETA_SCALE;
use busbar_renderer::{FrameStats, Renderer, ResolveRequest};
use busbar_ui::ModelRow;

use crate::frame_budget::FrameBudget;
use crate::uploaded_models::{self, UploadedModel, mesh_at_cursor};
use busbar_lod::{DrawItem, LodCamera, LodCursors, LodRequest};
use busbar_scene_loader::LoadedScene;

/// Level of detail of the scene, with the models that it is of.
pub(crate) struct DetailControl {
    cursors: LodCursors,
    /// Frame-time budget that controls the level of detail.
    budget: FrameBudget,
    models: Vec<UploadedModel>,
    /// Triangles of all instances at theta 0.
    triangles_full: u64,
    /// Meshes that were resolved since the start.
    resolved: u64,
}

impl DetailControl {
    /// Creates the control for a scene. Without `is_live`, detail does not depend on how long frames
    /// take.
    pub(crate) fn new(scene: &LoadedScene, is_live: bool) -> Self {
        let target_millis = scene.config.view.target_frame_millis.filter(|_| is_live);
        Self {
            cursors: cursors_of(scene),
            // A picture does not depend on how fast it came.
            budget: FrameBudget::new(target_millis),
            models: uploaded_models::without_details(scene),
            triangles_full: full_triangles(scene),
            resolved: 0,
        }
    }

    /// Adapts to a reloaded scene with other instances or other levels of detail.
    pub(crate) fn rebuild(&mut self, before: &LoadedScene, scene: &LoadedScene, same_graph: bool) {
        let mut cursors = cursors_of(scene);
        cursors.inherit(&self.cursors, same_graph, |model| {
            let name = &scene.models.get(model)?.name;
            before.config.models.keys().position(|known| known == name)
        });
        self.cursors = cursors;
        self.models = uploaded_models::without_details(scene);
        self.triangles_full = full_triangles(scene);
    }

    /// Applies changed settings of a reloaded scene.
    pub(crate) fn configure(&mut self, before: &LoadedScene, scene: &LoadedScene, is_live: bool) {
        let (was, is) = (&before.config.view, &scene.config.view);
        if was.theta_scale != is.theta_scale {
            self.cursors.set_scale(is.theta_scale);
        }
        self.cursors.set_morph_seconds(is.morph_seconds);
        if was.target_frame_millis != is.target_frame_millis {
            self.budget = FrameBudget::new(is.target_frame_millis.filter(|_| is_live));
        }
    }

    /// Sets theta of a model, 0 to 1; none lets its policy choose.
    pub(crate) fn set_manual_theta(&mut self, model: usize, theta: Option<f64>) {
        self.cursors.set_manual_theta(model, theta);
    }

    /// Sets the factor on every theta that a policy chooses, 0 to [`MAX_THETA_SCALE`].
    pub(crate) fn set_scale(&mut self, scale: f64) {
        self.cursors.set_scale(scale.clamp(0.0, MAX_THETA_SCALE));
    }

    /// Returns the factor on every theta that a policy chooses.
    pub(crate) fn scale(&self) -> f64 {
        self.cursors.scale()
    }

    /// Sets the duration of a gradual change of detail, seconds; 0 changes at once.
    pub(crate) fn set_morph_seconds(&mut self, seconds: f64) {
        self.cursors.set_morph_seconds(seconds);
    }

    /// Draws instances in full detail, and others individually, since a proxy may omit them.
    pub(crate) fn set_emphasized(&mut self, full_detail: BTreeSet<usize>, single: BTreeSet<usize>) {
        self.cursors.set_full_detail(full_detail);
        self.cursors.set_individual(single);
    }

    /// Notes the instances that moved.
    pub(crate) fn move_instances(
        &mut self,
        scene: &LoadedScene,
        just_moved: &[usize],
        moved: &BTreeSet<usize>,
    ) {
        self.cursors.move_instances(&scene.graph, just_moved, moved);
    }

    /// Chooses cursors for a camera, and moves those whose meshes are ready. `seconds` is the time
    /// of the frame.
    pub(crate) fn update(
        &mut self,
        renderer: &mut Renderer,
        eye: LodCamera,
        settles: bool,
        seconds: f64,
    ) {
        let Self { cursors, budget, models, .. } = self;
        cursors.set_coarseness(budget.coarseness());
        cursors.choose_levels(eye, settles);
        cursors.advance(settles, seconds, |needed| match needed {
            LodRequest::Mesh(place) => {
                renderer.triangles_at(&mesh_at_cursor(models, place)).is_some()
            }
            LodRequest::Morph(place) => renderer.has_morph_target(&mesh_at_cursor(models, place)),
        });
        renderer.request(cursors.waiting().map(|needed| match needed {
            LodRequest::Mesh(place) => ResolveRequest::Mesh(mesh_at_cursor(models, place)),
            LodRequest::Morph(place) => ResolveRequest::MorphTarget(mesh_at_cursor(models, place)),
        }));
    }

    /// Updates budget and panel rows after a frame was drawn. The budget judges the frame's time only
    /// if `is_judged`.
    pub(crate) fn note_frame(&mut self, renderer: &Renderer, frame: &FrameStats, is_judged: bool) {
        self.resolved += u64::from(frame.resolved);
        self.note_cursors(renderer);
        // A frame with the scene's image of an earlier one tells nothing of its cost.
        if is_judged && !frame.is_scene_kept {
            self.budget.record_frame(frame);
        }
    }

    /// Updates panel rows to the cursors of a frame.
    pub(crate) fn note_cursors(&mut self, renderer: &Renderer) {
        let Self { cursors, models, .. } = self;
        cursors.count_moved(|place| renderer.triangles_at(&mesh_at_cursor(models, place)));
        if let Some(details) = cursors.changed_detail() {
            models.iter_mut().zip(&details).for_each(|(model, detail)| model.set_detail(detail));
        }
    }

    /// Returns cursors and models for an update of the draw list.
    pub(crate) fn cursors_and_models(&mut self) -> (&mut LodCursors, &[UploadedModel]) {
        (&mut self.cursors, &self.models)
    }

    /// Reports whether detail changes by itself: morphs run, or meshes come that the last frame
    /// waited for.
    pub(crate) fn needs_frames(&self, last: &FrameStats) -> bool {
        self.cursors.is_morphing()
            || self.cursors.waiting_count() > 0 && last.resolved + last.waiting > 0
    }

    /// Returns the number of instances that wait for meshes.
    pub(crate) fn waiting_count(&self) -> usize {
        self.cursors.waiting_count()
    }

    /// Returns the number of meshes that were resolved since the start.
    pub(crate) fn resolved(&self) -> u64 {
        self.resolved
    }

    /// Returns the number of triangles of all instances at theta 0.
    pub(crate) fn triangles_full(&self) -> u64 {
        self.triangles_full
    }

    /// Returns the panel rows of the configured models.
    pub(crate) fn model_rows(
        &self,
        scene: &LoadedScene,
    ) -> impl Iterator<Item = &ModelRow> + Clone {
        self.models.iter().take(scene.model_count()).map(|model| &model.row)
    }

    /// Returns the number of vertices of all meshes that are drawn.
    pub(crate) fn surviving_vertices(&self, scene: &LoadedScene) -> u64 {
        let mut vertices = 0;
        self.cursors.for_each_drawn(|_, place, _| {
            let stacks = &scene.models[place.model].stacks[place.mesh];
            vertices += u64::from(stacks.surviving(place.cursor));
        });
        vertices
    }

    /// Returns the number of groups that are drawn as one proxy mesh.
    pub(crate) fn groups_as_one(&self) -> usize {
        let mut count = 0;
        self.cursors.for_each_drawn(|drawn, _, _| {
            count += usize::from(matches!(drawn, DrawItem::Group(_)));
        });
        count
    }
}

fn cursors_of(scene: &LoadedScene) -> LodCursors {
    let view = &scene.config.view;
    let mut cursors = LodCursors::new(
        &scene.graph,
        &scene.meshes(),
        &scene.policies,
        &scene.proxies,
        view.theta_scale,
        uploaded_models::MORPH_BUDGET,
    );
    cursors.set_morph_seconds(view.morph_seconds);
    cursors
}

fn full_triangles(scene: &LoadedScene) -> u64 {
    let triangles = |instance: busbar_scene::MeshInstance| {
        let stacks = &scene.models[instance.model.0 as usize].stacks;
        stacks[instance.mesh as usize].mesh().triangles.len() as u64
    };
    scene.graph.instances().map(triangles).sum()
}
