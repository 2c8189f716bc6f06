//! Running overlay plugins of an open view.

use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_plugin_host::{
    OverlayDescription, OverlayLine, OverlayPicture, OverlayQuantity, OverlayTint, Pattern,
    Quantity, SceneClock, Verdicts,
};
use busbar_plugin_process::RunningOverlay;
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::{Snapshot, TagHandle};
use busbar_ui::LegendRow;

use crate::alarms::ExternalAlarmTint;
use crate::index_remap::IndexRemap;
use crate::verdicts::{UnknownVerdict, VerdictBoard};
use crate::{ViewError, panel_rows};
use busbar_scene_loader::LoadedScene;

/// The longest that a frame in a window waits for an isolated overlay: mostly
/// enough for the picture of this frame, and too little to be seen.
pub(crate) const WINDOW_TIMEOUT: Duration = Duration::from_millis(4);
/// The longest that a frame without a window waits for one.
pub(crate) const HEADLESS_TIMEOUT: Duration = Duration::from_millis(250);

/// An overlay and what went wrong with it last.
pub(crate) struct OverlayInstance {
    pub(crate) overlay: RunningOverlay,
    pub(crate) fault: Option<String>,
    /// True if the operator shows the layer.
    pub(crate) is_shown: bool,
    /// Description that the overlay gives of its output.
    pub(crate) description: Arc<OverlayDescription>,
    /// Legend as panels show it.
    pub(crate) legend: Arc<[LegendRow]>,
    /// The nodes of the equipment described; none for what the scene has not.
    nodes: Vec<Option<NodeIndex>>,
    /// Names of the described mechanisms.
    mechanisms: Vec<Arc<str>>,
    /// Verdicts on the equipment described.
    pub(crate) verdicts: VerdictBoard,
    /// Ids of the equipment that the verdicts are on.
    verdict_equipment: Vec<String>,
    /// Last picture, in the indices of the present scene.
    last: Arc<OverlayPicture>,
    /// The same with nothing to rest on, while it is late.
    late: Option<Arc<OverlayPicture>>,
    /// Map from the plugin's indices to the present ones.
    remap: IndexRemap,
    /// Last picture of the plugin, before and after the remap.
    remapped: [Arc<OverlayPicture>; 2],
}

/// Unknown verdicts that labels name in a frame; the equipment of all others is hatched too.
const MAX_UNKNOWN_LABELS: usize = 1000;

/// Tag of what an overlay that is late or gone drew, lines of labels aside. No tag has this
/// number, so that nothing of it counts as known; what values are worth is not said by it.
pub(crate) const LATE_DISPLAY: TagHandle = TagHandle(u32::MAX - 1);

/// Output of all overlays in one frame.
#[derive(Default)]
pub(crate) struct OverlayFrame {
    /// Last picture of each overlay, and whether the overlay is late.
    pub(crate) pictures: Vec<(Arc<OverlayPicture>, bool)>,
    /// Nodes that an overlay which is drawn cannot judge.
    pub(crate) unknown: Vec<NodeIndex>,
    /// The same with layer and reason, for labels.
    pub(crate) unknown_labels: Vec<UnknownVerdict>,
    pub(crate) tints: Vec<OverlayTint>,
    /// Tints of alarms that external systems decide on.
    pub(crate) external_tints: Vec<ExternalAlarmTint>,
    pub(crate) states: Vec<NodeState>,
    pub(crate) positions: Vec<SwitchPosition>,
    pub(crate) flows: Vec<PowerFlow>,
    /// Contour levels, grouped by overlay.
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
    /// Index of the overlay.
    pub(crate) overlay: u32,
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
pub(crate) struct NodeState {
    pub(crate) node: NodeIndex,
    /// Basis of the state; a state with several tags is listed once for each, consecutively.
    pub(crate) basis: StateBasis,
    /// Color of the state, sRGB.
    pub(crate) color: [u8; 3],
    pub(crate) pattern: Pattern,
    /// The overlay, and the entry of its legend; none of a chart's.
    pub(crate) legend: Option<(u32, u32)>,
}

impl NodeState {
    /// Reports whether another entry is the same state with another basis.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        (self.node, self.legend) == (other.node, other.legend)
    }

    /// Reports whether the overlay that shows it is late.
    pub(crate) fn is_late(&self) -> bool {
        self.basis == StateBasis::Tag(LATE_DISPLAY)
    }
}

impl OverlayFrame {
    /// The lines of all overlays, and whether the overlay of each is late.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (&OverlayLine, bool)> {
        self.pictures
            .iter()
            .flat_map(|(picture, is_late)| picture.lines.iter().map(|line| (line, *is_late)))
    }
}

