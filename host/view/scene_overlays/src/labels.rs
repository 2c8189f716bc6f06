//! Lines of overlays to labels on the screen.

use std::collections::{BTreeSet, HashSet};

use busbar_overlay_picture::OverlayLine;
use busbar_scene::{NodeIndex, SceneGraph, SceneNode};
use busbar_tags::Snapshot;
use busbar_types::{Origin, Quality, Reason, Severity};
use busbar_ui::{Age, Label, LabelLine, ValueMark};
use glam::{Vec3, vec3};

use crate::overlay_layers::UnknownVerdict;
use busbar_camera::Projection;

/// Projection and eye position for content over the scene.
#[derive(Clone, Copy, Debug)]
pub struct OverlayCamera {
    /// Projection from the world to the screen.
    pub projection: Projection,
    /// Eye position in world space, metres.
    pub eye: Vec3,
}

/// Node sets that decide on a label's presentation.
#[derive(Clone, Copy)]
pub(crate) struct LabelContext<'a> {
    pub(crate) selection: &'a BTreeSet<NodeIndex>,
    /// Nodes whose labels are occluded.
    pub(crate) hidden: &'a BTreeSet<NodeIndex>,
    /// Nodes that are in alarm.
    pub(crate) alarmed: &'a BTreeSet<NodeIndex>,
}

