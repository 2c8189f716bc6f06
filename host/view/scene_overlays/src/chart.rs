//! Parallel-coordinates chart in the scene: records of a plugin, brushed by the operator, and the
//! states they give to equipment.

mod density;
mod text;

use std::collections::{BTreeSet, HashMap};
use std::time::Duration;

use busbar_chart::{
    Action, Brush, ChartSelection, Explanation, ParallelCoordinates, Shape, Size, nearest,
};
use busbar_config::ChartConfig;
use busbar_plugin_host::wall_clock;
use busbar_renderer::{
    MAX_POLYLINE_PARTS, Polylines, RenderError, Renderer, WorldFace, WorldStroke,
};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{ChartReader, ExplanationRequest};
use busbar_ui::{ChartCommand, ChartOverlay, ProjectedChartAxis};
use egui::Pos2;
use glam::{Affine3A, Quat};

use crate::overlay_layers::{NodeState, StateBasis};
use busbar_camera::Projection;
use density::Density;

/// Greatest distance at which the pointer picks a polyline, points.
const PICK_DISTANCE: f32 = 6.0;
/// The longest that a frame without a window waits for an explanation.
const EXPLANATION_TIMEOUT: Duration = Duration::from_secs(2);

/// A chart in the scene.
pub struct SceneChart {
    board: ParallelCoordinates,
    /// [`ChartData::number`](busbar_site::ChartData::number) of the records shown.
    last_read: u64,
    world_from_chart: Affine3A,
    follows: bool,
    settles: bool,
    /// The node of each piece of equipment, and the other way.
    nodes: Vec<Option<NodeIndex>>,
    equipment: HashMap<NodeIndex, usize>,
    /// Last known record of each piece of equipment in the last frame.
    known: Vec<Option<ChartSelection>>,
    hovered: Option<usize>,
    /// Projected axes of the last frame.
    projected_axes: Vec<ProjectedChartAxis>,
    /// Equipment index and its explanation.
    explained: Option<(usize, Explanation)>,
    geometry: ChartGeometry,
    density: Density,
    seconds: f64,
}

/// Geometry of the chart, cached until the board changes.
#[derive(Default)]
struct ChartGeometry {
    /// Board revision of the cached geometry.
    revision: Option<u64>,
    shape: Shape,
    faces: Vec<WorldFace>,
    strokes: Vec<WorldStroke>,
}

impl SceneChart {
    /// Creates a chart as it is configured. One that `settles` has the first records at once.
    pub(crate) fn new(
        config: &ChartConfig,
        reader: &ChartReader,
        graph: &SceneGraph,
        settles: bool,
    ) -> Self {
        let [width, height, depth] = config.size.map(|metres| metres as f32);
        let turn = Quat::from_rotation_y((config.yaw_degrees as f32).to_radians());
        let position = graph.point_from_world(config.position);
        let mut shown = Self {
            board: ParallelCoordinates::new(Size { width, height, depth }),
            last_read: 0,
            world_from_chart: Affine3A::from_rotation_translation(turn, position),
            follows: config.follows,
            settles,
            nodes: Vec::new(),
            equipment: HashMap::new(),
            known: Vec::new(),
            hovered: None,
            projected_axes: Vec::new(),
            explained: None,
            geometry: ChartGeometry::default(),
            density: Density::default(),
            seconds: 0.0,
        };
        if settles {
            shown.take(reader, graph);
        }
        shown
    }

    /// Takes the data that the site has read.
    fn take(&mut self, reader: &ChartReader, graph: &SceneGraph) {
        let Some(read) = reader.take() else { return };
        self.last_read = read.number;
        self.board.set_data(read.description, read.records);
        self.find_equipment(graph);
        let absent = self.nodes.iter().filter(|node| node.is_none()).count();
        if absent > 0 {
            tracing::warn!("{absent} pieces of equipment of the chart are not in the scene");
        }
        self.hovered = None;
    }

    /// Finds the equipment's nodes in a scene with other indices.
    pub(crate) fn find_equipment(&mut self, graph: &SceneGraph) {
        let ids = &self.board.description().equipment;
        self.nodes = ids.iter().map(|id| graph.find(id)).collect();
        let there = self.nodes.iter().enumerate();
        self.equipment = there.filter_map(|(at, node)| Some(((*node)?, at))).collect();
    }

