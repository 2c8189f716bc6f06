//! Lines of overlays to labels on the screen.

use std::collections::BTreeSet;

use busbar_plugin_host::{OverlayLine, Severity};
use busbar_scene::{NodeIndex, SceneGraph, SceneNode};
use busbar_tags::{Quality, Reason, Snapshot};
use busbar_ui::{Label, LabelLine, Mark};
use glam::{Vec3, vec3};

use crate::camera::Projection;

/// From where labels are seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) projection: Projection,
    /// World space, metres.
    pub(crate) eye: Vec3,
}

/// What labels say of their nodes besides lines.
#[derive(Clone, Copy)]
pub(crate) struct Marked<'a> {
    pub(crate) selection: &'a BTreeSet<NodeIndex>,
    /// Behind other equipment.
    pub(crate) hidden: &'a BTreeSet<NodeIndex>,
    /// In alarm.
    pub(crate) alarmed: &'a BTreeSet<NodeIndex>,
}

/// Labels of all nodes that lines name and that are before the camera.
pub(crate) fn build(
    lines: &[OverlayLine],
    snapshot: Snapshot<'_>,
    graph: &SceneGraph,
    sight: Sight,
    marked: Marked<'_>,
) -> Vec<Label> {
    let nodes = nodes_of(lines);
    let mut labels: Vec<Option<Label>> = nodes
        .iter()
        .map(|&index| {
            let node = graph.node(index);
            let top = top_of(node);
            Some(Label {
                title: node.id(),
                anchor: sight.projection.to_screen(top)?,
                distance: sight.eye.distance(top),
                lines: Vec::new(),
                hidden: marked.hidden.contains(&index),
                selected: marked.selection.contains(&index),
                alarmed: marked.alarmed.contains(&index),
            })
        })
        .collect();
    for line in lines {
        let Ok(rank) = nodes.binary_search(&NodeIndex(line.node)) else {
            continue;
        };
        let Some(label) = &mut labels[rank] else {
            continue;
        };
        let state = snapshot.state(line.tag);
        let quality = state.map_or(Quality::Bad(Reason::NotConnected), |s| s.quality);
        label.lines.push(LabelLine {
            caption: line.caption.clone(),
            text: line.text.clone(),
            mark: mark(quality, line.severity),
            age: state.and_then(|s| s.age),
        });
    }
    labels.into_iter().flatten().collect()
}

/// The nodes that lines name, in order.
pub(crate) fn nodes_of(lines: &[OverlayLine]) -> Vec<NodeIndex> {
    let mut nodes: Vec<NodeIndex> = lines.iter().map(|line| NodeIndex(line.node)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// How a value is marked: by its quality first, whatever an overlay says.
pub(crate) fn mark(quality: Quality, severity: Severity) -> Mark {
    match (quality, severity) {
        (Quality::Uncertain(reason), _) => Mark::Uncertain { reason: reason.to_string() },
        (Quality::Bad(reason), _) => Mark::Bad { reason: reason.to_string() },
        (Quality::Good, Severity::Normal) => Mark::Normal,
        (Quality::Good, Severity::Warning) => Mark::Warning,
        (Quality::Good, Severity::Alarm) => Mark::Alarm,
    }
}

/// The middle of the top of what hangs under a node; its origin if nothing does.
pub(crate) fn top_of(node: SceneNode<'_>) -> Vec3 {
    node.bounds().map_or_else(
        || node.world_from_node().w_axis.truncate(),
        |bounds| vec3(bounds.center().x, bounds.max.y, bounds.center().z),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quality_outranks_what_an_overlay_says() {
        let stale = Mark::Bad { reason: "stale".into() };
        for severity in [Severity::Normal, Severity::Warning, Severity::Alarm] {
            assert_eq!(mark(Quality::Bad(Reason::Stale), severity), stale);
        }
        assert_eq!(mark(Quality::Good, Severity::Alarm), Mark::Alarm);
    }
}