/// A line of a label.
#[derive(Clone, Copy)]
enum NodeLine<'a> {
    /// A value, and whether the overlay that wrote it is late.
    Value(&'a OverlayLine, bool),
    /// An overlay cannot judge the equipment.
    Unknown(&'a UnknownVerdict),
}

/// Lines by the nodes that they name.
pub struct LinesByNode<'a> {
    /// Node of each line, and its number, in order.
    order: Vec<(NodeIndex, u32, NodeLine<'a>)>,
}

impl<'a> LinesByNode<'a> {
    /// Sorts values, each with whether its overlay is late, and unknown verdicts by node.
    /// Verdicts stand at nodes that have a label for their values, or are selected: labels
    /// of all others would hide the scene, which hatches them.
    pub fn new(
        values: impl Iterator<Item = (&'a OverlayLine, bool)>,
        unknown: &'a [UnknownVerdict],
        selection: &BTreeSet<NodeIndex>,
    ) -> Self {
        let values: Vec<(NodeIndex, NodeLine<'_>)> = values
            .map(|(line, is_late)| (NodeIndex(line.node), NodeLine::Value(line, is_late)))
            .collect();
        let labelled: HashSet<NodeIndex> = values.iter().map(|(node, _)| *node).collect();
        let is_labelled = |node: &NodeIndex| labelled.contains(node) || selection.contains(node);
        let unknown = unknown.iter().filter(|verdict| is_labelled(&verdict.node));
        let unknown = unknown.map(|verdict| (verdict.node, NodeLine::Unknown(verdict)));
        let values = values.into_iter();
        let numbered = values.chain(unknown).zip(0..);
        let mut order: Vec<(NodeIndex, u32, NodeLine<'_>)> =
            numbered.map(|((node, line), number)| (node, number, line)).collect();
        order.sort_unstable_by_key(|(node, number, _)| (*node, *number));
        Self { order }
    }

    /// Returns the nodes that lines name, in order.
    pub fn nodes(&self) -> Vec<NodeIndex> {
        self.groups().map(|group| group[0].0).collect()
    }

    fn groups(&self) -> impl Iterator<Item = &[(NodeIndex, u32, NodeLine<'a>)]> {
        self.order.chunk_by(|(a, ..), (b, ..)| a == b)
    }

    /// Labels of all nodes that lines name and that are before the camera.
    pub(crate) fn labels(
        &self,
        snapshot: Snapshot<'_>,
        graph: &SceneGraph,
        camera: OverlayCamera,
        marked: LabelContext<'_>,
    ) -> Vec<Label<'a>> {
        let label = |group: &[(NodeIndex, u32, NodeLine<'a>)]| {
            let index = group[0].0;
            let node = graph.node(index);
            let top = top_of(node);
            let anchor = camera.projection.to_screen(top)?;
            Some(Label {
                title: node.id(),
                anchor,
                distance: camera.eye.distance(top),
                lines: group.iter().map(|(.., line)| label_line(*line, snapshot)).collect(),
                hidden: marked.hidden.contains(&index),
                selected: marked.selection.contains(&index),
                alarmed: marked.alarmed.contains(&index),
            })
        };
        self.groups().filter_map(label).collect()
    }
}

fn label_line<'a>(line: NodeLine<'a>, snapshot: Snapshot<'_>) -> LabelLine<'a> {
    let (line, is_late) = match line {
        NodeLine::Value(line, is_late) => (line, is_late),
        NodeLine::Unknown(verdict) => {
            return LabelLine {
                caption: verdict.layer.as_str().into(),
                text: "unknown".into(),
                mark: ValueMark::Bad { reason: verdict.reason.clone() },
                age: None,
                origin: Origin::LIVE,
            };
        }
    };
    let state = snapshot.state(line.tag);
    let quality = state.as_ref().map_or(Quality::Bad(Reason::NotConnected), |s| s.quality);
    // The worse of both: a late display hides no bad value.
    let mark = match (is_late, quality) {
        (true, Quality::Good) => ValueMark::LateDisplay,
        (true, quality) => late_mark(quality),
        (false, quality) => mark(quality, line.severity),
    };
    LabelLine {
        caption: line.caption.as_str().into(),
        text: line.text.as_str().into(),
        mark,
        // Shown beside a value that is not good.
        age: state.as_ref().filter(|s| !s.quality.is_good()).and_then(|s| s.age).map(Age::from),
        origin: state.map_or(Origin::LIVE, |s| s.origin),
    }
}

/// The mark of a value that is not good, drawn by an overlay that is late.
fn late_mark(quality: Quality) -> ValueMark {
    let reason = quality.reason().map_or_else(String::new, |reason| reason.to_string());
    ValueMark::Bad { reason: format!("{reason}, display late") }
}

/// Returns the mark of a value: by quality first, then by severity.
pub fn mark(quality: Quality, severity: Severity) -> ValueMark {
    match (quality, severity) {
        (Quality::Uncertain(reason), _) => ValueMark::Uncertain { reason: reason.to_string() },
        (Quality::Bad(reason), _) => ValueMark::Bad { reason: reason.to_string() },
        (Quality::Good, Severity::Normal) => ValueMark::Normal,
        (Quality::Good, Severity::Warning) => ValueMark::Warning,
        (Quality::Good, Severity::Alarm) => ValueMark::Alarm,
    }
}

/// The middle of the top of what hangs under a node; its origin if nothing does.
pub fn top_of(node: SceneNode<'_>) -> Vec3 {
    node.bounds().map_or_else(
        || node.world_from_node().w_axis.truncate(),
        |bounds| vec3(bounds.center().x, bounds.max.y, bounds.center().z),
    )
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use busbar_overlay_picture::OverlayPicture;
    use busbar_tags::{Moment, Sample, TagHandle, TagSet, TagSpec, TagTable};
    use busbar_types::{Value, ValueKind};

    use super::*;

    #[test]
    fn a_late_overlay_is_marked_late_and_hides_no_bad_value() {
        let spec = TagSpec {
            id: "U".into(),
            name: "U".into(),
            kind: ValueKind::F64,
            unit: "kV".into(),
            range: None,
            freshness: Duration::from_secs(1),
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let tags = TagSet::new(vec![spec]).unwrap();
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
        let mut table = table;
        let good =
            Sample::live(TagHandle(0), Some(Value::F64(231.0)), Quality::Good, Moment::now());
        table.apply(&good, |_| {});
        let line = |is_late| NodeLine::Value(&drawn.lines[0], is_late);
        let late = label_line(line(true), table.snapshot());
        assert_eq!(late.mark, ValueMark::LateDisplay);
        // A value that is bad stays bad while the display is late.
        let lost = Sample { value: None, quality: Quality::Bad(Reason::Communication), ..good };
        table.apply(&lost, |_| {});
        for (is_late, words) in [(false, "communication"), (true, "display late")] {
            let ValueMark::Bad { reason } = label_line(line(is_late), table.snapshot()).mark else {
                panic!("a bad value is shown as bad")
            };
            assert!(reason.contains("communication") && reason.contains(words), "{reason}");
        }
    }

    #[test]
    fn quality_outranks_what_an_overlay_says() {
        let stale = ValueMark::Bad { reason: "stale".into() };
        for severity in [Severity::Normal, Severity::Warning, Severity::Alarm] {
            assert_eq!(mark(Quality::Bad(Reason::Stale), severity), stale);
        }
        assert_eq!(mark(Quality::Good, Severity::Alarm), ValueMark::Alarm);
    }
}
