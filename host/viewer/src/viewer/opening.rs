//! From a loaded scene to a view of it.

use busbar_config::{OriginConfig, ThemeConfig};
use busbar_tags::{TagHandle, TagSpec};

use super::*;

/// Who looks at a view.
enum Watched {
    /// Nobody: a picture is to come of it, the same one each time.
    ByNobody,
    /// An operator, in another program's window.
    Offscreen,
    /// An operator, in a window of its own.
    InWindow(Arc<dyn WindowHandles>),
}

impl Viewer {
    /// A view without a window, `size` in pixels, without panels.
    ///
    /// # Errors
    /// No usable device, or a plugin that cannot start.
    pub fn headless(
        scene: LoadedScene,
        options: RendererOptions,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        Self::start(scene, options, Watched::ByNobody, size)
    }

    /// A live view without a window, `size` in pixels, for somebody who shows its pictures:
    /// it waits for nothing, and keeps the audit log. It has no panels at first.
    ///
    /// # Errors
    /// No usable device, or a plugin that cannot start.
    pub fn offscreen(
        scene: LoadedScene,
        options: RendererOptions,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        Self::start(scene, options, Watched::Offscreen, size)
    }

    /// A view in a window, `size` in pixels, with panels.
    ///
    /// # Errors
    /// No usable device, or a plugin that cannot start.
    pub fn for_window(
        scene: LoadedScene,
        options: RendererOptions,
        window: Arc<dyn WindowHandles>,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        Self::start(scene, options, Watched::InWindow(window), size)
    }

    fn start(
        mut scene: LoadedScene,
        options: RendererOptions,
        watched: Watched,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        let is_live = !matches!(watched, Watched::ByNobody);
        let window = match watched {
            Watched::InWindow(window) => Some(window),
            Watched::ByNobody | Watched::Offscreen => None,
        };
        let start = Instant::now();
        let in_window = window.is_some();
        let choice = choice_of(&scene);
        let options = options_of(options, is_live);
        let open = || Renderer::open(options, choice.clone(), window.clone(), size);
        let (recovery, renderer) = Recovery::start(&scene, !is_live, open)?;
        let models = shown_model::shown(&scene);
        scene.millis.insert("upload".into(), millis_since(start));
        let theta_scale = scene.config.view.theta_scale;
        let tags = table_of(&scene);
        let overlays = running::start_overlays(&scene)?;
        let telemetry = running::start_telemetry(&scene)?;
        let chart = start_chart(&scene, !is_live)?;
        let records = Books::start(&scene, !is_live)?;
        let camera =
            scene.config.view.camera.as_ref().and_then(|name| scene.config.cameras.get(name));
        let camera =
            camera.map_or_else(|| Camera::framing(scene.graph.bounds()), Camera::from_config);
        let mut cursors = Cursors::new(
            &scene.graph,
            &scene.models,
            scene.policies(),
            &scene.proxies,
            theta_scale,
        );
        cursors.set_morph_seconds(scene.config.view.morph_seconds);
        // In a window, its own glue says how large a point is.
        let scale = if in_window { 1.0 } else { scene.config.view.scale };
        let points = size.map(|pixels| pixels as f32 / scale);
        let screen = Rect::from_min_size(Pos2::ZERO, points.into());
        let appearance = appearance_of(&mut scene);
        let at_nodes = AtNodes::of(&scene);
        let tree = EquipmentTree::of(&scene.graph, &scene.equipment, &at_nodes.nodes());
        let alarms = Alarming::of(&scene, is_live, wall_clock());
        Ok(Self {
            telemetry,
            overlays,
            history: facing::history_of(&scene),
            origins: OriginWatch::default(),
            tags,
            pauses: PauseWatch::start(),
            events: EventLog::default(),
            alarms,
            operator: String::new(),
            has_host: false,
            host_intake: HostIntake::for_scene(&scene),
            chart,
            records,
            triangles_full: full_triangles(&scene),
            cursors,
            settles: !is_live,
            // A picture does not depend on how fast it came.
            pace: Pace::new(scene.config.view.target_frame_millis.filter(|_| is_live)),
            section: scene.config.view.section.map(surroundings::section_of),
            surroundings: Surroundings::of(&scene.config.view, scene.graph.bounds()),
            moving: scene.moving.clone(),
            navigator: Navigator::new(camera, &scene.config.view, is_live),
            scene,
            renderer,
            recovery,
            models,
            panels: Panels::new(in_window, appearance),
            selection: BTreeSet::new(),
            tree,
            tag_list: TagList::default(),
            at_nodes,
            faceplate: None,
            trend_span: faceplate::FIRST_SPAN,
            picker: Picker::default(),
            pointer: None,
            hovered: None,
            measuring: None,
            labelled: Vec::new(),
            hidden_labels: BTreeSet::new(),
            shown: None,
            rests: false,
            wireframe: false,
            viewport: screen,
            screen,
            in_window,
            pixels_per_point: scale,
            highlights: Highlights::default(),
            states: Vec::new(),
            outlines: Outlines::default(),
            ground_marks: GroundMarks::default(),
            drawn: DrawnScene::default(),
            painted: Vec::new(),
            asked: Vec::new(),
            picked: VecDeque::new(),
            last: FrameStats::default(),
            cpu_millis: 0.0,
            part_millis: PartMillis::default(),
            frame_millis: VecDeque::new(),
            frames: 0,
            resolved: 0,
            reloads: Reloads::default(),
        })
    }
}

