//! What a frame shows, at which detail.

use super::*;

/// Of the light of the background, what the dark theme leaves: equipment stands out from
/// it as brighter, and not as darker.
const DARK_BACKGROUND: f32 = 0.045;

impl Viewer {
    /// The last frame of a view without a window.
    ///
    /// # Errors
    /// The device's.
    pub fn read_picture(&mut self) -> Result<Picture, ViewError> {
        let no_textures = egui::TexturesDelta::default();
        let overlay = EguiFrame {
            textures_delta: &no_textures,
            primitives: &self.painted,
            pixels_per_point: self.pixels_per_point,
        };
        let shown = self.picture_of(
            self.view(),
            self.drawn.list(),
            self.highlights.of_nodes(),
            Some(overlay),
        );
        let chart = self.chart.as_ref().and_then(ShownChart::polylines);
        let polylines = self.ground_marks.polylines(chart);
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

    /// Whether the last frame had panels, labels or anything else over the scene: those
    /// take a few frames to find their sizes and places.
    pub fn paints_over_scene(&self) -> bool {
        !self.painted.is_empty()
    }

    /// Chooses cursors for where the camera is, and moves those that are ready. `now`:
    /// when the frame is, seconds.
    pub(super) fn move_cursors(&mut self, now: f64) {
        let Self { cursors, renderer, models, scene, .. } = self;
        let pixels = self.viewport.size() * self.pixels_per_point;
        let camera = self.navigator.camera();
        let eye =
            Eye { position: camera.eye(), ahead: camera.ahead(), pixel: camera.pixel(pixels) };
        cursors.set_coarseness(self.pace.coarseness());
        cursors.choose(eye, &scene.models, self.settles);
        cursors.advance(&scene.models, self.settles, now, |needed| match needed {
            Needed::Mesh(place) => renderer.triangles_at(&on_device(models, place)).is_some(),
            Needed::Way(place) => renderer.has_morph_target(&on_device(models, place)),
        });
        renderer.request(cursors.waiting(&scene.models).map(|needed| match needed {
            Needed::Mesh(place) => ResolveRequest::Mesh(on_device(models, place)),
            Needed::Way(place) => ResolveRequest::MorphTarget(on_device(models, place)),
        }));
    }

    /// Brings what is said of models up to the frame drawn.
    pub(super) fn note_detail(&mut self) {
        let Self { cursors, renderer, models, scene, .. } = self;
        self.resolved += u64::from(self.last.resolved);
        cursors.count_moved(|place| renderer.triangles_at(&on_device(models, place)));
        if let Some(details) = cursors.changed_detail(&scene.models) {
            models.iter_mut().zip(&details).for_each(|(model, detail)| model.note(detail));
        }
    }

    /// Takes over where parts stand that moved.
    pub(super) fn move_parts(&mut self) {
        let Self { moving, cursors, drawn, scene, .. } = self;
        if !moving.just_moved().is_empty() {
            cursors.move_instances(&scene.graph, moving.just_moved(), moving.moved());
            drawn.move_instances(scene, moving.just_moved());
        }
    }

    /// Takes over what is to be drawn otherwise than before.
    pub(super) fn update_drawn(&mut self) {
        let Self { drawn, scene, models, cursors, highlights, .. } = self;
        drawn.update(scene, models, cursors, highlights);
    }

    /// What is seen now.
    pub(super) fn view(&self) -> CameraView {
        let scene = self.scene.graph.bounds();
        // A wireframe has no ground, and its lines need fine depths.
        let around = if self.wireframe { scene } else { self.surroundings.with_ground(scene) };
        self.navigator.camera().view(self.viewport, self.screen, around)
    }

    /// Linear; in the dark theme much darker than configured.
    fn background(&self) -> [f32; 3] {
        let share = if self.panels.is_dark() { DARK_BACKGROUND } else { 1.0 };
        self.scene.config.view.background.map(|part| linear_from_srgb(part) * share)
    }

    pub(super) fn picture_of<'a>(
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
            ground: self.surroundings.ground,
            fog_distance: self.surroundings.fog_distance,
            shadow_bounds: self.surroundings.shadow_bounds,
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
