//! One view of one scene, stepped frame by frame.

mod alarming;
mod commands;
mod drawing;
mod embedding;
mod facing;
mod host_intake;
mod opening;
mod picking;
mod reloading;
mod report;
mod values;

pub(crate) use drawing::{node_of, object_of};
use host_intake::HostIntake;

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use busbar_config::MAX_THETA_SCALE;
use busbar_geometry::Bounds;
use busbar_history::History;
use busbar_plugin_host::{LinkReport, SampleSink, SceneClock, wall_clock};
use busbar_plugin_process::Plugin;
use busbar_renderer::{
    CameraView, DeviceChoice, DrawList, EguiFrame, Frame, FrameStats, InstanceSource, PickState,
    Picture, PixelArea, RenderError, Renderer, RendererOptions, ResolveRequest, SectionPlane,
    WindowHandles, release_freed_memory,
};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::{EventLog, Moment, Origin, Sample, Snapshot, TagTable};
use busbar_ui::{
    Appearance, Command, Lists, ModelRow, Navigation, Panels, SceneOverlay, StatusLine, ViewModel,
};
use egui::{Pos2, RawInput, Rect};

use crate::alarms::{self, Alarming};
use crate::camera::navigator::{Around, Navigator};
use crate::camera::{Camera, Projection};
use crate::chart::ShownChart;
use crate::color::linear_from_srgb;
use crate::cpu_clock::CpuClock;
use crate::cursors::{Cursors, Drawn, Eye, Needed};
use crate::drawn::DrawnScene;
use crate::equipment_tree::{self, EquipmentTree};
use crate::faceplate::{self, AtNodes, OpenFaceplate};
use crate::ground_marks::GroundMarks;
use crate::highlight::Highlights;
use crate::labels::LinesOfNodes;
use crate::load::LoadedScene;
use crate::looks::Highlight;
use crate::measuring::Measuring;
use crate::moving::MovingParts;
use crate::origins::OriginWatch;
use crate::outlines::Outlines;
use crate::pace::Pace;
use crate::pause_watch::PauseWatch;
use crate::picker::{Picker, Purpose, Question};
use crate::records::Books;
use crate::recovery::Recovery;
use crate::reload::Reloads;
use crate::running::{self, ShownOverlay, ShownState};
use crate::served::ServedTags;
use crate::shown_model::{self, ShownModel, on_device};
use crate::stacks::millis_since;
use crate::surroundings::{self, Surroundings};
use crate::tag_list::TagList;
use crate::{Stats, ViewError, flags, labels, occlusion, ray, rows, stats};

/// Pieces of equipment that are selected at once; of more the first in the scene.
pub const MAX_SELECTED: usize = 10_000;

/// Frame times kept for statistics.
const MAX_FRAME_TIMES: usize = 1024;

/// A scene on a device, with its plugins running.
pub struct Viewer {
    // Telemetry first: it stops before what it feeds is gone.
    telemetry: Vec<ServedTags>,
    overlays: Vec<ShownOverlay>,
    tags: TagTable,
    pauses: PauseWatch,
    /// What switched, in order.
    events: EventLog,
    /// What tags were.
    history: History,
    /// What of it was not live.
    origins: OriginWatch,
    /// None where none is configured.
    alarms: Option<Alarming>,
    /// Who acts on them.
    operator: String,
    /// Whether a host program takes part.
    has_host: bool,
    /// Judges the values that it sets.
    host_intake: HostIntake,
    /// None where none is configured.
    chart: Option<ShownChart>,
    /// Of business and management systems.
    records: Books,
    scene: LoadedScene,
    /// Parts that move with switches.
    moving: MovingParts,
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
    navigator: Navigator,
    selection: BTreeSet<NodeIndex>,
    tree: EquipmentTree,
    tag_list: TagList,
    at_nodes: AtNodes,
    /// Of what is selected; none where none or several are.
    faceplate: Option<OpenFaceplate>,
    /// How far back its trends go.
    trend_span: Duration,
    picker: Picker,
    /// Where the pointer is over the scene, points.
    pointer: Option<Pos2>,
    /// What is under the pointer, as far as it is known.
    hovered: Option<NodeIndex>,
    measuring: Option<Measuring>,
    /// The plane that cuts the scene open.
    section: Option<SectionPlane>,
    /// Nodes that labels stand at, and those of them that are behind other equipment.
    labelled: Vec<NodeIndex>,
    hidden_labels: BTreeSet<NodeIndex>,
    /// The camera of the last frame drawn, and whether that of the one before was there.
    shown: Option<CameraView>,
    rests: bool,
    wireframe: bool,
    viewport: Rect,
    screen: Rect,
    in_window: bool,
    pixels_per_point: f32,
    highlights: Highlights,
    /// The states of the last frame.
    states: Vec<ShownState>,
    outlines: Outlines,
    ground_marks: GroundMarks,
    /// What the last frame drew.
    drawn: DrawnScene,
    /// The panels of the last frame, to draw it again.
    painted: Vec<egui::ClippedPrimitive>,
    /// What the host program asked of the camera.
    asked: Vec<Command>,
    /// What was picked, for the host program.
    picked: VecDeque<Option<NodeIndex>>,
    last: FrameStats,
    cpu_millis: f64,
    part_millis: PartMillis,
    frame_millis: VecDeque<f64>,
    frames: u64,
    resolved: u64,
    /// How the configuration was reloaded.
    reloads: Reloads,
}

