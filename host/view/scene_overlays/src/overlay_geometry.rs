//! World geometry of overlays: flow arrows and contours, merged with the chart's lines and faces.
//! It is rebuilt when its inputs change, such as the eye position.

use busbar_overlay_picture::Contour;
use busbar_renderer::{MAX_POLYLINE_PARTS, Polylines, WorldFace, WorldStroke};
use busbar_scene::SceneGraph;
use busbar_tags::Snapshot;
use glam::{Vec3, vec2};

use crate::overlay_layers::{ContourLevel, OverlayFrame, OverlayLayers, PowerFlow};
use crate::{contour, flow_arrows};

/// Bit that distinguishes merged revisions from the chart's own.
const OVERLAY_REVISION_BIT: u64 = 1 << 63;

/// Lines and faces of a frame, kept while nothing changes.
#[derive(Default)]
pub(crate) struct OverlayGeometry {
    inputs: GeometryInputs,
    contours: Geometry,
    arrows: Geometry,
    /// Geometry of overlays and chart together.
    all: Geometry,
    /// Revision of the chart when `all` was composed.
    chart: Option<u64>,
    revision: u64,
}

#[derive(Default, PartialEq)]
struct Geometry {
    faces: Vec<WorldFace>,
    strokes: Vec<WorldStroke>,
}

/// Inputs that the geometry was computed from.
#[derive(Default)]
struct GeometryInputs {
    eye: Vec3,
    flows: Vec<(PowerFlow, bool)>,
    levels: Vec<(ContourLevel, bool)>,
}

impl OverlayGeometry {
    /// Rebuilds the geometry if overlays or the eye position have changed, and something would look
    /// otherwise.
    pub(crate) fn update(
        &mut self,
        graph: &SceneGraph,
        layers: &OverlayLayers,
        overlay_frame: &OverlayFrame,
        snapshot: Snapshot<'_>,
        (eye, pixel_at): (Vec3, &dyn Fn(f32) -> f32),
    ) {
        let is_good = |tag| snapshot.state(tag).is_some_and(|state| state.quality.is_good());
        let inputs = GeometryInputs {
            // Without arrows it does not matter who looks.
            eye: if overlay_frame.flows.is_empty() { Vec3::ZERO } else { eye },
            flows: overlay_frame.flows.iter().map(|flow| (*flow, is_good(flow.tag))).collect(),
            levels: overlay_frame.levels.iter().map(|level| (*level, is_good(level.tag))).collect(),
        };
        let mut has_changed = false;
        if inputs.levels != self.inputs.levels {
            let contours = contours(graph, layers, &inputs.levels);
            // Most levels move within their bands.
            has_changed |= contours != self.contours;
            (self.contours, self.inputs.levels) = (contours, inputs.levels);
        }
        let looks_alike = inputs.eye == self.inputs.eye
            && inputs.flows.len() == self.inputs.flows.len()
            && self.inputs.flows.iter().zip(&inputs.flows).all(|((before, was), (now, is))| {
                was == is && flow_arrows::look_alike([before, now], *is, graph, (eye, pixel_at))
            });
        if !looks_alike {
            self.arrows = Geometry::default();
            let Geometry { faces, strokes } = &mut self.arrows;
            flow_arrows::draw(&overlay_frame.flows, graph, snapshot, eye, faces, strokes);
            (self.inputs.flows, self.inputs.eye) = (inputs.flows, inputs.eye);
            has_changed = true;
        }
        if has_changed {
            self.chart = None;
        }
    }

    fn is_empty(&self) -> bool {
        let is_empty =
            |geometry: &Geometry| geometry.faces.is_empty() && geometry.strokes.is_empty();
        is_empty(&self.contours) && is_empty(&self.arrows)
    }

    /// Puts the lines and faces of a chart before its own.
    pub(crate) fn append_chart(&mut self, chart: Option<Polylines<'_>>) {
        let of_chart = chart.map_or(0, |chart| chart.revision);
        if self.is_empty() || self.chart == Some(of_chart) {
            return;
        }
        let mut all = Geometry::default();
        for geometry in [&self.contours, &self.arrows] {
            all.faces.extend_from_slice(&geometry.faces);
            all.strokes.extend_from_slice(&geometry.strokes);
        }
        if let Some(Polylines { faces, strokes, .. }) = chart {
            all.faces.extend_from_slice(faces);
            all.strokes.extend_from_slice(strokes);
        }
        // What lies behind gives way where there is too much.
        let from = |count: usize| count.saturating_sub(MAX_POLYLINE_PARTS);
        all.faces.drain(..from(all.faces.len()));
        all.strokes.drain(..from(all.strokes.len()));
        (self.all, self.chart) = (all, Some(of_chart));
        self.revision += 1;
    }

    /// Returns all lines and faces of a frame, or those of the chart alone.
    pub(crate) fn polylines<'a>(&'a self, chart: Option<Polylines<'a>>) -> Option<Polylines<'a>> {
        if self.is_empty() {
            return chart;
        }
        let Geometry { faces, strokes } = &self.all;
        let planes = chart.map_or(&[][..], |chart| chart.planes);
        Some(Polylines { revision: OVERLAY_REVISION_BIT | self.revision, faces, planes, strokes })
    }
}

/// Builds one contour for each overlay with levels.
fn contours(
    graph: &SceneGraph,
    layers: &OverlayLayers,
    levels: &[(ContourLevel, bool)],
) -> Geometry {
    let mut geometry = Geometry::default();
    for of_layer in levels.chunk_by(|(a, _), (b, _)| a.layer == b.layer) {
        let layer = layers.get(of_layer[0].0.layer);
        let described: Option<&Contour> = layer.and_then(|l| l.description().contour.as_ref());
        let Some(described) = described else { continue };
        let level = |(level, is_good): &(ContourLevel, bool)| {
            let place = graph.node(level.node).bounds()?.center();
            let value = is_good.then_some(level.value);
            Some(contour::MeasuredLevel { place: vec2(place.x, place.z), value })
        };
        let levels: Vec<contour::MeasuredLevel> = of_layer.iter().filter_map(level).collect();
        contour::draw(described, &levels, &mut geometry.faces, &mut geometry.strokes);
    }
    geometry
}
