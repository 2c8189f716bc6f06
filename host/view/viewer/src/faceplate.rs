//! The piece of equipment that is looked at, with all that is known of it.

use std::collections::HashSet;
use std::time::Duration;

use busbar_alarms::AlarmHandle;
use busbar_history::{History, Point, PointState};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{OriginInterval, Site, VerdictText};
use busbar_tags::{HandleRemap, Moment, Snapshot, SourceTime, TagHandle, TagState};
use busbar_types::{Origin, Quality, Reason, Severity, Verdict};
use busbar_ui::{
    Age, Faceplate, FaceplateState, FaceplateValue, LegendRow, Trend, TrendOrigin, TrendPoint,
    TrendState, ValueMark,
};
use jiff::Timestamp;
use jiff::tz::TimeZone;

use crate::alarms;
use crate::equipment_tree::EquipmentTree;
use crate::panel_rows::TagListRows;
use crate::records::EquipmentRecords;
use busbar_scene_loader::LoadedScene;
use busbar_scene_overlays::SceneChart;
use busbar_scene_overlays::mark;
use busbar_scene_overlays::{NodeState, OverlayLayers, StateBasis};

/// Nodes at or below a device that are looked at; a bay has some hundred.
const MAX_NODES: usize = 20_000;
/// Live values of a faceplate.
const MAX_VALUES: usize = 60;
/// Alarms of a faceplate that are not normal.
const MAX_ALARMS: usize = 30;
/// States of a faceplate.
const MAX_STATES: usize = 24;
/// Trends of a faceplate.
const MAX_TRENDS: usize = 6;
/// Trends that it begins with.
const FIRST_TRENDS: usize = 3;
/// Columns that a trend is drawn in: about as wide as it is, points.
const TREND_COLUMNS: usize = 240;
/// Initial time span of trends.
pub(crate) const FIRST_SPAN: Duration = Duration::from_secs(600);

const NANOS_PER_SECOND: f64 = 1e9;

/// Color of an abnormal verdict, sRGB: that of a warning in legends.
const ABNORMAL: [u8; 3] = [0xd9, 0x8a, 0x1c];
/// Color of a verdict that requires no action, sRGB.
const NEUTRAL: [u8; 3] = [0x8a, 0x8f, 0x96];

/// Bindings and alarms by node, sorted for binary search.
#[derive(Debug, Default)]
pub(crate) struct NodeAttachments {
    bindings: Vec<(NodeIndex, u32)>,
    alarms: Vec<(NodeIndex, u32)>,
}

impl NodeAttachments {
    pub(crate) fn new(scene: &LoadedScene) -> Self {
        let bindings = scene.bindings.iter().zip(0..);
        let mut bindings: Vec<_> = bindings.map(|(binding, index)| (binding.node, index)).collect();
        let alarms = scene.alarms.nodes.iter().zip(0..);
        let mut alarms: Vec<_> =
            alarms.filter_map(|(node, index)| Some(((*node)?, index))).collect();
        bindings.sort_unstable();
        alarms.sort_unstable();
        Self { bindings, alarms }
    }

    /// Returns all nodes with a binding or an alarm.
    pub(crate) fn nodes(&self) -> HashSet<NodeIndex> {
        self.bindings.iter().chain(&self.alarms).map(|(node, _)| *node).collect()
    }
}

fn at<'a>(all: &'a [(NodeIndex, u32)], node: NodeIndex) -> impl Iterator<Item = u32> + use<'a> {
    let first = all.partition_point(|(other, _)| *other < node);
    all[first..].iter().take_while(move |(other, _)| *other == node).map(|(_, index)| *index)
}

/// A faceplate between frames: what does not change while it is open.
#[derive(Debug)]
pub(crate) struct OpenFaceplate {
    pub(crate) device: NodeIndex,
    /// Device and its descendants.
    nodes: HashSet<NodeIndex>,
    id: String,
    name: String,
    within: Vec<String>,
    aliases: Vec<String>,
    values: Vec<(TagHandle, Option<String>)>,
    more_values: usize,
    alarms: Vec<AlarmHandle>,
    trended: Vec<TagHandle>,
    /// Records of business and asset management systems.
    pub(crate) records: EquipmentRecords,
}

