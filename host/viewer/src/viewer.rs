//! One view of one scene, stepped frame by frame.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_config::MAX_THETA_SCALE;
use busbar_plugin_host::{LinkReport, SampleSink, wall_clock};
use busbar_plugin_process::{Plugin, RunningTelemetry};
use busbar_renderer::{
    DeviceChoice, DrawInstance, EguiFrame, Frame, FrameStats, Picture, RenderError, Renderer,
    RendererOptions, SectionPlane, WindowHandles,
};
use busbar_scene::NodeIndex;
use busbar_tags::{EventLog, Moment, Sample, Snapshot, TagTable};
use busbar_ui::{Command, ModelRow, Panels, StatusLine, ViewModel};
use egui::{Pos2, RawInput, Rect, vec2};

use crate::camera::{OrbitCamera, Projection};
use crate::color::linear_from_srgb;
use crate::cursors::{Cursors, Drawn, Eye};
use crate::highlight::{self, Highlight, Highlights};
use crate::load::LoadedScene;
use crate::outlines::Outlines;
use crate::pace::Pace;
use crate::recovery::Recovery;
use crate::running::{self, ShownOverlay};
use crate::shown_model::{self, ShownModel, on_device};
use crate::stacks::millis_since;
use crate::surroundings::{self, Surroundings};
use crate::{Stats, ViewError, labels, rows, stats};

/// Frame times kept for statistics.
const MAX_FRAME_TIMES: usize = 1024;

/// A scene on a device, with its plugins running.
pub struct Viewer {
    // Telemetry first: it stops before what it feeds is gone.
    telemetry: Vec<RunningTelemetry>,
    overlays: Vec<ShownOverlay>,
    tags: TagTable,
    /// What switched, in order.
    events: EventLog,
    scene: LoadedScene,
    renderer: Renderer,
    recovery: Recovery,
    models: Vec<ShownModel>,
    cursors: Cursors,
    /// Whether frames wait until every cursor is where it is wanted.
    settles: bool,
    /// What frames may take, and what that asks of the detail.
    pace: Pace,
    /// Triangles of all instances at theta 0.
    triangles_full: u64,
    panels: Panels,
    surroundings: Surroundings,
    camera: OrbitCamera,
    selected: Option<NodeIndex>,
    wireframe: bool,
    viewport: Rect,
    screen: Rect,
    in_window: bool,
    pixels_per_point: f32,
    highlights: Highlights,
    outlines: Outlines,
    section: Option<SectionPlane>,
    /// What the last frame drew, kept for its room.
    drawn: Vec<DrawInstance>,
    /// The panels of the last frame, to draw it again.
    painted: Vec<egui::ClippedPrimitive>,
    last: FrameStats,
    cpu_millis: f64,
    frame_millis: VecDeque<f64>,
    frames: u64,
    resolved: u64,
}

/// What the platform must do after a frame.
pub struct FrameOutput {
    /// Cursor shape, clipboard, links.
    pub platform: egui::PlatformOutput,
    /// When the panels want to be run again at the latest.
    pub repaint_after: Duration,
    /// Why the window shows an older picture, if it does: no values in it are
    /// live then.
    pub trouble: Option<String>,
}

/// Where samples go: into the tags, and what they switch to the events.
struct Updates<'a> {
    tags: &'a mut TagTable,
    events: &'a mut EventLog,
}

