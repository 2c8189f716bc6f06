//! Construction of a viewer from a loaded scene.

use std::sync::Arc;
use std::time::Instant;

use busbar_renderer::{RendererOptions, WindowHandles};
use busbar_site::Site;
use busbar_ui::Panels;

use super::Viewer;
use crate::ViewError;
use crate::alarms::AlarmPresentation;
use crate::detail_control::DetailControl;
use crate::equipment_panels::EquipmentPanels;
use crate::frame_statistics::FrameStatistics;
use crate::host_program::HostProgram;
use crate::interaction::Interaction;
use crate::panel_frame::appearance_of;
use crate::scene_drawing::SceneDrawing;
use crate::site_definition::{site_definition, start_plugins};
use crate::view_renderer::ViewRenderer;
use crate::view_target::ViewTarget;
use busbar_camera::Camera;
use busbar_camera::Navigator;
use busbar_scene_loader::LoadedScene;
use busbar_scene_loader::millis_since;
use busbar_scene_overlays::SceneOverlays;

/// Place where a view is shown.
enum ViewPlace {
    /// Still picture without a spectator, the same each time.
    Headless,
    /// An operator, in another program's window.
    Offscreen,
    /// An operator, in a window of its own.
    Window(Arc<dyn WindowHandles>),
}

impl Viewer {
    /// A view without a window, `size` in pixels, without panels.
    ///
    /// # Errors
    /// No usable graphics device, or a plugin that cannot start.
    pub fn new_headless(
        scene: LoadedScene,
        options: RendererOptions,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        Self::start(scene, options, ViewPlace::Headless, size)
    }

    /// Opens a live view without a window, `size` in pixels, whose pictures are shown elsewhere. It
    /// waits for nothing and writes the audit log. Panels are hidden at first.
    ///
    /// # Errors
    /// No usable graphics device, or a plugin that cannot start.
    pub fn new_offscreen(
        scene: LoadedScene,
        options: RendererOptions,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        Self::start(scene, options, ViewPlace::Offscreen, size)
    }

    /// A view in a window, `size` in pixels, with panels.
    ///
    /// # Errors
    /// No usable graphics device, or a plugin that cannot start.
    pub fn new_in_window(
        scene: LoadedScene,
        options: RendererOptions,
        window: Arc<dyn WindowHandles>,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        Self::start(scene, options, ViewPlace::Window(window), size)
    }

    fn start(
        mut scene: LoadedScene,
        options: RendererOptions,
        place: ViewPlace,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        let is_live = !matches!(place, ViewPlace::Headless);
        let window = match place {
            ViewPlace::Window(window) => Some(window),
            ViewPlace::Headless | ViewPlace::Offscreen => None,
        };
        let in_window = window.is_some();
        let start = Instant::now();
        let renderer = ViewRenderer::start(&scene, options, window, size, !is_live)?;
        scene.millis.insert("upload".into(), millis_since(start));
        let plugins = start_plugins(&scene, &|_| true)?;
        let site = Site::start(site_definition(&scene), plugins, !is_live)?;
        // In a window, its own glue says how large a point is.
        let scale = if in_window { 1.0 } else { scene.config.view.scale };
        Ok(Self {
            alarms: AlarmPresentation::new(&scene),
            overlays: SceneOverlays::new(&scene, &site, !is_live),
            navigator: Navigator::new(first_camera(&scene), &scene.config.view, is_live),
            interaction: Interaction::default(),
            equipment: EquipmentPanels::new(&scene),
            detail: DetailControl::new(&scene, is_live),
            renderer,
            drawing: SceneDrawing::new(&scene),
            target: ViewTarget::new(size, scale, in_window, !is_live),
            panels: Panels::new(in_window, appearance_of(&mut scene)),
            host: HostProgram::default(),
            statistics: FrameStatistics::default(),
            is_seen: true,
            has_unseen_changes: false,
            site,
            scene,
        })
    }
}

/// Returns the camera of the configuration, or else one that shows the whole scene.
fn first_camera(scene: &LoadedScene) -> Camera {
    let view = &scene.config.view;
    let camera = view.camera.as_ref().and_then(|name| scene.config.cameras.get(name));
    match camera {
        None => Camera::framing(scene.graph.bounds()),
        Some(config) => Camera::from_config(config, &scene.graph),
    }
}