/// What parts of the last frame took of the CPU, milliseconds of this thread: what waits,
/// such as for an overlay's process, does not count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartMillis {
    /// Taking over what plugins brought; histories.
    pub tags: f64,
    /// Stepping alarms, listing them, their marks in the scene.
    pub alarms: f64,
    /// Running overlays, their labels, what they tint.
    pub overlays: f64,
    /// Laying out and tessellating panels and labels.
    pub panels: f64,
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

    /// What parts of the last frame took of the CPU.
    pub fn part_millis(&self) -> PartMillis {
        self.part_millis
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

    /// Lets changes of detail take so long, by degrees; 0 seconds shows them at once.
    /// Where frames settle they do not wait.
    pub fn set_morph_seconds(&mut self, seconds: f64) {
        self.cursors.set_morph_seconds(seconds);
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
        let now = input.time.unwrap_or_default();
        self.navigator.advance(now);
        let mut parts = self.take_samples();
        self.take_records();
        let began = CpuClock::start();
        let snapshot = self.tags.snapshot();
        self.origins.follow(&self.scene, snapshot, &self.history, Moment::now());
        let patience =
            if self.settles { running::HEADLESS_PATIENCE } else { running::WINDOW_PATIENCE };
        let recorded = self.telemetry.iter().filter_map(ServedTags::scene_time).max();
        let clock = SceneClock { wall: SystemTime::now(), recorded };
        let mut overlaid =
            running::run_overlays(&mut self.overlays, &self.scene, snapshot, (clock, patience));
        if let Some(alarms) = &self.alarms {
            overlaid.tints.extend_from_slice(alarms.tints());
            overlaid.sourced_tints.extend_from_slice(alarms.sourced_tints());
        }
        let graph = &mut self.scene.graph;
        overlaid.states.extend_from_slice(self.moving.update(graph, &overlaid.positions, snapshot));
        let chart_goes_to =
            self.chart.as_mut().and_then(|chart| chart.step(&self.scene.graph, now));
        if let Some(id) = &chart_goes_to {
            self.selection = self.scene.graph.find(id).into_iter().collect();
        }
        if let Some(chart) = &mut self.chart {
            // Of several the last one shows: what tags say now comes after records.
            overlaid.states.splice(0..0, chart.states());
            chart.follow_selection(&self.scene.graph, &self.selection);
            chart.shape_up();
        }
        let labelled =
            LinesOfNodes::new(overlaid.lines(), &overlaid.unknown_labels, &self.selection);
        parts.overlays += began.millis();
        let began = CpuClock::start();
        let rows = rows::Rows::new(&self.scene, snapshot, &self.tag_list, overlaid.lines());
        let model = self.view_model(snapshot, &rows, &overlaid.states);
        let (scene, selection, measuring) = (&self.scene, &self.selection, &self.measuring);
        let (panels, navigator, hovered) = (&mut self.panels, &mut self.navigator, self.hovered);
        let (screen, graph) = (self.screen, &scene.graph);
        let selected_bounds = bounds_of(graph, selection);
        let (hidden, alarming) = (&self.hidden_labels, self.alarms.as_ref());
        let alarm_rows = alarms::Rows { alarming, scene, snapshot };
        let alarmed = alarming.map(alarms::nodes_in_alarm).unwrap_or_default();
        let marked = labels::Marked { selection, hidden, alarmed: &alarmed };
        let (tree, equipment) = (&self.tree, &scene.equipment);
        let equipment_rows = equipment_tree::Rows { tree, graph, equipment };
        let lists = Lists { tags: &rows, alarms: &alarm_rows, equipment: &equipment_rows };
        let mut over_scene = [0.0; 2];
        let mut asked = std::mem::take(&mut self.asked);
        asked.extend(chart_goes_to.map(Command::Reveal));
        let (chart, pointer) = (&mut self.chart, self.pointer);
        let (positions, moving) = (&overlaid.positions, &self.moving);
        let output = panels.run(input, &model, &lists, |viewport, commands| {
            let cameras = &scene.config.cameras;
            let around = Around { graph, cameras, viewport, selection: selected_bounds };
            navigator.steer(&asked, &around);
            navigator.steer(commands, &around);
            let view = navigator.camera().view(viewport, screen, graph.bounds());
            let projection = Projection::new(&view, screen);
            let sight = labels::Sight { projection, eye: view.eye };
            let began = CpuClock::start();
            let labels = labelled.labels(snapshot, graph, sight, marked);
            let labels_millis = began.millis();
            let of_alarms = |alarms| alarms::beacons(alarms, graph, sight);
            let beacons = alarming.map_or_else(Vec::new, of_alarms);
            over_scene = [labels_millis, began.millis() - labels_millis];
            SceneOverlay {
                labels,
                beacons,
                flags: flags::flags(positions, moving, snapshot, graph, sight),
                arrived: navigator.take_arrival(),
                measurement: measuring.as_ref().map(|measuring| measuring.shown(projection)),
                hovered: hovered.map(|node| graph.node(node).id()),
                chart: chart.as_mut().map(|chart| {
                    chart.point_at(pointer, projection);
                    chart.overlay(projection)
                }),
            }
        });
        self.viewport = output.viewport;
        self.obey(&output.commands);

        let mut egui = output.egui;
        let shapes = std::mem::take(&mut egui.shapes);
        let primitives = self.panels.context().tessellate(shapes, egui.pixels_per_point);
        let [labels_millis, beacons_millis] = over_scene;
        parts.panels = began.millis() - labels_millis - beacons_millis;
        let began = CpuClock::start();
        let (graph, snapshot) = (&self.scene.graph, self.tags.snapshot());
        self.highlights.update(graph, &overlaid, snapshot, &self.selection);
        let eye = self.navigator.camera().eye();
        self.ground_marks.update(graph, &self.overlays, &overlaid, snapshot, eye);
        self.ground_marks.join(self.chart.as_ref().and_then(ShownChart::polylines));
        parts.overlays += labels_millis + began.millis();
        parts.alarms += beacons_millis;
        self.part_millis = parts;
        let brushed = self.chart.as_ref().map_or_else(BTreeSet::new, ShownChart::brushed_nodes);
        self.outlines.update(&self.scene.graph, &self.selection, self.hovered, &brushed);
        self.force_detail();
        self.move_parts();
        self.move_cursors(now);
        self.update_drawn();
        let overlay = EguiFrame {
            textures_delta: &egui.textures_delta,
            primitives: &primitives,
            pixels_per_point: egui.pixels_per_point,
        };
        let prepared_millis = millis_since(started);
        let view = self.view();
        let of_nodes = self.highlights.of_nodes();
        let shown = self.picture_of(view, self.drawn.list(), of_nodes, Some(overlay));
        let shown = Frame { outlined: self.outlines.list(), ..shown };
        let (in_window, chart) = (self.in_window, &mut self.chart);
        let ground_marks = &mut self.ground_marks;
        let drawn = self.recovery.run(&mut self.renderer, &self.scene, |renderer| {
            chart.as_mut().map_or(Ok(()), |chart| chart.count(renderer))?;
            let chart = chart.as_ref().and_then(ShownChart::polylines);
            let polylines = ground_marks.polylines(chart);
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
            return Ok(FrameOutput { platform, repaint_after, trouble: self.recovery.trouble() });
        };
        self.last = drawn;
        self.painted = primitives;
        self.cpu_millis = prepared_millis + self.last.cpu_millis;
        self.note_detail();
        self.pace.note(&self.last);
        // What was never seen elsewhere rests from the first.
        self.rests = self.shown.replace(view).is_none_or(|before| before == view);
        let labelled = labelled.nodes();
        if self.labelled != labelled {
            self.picker.forget_labels();
            self.labelled = labelled;
        }
        self.states = overlaid.states;
        self.step_picks()?;
        self.count_frame(started);
        if self.frames == 1 && !self.settles {
            // What loading took, nobody needs again.
            release_freed_memory();
        }
        let root = egui.viewport_output.get(&egui::ViewportId::ROOT);
        let is_coming = self.cursors.is_morphing()
            || self.chart.as_ref().is_some_and(ShownChart::is_coming)
            || self.cursors.waiting_count() > 0 && self.last.resolved + self.last.waiting > 0;
        let repaint_after = match root {
            _ if is_coming || self.is_restless() => Duration::ZERO,
            root => root.map_or(Duration::MAX, |viewport| viewport.repaint_delay),
        };
        let trouble = self.recovery.trouble();
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

    fn note_screen(&mut self, input: &RawInput) {
        if let Some(screen) = input.screen_rect {
            self.screen = screen;
        }
        let native =
            input.viewports.get(&input.viewport_id).and_then(|v| v.native_pixels_per_point);
        self.pixels_per_point = native.unwrap_or(1.0) * self.panels.context().zoom_factor();
    }

    fn count_frame(&mut self, started: Instant) {
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

impl Drop for Viewer {
    fn drop(&mut self) {
        for plugin in self.scene.instances.values() {
            plugin.quit();
        }
    }
}