impl SampleSink for Updates<'_> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        self.tags.apply(sample, |change| self.events.note(change));
    }
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
        Self::start(scene, options, None, size)
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
        Self::start(scene, options, Some(window), size)
    }

    fn start(
        mut scene: LoadedScene,
        options: RendererOptions,
        window: Option<Arc<dyn WindowHandles>>,
        size: [u32; 2],
    ) -> Result<Self, ViewError> {
        let start = Instant::now();
        let in_window = window.is_some();
        let choice = DeviceChoice {
            device: scene.config.view.device.clone(),
            pipeline_cache: scene.pipeline_cache.clone(),
        };
        let open = || Renderer::open(options, choice.clone(), window.clone(), size);
        let (recovery, renderer, handles) = Recovery::start(&scene, !in_window, open)?;
        let models = shown_model::shown(&scene, handles);
        scene.millis.insert("upload".into(), millis_since(start));
        let theta_scale = scene.config.view.theta_scale;
        let tags = TagTable::new(scene.tags.clone(), Moment::now());
        let overlays = running::start_overlays(&scene)?;
        let telemetry = running::start_telemetry(&scene)?;
        let camera =
            scene.config.view.camera.as_ref().and_then(|name| scene.config.cameras.get(name));
        let camera = camera
            .map_or_else(|| OrbitCamera::framing(scene.graph.bounds()), OrbitCamera::from_config);
        let screen = Rect::from_min_size(Pos2::ZERO, vec2(size[0] as f32, size[1] as f32));
        Ok(Self {
            telemetry,
            overlays,
            tags,
            events: EventLog::default(),
            triangles_full: full_triangles(&scene),
            cursors: Cursors::new(
                &scene.graph,
                &scene.models,
                scene.policies(),
                &scene.groups,
                theta_scale,
            ),
            settles: !in_window,
            // A picture does not depend on how fast it came.
            pace: Pace::new(scene.config.view.target_frame_millis.filter(|_| in_window)),
            section: scene.config.view.section.map(surroundings::section_of),
            surroundings: Surroundings::of(&scene.config.view, scene.graph.bounds()),
            scene,
            renderer,
            recovery,
            models,
            panels: Panels::new(in_window),
            camera,
            selected: None,
            wireframe: false,
            viewport: screen,
            screen,
            in_window,
            pixels_per_point: 1.0,
            highlights: Highlights::default(),
            outlines: Outlines::default(),
            drawn: Vec::new(),
            painted: Vec::new(),
            last: FrameStats::default(),
            cpu_millis: 0.0,
            frame_millis: VecDeque::new(),
            frames: 0,
            resolved: 0,
        })
    }

    /// The egui context that platform glue feeds.
    pub fn egui_context(&self) -> &egui::Context {
        self.panels.context()
    }

    /// Tells the size of the window, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.renderer.resize(size);
    }

    /// Uses a camera of the configuration.
    ///
    /// # Errors
    /// [`ViewError::UnknownCamera`].
    pub fn use_camera(&mut self, name: &str) -> Result<(), ViewError> {
        let cameras = &self.scene.config.cameras;
        let camera = cameras.get(name).ok_or_else(|| ViewError::UnknownCamera {
            wanted: name.to_owned(),
            known: cameras.keys().cloned().collect(),
        })?;
        self.camera = OrbitCamera::from_config(camera);
        Ok(())
    }

    /// Looks from `eye` at `target`, world space in metres, with the angle of
    /// the camera before.
    pub fn look_from(&mut self, eye: [f32; 3], target: [f32; 3]) {
        self.camera = self.camera.moved_to(eye.into(), target.into());
    }

    /// Sets theta of every model, 0 to 1, instead of what their policies choose.
    pub fn set_theta(&mut self, theta: f64) {
        for model in 0..self.scene.model_count() {
            self.cursors.set_by_hand(model, Some(theta));
        }
    }

    /// Lets policies choose the theta of every model again.
    pub fn use_policies(&mut self) {
        for model in 0..self.scene.model_count() {
            self.cursors.set_by_hand(model, None);
        }
    }

    /// Sets the factor on every theta that a policy chooses: 0 shows all in
    /// full detail; at most [`MAX_THETA_SCALE`].
    pub fn set_theta_scale(&mut self, scale: f64) {
        self.cursors.set_scale(scale.clamp(0.0, MAX_THETA_SCALE));
    }

    /// Whether a frame waits until every instance is shown at the theta wanted.
    /// Without a window it does, so that a picture does not depend on timing;
    /// in a window an instance is shown as it was until the new mesh is there.
    pub fn set_settles(&mut self, settles: bool) {
        self.settles = settles;
    }

    /// Cuts away what lies before a plane, or shows all again.
    pub fn set_section(&mut self, section: Option<SectionPlane>) {
        self.section = section;
    }

    /// Draws edges instead of surfaces.
    pub fn set_wireframe(&mut self, wireframe: bool) {
        self.wireframe = wireframe;
    }

    /// Steps the view: takes samples, runs overlays and panels, draws.
    ///
    /// # Errors
    /// The device's.
    pub fn frame(&mut self, input: RawInput) -> Result<FrameOutput, ViewError> {
        let started = Instant::now();
        self.note_screen(&input);
        self.take_samples();
        let snapshot = self.tags.snapshot();
        let patience =
            if self.settles { running::HEADLESS_PATIENCE } else { running::WINDOW_PATIENCE };
        let overlaid = running::run_overlays(&mut self.overlays, snapshot, patience);
        let model = self.view_model(snapshot);

        let (scene, screen, selected) = (&self.scene, self.screen, self.selected);
        let rows = rows::Rows::new(scene, snapshot, &overlaid.lines);
        let mut camera = self.camera;
        let output = self.panels.run(input, &model, &rows, |viewport, commands| {
            camera.steer(commands, viewport, scene);
            let view = camera.view(viewport, screen);
            let projection = Projection::new(&view, screen);
            labels::build(&overlaid.lines, snapshot, &scene.graph, projection, view.eye, selected)
        });
        self.camera = camera;
        self.viewport = output.viewport;
        let picked_at = self.obey(&output.commands);

        let mut egui = output.egui;
        let shapes = std::mem::take(&mut egui.shapes);
        let primitives = self.panels.context().tessellate(shapes, egui.pixels_per_point);
        let mut highlights = std::mem::take(&mut self.highlights);
        highlights.update(&self.scene.graph, &overlaid.tints, self.tags(), self.selected);
        let selection = self.selected.into_iter().collect();
        self.outlines.update(&self.scene.graph, &selection, None);
        self.move_cursors();
        let mut instances = std::mem::take(&mut self.drawn);
        self.list_instances(highlights.of_nodes(), &mut instances);
        let overlay = EguiFrame {
            textures_delta: &egui.textures_delta,
            primitives: &primitives,
            pixels_per_point: egui.pixels_per_point,
        };
        let prepared_millis = millis_since(started);
        let shown = self.picture_of(&instances, highlights.of_nodes(), Some(overlay));
        let frame = Frame { outlined: self.outlines.list(), ..shown };
        let in_window = self.in_window;
        let drawn = self.recovery.run(&mut self.renderer, &self.scene, |renderer| {
            let drawn = renderer.draw(&frame)?;
            if !in_window {
                // Nobody watches: a frame counts from its beginning to its end.
                renderer.finish()?;
            }
            Ok(drawn)
        });
        if !matches!(drawn, Ok(Some(_))) {
            // egui tells of these once, and the next frame needs them.
            self.renderer.keep_textures(&egui.textures_delta)?;
        }
        // Cleared in any case: egui panics when a delta is dropped full.
        egui.textures_delta.clear();
        let Some(drawn) = drawn? else {
            (self.highlights, self.drawn) = (highlights, instances);
            let repaint_after = self.recovery.next_try().unwrap_or(Duration::ZERO);
            let platform = egui.platform_output;
            return Ok(FrameOutput { platform, repaint_after, trouble: self.recovery.trouble() });
        };
        self.last = drawn;
        self.painted = primitives;
        self.cpu_millis = prepared_millis + self.last.cpu_millis;
        self.note_detail();
        self.pace.note(&self.last);
        if let Some(position) = picked_at {
            let pixel = [position.x, position.y].map(|p| (p * self.pixels_per_point) as u32);
            self.selected = match self.pick_node(&instances, highlights.of_nodes(), pixel) {
                // The window shrank since the click.
                Err(ViewError::Render(RenderError::OutsidePicture { .. })) => None,
                picked => picked?.unwrap_or(self.selected),
            };
        }
        (self.highlights, self.drawn) = (highlights, instances);
        self.count_frame(started);
        let root = egui.viewport_output.get(&egui::ViewportId::ROOT);
        let is_coming =
            self.cursors.waiting().len() > 0 && self.last.resolved + self.last.waiting > 0;
        let repaint_after = match root {
            _ if is_coming => Duration::ZERO,
            root => root.map_or(Duration::MAX, |viewport| viewport.repaint_delay),
        };
        let trouble = self.recovery.trouble();
        Ok(FrameOutput { platform: egui.platform_output, repaint_after, trouble })
    }

    /// Input for a frame of a view without a window.
    pub fn headless_input(&self, seconds: f64) -> RawInput {
        RawInput { screen_rect: Some(self.screen), time: Some(seconds), ..RawInput::default() }
    }

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
        let shown = self.picture_of(&self.drawn, self.highlights.of_nodes(), Some(overlay));
        let frame = Frame { outlined: self.outlines.list(), ..shown };
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

    /// Selects and names what is at a pixel: its equipment id.
    ///
    /// # Errors
    /// The device's.
    pub fn pick(&mut self, pixel: [u32; 2]) -> Result<Option<String>, ViewError> {
        let mut instances = Vec::new();
        self.list_instances(&[], &mut instances);
        self.selected = self.pick_node(&instances, &[], pixel)?.unwrap_or(self.selected);
        Ok(self.selected_id())
    }

    /// Names what the last frame shows at each of many pixels, from one picture
    /// of ids, and selects nothing.
    ///
    /// # Errors
    /// The device's, or a pixel outside the picture.
    pub fn pick_many(&mut self, pixels: &[[u32; 2]]) -> Result<Vec<Option<String>>, ViewError> {
        let size = self.renderer.picked_size();
        let mut instances = Vec::new();
        self.list_instances(&[], &mut instances);
        let frame = self.picture_of(&instances, &[], None);
        let objects = self.recovery.run(&mut self.renderer, &self.scene, |r| r.pick_all(&frame))?;
        let objects = objects.ok_or(ViewError::Render(RenderError::NoPicture))?;
        let id_at = |&pixel: &[u32; 2]| {
            if pixel[0] >= size[0] || pixel[1] >= size[1] {
                return Err(RenderError::OutsidePicture { pixel, size }.into());
            }
            let index = pixel[1] as usize * size[0] as usize + pixel[0] as usize;
            Ok(node_of(objects[index]).map(|node| self.scene.graph.node(node).id()))
        };
        pixels.iter().map(id_at).collect()
    }

    /// Numbers about the view as its last frame showed it.
    pub fn stats(&self) -> Stats {
        let mut millis: Vec<f64> = self.frame_millis.iter().copied().collect();
        millis.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * millis.len().saturating_sub(1) as f64).round() as usize;
            millis.get(rank).copied().unwrap_or(0.0)
        };
        let median = at(0.5);
        let rows = self.rows();
        Stats {
            vertices: self.surviving_vertices(),
            triangles: self.last.triangles,
            triangles_full: self.triangles_full,
            theta: rows.clone().map(|row| (row.name.clone(), row.theta[1])).collect(),
            theta_span: rows.map(|row| (row.name.clone(), row.theta)).collect(),
            cpu_ms: self.cpu_millis,
            gpu_ms: stats::gpu_millis(&self.last),
            resolve_ms: self.last.resolve_millis,
            resolved: self.resolved,
            waiting: self.cursors.waiting().len(),
            groups_as_one: self.groups_as_one(),
            index_cache_bytes: self.renderer.index_cache_bytes(),
            frames: self.frames,
            fps_median: if median > 0.0 { 1e3 / median } else { 0.0 },
            frame_ms_p99: at(0.99),
            gpu: self.renderer.device_name().to_owned(),
            devices_replaced: self.recovery.replaced,
            frames_skipped: self.recovery.skipped,
            load_ms: self.scene.millis.clone(),
            cached_meshes: self.scene.cached_meshes,
            plugins: self
                .instances()
                .map(|(plugin, link, fault)| stats::plugin(plugin, link, fault))
                .collect(),
            tags: stats::tags(&self.scene.tags, self.tags.snapshot()),
            quality: self.tags.snapshot().counts().into(),
            events: self.events.count(),
            picked: self.selected_id(),
            validation_messages: self.renderer.validation_messages(),
        }
    }

    /// Starts a plugin again that waits for that or is in quarantine.
    pub fn start_plugin(&self, name: &str) {
        if let Some(plugin) = self.scene.instances.get(name) {
            plugin.start_again();
        }
    }

    /// The tags as the last frame showed them.
    pub fn tags(&self) -> Snapshot<'_> {
        self.tags.snapshot()
    }

    /// What switched since the start, in the order in which it came.
    pub fn events(&self) -> &EventLog {
        &self.events
    }

    /// Takes over what plugins brought; values past their limit are stale from here on.
    fn take_samples(&mut self) {
        let (tags, events) = (&mut self.tags, &mut self.events);
        tags.follow_clock(wall_clock(), Moment::now());
        for telemetry in &self.telemetry {
            telemetry.drain(&mut Updates { tags, events });
        }
        tags.advance(Moment::now(), |change| events.note(change));
    }

    fn note_screen(&mut self, input: &RawInput) {
        if let Some(screen) = input.screen_rect {
            self.screen = screen;
        }
        let native =
            input.viewports.get(&input.viewport_id).and_then(|v| v.native_pixels_per_point);
        self.pixels_per_point = native.unwrap_or(1.0) * self.panels.context().zoom_factor();
    }

    fn view_model(&self, snapshot: Snapshot<'_>) -> ViewModel {
        let counts = snapshot.counts();
        ViewModel {
            models: self.rows().cloned().collect(),
            plugins: self
                .instances()
                .map(|(plugin, link, fault)| rows::plugin(plugin, link, fault))
                .collect(),
            cameras: self.scene.config.cameras.keys().cloned().collect(),
            wireframe: self.wireframe,
            theta_scale: self.cursors.scale(),
            max_theta_scale: MAX_THETA_SCALE,
            status: StatusLine {
                triangles: self.last.triangles,
                triangles_full: self.triangles_full,
                frame_millis: self.last_frame_millis(),
                gpu_millis: stats::gpu_millis(&self.last).into_iter().collect(),
                device: self.renderer.device_name().to_owned(),
                good: counts.good,
                uncertain: counts.uncertain,
                bad: counts.bad,
            },
            selected: self.selected_id(),
        }
    }

    /// What is said of the configuration's models.
    fn rows(&self) -> impl Iterator<Item = &ModelRow> + Clone {
        self.models.iter().take(self.scene.model_count()).map(|model| &model.row)
    }

    /// Plugins with their links, and what went wrong with them last.
    fn instances(&self) -> impl Iterator<Item = (&Plugin, Option<LinkReport>, Option<&str>)> {
        self.scene.instances.iter().map(|(name, plugin)| {
            let link = self.telemetry.iter().find(|t| t.name() == name);
            let overlay = self.overlays.iter().find(|o| o.overlay.name() == name);
            let fault = overlay.and_then(|overlay| overlay.fault.as_deref());
            (plugin, link.map(RunningTelemetry::link), fault)
        })
    }

    /// Does what the panels ask, except for the camera, which is steered already;
    /// returns where to pick.
    fn obey(&mut self, commands: &[Command]) -> Option<Pos2> {
        let mut pick = None;
        for command in commands {
            match command {
                Command::SetTheta { model, theta } => {
                    self.cursors.set_by_hand(*model, Some(*theta));
                }
                Command::UsePolicy { model } => self.cursors.set_by_hand(*model, None),
                Command::SetThetaScale(scale) => self.set_theta_scale(*scale),
                Command::SetWireframe(wireframe) => self.wireframe = *wireframe,
                Command::Focus(id) => self.selected = self.scene.graph.find(id),
                Command::StartPlugin(name) => self.start_plugin(name),
                Command::Pick(position) => pick = Some(*position),
                Command::UseCamera(_)
                | Command::FitAll
                | Command::Orbit(_)
                | Command::Pan(_)
                | Command::Zoom(_) => {}
            }
        }
        pick
    }

    /// Chooses cursors for where the camera is, and moves those that are ready.
    fn move_cursors(&mut self) {
        let Self { cursors, renderer, models, scene, .. } = self;
        let pixels = self.viewport.size() * self.pixels_per_point;
        let eye = Eye { position: self.camera.eye(), pixel: self.camera.pixel(pixels) };
        cursors.set_coarseness(self.pace.coarseness());
        cursors.choose(eye, &scene.models, self.settles);
        cursors.advance(self.settles, |place| {
            renderer.triangles_at(&on_device(models, place)).is_some()
        });
        renderer.request(cursors.waiting().map(|place| on_device(models, place)));
    }

    /// Brings what is said of models up to the frame drawn.
    fn note_detail(&mut self) {
        let Self { cursors, renderer, models, scene, .. } = self;
        self.resolved += u64::from(self.last.resolved);
        cursors.count_moved(|place| renderer.triangles_at(&on_device(models, place)));
        if let Some(details) = cursors.changed_detail(&scene.models) {
            models.iter_mut().zip(&details).for_each(|(model, detail)| model.note(detail));
        }
    }

    fn list_instances(&self, highlights: &[Highlight], into: &mut Vec<DrawInstance>) {
        let graph = &self.scene.graph;
        into.clear();
        self.cursors.for_each_drawn(|drawn, place| {
            let (node, world_from_mesh, first_feature) = match drawn {
                Drawn::Instance(index) => {
                    let instance = &graph.instances()[index];
                    (instance.node, graph.world_from_mesh(instance), instance.first_feature)
                }
                Drawn::Group(index) => {
                    let group = &self.scene.groups[index].group;
                    let top = NodeIndex(group.nodes.start);
                    (top, group.world_from_group, Some(top))
                }
            };
            into.push(DrawInstance {
                model: self.models[place.model].handle,
                mesh: place.mesh as u32,
                cursor: place.cursor,
                world_from_mesh,
                object: object_of(node),
                highlight: highlights.get(node.0 as usize).copied().unwrap_or(highlight::NONE),
                first_feature: first_feature.map(object_of),
            });
        });
    }

    fn picture_of<'a>(
        &self,
        instances: &'a [DrawInstance],
        object_highlights: &'a [Highlight],
        overlay: Option<EguiFrame<'a>>,
    ) -> Frame<'a> {
        Frame {
            camera: self.camera.view(self.viewport, self.screen),
            instances,
            object_highlights,
            wireframe: self.wireframe,
            background: self.scene.config.view.background.map(linear_from_srgb),
            ground: self.surroundings.ground,
            fog_distance: self.surroundings.fog_distance,
            shadow_bounds: self.surroundings.shadow_bounds,
            outlined: &[],
            section: self.section,
            overlay,
        }
    }

    /// The node at a pixel; `None` where the device cannot tell at present.
    fn pick_node(
        &mut self,
        instances: &[DrawInstance],
        highlights: &[Highlight],
        pixel: [u32; 2],
    ) -> Result<Option<Option<NodeIndex>>, ViewError> {
        let frame = self.picture_of(instances, highlights, None);
        let pick = |renderer: &mut Renderer| renderer.pick(&frame, pixel);
        Ok(self.recovery.run(&mut self.renderer, &self.scene, pick)?.map(node_of))
    }

    fn selected_id(&self) -> Option<String> {
        self.selected.map(|node| self.scene.graph.node(node).id())
    }

    fn surviving_vertices(&self) -> u64 {
        let mut vertices = 0;
        self.cursors.for_each_drawn(|_, place| {
            let stacks = &self.scene.models[place.model].stacks[place.mesh];
            vertices += u64::from(stacks.surviving(place.cursor));
        });
        vertices
    }

    fn groups_as_one(&self) -> usize {
        let mut count = 0;
        self.cursors.for_each_drawn(|drawn, _| {
            count += usize::from(matches!(drawn, Drawn::Group(_)));
        });
        count
    }

    fn last_frame_millis(&self) -> f64 {
        self.frame_millis.back().copied().unwrap_or(0.0)
    }

    fn count_frame(&mut self, started: Instant) {
        self.frames += 1;
        if self.frame_millis.len() == MAX_FRAME_TIMES {
            self.frame_millis.pop_front();
        }
        self.frame_millis.push_back(millis_since(started));
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        for plugin in self.scene.instances.values() {
            plugin.quit();
        }
    }
}

/// Objects count from 1, nodes from 0.
fn object_of(node: NodeIndex) -> u32 {
    node.0 + 1
}

fn node_of(object: Option<u32>) -> Option<NodeIndex> {
    object.and_then(|object| object.checked_sub(1)).map(NodeIndex)
}

fn full_triangles(scene: &LoadedScene) -> u64 {
    let triangles = |instance: &busbar_scene::MeshInstance| {
        let stacks = &scene.models[instance.model.0 as usize].stacks;
        stacks[instance.mesh as usize].mesh().triangles.len() as u64
    };
    scene.graph.instances().iter().map(triangles).sum()
}
