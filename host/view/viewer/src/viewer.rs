//! Viewer: one view of one scene, stepped frame by frame.

mod alarms;
mod apply_reload;
mod commands;
mod construction;
mod drawing;
mod host_interface;
mod picking;
mod report;
mod selection;

pub(crate) use drawing::{node_of, object_of};
pub use host_interface::{CameraPose, ChangedAlarm};

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_config::MAX_THETA_SCALE;
use busbar_geometry::Bounds;
use busbar_plugin_host::wall_clock;
use busbar_renderer::{
    CameraView, DeviceChoice, DrawList, EguiFrame, Frame, FrameStats, InstanceSource, PickState,
    Picture, PixelArea, RenderError, Renderer, RendererOptions, ResolveRequest, SectionPlane,
    WindowHandles, release_freed_memory,
};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{CpuClock, Site};
use busbar_tags::{EventLog, Moment, Origin, Snapshot};
use busbar_ui::{
    Appearance, Command, ListModels, ModelRow, Navigation, Panels, SceneOverlay, StatusBarModel,
    ViewModel,
};
use egui::{Pos2, RawInput, Rect};

use crate::alarms::{AlarmListRows, AlarmPresentation, alarm_markers, nodes_in_alarm};
use crate::camera::navigator::{NavigationContext, Navigator};
use crate::camera::{Camera, Projection};
use crate::chart::SceneChart;
use crate::color::linear_from_srgb;
use crate::device_recovery::DeviceRecovery;
use crate::environment::{self, Environment};
use crate::equipment_tree::{self, EquipmentTree};
use crate::faceplate::{self, NodeAttachments, OpenFaceplate};
use crate::frame_budget::FrameBudget;
use crate::highlight::Highlights;
use crate::highlight_styles::Highlight;
use crate::labels::{LinesByNode, hidden_labels};
use crate::load::LoadedScene;
use crate::lod::{DrawItem, LodCamera, LodCursors, LodRequest};
use crate::measurement_chain::MeasurementChain;
use crate::moving_parts::MovingParts;
use crate::outlines::Outlines;
use crate::overlay_geometry::OverlayGeometry;
use crate::overlay_layers::{NodeState, OverlayLayers};
use crate::pick_queue::{PickPurpose, PickQueue, PickRequest};
use crate::reload::ReloadCounters;
use crate::scene_draw_list::SceneDrawList;
use crate::site_definition::SceneDirectory;
use crate::stack_builder::millis_since;
use crate::tag_filter::TagFilter;
use crate::uploaded_models::{self, UploadedModel, mesh_at_cursor};
use crate::{Stats, ViewError, labels, panel_rows, ray_casting, stats, switch_symbols};

/// Pieces of equipment that are selected at once; of more the first in the scene.
pub const MAX_SELECTED: usize = 10_000;

/// Frame times kept for statistics.
const MAX_FRAME_TIMES: usize = 1024;

