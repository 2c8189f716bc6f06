//! Assembly of a frame for the renderer: level of detail, draw list, background.

use super::*;

/// Share of the configured background light that the dark theme keeps.
const DARK_BACKGROUND: f32 = 0.045;

impl Viewer {
    /// The last frame of a view without a window.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn read_picture(&mut self) -> Result<Picture, ViewError> {
        let no_textures = egui::TexturesDelta::default();
        let overlay = EguiFrame {
            textures_delta: &no_textures,
            primitives: &self.last_primitives,
            pixels_per_point: self.pixels_per_point,
        };
        let shown = self.frame_of(
            self.view(),
            self.scene_draw_list.list(),
            self.highlights.of_nodes(),
            Some(overlay),
        );
        let chart = self.chart.as_ref().and_then(SceneChart::polylines);
        let polylines = self.overlay_geometry.polylines(chart);
        let frame = Frame { outlined: self.outlines.list(), polylines, ..shown };
        let has_drawn = self.frames > 0;
        let read = self.recovery.run(&mut self.renderer, &self.scene, |renderer| {
            match renderer.read_picture() {
                // On a device that was made since.
                Err(RenderError::NoPicture) if has_drawn => {
                    renderer.draw(&frame)?;
                    renderer.read_picture()
                }
                read => read,
            }
        });
        read?.ok_or(ViewError::Render(RenderError::NoPicture))
    }

    /// Reports whether the last frame had panels, labels or other content over the scene. Such
    /// content takes a few frames to settle.
    pub fn has_content_over_scene(&self) -> bool {
        !self.last_primitives.is_empty()
    }

    /// Chooses cursors for where the camera is, and moves those that are ready. `now`:
    /// when the frame is, seconds.
    pub(super) fn update_lod_cursors(&mut self, now: f64) {
        let Self { lod_cursors, renderer, models, .. } = self;
        let pixels = self.viewport.size() * self.pixels_per_point;
        let camera = self.navigator.camera();
        let eye = LodCamera {
            position: camera.eye(),
            ahead: camera.forward(),
            pixel: camera.pixel_size(pixels),
        };
        lod_cursors.set_coarseness(self.frame_budget.coarseness());
        lod_cursors.choose_levels(eye, self.settles);
        lod_cursors.advance(self.settles, now, |needed| match needed {
            LodRequest::Mesh(place) => {
                renderer.triangles_at(&mesh_at_cursor(models, place)).is_some()
            }
            LodRequest::Morph(place) => renderer.has_morph_target(&mesh_at_cursor(models, place)),
        });
        renderer.request(lod_cursors.waiting().map(|needed| match needed {
            LodRequest::Mesh(place) => ResolveRequest::Mesh(mesh_at_cursor(models, place)),
            LodRequest::Morph(place) => ResolveRequest::MorphTarget(mesh_at_cursor(models, place)),
        }));
    }

    /// Updates the panel rows of models after the frame was drawn.
    pub(super) fn update_model_rows(&mut self) {
        let Self { lod_cursors, renderer, models, .. } = self;
        self.resolved += u64::from(self.last_frame.resolved);
        lod_cursors.count_moved(|place| renderer.triangles_at(&mesh_at_cursor(models, place)));
        if let Some(details) = lod_cursors.changed_detail() {
            models.iter_mut().zip(&details).for_each(|(model, detail)| model.set_detail(detail));
        }
    }

    /// Updates cursors and draw list with the instances that moved.
    pub(super) fn move_instances(&mut self) {
        let Self { moving_parts: moving, lod_cursors, scene_draw_list: drawn, scene, .. } = self;
        if !moving.just_moved().is_empty() {
            lod_cursors.move_instances(&scene.graph, moving.just_moved(), moving.moved());
            drawn.move_instances(scene, moving.just_moved());
        }
    }

    /// Updates the draw list with all changes since the last frame.
    pub(super) fn update_draw_list(&mut self) {
        let Self { scene_draw_list: drawn, scene, models, lod_cursors, highlights, .. } = self;
        drawn.update(scene, models, lod_cursors, highlights);
    }

    /// Returns the camera view of the present frame.
    pub(super) fn view(&self) -> CameraView {
        let scene = self.scene.graph.bounds();
        // A wireframe has no ground, and its lines need fine depths.
        let around = if self.wireframe { scene } else { self.environment.with_ground(scene) };
        self.navigator.camera().view(self.viewport, self.screen, around)
    }

    /// Linear; in the dark theme much darker than configured.
    fn background(&self) -> [f32; 3] {
        let share = if self.panels.is_dark() { DARK_BACKGROUND } else { 1.0 };
        self.scene.config.view.background.map(|part| linear_from_srgb(part) * share)
    }

    pub(super) fn frame_of<'a>(
        &self,
        camera: CameraView,
        instances: &'a DrawList,
        object_highlights: &'a [Highlight],
        overlay: Option<EguiFrame<'a>>,
    ) -> Frame<'a> {
        Frame {
            camera,
            instances: InstanceSource::Retained(instances),
            object_highlights,
            wireframe: self.wireframe,
            background: self.background(),
            ground: self.environment.ground,
            fog_distance: self.environment.fog_distance,
            shadow_bounds: self.environment.shadow_bounds,
            outlined: &[],
            section: self.section,
            polylines: None,
            overlay,
        }
    }
}

/// Objects count from 1, nodes from 0.
pub(crate) fn object_of(node: NodeIndex) -> u32 {
    node.0 + 1
}

pub(crate) fn node_of(object: Option<u32>) -> Option<NodeIndex> {
    object.and_then(|object| object.checked_sub(1)).map(NodeIndex)
}
