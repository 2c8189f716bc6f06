//! Lines of overlays to labels on the screen.

use std::collections::BTreeSet;

use busbar_plugin_host::{OverlayLine, Severity};
use busbar_scene::{NodeIndex, SceneGraph, SceneNode};
use busbar_tags::{Origin, Quality, Reason, Snapshot};
use busbar_ui::{Label, LabelLine, Mark};
use glam::{Vec3, vec3};

use crate::camera::Projection;
use crate::running::LATE_DISPLAY;

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

/// Lines by the nodes that they name.
pub(crate) struct LinesOfNodes<'a> {
    /// Of each line its node and its number, in order.
    order: Vec<(NodeIndex, u32, &'a OverlayLine)>,
}

impl<'a> LinesOfNodes<'a> {
    pub(crate) fn of(lines: impl Iterator<Item = &'a OverlayLine>) -> Self {
        let numbered = lines.zip(0..);
        let mut order: Vec<(NodeIndex, u32, &OverlayLine)> =
            numbered.map(|(line, number)| (NodeIndex(line.node), number, line)).collect();
        order.sort_unstable_by_key(|(node, number, _)| (*node, *number));
        Self { order }
    }

    /// The nodes that lines name, in order.
    pub(crate) fn nodes(&self) -> Vec<NodeIndex> {
        self.groups().map(|group| group[0].0).collect()
    }

    fn groups(&self) -> impl Iterator<Item = &[(NodeIndex, u32, &'a OverlayLine)]> {
        self.order.chunk_by(|(a, ..), (b, ..)| a == b)
    }

    /// Labels of all nodes that lines name and that are before the camera.
    pub(crate) fn labels(
        &self,
        snapshot: Snapshot<'_>,
        graph: &SceneGraph,
        sight: Sight,
        marked: Marked<'_>,
    ) -> Vec<Label<'a>> {
        let label = |group: &[(NodeIndex, u32, &'a OverlayLine)]| {
            let index = group[0].0;
            let node = graph.node(index);
            let top = top_of(node);
            let anchor = sight.projection.to_screen(top)?;
            Some(Label {
                title: node.id(),
                anchor,
                distance: sight.eye.distance(top),
                lines: group.iter().map(|(.., line)| label_line(line, snapshot)).collect(),
                hidden: marked.hidden.contains(&index),
                selected: marked.selection.contains(&index),
                alarmed: marked.alarmed.contains(&index),
            })
        };
        self.groups().filter_map(label).collect()
    }
}

fn label_line<'a>(line: &'a OverlayLine, snapshot: Snapshot<'_>) -> LabelLine<'a> {
    let state = snapshot.state(line.tag);
    let quality = state.map_or(Quality::Bad(Reason::NotConnected), |s| s.quality);
    let is_late = line.tag == LATE_DISPLAY;
    LabelLine {
        caption: &line.caption,
        text: &line.text,
        mark: if is_late { Mark::LateDisplay } else { mark(quality, line.severity) },
        age: state.and_then(|s| s.age),
        origin: state.map_or(Origin::LIVE, |s| s.origin),
    }
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
    use std::sync::Arc;

    use busbar_plugin_host::OverlayPicture;
    use busbar_tags::{Moment, TagHandle, TagSet, TagTable};

    use super::*;
    use crate::running::late_copy;

    #[test]
    fn a_late_overlay_is_late_and_blames_no_value() {
        let tags = TagSet::new(Vec::new()).unwrap();
        let table = TagTable::new(Arc::new(tags), Moment::now());
        let drawn = OverlayPicture {
            lines: vec![OverlayLine {
                node: 0,
                tag: TagHandle(0),
                severity: Severity::Alarm,
                caption: "U".into(),
                text: "231 kV".into(),
            }],
            ..OverlayPicture::default()
        };
        let late = late_copy(&drawn);
        let line = label_line(&late.lines[0], table.snapshot());
        assert_eq!((line.mark, line.age), (Mark::LateDisplay, None));
        // A tag that is not there is the plant's, or the configuration's.
        let absent = label_line(&drawn.lines[0], table.snapshot());
        assert!(matches!(absent.mark, Mark::Bad { .. }));
    }

    #[test]
    fn quality_outranks_what_an_overlay_says() {
        let stale = Mark::Bad { reason: "stale".into() };
        for severity in [Severity::Normal, Severity::Warning, Severity::Alarm] {
            assert_eq!(mark(Quality::Bad(Reason::Stale), severity), stale);
        }
        assert_eq!(mark(Quality::Good, Severity::Alarm), Mark::Alarm);
    }
}