/// Basis of a state: a live tag or a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StateBasis {
    /// The value of a tag.
    Tag(TagHandle),
    /// A record that still speaks for the equipment, or does not any more.
    Record { is_valid: bool },
}

impl OverlayInstance {
    /// Reports whether the overlay shows power flows.
    pub(crate) fn has_flows(&self) -> bool {
        self.last.quantities.iter().any(|quantity| matches!(quantity.what, Quantity::Flow { .. }))
    }

    /// An overlay that was just configured.
    pub(crate) fn new(overlay: RunningOverlay) -> Self {
        Self {
            overlay,
            fault: None,
            is_shown: true,
            description: Arc::default(),
            legend: Arc::default(),
            nodes: Vec::new(),
            mechanisms: Vec::new(),
            verdicts: VerdictBoard::default(),
            verdict_equipment: Vec::new(),
            last: Arc::default(),
            late: None,
            remap: IndexRemap::default(),
            remapped: Default::default(),
        }
    }

    /// Inherits visibility and past abnormal verdicts from the overlay before a change of settings.
    pub(crate) fn inherit(&mut self, before: Self) {
        self.is_shown = before.is_shown;
        (self.verdicts, self.verdict_equipment) = (before.verdicts, before.verdict_equipment);
    }

    /// The node of a piece of the equipment described.
    pub(crate) fn node_of(&self, equipment: usize) -> Option<NodeIndex> {
        self.nodes.get(equipment).copied().flatten()
    }

    /// Adapts to a scene with other tag and node indices.
    pub(crate) fn remap_indices(&mut self, remap: &IndexRemap, graph: &SceneGraph) {
        self.remap = self.remap.then(remap);
        self.last = remap.picture(&self.last);
        self.late = None;
        self.remapped = Default::default();
        let equipment = self.description.equipment.iter();
        self.nodes = equipment.map(|id| graph.find(id)).collect();
    }

    /// Maps a plugin's picture to the present indices.
    fn remap_picture(&mut self, picture: Arc<OverlayPicture>) -> Arc<OverlayPicture> {
        if !Arc::ptr_eq(&self.remapped[0], &picture) {
            let now = self.remap.picture(&picture);
            self.remapped = [picture, now];
        }
        Arc::clone(&self.remapped[1])
    }

    /// Finds the equipment that it says it shows; an isolated one says so anew after it
    /// was started again.
    fn take_description(&mut self, graph: &SceneGraph) {
        let description = self.overlay.description();
        if Arc::ptr_eq(&description, &self.description) {
            return;
        }
        if description != self.description {
            // An operator's choice outlives what an overlay says when it is started again.
            if *self.description == OverlayDescription::default() {
                self.is_shown &= !description.starts_hidden;
            }
            self.mechanisms =
                description.mechanisms.iter().map(|name| name.as_str().into()).collect();
            self.legend = panel_rows::legend(&description.legend);
            self.nodes = description.equipment.iter().map(|id| graph.find(id)).collect();
            self.verdicts.describe(&self.verdict_equipment, &description.equipment);
            self.verdict_equipment.clone_from(&description.equipment);
            for finding in &description.findings {
                tracing::warn!(overlay = self.overlay.name(), "{finding}");
            }
            let mut absent = description.equipment.iter().zip(&self.nodes);
            if let Some((first, _)) = absent.find(|(_, node)| node.is_none()) {
                let count = self.nodes.iter().filter(|node| node.is_none()).count();
                tracing::warn!(
                    overlay = self.overlay.name(),
                    "{count} pieces of equipment that it shows are not in the scene, '{first}' \
                     first: mend their ids in its settings, or add them to the scene"
                );
            }
        }
        self.description = description;
    }

    /// Marks the last picture as late. Removing it would suggest a healthy plant; marking it bad
    /// would blame the plant.
    fn late_picture(&mut self) -> Arc<OverlayPicture> {
        let last = &self.last;
        Arc::clone(self.late.get_or_insert_with(|| Arc::new(without_values(last))))
    }

    fn add(
        &self,
        overlay: u32,
        picture: Arc<OverlayPicture>,
        is_late: bool,
        all: &mut OverlayFrame,
    ) {
        all.tints.extend_from_slice(&picture.tints);
        all.states.extend(picture.states.iter().filter_map(|state| {
            let node = (*self.nodes.get(state.equipment as usize)?)?;
            let entry = self.description.legend.get(state.entry as usize)?;
            let (color, pattern) = (entry.color, entry.pattern);
            let legend = Some((overlay, state.entry));
            Some(NodeState { node, basis: StateBasis::Tag(state.tag), color, pattern, legend })
        }));
        for quantity in &picture.quantities {
            self.add_quantity(overlay, quantity, all);
        }
        all.pictures.push((picture, is_late));
    }

