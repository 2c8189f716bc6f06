//! Drawing of the scene: camera view, draw list, surroundings and section of a frame.

use busbar_config::ViewConfig;
use busbar_geometry::Bounds;
use busbar_renderer::{
    CameraView, DrawList, EguiFrame, Frame, FrameStats, InstanceSource, SectionPlane,
};
use egui::ClippedPrimitive;

use crate::detail_control::DetailControl;
use crate::environment::{self, Environment};
use crate::motion_resolution::MotionResolution;
use crate::scene_draw_list::SceneDrawList;
use crate::view_target::ViewTarget;
use busbar_camera::Camera;
use busbar_scene::linear_from_srgb;
use busbar_scene_loader::LoadedScene;
use busbar_scene_overlays::Highlights;
use busbar_scene_overlays::MovingParts;
use busbar_scene_overlays::highlight_styles::Highlight;

/// Share of the configured background light that the dark theme keeps.
const DARK_BACKGROUND: f32 = 0.045;

/// State of the scene's picture between frames.
pub(crate) struct SceneDrawing {
    draw_list: SceneDrawList,
    environment: Environment,
    motion: MotionResolution,
    pub(crate) wireframe: bool,
    /// Plane that cuts the scene open.
    pub(crate) section: Option<SectionPlane>,
    /// Camera view of the last frame drawn.
    last_view: Option<CameraView>,
    /// True if the camera view of the last frame was that of the frame before.
    camera_rests: bool,
    last_frame: FrameStats,
    /// Panels of the last frame, to draw it again.
    primitives: Vec<ClippedPrimitive>,
}

impl SceneDrawing {
    /// Creates the drawing of a scene as configured.
    pub(crate) fn new(scene: &LoadedScene) -> Self {
        let view = &scene.config.view;
        Self {
            draw_list: SceneDrawList::default(),
            environment: Environment::new(view, scene.graph.bounds()),
            motion: MotionResolution::new(None),
            wireframe: false,
            section: view
                .section
                .map(|section| environment::section_of(section, scene.graph.world_origin())),
            last_view: None,
            camera_rests: false,
            last_frame: FrameStats::default(),
            primitives: Vec::new(),
        }
    }

    /// Applies changed settings of a reloaded scene.
    pub(crate) fn configure(&mut self, before: &LoadedScene, scene: &LoadedScene) {
        let view = &scene.config.view;
        let origin = scene.graph.world_origin();
        if before.config.view.section != view.section {
            self.section = view.section.map(|section| environment::section_of(section, origin));
        } else if let Some(section) = &mut self.section {
            let moved = (before.graph.world_origin() - origin).as_vec3();
            section.distance += section.normal.dot(moved);
        }
        self.environment = Environment::new(view, scene.graph.bounds());
    }

    /// Forgets what was drawn, for a scene with other instances or other levels of detail. With
    /// other nodes, the view of the last frame is forgotten, too.
    pub(crate) fn reset(&mut self, same_graph: bool) {
        self.draw_list = SceneDrawList::default();
        if !same_graph {
            (self.last_view, self.camera_rests) = (None, false);
        }
    }

    /// Chooses the resolution of the scene in a frame at a time in seconds, with a picture of `size`
    /// pixels, so that frames take `target_millis` while the camera moves; without a target it is
    /// full.
    pub(crate) fn choose_resolution(
        &mut self,
        view: &CameraView,
        (seconds, size): (f64, [u32; 2]),
        target_millis: Option<f64>,
    ) {
        self.motion.set_target(target_millis);
        let has_moved = self.last_view.is_some_and(|last| last != *view);
        self.motion.advance(seconds, size, has_moved);
    }

    /// Returns the seconds until the scene is to be drawn at full resolution; none where it was.
    pub(crate) fn full_resolution_in(&self) -> Option<f64> {
        self.motion.full_in()
    }

    /// Reports whether the last frame drawn had a resolution between the lowest and the full one: its
    /// time is no reason to change the detail of the scene.
    pub(crate) fn is_resolution_intermediate(&self) -> bool {
        self.motion.is_intermediate()
    }