/// A scene on a device, with its plugins running.
pub struct Viewer {
    // The site first: it stops before what it feeds is gone.
    site: Site,
    /// Layers that show the overlays of the site.
    layers: OverlayLayers,
    /// Presentation of the site's alarms.
    alarms: AlarmPresentation,
    /// Name of the operator who acts on alarms.
    operator: String,
    /// True if a host program embeds the view.
    has_host: bool,
    /// Chart in the scene; none without a configured one.
    chart: Option<SceneChart>,
    scene: LoadedScene,
    /// Parts that move with switches.
    moving_parts: MovingParts,
    renderer: Renderer,
    recovery: DeviceRecovery,
    models: Vec<UploadedModel>,
    lod_cursors: LodCursors,
    /// True if frames wait until all background work is done.
    settles: bool,
    /// Frame-time budget that controls the level of detail.
    frame_budget: FrameBudget,
    /// Triangles of all instances at theta 0.
    triangles_full: u64,
    panels: Panels,
    environment: Environment,
    navigator: Navigator,
    selection: BTreeSet<NodeIndex>,
    equipment_tree: EquipmentTree,
    tag_filter: TagFilter,
    node_attachments: NodeAttachments,
    /// Faceplate of the selected equipment; none unless exactly one is selected.
    faceplate: Option<OpenFaceplate>,
    /// Time span of the trends.
    trend_span: Duration,
    pick_queue: PickQueue,
    /// Pointer position over the scene, points.
    pointer: Option<Pos2>,
    /// Node under the pointer, as last picked.
    hovered: Option<NodeIndex>,
    measuring: Option<MeasurementChain>,
    /// The plane that cuts the scene open.
    section: Option<SectionPlane>,
    /// Nodes that labels stand at, and those of them that are behind other equipment.
    labelled: Vec<NodeIndex>,
    hidden_labels: BTreeSet<NodeIndex>,
    /// The camera of the last frame drawn, and whether that of the one before was there.
    last_view: Option<CameraView>,
    camera_rests: bool,
    wireframe: bool,
    viewport: Rect,
    screen: Rect,
    in_window: bool,
    pixels_per_point: f32,
    highlights: Highlights,
    /// The states of the last frame.
    states: Vec<NodeState>,
    outlines: Outlines,
    overlay_geometry: OverlayGeometry,
    /// Draw list of the last frame.
    scene_draw_list: SceneDrawList,
    /// The panels of the last frame, to draw it again.
    last_primitives: Vec<egui::ClippedPrimitive>,
    /// Camera commands of the host program.
    host_camera_commands: Vec<Command>,
    /// Picked nodes that the host program has not received yet.
    host_picks: VecDeque<Option<NodeIndex>>,
    last_frame: FrameStats,
    cpu_millis: f64,
    stage_millis: FrameStageMillis,
    frame_millis: VecDeque<f64>,
    frames: u64,
    resolved: u64,
    /// Counters of configuration reloads.
    reloads: ReloadCounters,
}

/// CPU time of parts of the last frame, milliseconds of this thread. Waiting time, such as for an
/// overlay's process, is not included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStageMillis {
    /// Taking over what plugins brought; histories.
    pub tags: f64,
    /// Stepping alarms, listing them, their marks in the scene.
    pub alarms: f64,
    /// Running overlays, their labels and tints.
    pub overlays: f64,
    /// Laying out and tessellating panels and labels.
    pub panels: f64,
}

/// Output of a frame for the platform.
pub struct FrameOutput {
    /// Cursor shape, clipboard, links.
    pub platform: egui::PlatformOutput,
    /// Longest delay until the panels must run again.
    pub repaint_after: Duration,
    /// Reason why the window shows an older picture; no value in it is live then.
    pub trouble: Option<String>,
}

impl Viewer {
    /// The egui context that platform glue feeds.
    pub fn egui_context(&self) -> &egui::Context {
        self.panels.context()
    }

    /// Shows the panels, or labels alone; the band over a scene that is not live stays.
    pub fn set_panels_shown(&mut self, shown: bool) {
        self.panels.set_shown(shown);
    }

    /// Selects a piece of equipment by its id or an alias, and opens its faceplate;
    /// whether there is one.
    pub fn select_equipment(&mut self, id: &str) -> bool {
        let found = self.scene.equipment.find(&self.scene.graph, id);
        self.select(found);
        found.is_some()
    }

    /// Returns the CPU time of parts of the last frame.
    pub fn stage_millis(&self) -> FrameStageMillis {
        self.stage_millis
    }

