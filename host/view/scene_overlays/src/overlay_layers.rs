//! Overlay layers: pictures of the site's overlays on the nodes of the scene, as far as the operator
//! shows them.

use std::sync::Arc;

use busbar_overlay_picture::{
    LegendEntry, OverlayDescription, OverlayLine, OverlayPicture, OverlayQuantity, OverlayTint,
    Quantity,
};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{JudgedAlarmTint, LATE_DISPLAY, OverlayInstance, Site};
use busbar_tags::TagHandle;
use busbar_types::Pattern;
use busbar_ui::{LayerRow, LegendRow};

use crate::contour;

/// Unknown verdicts that labels name in a frame; the equipment of all others is hatched too.
const MAX_UNKNOWN_LABELS: usize = 1000;

/// Layer of the view that shows one overlay of the site.
pub struct OverlayLayer {
    /// Name of the overlay's plugin instance.
    name: String,
    /// True if the operator shows the layer.
    is_shown: bool,
    /// Description that legend, nodes and mechanisms are of.
    description: Arc<OverlayDescription>,
    /// Legend as panels show it.
    legend: Arc<[LegendRow]>,
    /// Nodes of the equipment described; none for what the scene lacks.
    nodes: Vec<Option<NodeIndex>>,
    /// Names of the described mechanisms.
    mechanisms: Vec<Arc<str>>,
}

/// Layers of all overlays, in the order of the site.
#[derive(Default)]
pub struct OverlayLayers(Vec<OverlayLayer>);

/// An unknown verdict at a node, for its label.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownVerdict {
    /// Node of the equipment.
    pub(crate) node: NodeIndex,
    /// Name of the overlay.
    pub(crate) layer: String,
    pub(crate) reason: String,
}

/// Output of all overlays in one frame.
#[derive(Default)]
pub struct OverlayFrame {
    /// Last picture of each shown overlay, and whether the overlay is late.
    pub(crate) pictures: Vec<(Arc<OverlayPicture>, bool)>,
    /// Nodes that an overlay which is drawn cannot judge.
    pub(crate) unknown: Vec<NodeIndex>,
    /// The same with layer and reason, for labels.
    pub unknown_labels: Vec<UnknownVerdict>,
    pub(crate) tints: Vec<OverlayTint>,
    /// Tints of alarms that overlays or external systems decide on.
    pub(crate) judged_tints: Vec<JudgedAlarmTint>,
    /// States of the equipment, those that matter most last.
    pub states: Vec<NodeState>,
    pub(crate) positions: Vec<SwitchPosition>,
    pub(crate) flows: Vec<PowerFlow>,
    /// Contour levels, grouped by layer.
    pub(crate) levels: Vec<ContourLevel>,
}

/// Power that flows from one piece of equipment to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PowerFlow {
    pub(crate) from: NodeIndex,
    pub(crate) to: NodeIndex,
    /// The tag that it rests on.
    pub(crate) tag: TagHandle,
    /// Share of the rating; negative against that direction.
    pub(crate) share: f64,
}

/// A level of an overlay's contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContourLevel {
    /// Index of the overlay's layer.
    pub(crate) layer: u32,
    pub(crate) node: NodeIndex,
    /// The tag that it rests on.
    pub(crate) tag: TagHandle,
    /// Value in the contour's unit.
    pub(crate) value: f64,
}

/// Position of a switch.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SwitchPosition {
    pub(crate) node: NodeIndex,
    /// Name of the moving mechanism.
    pub(crate) mechanism: Arc<str>,
    /// The tag that it rests on.
    pub(crate) tag: TagHandle,
    /// Travel from open, 0, to closed, 1; none for a contradictory report.
    pub(crate) travelled: Option<f64>,
}

/// A node in a state of a legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeState {
    /// Node that is in the state.
    pub node: NodeIndex,
    /// Basis of the state; a state with several tags is listed once for each, consecutively.
    pub basis: StateBasis,
    /// Color of the state, sRGB.
    pub color: [u8; 3],
    /// Pattern of the state, besides its colour.
    pub pattern: Pattern,
    /// The overlay, and the entry of its legend; none of a chart's.
    pub legend: Option<(u32, u32)>,
}

impl NodeState {
    /// Reports whether another entry is the same state with another basis.
    pub fn is_same(&self, other: &Self) -> bool {
        (self.node, self.legend) == (other.node, other.legend)
    }