    /// Adds the equipment that cannot be judged, to be drawn as bad data is.
    fn add_unknown(&self, scene: &LoadedScene, snapshot: Snapshot<'_>, all: &mut OverlayFrame) {
        for equipment in self.verdicts.unknown() {
            let Some(node) = self.node_of(equipment) else { continue };
            all.unknown.push(node);
            if all.unknown_labels.len() < MAX_UNKNOWN_LABELS {
                let verdict = self.verdicts.verdict(equipment, scene, snapshot);
                let (layer, reason) = (self.overlay.name().to_owned(), verdict.reason.into_owned());
                all.unknown_labels.push(UnknownVerdict { node, layer, reason });
            }
        }
    }

    fn add_quantity(&self, overlay: u32, quantity: &OverlayQuantity, all: &mut OverlayFrame) {
        let node_of = |equipment: u32| self.nodes.get(equipment as usize).copied().flatten();
        let Some(node) = node_of(quantity.equipment) else { return };
        let tag = quantity.tag;
        match quantity.what {
            Quantity::Position { mechanism, travelled } => {
                if let Some(mechanism) = self.mechanisms.get(mechanism as usize).cloned() {
                    all.positions.push(SwitchPosition { node, mechanism, tag, travelled });
                }
            }
            Quantity::Flow { to, share } => {
                if let Some(to) = node_of(to) {
                    all.flows.push(PowerFlow { from: node, to, tag, share });
                }
            }
            Quantity::Level(value) => all.levels.push(ContourLevel { overlay, node, tag, value }),
        }
    }
}

/// A copy of a picture, none of which rests on a value.
pub(crate) fn without_values(picture: &OverlayPicture) -> OverlayPicture {
    let mut late = picture.clone();
    // Lines keep their tags: what is late may rest on a value that is bad besides.
    let OverlayPicture { lines: _, tints, states, quantities, verdicts } = &mut late;
    *verdicts = Verdicts::default();
    tints.iter_mut().for_each(|tint| tint.tag = LATE_DISPLAY);
    states.iter_mut().for_each(|state| state.tag = LATE_DISPLAY);
    quantities.iter_mut().for_each(|quantity| quantity.tag = LATE_DISPLAY);
    late
}

/// Configures the overlays of a scene.
pub(crate) fn start_overlays(scene: &LoadedScene) -> Result<Vec<OverlayInstance>, ViewError> {
    let mut overlays = Vec::new();
    for overlay in &scene.config.overlays {
        if let Some(plugin) = scene.instances.get(&overlay.plugin) {
            let bindings = scene.overlay_bindings(&overlay.plugin);
            let overlay = RunningOverlay::configure(plugin, bindings)?;
            overlays.push(OverlayInstance::new(overlay));
        }
    }
    Ok(overlays)
}

/// Runs every overlay, hidden ones included: their calculations have a history, and their verdicts
/// count. All share the timeout. A failed overlay shows its last picture as late; its fault is
/// logged once.
pub(crate) fn run_overlays(
    overlays: &mut [OverlayInstance],
    scene: &LoadedScene,
    snapshot: Snapshot<'_>,
    (clock, timeout): (SceneClock, Duration),
) -> OverlayFrame {
    let mut all = OverlayFrame::default();
    let start = Instant::now();
    for (shown, index) in overlays.iter_mut().zip(0..) {
        shown.take_description(&scene.graph);
        let left = timeout.saturating_sub(start.elapsed());
        let OverlayInstance { overlay, remap, .. } = shown;
        match overlay.draw(|tag| snapshot.state(remap.tags.tag(tag)?), clock, left) {
            Ok(picture) => {
                let picture = shown.remap_picture(picture);
                shown.verdicts.update(&picture, snapshot);
                shown.verdicts.log_missing(shown.overlay.name(), &shown.verdict_equipment);
                shown.last = Arc::clone(&picture);
                shown.late = None;
                shown.fault = None;
                if shown.is_shown {
                    shown.add(index, picture, false, &mut all);
                    shown.add_unknown(scene, snapshot, &mut all);
                }
            }
            Err(error) => {
                let fault = error.to_string();
                if shown.fault.as_ref() != Some(&fault) {
                    tracing::error!(plugin = shown.overlay.name(), "{fault}");
                }
                shown.fault = Some(fault);
                shown.verdicts.mark_unknown();
                let late = shown.late_picture();
                if shown.is_shown {
                    shown.add(index, late, true, &mut all);
                    shown.add_unknown(scene, snapshot, &mut all);
                }
            }
        }
    }
    all
}