    /// Sets the size of the window, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.renderer.resize(size);
    }

    /// Uses a camera of the configuration.
    ///
    /// # Errors
    /// [`ViewError::UnknownCamera`] for a name that is not configured.
    pub fn use_camera(&mut self, name: &str) -> Result<(), ViewError> {
        let cameras = &self.scene.config.cameras;
        let camera = cameras.get(name).ok_or_else(|| ViewError::UnknownCamera {
            wanted: name.to_owned(),
            known: cameras.keys().cloned().collect(),
        })?;
        self.navigator.jump_to(Camera::from_config(camera));
        Ok(())
    }

    /// Looks from `eye` at `target`, world space in metres, with the angle of
    /// the camera before.
    pub fn look_from(&mut self, eye: [f32; 3], target: [f32; 3]) {
        let camera = self.navigator.camera().moved_to(eye.into(), target.into());
        self.navigator.jump_to(camera);
    }

    /// Sets theta of every model, 0 to 1, instead of what their policies choose.
    pub fn set_theta(&mut self, theta: f64) {
        for model in 0..self.scene.model_count() {
            self.lod_cursors.set_manual_theta(model, Some(theta));
        }
    }

    /// Lets policies choose the theta of every model again.
    pub fn use_policies(&mut self) {
        for model in 0..self.scene.model_count() {
            self.lod_cursors.set_manual_theta(model, None);
        }
    }

    /// Sets the factor on every theta that a policy chooses: 0 shows all in
    /// full detail; at most [`MAX_THETA_SCALE`].
    pub fn set_theta_scale(&mut self, scale: f64) {
        self.lod_cursors.set_scale(scale.clamp(0.0, MAX_THETA_SCALE));
    }

    /// Sets whether a frame waits until every instance is shown at its wanted theta. Headless views
    /// wait, so that a picture does not depend on timing. In a window an instance keeps its mesh
    /// until the new one is ready.
    pub fn set_settles(&mut self, settles: bool) {
        self.settles = settles;
        self.site.set_settles(settles);
    }

    /// Lets changes of detail take so long, by degrees; 0 seconds shows them at once.
    /// Where frames settle they do not wait.
    pub fn set_morph_seconds(&mut self, seconds: f64) {
        self.lod_cursors.set_morph_seconds(seconds);
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
    /// Errors of the graphics device.
    pub fn frame(&mut self, input: RawInput) -> Result<FrameOutput, ViewError> {
        let started = Instant::now();
        self.update_screen(&input);
        let now = input.time.unwrap_or_default();
        self.navigator.advance(now);
        let stepped = self.site.step(&SceneDirectory::new(&self.scene));
        self.look_up_records();
        let began = CpuClock::start();
        let snapshot = self.site.snapshot();
        let mut overlay_frame = self.layers.frame(&self.site, &self.scene.graph);
        if let Some(alarms) = self.site.alarms() {
            let listing = alarms.listing();
            overlay_frame.tints.extend_from_slice(listing.tints());
            overlay_frame.external_tints.extend_from_slice(listing.external_tints());
        }
        let graph = &mut self.scene.graph;
        overlay_frame.states.extend_from_slice(self.moving_parts.update(
            graph,
            &overlay_frame.positions,
            snapshot,
        ));
        let mut chart = self.chart.as_mut().zip(self.site.chart());
        let chart_goes_to =
            chart.as_mut().and_then(|(chart, reader)| chart.step(reader, &self.scene.graph, now));
        if let Some(id) = &chart_goes_to {
            self.selection = self.scene.graph.find(id).into_iter().collect();
        }
        if let Some((chart, reader)) = chart {
            // Of several the last one shows: what tags say now comes after records.
            overlay_frame.states.splice(0..0, chart.states());
            chart.follow_selection(reader, &self.scene.graph, &self.selection);
            chart.update_geometry();
        }
        let labelled =
            LinesByNode::new(overlay_frame.lines(), &overlay_frame.unknown_labels, &self.selection);
        let mut parts = FrameStageMillis {
            tags: stepped.tags,
            alarms: stepped.alarms,
            overlays: stepped.overlays + began.millis(),
            panels: 0.0,
        };
        let began = CpuClock::start();
        let rows = panel_rows::TagListRows::new(
            &self.scene,
            snapshot,
            &self.tag_filter,
            overlay_frame.lines(),
        );
        let model = self.view_model(snapshot, &rows, &overlay_frame.states);
        let (scene, selection, measuring) = (&self.scene, &self.selection, &self.measuring);
        let (panels, navigator, hovered) = (&mut self.panels, &mut self.navigator, self.hovered);
        let (screen, graph) = (self.screen, &scene.graph);
        let selected_bounds = bounds_of(graph, selection);
        let (hidden, alarm_service) = (&self.hidden_labels, self.site.alarms());
        let alarm_rows =
            AlarmListRows { alarm_service, presentation: &self.alarms, scene, snapshot };
        let alarmed = alarm_service.map(nodes_in_alarm).unwrap_or_default();
        let marked = labels::LabelContext { selection, hidden, alarmed: &alarmed };
        let (tree, equipment) = (&self.equipment_tree, &scene.equipment);
        let equipment_rows = equipment_tree::EquipmentTreeRows { tree, graph, equipment };
        let lists = ListModels { tags: &rows, alarms: &alarm_rows, equipment: &equipment_rows };
        let mut over_scene = [0.0; 2];
        let mut host_camera_commands = std::mem::take(&mut self.host_camera_commands);
        host_camera_commands.extend(chart_goes_to.map(Command::Reveal));
        let (chart, pointer) = (&mut self.chart, self.pointer);
        let (positions, moving) = (&overlay_frame.positions, &self.moving_parts);
        let output = panels.run(input, &model, &lists, |viewport, commands| {
            let cameras = &scene.config.cameras;
            let context =
                NavigationContext { graph, cameras, viewport, selection: selected_bounds };
            navigator.steer(&host_camera_commands, &context);
            navigator.steer(commands, &context);
            let view = navigator.camera().view(viewport, screen, graph.bounds());
            let projection = Projection::new(&view, screen);
            let overlay_camera = labels::OverlayCamera { projection, eye: view.eye };
            let began = CpuClock::start();
            let labels = labelled.labels(snapshot, graph, overlay_camera, marked);
            let labels_millis = began.millis();
            let of_alarms = |alarms| alarm_markers(alarms, graph, overlay_camera);
            let alarm_markers = alarm_service.map_or_else(Vec::new, of_alarms);
            over_scene = [labels_millis, began.millis() - labels_millis];
            SceneOverlay {
                labels,
                alarm_markers,
                switch_symbols: switch_symbols::switch_symbols(
                    positions,
                    moving,
                    snapshot,
                    graph,
                    overlay_camera,
                ),
                arrived: navigator.take_arrival(),
                measurement: measuring.as_ref().map(|measuring| measuring.projected(projection)),
                hovered: hovered.map(|node| graph.node(node).id()),
                chart: chart.as_mut().map(|chart| {
                    chart.point_at(pointer, projection);
                    chart.overlay(projection)
                }),
            }
        });
        self.viewport = output.viewport;
        self.apply_commands(&output.commands);

        let mut egui = output.egui;
        let shapes = std::mem::take(&mut egui.shapes);
        let primitives = self.panels.context().tessellate(shapes, egui.pixels_per_point);
        let [labels_millis, beacons_millis] = over_scene;
        parts.panels = began.millis() - labels_millis - beacons_millis;
        let began = CpuClock::start();
        let (graph, snapshot) = (&self.scene.graph, self.site.snapshot());
        self.highlights.update(graph, &overlay_frame, snapshot, &self.selection);
        let eye = self.navigator.camera().eye();
        self.overlay_geometry.update(graph, &self.layers, &overlay_frame, snapshot, eye);
        self.overlay_geometry.append_chart(self.chart.as_ref().and_then(SceneChart::polylines));
        parts.overlays += labels_millis + began.millis();
        parts.alarms += beacons_millis;
        self.stage_millis = parts;
        let brushed = self.chart.as_ref().map_or_else(BTreeSet::new, SceneChart::brushed_nodes);
        self.outlines.update(&self.scene.graph, &self.selection, self.hovered, &brushed);
        self.apply_alarm_detail();
        self.move_instances();
        self.update_lod_cursors(now);
        self.update_draw_list();
        let overlay = EguiFrame {
            textures_delta: &egui.textures_delta,
            primitives: &primitives,
            pixels_per_point: egui.pixels_per_point,
        };
        let prepared_millis = millis_since(started);
        let view = self.view();
        let of_nodes = self.highlights.of_nodes();
        let shown = self.frame_of(view, self.scene_draw_list.list(), of_nodes, Some(overlay));
        let shown = Frame { outlined: self.outlines.list(), ..shown };
        let (in_window, chart) = (self.in_window, &mut self.chart);
        let overlay_geometry = &mut self.overlay_geometry;
        let drawn = self.recovery.run(&mut self.renderer, &self.scene, |renderer| {
            chart.as_mut().map_or(Ok(()), |chart| chart.count(renderer))?;
            let chart = chart.as_ref().and_then(SceneChart::polylines);
            let polylines = overlay_geometry.polylines(chart);
            let frame = Frame { polylines, ..shown };
            let drawn = renderer.draw(&frame)?;
            if !in_window {
                // Nobody watches: a frame counts from its beginning to its end.
                renderer.finish()?;
            }
            Ok(drawn)
        });
        if !matches!(drawn, Ok(Some(_))) {
            // egui tells of these once, and the next frame needs them.
            self.renderer.update_textures(&egui.textures_delta)?;
        }
        // Cleared in any case: egui panics when a delta is dropped full.
        egui.textures_delta.clear();
        let Some(drawn) = drawn? else {
            let repaint_after = self.recovery.next_try().unwrap_or(Duration::ZERO);
            let platform = egui.platform_output;
            return Ok(FrameOutput {
                platform,
                repaint_after,
                trouble: self.recovery.frozen_message(),
            });
        };
        self.last_frame = drawn;
        self.last_primitives = primitives;
        self.cpu_millis = prepared_millis + self.last_frame.cpu_millis;
        self.update_model_rows();
        self.frame_budget.record_frame(&self.last_frame);
        // What was never seen elsewhere rests from the first.
        self.camera_rests = self.last_view.replace(view).is_none_or(|before| before == view);
        let labelled = labelled.nodes();
        if self.labelled != labelled {
            self.pick_queue.forget_labels();
            self.labelled = labelled;
        }
        self.states = overlay_frame.states;
        self.step_pick_queue()?;
        self.record_frame_time(started);
        if self.frames == 1 && !self.settles {
            // What loading took, nobody needs again.
            release_freed_memory();
        }
        let root = egui.viewport_output.get(&egui::ViewportId::ROOT);
        let needs_frames = self.lod_cursors.is_morphing()
            || self.chart.as_ref().is_some_and(SceneChart::needs_frames)
            || self.lod_cursors.waiting_count() > 0
                && self.last_frame.resolved + self.last_frame.waiting > 0;
        let repaint_after = match root {
            _ if needs_frames || self.needs_frames() => Duration::ZERO,
            root => root.map_or(Duration::MAX, |viewport| viewport.repaint_delay),
        };
        let trouble = self.recovery.frozen_message();
        Ok(FrameOutput { platform: egui.platform_output, repaint_after, trouble })
    }

    /// Input for a frame of a view without a window.
    pub fn headless_input(&self, seconds: f64) -> RawInput {
        let mut input =
            RawInput { screen_rect: Some(self.screen), time: Some(seconds), ..RawInput::default() };
        input.viewports.entry(input.viewport_id).or_default().native_pixels_per_point =
            Some(self.scene.config.view.scale);
        input
    }

    fn update_screen(&mut self, input: &RawInput) {
        if let Some(screen) = input.screen_rect {
            self.screen = screen;
        }
        let native =
            input.viewports.get(&input.viewport_id).and_then(|v| v.native_pixels_per_point);
        self.pixels_per_point = native.unwrap_or(1.0) * self.panels.context().zoom_factor();
    }

    fn record_frame_time(&mut self, started: Instant) {
        self.frames += 1;
        if self.frame_millis.len() == MAX_FRAME_TIMES {
            self.frame_millis.pop_front();
        }
        self.frame_millis.push_back(millis_since(started));
    }
}

/// The box around nodes.
fn bounds_of(graph: &SceneGraph, nodes: &BTreeSet<NodeIndex>) -> Option<Bounds> {
    nodes.iter().filter_map(|node| graph.node(*node).bounds()).reduce(Bounds::union)
}
