//! Overlays of the scene: what the site's overlays, alarms and chart put on equipment and over it.

use std::collections::BTreeSet;
use std::sync::Arc;

use busbar_renderer::{OutlinedObject, Polylines, RenderError, Renderer};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{ChartReader, CpuClock, Site};
use busbar_ui::{AlarmMarker, ChartOverlay, Label, SwitchSymbol};
use egui::Pos2;
use glam::Vec3;

use crate::alarm_markers::{alarm_markers, nodes_in_alarm};
use crate::chart::SceneChart;
use crate::highlight::Highlights;
use crate::labels::{LabelContext, LinesByNode, OverlayCamera};
use crate::moving_parts::MovingParts;
use crate::outlines::Outlines;
use crate::overlay_geometry::OverlayGeometry;
use crate::overlay_layers::{NodeState, OverlayFrame, OverlayLayers};
use crate::switch_symbols;
use busbar_scene_loader::LoadedScene;

/// Overlays of the scene, with what they drew in the last frame.
pub struct SceneOverlays {
    /// Layers that show the overlays of the site.
    pub layers: OverlayLayers,
    /// Parts that move with switches.
    moving_parts: MovingParts,
    /// Chart in the scene; none without a configured one.
    chart: Option<SceneChart>,
    highlights: Highlights,
    outlines: Outlines,
    geometry: OverlayGeometry,
    /// States of the last frame.
    states: Vec<NodeState>,
    /// Nodes that labels of the last frame stand at.
    labelled: Vec<NodeIndex>,
    /// Nodes among them that are behind other equipment.
    hidden_labels: BTreeSet<NodeIndex>,
}

/// Content over the scene in one frame.
pub struct OverSceneContent<'a> {
    /// Labels at the equipment.
    pub labels: Vec<Label<'a>>,
    /// Markers at equipment in alarm.
    pub alarm_markers: Vec<AlarmMarker>,
    /// Symbols of switch positions.
    pub switch_symbols: Vec<SwitchSymbol>,
    /// Texts and axes of the chart.
    pub chart: Option<ChartOverlay>,
    /// CPU time of the labels and of the alarm markers, milliseconds.
    pub millis: [f64; 2],
}

impl SceneOverlays {
    /// Creates the overlays of a scene and its site. A chart that `settles` has its first records at
    /// once.
    pub fn new(scene: &LoadedScene, site: &Site, settles: bool) -> Self {
        Self {
            layers: OverlayLayers::new(site),
            moving_parts: MovingParts::new(Arc::clone(&scene.moving_parts)),
            chart: chart_of(scene, site.chart(), settles),
            highlights: Highlights::default(),
            outlines: Outlines::default(),
            geometry: OverlayGeometry::default(),
            states: Vec::new(),
            labelled: Vec::new(),
            hidden_labels: BTreeSet::new(),
        }
    }

    /// Replaces the chart at a reload.
    pub fn replace_chart(&mut self, chart: Option<SceneChart>) {
        self.chart = chart;
    }

    /// Adapts to a reloaded scene with other nodes.
    pub fn reset(&mut self, scene: &LoadedScene) {
        self.moving_parts = MovingParts::new(Arc::clone(&scene.moving_parts));
        (self.labelled, self.hidden_labels) = (Vec::new(), BTreeSet::new());
        (self.highlights, self.outlines) = (Highlights::default(), Outlines::default());
        (self.geometry, self.states) = (OverlayGeometry::default(), Vec::new());
        if let Some(chart) = &mut self.chart {
            chart.find_equipment(&scene.graph);
        }
    }

    /// Assembles what overlays and alarms show in a frame, and moves the parts of switches.
    pub fn assemble(&mut self, site: &Site, graph: &mut Arc<SceneGraph>) -> OverlayFrame {
        let mut frame = self.layers.frame(site, graph);
        if let Some(alarms) = site.alarms() {
            let listing = alarms.listing();
            frame.tints.extend_from_slice(listing.tints());
            frame.judged_tints.extend_from_slice(listing.judged_tints());
        }
        let unknown = self.moving_parts.update(graph, &frame.positions, site.snapshot());
        frame.states.extend_from_slice(unknown);
        frame
    }

    /// Steps the chart to the time of a frame. Returns the equipment to visit if one of its records
    /// has become abnormal.
    pub fn step_chart(&mut self, site: &Site, graph: &SceneGraph, seconds: f64) -> Option<String> {
        let (chart, reader) = self.chart.as_mut().zip(site.chart())?;
        chart.step(reader, graph, seconds)
    }

    /// Adds the chart's states to a frame, and lets the chart follow the selection.
    pub fn add_chart(
        &mut self,
        site: &Site,
        graph: &SceneGraph,
        selection: &BTreeSet<NodeIndex>,
        frame: &mut OverlayFrame,
    ) {
        let Some((chart, reader)) = self.chart.as_mut().zip(site.chart()) else { return };
        // Of several the last one shows: what tags say now comes after records.
        frame.states.splice(0..0, chart.states());
        chart.follow_selection(reader, graph, selection);
        chart.update_geometry();
    }