    /// Reports whether the overlay that shows it is late.
    pub fn is_late(&self) -> bool {
        self.basis == StateBasis::Tag(LATE_DISPLAY)
    }
}

impl OverlayFrame {
    /// Returns the lines of all overlays, and whether the overlay of each is late.
    pub fn lines(&self) -> impl Iterator<Item = (&OverlayLine, bool)> {
        self.pictures
            .iter()
            .flat_map(|(picture, is_late)| picture.lines.iter().map(|line| (line, *is_late)))
    }
}

/// Basis of a state: a live tag or a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateBasis {
    /// The value of a tag.
    Tag(TagHandle),
    /// A record that still speaks for the equipment, or does not any more.
    Record {
        /// True while the record is not outdated.
        is_valid: bool,
    },
}

impl OverlayLayers {
    /// Creates a layer for each overlay of a site.
    pub fn new(site: &Site) -> Self {
        Self(site.overlays().iter().map(|overlay| OverlayLayer::new(overlay.name())).collect())
    }

    /// Adapts to the overlays of a reloaded site. Layers of overlays that `is_kept` keeps go on; of
    /// all others the operator's choice alone is kept.
    pub fn reload(&mut self, site: &Site, graph: &SceneGraph, is_kept: &dyn Fn(&str) -> bool) {
        let mut before = std::mem::take(&mut self.0);
        self.0.extend(site.overlays().iter().map(|overlay| {
            let name = overlay.name();
            let was = before.iter().position(|layer| layer.name == name);
            match was.map(|index| before.swap_remove(index)) {
                Some(mut was) if is_kept(name) => {
                    was.find_nodes(graph);
                    was
                }
                was => {
                    let is_shown = was.is_none_or(|was| was.is_shown);
                    OverlayLayer { is_shown, ..OverlayLayer::new(name) }
                }
            }
        }));
    }

    /// Assembles the output of all shown overlays for one frame.
    pub fn frame(&mut self, site: &Site, graph: &SceneGraph) -> OverlayFrame {
        let mut all = OverlayFrame::default();
        for ((layer, overlay), index) in self.0.iter_mut().zip(site.overlays()).zip(0..) {
            layer.take_description(overlay, graph);
            if layer.is_shown {
                layer.add(index, overlay, &mut all);
                layer.add_unknown(overlay, site, &mut all);
            }
        }
        all
    }

    /// Shows a layer or hides it, by its index.
    pub fn set_shown(&mut self, layer: usize, shown: bool) {
        if let Some(layer) = self.0.get_mut(layer) {
            layer.is_shown = shown;
        }
    }

    /// Shows a layer or hides it, by the overlay's plugin instance; reports whether there is one.
    pub fn set_shown_by_name(&mut self, name: &str, shown: bool) -> bool {
        let found = self.0.iter_mut().find(|layer| layer.name == name);
        found.map(|layer| layer.is_shown = shown).is_some()
    }

    /// Returns a layer by its index.
    pub fn get(&self, layer: u32) -> Option<&OverlayLayer> {
        self.0.get(layer as usize)
    }

    /// Returns each layer with its overlay.
    pub fn with_overlays<'a>(
        &'a self,
        site: &'a Site,
    ) -> impl Iterator<Item = (&'a OverlayLayer, &'a OverlayInstance)> {
        self.0.iter().zip(site.overlays())
    }

    /// Returns the panel rows of all layers.
    pub fn rows(&self, site: &Site) -> Vec<LayerRow> {
        self.with_overlays(site).map(|(layer, overlay)| layer_row(layer, overlay)).collect()
    }
}