/// Inputs of a faceplate in one frame.
pub(crate) struct FaceplateInputs<'a> {
    pub(crate) scene: &'a LoadedScene,
    pub(crate) snapshot: Snapshot<'a>,
    pub(crate) rows: &'a TagListRows<'a>,
    pub(crate) alarms: alarms::AlarmListRows<'a>,
    pub(crate) site: &'a Site,
    pub(crate) layers: &'a OverlayLayers,
    pub(crate) states: &'a [NodeState],
    pub(crate) chart: Option<&'a SceneChart>,
    pub(crate) span: Duration,
    pub(crate) now: Moment,
    pub(crate) wall_clock: SourceTime,
}

impl OpenFaceplate {
    /// Opens the faceplate of a device.
    pub(crate) fn open(
        scene: &LoadedScene,
        node_attachments: &NodeAttachments,
        tree: &EquipmentTree,
        history: &History,
        device: NodeIndex,
    ) -> Self {
        let graph = &scene.graph;
        let mut nodes: Vec<NodeIndex> = tree.below(device).take(MAX_NODES).collect();
        nodes.insert(0, device);
        let mut seen = HashSet::new();
        let mut values = Vec::new();
        let mut more_values = 0;
        let mut alarms = Vec::new();
        let mut records = EquipmentRecords::default();
        for &node in &nodes {
            let aliases = scene.equipment.names(node).map_or(&[][..], |names| &names.aliases);
            let ids = [graph.node(node).id()].into_iter().chain(aliases.iter().cloned());
            records.add(ids, place(graph, device, node).as_deref());
            alarms.extend(at(&node_attachments.alarms, node).map(AlarmHandle));
            for binding in at(&node_attachments.bindings, node) {
                let tag = scene.bindings[binding as usize].tag;
                match seen.insert(tag) {
                    true if values.len() < MAX_VALUES => {
                        values.push((tag, place(graph, device, node)));
                    }
                    true => more_values += 1,
                    false => {}
                }
            }
        }
        let with_history = values.iter().map(|(tag, _)| *tag).filter(|tag| history.has(*tag));
        let trended = with_history.take(FIRST_TRENDS).collect();
        let above =
            std::iter::successors(graph.node(device).parent(), |node| graph.node(*node).parent());
        let mut within: Vec<String> = above.map(|node| graph.node(node).id()).collect();
        within.reverse();
        let names = scene.equipment.names(device).cloned().unwrap_or_default();
        Self {
            device,
            nodes: nodes.into_iter().collect(),
            id: graph.node(device).id(),
            name: names.name,
            within,
            aliases: names.aliases,
            values,
            more_values,
            alarms,
            trended,
            records,
        }
    }

    /// Shows the trends that another showed, of the values that it has.
    pub(crate) fn keep_trends(&mut self, before: &Self, numbers: &HandleRemap) {
        let has = |tag: &TagHandle| self.values.iter().any(|(own, _)| own == tag);
        let kept = before.trended.iter().filter_map(|tag| numbers.tag(*tag)).filter(has);
        self.trended = kept.collect();
    }

    /// Shows the trend of a value, the oldest shown gives way; or shows it no longer.
    pub(crate) fn toggle_trend(&mut self, tag: TagHandle) {
        match self.trended.iter().position(|other| *other == tag) {
            Some(at) => drop(self.trended.remove(at)),
            None => {
                if self.trended.len() >= MAX_TRENDS {
                    self.trended.remove(0);
                }
                self.trended.push(tag);
            }
        }
    }