    /// Returns the content over the scene, as a camera sees it.
    pub fn content_over_scene<'a>(
        &mut self,
        site: &Site,
        graph: &SceneGraph,
        (frame, lines): (&OverlayFrame, &LinesByNode<'a>),
        camera: OverlayCamera,
        (selection, pointer): (&BTreeSet<NodeIndex>, Option<Pos2>),
    ) -> OverSceneContent<'a> {
        let (snapshot, alarms) = (site.snapshot(), site.alarms());
        let alarmed = alarms.map(nodes_in_alarm).unwrap_or_default();
        let marked = LabelContext { selection, hidden: &self.hidden_labels, alarmed: &alarmed };
        let began = CpuClock::start();
        let labels = lines.labels(snapshot, graph, camera, marked);
        let labels_millis = began.millis();
        let markers = |alarms| alarm_markers(alarms, graph, camera);
        let alarm_markers = alarms.map_or_else(Vec::new, markers);
        let millis = [labels_millis, began.millis() - labels_millis];
        let switch_symbols = switch_symbols::switch_symbols(
            &frame.positions,
            &self.moving_parts,
            snapshot,
            graph,
            camera,
        );
        let chart = self.chart.as_mut().map(|chart| {
            chart.point_at(pointer, camera.projection);
            chart.overlay(camera.projection)
        });
        OverSceneContent { labels, alarm_markers, switch_symbols, chart, millis }
    }

    /// Updates highlights and geometry to a frame, as seen from `eye`, world space in metres.
    /// `pixel_at` gives the size of a pixel at a distance from it, both in metres; 0 draws each
    /// change, however small.
    pub fn update_graphics(
        &mut self,
        site: &Site,
        graph: &SceneGraph,
        frame: &OverlayFrame,
        selection: &BTreeSet<NodeIndex>,
        (eye, pixel_at): (Vec3, &dyn Fn(f32) -> f32),
    ) {
        let snapshot = site.snapshot();
        self.highlights.update(graph, frame, snapshot, selection);
        self.geometry.update(graph, &self.layers, frame, snapshot, (eye, pixel_at));
        self.geometry.append_chart(self.chart.as_ref().and_then(SceneChart::polylines));
    }

    /// Updates the outlines of selected, hovered and brushed equipment.
    pub fn update_outlines(
        &mut self,
        graph: &SceneGraph,
        selection: &BTreeSet<NodeIndex>,
        hovered: Option<NodeIndex>,
    ) {
        let brushed = self.chart.as_ref().map_or_else(BTreeSet::new, SceneChart::brushed_nodes);
        self.outlines.update(graph, selection, hovered, &brushed);
    }

    /// Continues the density count of a chart, before a frame is drawn.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn count_chart(&mut self, renderer: &mut Renderer) -> Result<(), RenderError> {
        self.chart.as_mut().map_or(Ok(()), |chart| chart.count(renderer))
    }

    /// Returns the lines and faces of overlays and chart.
    pub fn polylines(&self) -> Option<Polylines<'_>> {
        self.geometry.polylines(self.chart.as_ref().and_then(SceneChart::polylines))
    }

    /// Returns the outlined objects.
    pub fn outlined(&self) -> &[OutlinedObject] {
        self.outlines.list()
    }

    /// Returns the highlights of the nodes.
    pub fn highlights(&self) -> &Highlights {
        &self.highlights
    }

    /// Notes what a frame showed that was drawn; reports whether labels stand at other nodes than
    /// before.
    pub fn note_frame(&mut self, frame: OverlayFrame, labelled: Vec<NodeIndex>) -> bool {
        self.states = frame.states;
        let is_new = self.labelled != labelled;
        self.labelled = labelled;
        is_new
    }

    /// Returns the states of the last frame.
    pub fn states(&self) -> &[NodeState] {
        &self.states
    }

    /// Returns the nodes that labels of the last frame stand at.
    pub fn labelled(&self) -> &[NodeIndex] {
        &self.labelled
    }

    /// Returns the nodes whose labels are behind other equipment.
    pub fn hidden_labels(&self) -> &BTreeSet<NodeIndex> {
        &self.hidden_labels
    }

    /// Sets the nodes whose labels are behind other equipment.
    pub fn set_hidden_labels(&mut self, hidden: BTreeSet<NodeIndex>) {
        self.hidden_labels = hidden;
    }

    /// Returns the parts that move with switches.
    pub fn moving_parts(&self) -> &MovingParts {
        &self.moving_parts
    }

    /// Returns the chart in the scene.
    pub fn chart(&self) -> Option<&SceneChart> {
        self.chart.as_ref()
    }

    /// Returns the chart in the scene, to arrange it.
    pub fn chart_mut(&mut self) -> Option<&mut SceneChart> {
        self.chart.as_mut()
    }

    /// Reports whether a part moves or the chart changes by itself.
    pub fn needs_frames(&self) -> bool {
        !self.moving_parts.just_moved().is_empty()
            || self.chart.as_ref().is_some_and(SceneChart::needs_frames)
    }
}

/// Creates the configured chart on the reader of its records.
pub fn chart_of(
    scene: &LoadedScene,
    reader: Option<&ChartReader>,
    settles: bool,
) -> Option<SceneChart> {
    let config = scene.config.chart.as_ref()?;
    Some(SceneChart::new(config, reader?, &scene.graph, settles))
}