    /// Steps the chart to a frame: takes new data and advances playback. Returns the equipment to
    /// visit if one of its records has become abnormal.
    pub(crate) fn step(
        &mut self,
        reader: &ChartReader,
        graph: &SceneGraph,
        seconds: f64,
    ) -> Option<String> {
        self.take(reader, graph);
        self.board.advance(seconds - self.seconds);
        self.seconds = seconds;
        let known: Vec<ChartSelection> = self.board.known(wall_clock().0).collect();
        let mut by_equipment = vec![None; self.board.records().equipment_count()];
        known.iter().for_each(|one| by_equipment[one.equipment] = Some(*one));
        let before = std::mem::replace(&mut self.known, by_equipment);
        let record_before = |equipment: usize| Some((*before.get(equipment)?)?.record);
        let legend = &self.board.description().legend;
        let is_new = |one: &&ChartSelection| {
            let abnormal = one.state.is_some_and(|state| legend[state as usize].is_abnormal);
            abnormal && record_before(one.equipment) != Some(one.record)
        };
        let newest = known.iter().filter(is_new).max_by_key(|one| (one.state, -one.age_nanos));
        let id = newest.map(|one| self.board.description().equipment[one.equipment].clone());
        id.filter(|_| self.follows)
    }

    /// Selects the records of the selected equipment, and requests its explanation.
    pub(crate) fn follow_selection(
        &mut self,
        reader: &ChartReader,
        graph: &SceneGraph,
        nodes: &BTreeSet<NodeIndex>,
    ) {
        let equipment: BTreeSet<usize> =
            nodes.iter().filter_map(|node| self.equipment_at(graph, *node)).collect();
        let only = equipment.first().copied().filter(|_| nodes.len() == 1);
        self.board.select(equipment);
        let known = only.and_then(|one| *self.known.get(one)?);
        let Some(ChartSelection { equipment, record, .. }) = known else {
            self.explained = None;
            return;
        };
        let question = ExplanationRequest {
            equipment: self.board.description().equipment[equipment].clone(),
            unix_nanos: self.board.records().all()[record].unix_nanos,
            read: self.last_read,
        };
        let timeout = if self.settles { EXPLANATION_TIMEOUT } else { Duration::ZERO };
        match reader.explain(&question, timeout) {
            Some(Ok(explanation)) => {
                let states = self.board.description().legend.len();
                let fits = (explanation.state as usize) < states;
                self.explained = fits.then_some((equipment, explanation));
            }
            Some(Err(_)) => self.explained = None,
            // What is said of another record must not stand in for the answer.
            None => self.explained.take_if(|(shown, _)| *shown != equipment).map_or((), drop),
        }
    }

    /// The equipment that a node is, or is part of.
    fn equipment_at(&self, graph: &SceneGraph, node: NodeIndex) -> Option<usize> {
        let mut at = Some(node);
        while let Some(here) = at {
            if let Some(equipment) = self.equipment.get(&here) {
                return Some(*equipment);
            }
            at = graph.node(here).parent();
        }
        None
    }