/// How panels look; the font is handed over.
pub(super) fn appearance_of(scene: &mut LoadedScene) -> Appearance {
    Appearance {
        is_dark: scene.config.view.theme == ThemeConfig::Dark,
        scale: scene.config.view.scale,
        font: scene.font.take().map(|font| font.to_vec()),
    }
}

/// How it is drawn for whom: a picture is the same wherever it is drawn.
pub(super) fn options_of(options: RendererOptions, is_live: bool) -> RendererOptions {
    RendererOptions {
        on_software_rasterizer: options.on_software_rasterizer.filter(|_| is_live),
        ..options
    }
}

/// The device that the configuration wants.
pub(super) fn choice_of(scene: &LoadedScene) -> DeviceChoice {
    DeviceChoice {
        device: scene.config.view.device.clone(),
        pipeline_cache: scene.pipeline_cache.clone(),
    }
}

pub(super) fn start_chart(
    scene: &LoadedScene,
    settles: bool,
) -> Result<Option<ShownChart>, ViewError> {
    let Some(config) = &scene.config.chart else { return Ok(None) };
    let Some(plugin) = scene.instances.get(&config.plugin) else { return Ok(None) };
    Ok(Some(ShownChart::start(config, plugin, &scene.graph, settles)?))
}

pub(super) fn full_triangles(scene: &LoadedScene) -> u64 {
    let triangles = |instance: busbar_scene::MeshInstance| {
        let stacks = &scene.models[instance.model.0 as usize].stacks;
        stacks[instance.mesh as usize].mesh().triangles.len() as u64
    };
    scene.graph.instances().map(triangles).sum()
}

/// A table of the scene's tags without values. A host program tells every change of its own
/// in a queue, which a stop of this process does not empty.
pub(super) fn table_of(scene: &LoadedScene) -> TagTable {
    let mut table = TagTable::new(scene.tags.clone(), Moment::now());
    let is_by_host = |spec: &TagSpec| {
        let tag = scene.config.tags.get(&spec.id);
        tag.is_some_and(|tag| matches!(tag.origin, OriginConfig::Host))
    };
    let specs = scene.tags.specs().iter().zip(0..);
    let by_host = specs.filter(|(spec, _)| is_by_host(spec)).map(|(_, tag)| TagHandle(tag));
    table.let_outlive_stops(by_host);
    table
}