    /// Returns the view model for this frame.
    pub(crate) fn model(&self, inputs: &FaceplateInputs<'_>) -> Faceplate {
        let (alarms, calm_alarms) =
            inputs.alarms.for_equipment(&self.alarms, &self.nodes, MAX_ALARMS);
        Faceplate {
            id: self.id.clone(),
            name: self.name.clone(),
            within: self.within.clone(),
            aliases: self.aliases.clone(),
            alarms,
            calm_alarms,
            verdict: inputs.chart.and_then(SceneChart::verdict),
            states: self.states(inputs),
            values: self.values.iter().map(|value| self.value(value, inputs)).collect(),
            more_values: self.more_values,
            trends: self.trends(inputs),
            records: self.records.sections(),
            trend_span: inputs.span,
        }
    }

    fn value(
        &self,
        (tag, place): &(TagHandle, Option<String>),
        inputs: &FaceplateInputs<'_>,
    ) -> FaceplateValue {
        let is_trended = self.trended.contains(tag);
        FaceplateValue {
            tag: tag.0,
            row: inputs.rows.of_tag(*tag),
            place: place.clone(),
            is_trended: inputs.site.history().has(*tag).then_some(is_trended),
        }
    }

    fn states(&self, inputs: &FaceplateInputs<'_>) -> Vec<FaceplateState> {
        let graph = &inputs.scene.graph;
        let tag_of = |shown: &NodeState| match shown.basis {
            StateBasis::Tag(tag) => inputs.snapshot.state(tag),
            StateBasis::Record { .. } => None,
        };
        let is_good =
            |tag: &Option<TagState>| tag.as_ref().is_some_and(|tag| tag.quality.is_good());
        let of_run = |run: &[NodeState]| {
            let shown = run.last()?;
            let (overlay, entry) = shown.legend?;
            let layer = inputs.layers.get(overlay)?;
            // It is worth what the worst is that it rests on.
            let worst = run.iter().map(tag_of).find(|tag| !is_good(tag));
            let tag = worst.unwrap_or_else(|| tag_of(shown));
            let quality =
                tag.as_ref().map_or(Quality::Bad(Reason::NotConnected), |tag| tag.quality);
            let origins = run.iter().filter_map(tag_of).map(|tag| tag.origin);
            let is_late = run.iter().any(NodeState::is_late);
            Some(FaceplateState {
                layer: layer.name().to_owned(),
                state: layer.legend().get(entry as usize)?.clone(),
                place: place(graph, self.device, shown.node),
                mark: if is_late {
                    ValueMark::LateDisplay
                } else {
                    mark(quality, Severity::Normal)
                },
                age: tag.and_then(|tag| tag.age).map(Age::from),
                origin: origins.fold(Origin::LIVE, Origin::union),
            })
        };
        let runs = inputs.states.chunk_by(NodeState::is_same);
        let own = runs.filter(|run| run.first().is_some_and(|of| self.nodes.contains(&of.node)));
        self.verdicts(inputs).chain(own.filter_map(of_run)).take(MAX_STATES).collect()
    }

    /// Verdicts of the overlays on the device and its parts, the unknown ones first.
    fn verdicts(
        &self,
        inputs: &FaceplateInputs<'_>,
    ) -> impl Iterator<Item = FaceplateState> + use<> {
        let mut states = Vec::new();
        for (layer, overlay) in inputs.layers.with_overlays(inputs.site) {
            let verdicts = overlay.verdicts();
            for equipment in 0..verdicts.len() {
                let node = layer.node_of(equipment).filter(|node| self.nodes.contains(node));
                let Some(node) = node else { continue };
                let verdict = verdicts.verdict(equipment, inputs.site.tags(), inputs.snapshot);
                let place = place(&inputs.scene.graph, self.device, node);
                let state = verdict_state(layer.name(), place, &verdict);
                states.push((verdict.verdict != Verdict::Unknown, state));
            }
        }
        states.sort_by_key(|(is_known, _)| *is_known);
        states.into_iter().map(|(_, state)| state)
    }

