//! Construction of a viewer from a loaded scene.

use busbar_config::ThemeConfig;
use busbar_site::ChartReader;

use super::*;
use crate::site_definition::{site_definition, start_plugins};

/// Target of a view: a picture, another program's window, or an own window.
enum ViewTarget {
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
        Self::start(scene, options, ViewTarget::Headless, size)
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
        Self::start(scene, options, ViewTarget::Offscreen, size)
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
        Self::start(scene, options, ViewTarget::Window(window), size)
    }

    fn start(
        mut scene: LoadedScene,
        options: RendererOptions,
        watched: ViewTarget,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        let is_live = !matches!(watched, ViewTarget::Headless);
        let window = match watched {
            ViewTarget::Window(window) => Some(window),
            ViewTarget::Headless | ViewTarget::Offscreen => None,
        };
        let start = Instant::now();
        let in_window = window.is_some();
        let choice = device_choice(&scene);
        let options = options_of(options, is_live);
        let open = || Renderer::open(options, choice.clone(), window.clone(), size);
        let (recovery, renderer) = DeviceRecovery::start(&scene, !is_live, open)?;
        let models = uploaded_models::without_details(&scene);
        scene.millis.insert("upload".into(), millis_since(start));
        let theta_scale = scene.config.view.theta_scale;
        let site = Site::start(site_definition(&scene), start_plugins(&scene)?, !is_live)?;
        let chart = chart_of(&scene, site.chart(), !is_live);
        let camera =
            scene.config.view.camera.as_ref().and_then(|name| scene.config.cameras.get(name));
        let camera =
            camera.map_or_else(|| Camera::framing(scene.graph.bounds()), Camera::from_config);
        let mut lod_cursors = LodCursors::new(
            &scene.graph,
            &scene.models,
            scene.policies(),
            &scene.proxies,
            theta_scale,
        );
        lod_cursors.set_morph_seconds(scene.config.view.morph_seconds);
        // In a window, its own glue says how large a point is.
        let scale = if in_window { 1.0 } else { scene.config.view.scale };
        let points = size.map(|pixels| pixels as f32 / scale);
        let screen = Rect::from_min_size(Pos2::ZERO, points.into());
        let appearance = appearance_of(&mut scene);
        let node_attachments = NodeAttachments::new(&scene);
        let tree = EquipmentTree::new(&scene.graph, &scene.equipment, &node_attachments.nodes());
        Ok(Self {
            layers: OverlayLayers::new(&site),
            alarms: AlarmPresentation::new(&scene),
            site,
            operator: String::new(),
            has_host: false,
            chart,
            triangles_full: full_triangles(&scene),
            lod_cursors,
            settles: !is_live,
            // A picture does not depend on how fast it came.
            frame_budget: FrameBudget::new(
                scene.config.view.target_frame_millis.filter(|_| is_live),
            ),
            section: scene.config.view.section.map(environment::section_of),
            environment: Environment::new(&scene.config.view, scene.graph.bounds()),
            moving_parts: scene.moving.clone(),
            navigator: Navigator::new(camera, &scene.config.view, is_live),
            scene,
            renderer,
            recovery,
            models,
            panels: Panels::new(in_window, appearance),
            selection: BTreeSet::new(),
            equipment_tree: tree,
            tag_filter: TagFilter::default(),
            node_attachments,
            faceplate: None,
            trend_span: faceplate::FIRST_SPAN,
            pick_queue: PickQueue::default(),
            pointer: None,
            hovered: None,
            measuring: None,
            labelled: Vec::new(),
            hidden_labels: BTreeSet::new(),
            last_view: None,
            camera_rests: false,
            wireframe: false,
            viewport: screen,
            screen,
            in_window,
            pixels_per_point: scale,
            highlights: Highlights::default(),
            states: Vec::new(),
            outlines: Outlines::default(),
            overlay_geometry: OverlayGeometry::default(),
            scene_draw_list: SceneDrawList::default(),
            last_primitives: Vec::new(),
            host_camera_commands: Vec::new(),
            host_picks: VecDeque::new(),
            last_frame: FrameStats::default(),
            cpu_millis: 0.0,
            stage_millis: FrameStageMillis::default(),
            frame_millis: VecDeque::new(),
            frames: 0,
            resolved: 0,
            reloads: ReloadCounters::default(),
        })
    }
}

/// Returns the appearance of the panels; the font is moved out of the scene.
pub(super) fn appearance_of(scene: &mut LoadedScene) -> Appearance {
    Appearance {
        is_dark: scene.config.view.theme == ThemeConfig::Dark,
        scale: scene.config.view.scale,
        font: scene.font.take().map(|font| font.to_vec()),
    }
}

/// Returns the renderer options; headless pictures ignore those for software rasterizers.
pub(super) fn options_of(options: RendererOptions, is_live: bool) -> RendererOptions {
    RendererOptions {
        on_software_rasterizer: options.on_software_rasterizer.filter(|_| is_live),
        ..options
    }
}

/// The device that the configuration wants.
pub(super) fn device_choice(scene: &LoadedScene) -> DeviceChoice {
    DeviceChoice {
        device: scene.config.view.device.clone(),
        pipeline_cache: scene.pipeline_cache.clone(),
    }
}

/// Creates the configured chart on the reader of its records.
pub(super) fn chart_of(
    scene: &LoadedScene,
    reader: Option<&ChartReader>,
    settles: bool,
) -> Option<SceneChart> {
    let config = scene.config.chart.as_ref()?;
    Some(SceneChart::new(config, reader?, &scene.graph, settles))
}

pub(super) fn full_triangles(scene: &LoadedScene) -> u64 {
    let triangles = |instance: busbar_scene::MeshInstance| {
        let stacks = &scene.models[instance.model.0 as usize].stacks;
        stacks[instance.mesh as usize].mesh().triangles.len() as u64
    };
    scene.graph.instances().map(triangles).sum()
}