impl OverlayLayer {
    fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            is_shown: true,
            description: Arc::default(),
            legend: Arc::default(),
            nodes: Vec::new(),
            mechanisms: Vec::new(),
        }
    }

    /// Returns the name of the overlay's plugin instance.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reports whether the operator shows the layer.
    pub fn is_shown(&self) -> bool {
        self.is_shown
    }

    /// Returns the description that the layer shows.
    pub fn description(&self) -> &OverlayDescription {
        &self.description
    }

    /// Returns the legend as panels show it.
    pub fn legend(&self) -> &Arc<[LegendRow]> {
        &self.legend
    }

    /// Returns the node of a piece of the equipment described.
    pub fn node_of(&self, equipment: usize) -> Option<NodeIndex> {
        self.nodes.get(equipment).copied().flatten()
    }

    fn find_nodes(&mut self, graph: &SceneGraph) {
        self.nodes = self.description.equipment.iter().map(|id| graph.find(id)).collect();
    }

    /// Finds the equipment that the overlay says it shows.
    fn take_description(&mut self, overlay: &OverlayInstance, graph: &SceneGraph) {
        let description = overlay.description();
        if Arc::ptr_eq(description, &self.description) {
            return;
        }
        let before = std::mem::replace(&mut self.description, Arc::clone(description));
        if before == self.description {
            return;
        }
        // An operator's choice outlives what an overlay says when it is started again.
        if *before == OverlayDescription::default() {
            self.is_shown &= !description.starts_hidden;
        }
        self.mechanisms = description.mechanisms.iter().map(|name| name.as_str().into()).collect();
        self.legend = legend_rows(&description.legend);
        self.find_nodes(graph);
        let mut absent = description.equipment.iter().zip(&self.nodes);
        if let Some((first, _)) = absent.find(|(_, node)| node.is_none()) {
            let count = self.nodes.iter().filter(|node| node.is_none()).count();
            tracing::warn!(
                overlay = self.name,
                "{count} pieces of equipment that it shows are not in the scene, '{first}' first: \
                 mend their ids in its settings, or add them to the scene"
            );
        }
    }

    fn add(&self, layer: u32, overlay: &OverlayInstance, all: &mut OverlayFrame) {
        let picture = overlay.picture();
        all.tints.extend_from_slice(&picture.tints);
        all.states.extend(picture.states.iter().filter_map(|state| {
            let node = self.node_of(state.equipment as usize)?;
            let entry = self.description.legend.get(state.entry as usize)?;
            let (color, pattern) = (entry.color, entry.pattern);
            let legend = Some((layer, state.entry));
            Some(NodeState { node, basis: StateBasis::Tag(state.tag), color, pattern, legend })
        }));
        for quantity in &picture.quantities {
            self.add_quantity(layer, quantity, all);
        }
        all.pictures.push((Arc::clone(picture), overlay.is_late()));
    }

    /// Adds the equipment that cannot be judged, to be drawn as bad data is.
    fn add_unknown(&self, overlay: &OverlayInstance, site: &Site, all: &mut OverlayFrame) {
        let verdicts = overlay.verdicts();
        for equipment in verdicts.unknown() {
            let Some(node) = self.node_of(equipment) else { continue };
            all.unknown.push(node);
            if all.unknown_labels.len() < MAX_UNKNOWN_LABELS {
                let verdict = verdicts.verdict(equipment, site.tags(), site.snapshot());
                let (layer, reason) = (self.name.clone(), verdict.reason.into_owned());
                all.unknown_labels.push(UnknownVerdict { node, layer, reason });
            }
        }
    }

    fn add_quantity(&self, layer: u32, quantity: &OverlayQuantity, all: &mut OverlayFrame) {
        let Some(node) = self.node_of(quantity.equipment as usize) else { return };
        let tag = quantity.tag;
        match quantity.what {
            Quantity::Position { mechanism, travelled } => {
                if let Some(mechanism) = self.mechanisms.get(mechanism as usize).cloned() {
                    all.positions.push(SwitchPosition { node, mechanism, tag, travelled });
                }
            }
            Quantity::Flow { to, share } => {
                if let Some(to) = self.node_of(to as usize) {
                    all.flows.push(PowerFlow { from: node, to, tag, share });
                }
            }
            Quantity::Level(value) => all.levels.push(ContourLevel { layer, node, tag, value }),
        }
    }
}

/// Returns the row of a layer and its overlay.
fn layer_row(layer: &OverlayLayer, overlay: &OverlayInstance) -> LayerRow {
    let is_flow = |quantity: &OverlayQuantity| matches!(quantity.what, Quantity::Flow { .. });
    LayerRow {
        name: layer.name().to_owned(),
        shown: layer.is_shown(),
        is_late: overlay.fault().is_some(),
        legend: Arc::clone(layer.legend()),
        has_switch_symbols: !layer.description().mechanisms.is_empty(),
        has_arrows: overlay.picture().quantities.iter().any(is_flow),
        contour: layer.description().contour.as_ref().map(contour::legend),
    }
}

/// Returns a legend as panels show it.
fn legend_rows(entries: &[LegendEntry]) -> Arc<[LegendRow]> {
    let entry = |entry: &LegendEntry| LegendRow {
        name: entry.name.clone(),
        color: entry.color,
        pattern: entry.pattern,
    };
    entries.iter().map(entry).collect()
}