    fn trends(&self, inputs: &FaceplateInputs<'_>) -> Vec<Trend> {
        let local_seconds = local_seconds(inputs.wall_clock);
        let from = inputs.now.before(inputs.span);
        let of_tag = |(tag, place): &(TagHandle, Option<String>)| {
            let spec = inputs.scene.tags.spec(*tag)?;
            let limits = inputs.scene.config.tags.get(&spec.id).map(|tag| tag.limits);
            let points = inputs.site.history().between(*tag, from, inputs.now, TREND_COLUMNS);
            let points = points.iter().map(|point| trend_point(point, inputs.now)).collect();
            let origins = inputs.site.origins().between(*tag, from, inputs.now);
            let title = place.iter().map(String::as_str).chain([spec.name.as_str()]);
            Some(Trend {
                tag: tag.0,
                title: title.collect::<Vec<_>>().join("  "),
                unit: spec.unit.clone(),
                local_seconds,
                points,
                limits: limits.map_or([None; 2], |limits| [limits.low, limits.high]),
                origins: origins.iter().map(|origin| trend_origin(origin, inputs.now)).collect(),
            })
        };
        let shown = self.values.iter().filter(|(tag, _)| self.trended.contains(tag));
        shown.filter_map(of_tag).collect()
    }
}

/// A verdict as a row of a faceplate.
fn verdict_state(layer: &str, place: Option<String>, verdict: &VerdictText<'_>) -> FaceplateState {
    let name = match (verdict.verdict, verdict.reason.as_ref()) {
        (Verdict::Unknown, _) => "unknown".to_owned(),
        (known, "") => known.name().to_owned(),
        (known, reason) => format!("{}: {reason}", known.name()),
    };
    let color = match verdict.verdict {
        Verdict::Abnormal => ABNORMAL,
        Verdict::Normal | Verdict::Unknown => NEUTRAL,
    };
    FaceplateState {
        layer: layer.to_owned(),
        state: LegendRow { name, color, pattern: busbar_types::Pattern::Solid },
        place,
        mark: match verdict.verdict {
            Verdict::Unknown => ValueMark::Bad { reason: verdict.reason.clone().into_owned() },
            Verdict::Normal | Verdict::Abnormal => ValueMark::Normal,
        },
        age: None,
        origin: verdict.origin,
    }
}

fn trend_point(point: &Point, now: Moment) -> TrendPoint {
    let state = match point.state {
        PointState::Good(value) => TrendState::Good(value),
        PointState::Uncertain(value) => TrendState::Uncertain(value),
        PointState::Bad => TrendState::Bad,
    };
    TrendPoint { at: -now.since(point.at).as_secs_f64(), state }
}

fn trend_origin(interval: &OriginInterval, now: Moment) -> TrendOrigin {
    let OriginInterval { start, end, origin } = *interval;
    TrendOrigin { span: [start, end].map(|at| -now.since(at).as_secs_f64()), origin }
}

/// Returns the local time as seconds since 1970-01-01 00:00 local time.
fn local_seconds(wall_clock: SourceTime) -> f64 {
    let seconds = wall_clock.0 as f64 / NANOS_PER_SECOND;
    let timestamp = Timestamp::from_second(seconds as i64).unwrap_or_default();
    seconds + f64::from(TimeZone::system().to_offset(timestamp).seconds())
}

/// Returns the id of a node relative to its device; none for the device itself.
fn place(graph: &SceneGraph, device: NodeIndex, node: NodeIndex) -> Option<String> {
    if node == device {
        return None;
    }
    let (device, node) = (graph.node(device).id(), graph.node(node).id());
    let rest = node.strip_prefix(device.as_str()).unwrap_or(&node);
    Some(rest.trim_start_matches(['-', '/']).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_keeps_the_origin_of_its_values() {
        for verdict in [Verdict::Normal, Verdict::Abnormal, Verdict::Unknown] {
            for origin in [Origin::LIVE, Origin::SIMULATED, Origin::RECORDED | Origin::TEST] {
                let text = VerdictText {
                    verdict,
                    severity: None,
                    is_assumed: false,
                    was_abnormal: false,
                    reason: "".into(),
                    origin,
                };
                assert_eq!(verdict_state("condition", None, &text).origin, origin);
            }
        }
    }
}