    /// The states that its records put equipment in.
    pub(crate) fn states(&self) -> impl Iterator<Item = NodeState> + '_ {
        self.known.iter().flatten().filter_map(|one| {
            let node = (*self.nodes.get(one.equipment)?)?;
            let state = self.board.records().all()[one.record].state;
            let state = self.board.description().legend.get(state as usize)?;
            let basis = StateBasis::Record { is_valid: one.state.is_some() };
            Some(NodeState {
                node,
                basis,
                color: state.color,
                pattern: state.pattern,
                legend: None,
            })
        })
    }

    /// Nodes of the equipment whose last known record is brushed.
    pub(crate) fn brushed_nodes(&self) -> BTreeSet<NodeIndex> {
        self.brushed_known().filter_map(|one| self.nodes[one.equipment]).collect()
    }

    fn brushed_known(&self) -> impl Iterator<Item = &ChartSelection> {
        self.known.iter().flatten().filter(|one| self.board.is_brushed(one.record))
    }

    /// Performs a command of the operator; returns a text for the clipboard.
    pub fn apply(&mut self, command: &ChartCommand) -> Option<String> {
        match command {
            ChartCommand::Apply(action) => self.board.apply(action),
            ChartCommand::BrushAt { shown, positions, alone } => {
                if let Some(brush) = self.board.brush_at(*shown, *positions) {
                    self.board.apply(&Action::AddBrush { brush, alone: *alone });
                }
            }
            ChartCommand::BrushRise { shown, range } => {
                let views = self.board.shown_axes();
                if let [from, to, ..] = views.get(*shown..).unwrap_or_default() {
                    let brush = Brush::Rise { axes: [from.axis, to.axis], range: *range };
                    self.board.apply(&Action::AddBrush { brush, alone: true });
                }
            }
            ChartCommand::Follow(follows) => self.follows = *follows,
            ChartCommand::Copy => return Some(self.board.csv()),
        }
        None
    }

    /// Updates the geometry if the board has changed.
    pub(crate) fn update_geometry(&mut self) {
        let revision = self.board.revision();
        if self.geometry.revision == Some(revision) {
            return;
        }
        let shape = self.board.shape(wall_clock().0);
        let world = |at: [f32; 3]| self.world_from_chart.transform_point3(at.into());
        let face = |face: &busbar_chart::Face| WorldFace {
            corners: face.corners.map(world),
            color: face.color,
            cover: face.cover,
        };
        let stroke = |stroke: &busbar_chart::Stroke| WorldStroke {
            from: world(stroke.from),
            to: world(stroke.to),
            width: stroke.width,
            color: stroke.color,
            cover: stroke.cover,
            pattern: stroke.pattern as u32,
        };
        // What lies behind gives way where there is too much.
        let from = |count: usize| count.saturating_sub(MAX_POLYLINE_PARTS);
        let faces = shape.faces[from(shape.faces.len())..].iter().map(face).collect();
        let strokes = shape.strokes[from(shape.strokes.len())..].iter().map(stroke).collect();
        self.geometry = ChartGeometry { revision: Some(revision), faces, strokes, shape };
    }

    /// Continues the density count of records that are too many for single lines.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub(crate) fn count(&mut self, renderer: &mut Renderer) -> Result<(), RenderError> {
        let counted = (&self.board, self.last_read);
        self.density.advance(renderer, counted, self.world_from_chart, self.settles)
    }

    /// Reports whether it shows an instant of the past, and not the present.
    pub fn shows_past(&self) -> bool {
        self.board.playhead().is_some()
    }

    /// Reports whether the chart will change by itself: counting or playback is under way.
    pub(crate) fn needs_frames(&self) -> bool {
        self.density.needs_frames() || self.board.plays()
    }

    /// Returns the lines and faces of the chart.
    pub(crate) fn polylines(&self) -> Option<Polylines<'_>> {
        let ChartGeometry { revision, faces, strokes, .. } = &self.geometry;
        let planes = self.density.planes();
        Some(Polylines { revision: (*revision)?, faces, planes, strokes })
    }

    /// Picks the polyline under the pointer.
    pub(crate) fn point_at(&mut self, pointer: Option<Pos2>, projection: Projection) {
        self.hovered = pointer.and_then(|pointer| self.record_at(pointer, projection));
    }

    fn record_at(&self, pointer: Pos2, projection: Projection) -> Option<usize> {
        let project = |at| self.on_screen(at, projection).map(|at| [at.x, at.y]);
        nearest(&self.geometry.shape, project, [pointer.x, pointer.y], PICK_DISTANCE)
    }

    /// Returns the node of the equipment whose line is at a place on the screen.
    pub fn node_at(&self, pointer: Pos2, projection: Projection) -> Option<NodeIndex> {
        let record = self.record_at(pointer, projection)?;
        self.nodes[self.board.records().all()[record].equipment as usize]
    }

    fn on_screen(&self, at: [f32; 3], projection: Projection) -> Option<Pos2> {
        projection.to_screen(self.world_from_chart.transform_point3(at.into()))
    }

    /// Returns the parts of the chart that are painted over the scene.
    pub(crate) fn overlay(&mut self, projection: Projection) -> ChartOverlay {
        let overlay = text::overlay(self, projection);
        self.projected_axes.clone_from(&overlay.axes);
        overlay
    }

    /// Returns the view model of the chart panel.
    pub fn model(&self, reader: &ChartReader) -> busbar_ui::ChartModel {
        text::model(self, reader.fault())
    }

    /// Returns the explanation of the selected equipment.
    pub fn verdict(&self) -> Option<busbar_ui::EquipmentExplanation> {
        text::explained(self)
    }

    /// Returns the chart's part of the statistics.
    pub fn stats(&self, reader: &ChartReader) -> crate::chart_stats::ChartStats {
        text::stats(self, reader.fault())
    }
}