    /// Returns the camera view of the present frame.
    pub(crate) fn view(
        &self,
        camera: &Camera,
        target: &ViewTarget,
        scene: Option<Bounds>,
    ) -> CameraView {
        // A wireframe has no ground, and its lines need fine depths.
        let around = if self.wireframe { scene } else { self.environment.with_ground(scene) };
        camera.view(target.viewport, target.screen, around)
    }

    /// Updates the transforms of the instances that moved.
    pub(crate) fn move_instances(&mut self, scene: &LoadedScene, moving: &MovingParts) {
        self.draw_list.move_instances(scene, moving.just_moved());
    }

    /// Updates the draw list with all changes since the last frame.
    pub(crate) fn update_draw_list(
        &mut self,
        scene: &LoadedScene,
        detail: &mut DetailControl,
        highlights: &Highlights,
    ) {
        let (cursors, models) = detail.cursors_and_models();
        self.draw_list.update(scene, models, cursors, highlights);
    }

    /// Returns the draw list of the last update.
    pub(crate) fn draw_list(&self) -> &DrawList {
        self.draw_list.list()
    }

    /// Returns a frame of the present draw list, for the renderer.
    pub(crate) fn frame<'a>(
        &'a self,
        camera: CameraView,
        background: [f32; 3],
        object_highlights: &'a [Highlight],
        overlay: Option<EguiFrame<'a>>,
    ) -> Frame<'a> {
        let instances = self.draw_list();
        let scene_resolution = self.motion.resolution();
        Frame {
            object_highlights,
            overlay,
            scene_resolution,
            ..self.pick_frame(camera, background, instances)
        }
    }

    /// Returns a frame of a draw list without colours and panels, for picks.
    pub(crate) fn pick_frame<'a>(
        &self,
        camera: CameraView,
        background: [f32; 3],
        instances: &'a DrawList,
    ) -> Frame<'a> {
        Frame {
            camera,
            instances: InstanceSource::Retained(instances),
            object_highlights: &[],
            wireframe: self.wireframe,
            background,
            ground: self.environment.ground,
            fog_distance: self.environment.fog_distance,
            shadow_bounds: self.environment.shadow_bounds,
            outlined: &[],
            section: self.section,
            polylines: None,
            overlay: None,
            scene_resolution: 1.0,
        }
    }

    /// Notes a frame that was drawn.
    pub(crate) fn note_frame(&mut self, view: CameraView, mut drawn: FrameStats) {
        self.motion.note_frame(&drawn);
        if drawn.is_scene_kept {
            // The scene is that of an earlier frame, and so is what it took.
            drawn.occlusion_millis = self.last_frame.occlusion_millis;
        }
        self.last_frame = drawn;
        // What was never seen elsewhere rests from the first.
        self.camera_rests = self.last_view.replace(view).is_none_or(|before| before == view);
    }

    /// Notes a frame whose picture is the last one.
    pub(crate) fn note_unchanged(&mut self) {
        self.camera_rests = true;
        // Nothing came and nothing is on its way.
        (self.last_frame.resolved, self.last_frame.waiting) = (0, 0);
    }

    /// Returns the camera view of the last frame drawn.
    pub(crate) fn last_view(&self) -> Option<CameraView> {
        self.last_view
    }

    /// Reports whether the camera view of the last frame was that of the frame before.
    pub(crate) fn camera_rests(&self) -> bool {
        self.camera_rests
    }

    /// Keeps the panels of a frame, to draw it again.
    pub(crate) fn keep_panels(&mut self, primitives: Vec<ClippedPrimitive>) {
        self.primitives = primitives;
    }

    /// Takes the panels of the last frame, which are to come back by
    /// [`SceneDrawing::keep_panels`].
    pub(crate) fn take_panels(&mut self) -> Vec<ClippedPrimitive> {
        std::mem::take(&mut self.primitives)
    }

    /// Returns the panels of the last frame drawn.
    pub(crate) fn primitives(&self) -> &[ClippedPrimitive] {
        &self.primitives
    }

    /// Returns the statistics of the last frame drawn.
    pub(crate) fn last_frame(&self) -> &FrameStats {
        &self.last_frame
    }
}

/// Returns the background in linear light; in the dark theme much darker than configured.
pub(crate) fn background(view: &ViewConfig, is_dark: bool) -> [f32; 3] {
    let share = if is_dark { DARK_BACKGROUND } else { 1.0 };
    view.background.map(|part| linear_from_srgb(part) * share)
}
