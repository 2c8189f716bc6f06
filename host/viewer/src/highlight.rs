//! Colour on equipment: selection, and severities that overlays give.

use std::collections::HashMap;

use busbar_plugin_host::{OverlayTint, Severity};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::Snapshot;

/// Linear rgb and strength.
pub(crate) type Highlight = [f32; 4];

const NONE: Highlight = [0.0; 4];
const SELECTION: Highlight = [0.02, 0.16, 0.55, 0.45];
const WARNING: Highlight = [0.96, 0.46, 0.02, 0.6];
const ALARM: Highlight = [0.6, 0.005, 0.008, 0.7];

/// The highlight of every node: its own, or that of the nearest node above it.
/// A tint that rests on a value that is not good is left out: what is not
/// known must not look certain; the label says so in hatching.
pub(crate) fn of_nodes(
    graph: &SceneGraph,
    tints: &[OverlayTint],
    snapshot: &Snapshot,
    selected: Option<NodeIndex>,
) -> Vec<Highlight> {
    let mut severities: HashMap<u32, Severity> = HashMap::new();
    for tint in tints {
        if snapshot.state(tint.tag).is_some_and(|state| state.quality.is_good()) {
            let severity = severities.entry(tint.node).or_default();
            *severity = (*severity).max(tint.severity);
        }
    }
    let mut highlights: Vec<Highlight> = Vec::with_capacity(graph.nodes().len());
    for (index, node) in graph.nodes().iter().enumerate() {
        let above = node.parent.map_or(NONE, |parent| highlights[parent.0 as usize]);
        let own = match severities.get(&(index as u32)) {
            Some(Severity::Alarm) => ALARM,
            Some(Severity::Warning) => WARNING,
            Some(Severity::Normal) | None => above,
        };
        let selected = selected == Some(NodeIndex(index as u32));
        highlights.push(if selected { SELECTION } else { own });
    }
    highlights
}
