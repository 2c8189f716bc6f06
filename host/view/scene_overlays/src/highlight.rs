//! Colour on equipment: selection, severities and states that overlays give.

use std::collections::{BTreeSet, HashMap};

use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::Snapshot;
use busbar_types::Severity;

use crate::highlight_styles::{self, ALARM, Highlight, NONE, SELECTION, UNKNOWN, WARNING};
use crate::overlay_layers::{NodeState, OverlayFrame, StateBasis};

/// Condition of a node, the least urgent first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Condition {
    #[default]
    Normal,
    Unknown,
    Warning,
    Alarm,
}

/// The highlight of every node, as it was last worked out.
#[derive(Default)]
pub struct Highlights {
    /// Empty where none has any.
    of_nodes: Vec<Highlight>,
    /// Number of changes so far.
    revision: u64,
    /// Conditions and states that the highlights were computed from.
    conditions: HashMap<u32, Condition>,
    states: HashMap<u32, Highlight>,
    selection: BTreeSet<NodeIndex>,
}

impl Highlights {
    /// Updates the highlights. A node takes the more urgent of its own condition and its
    /// ancestors'. Where nothing is wrong, it takes the nearest ancestor's state, else the
    /// selection color. The selection has an outline besides and hides nothing.
    ///
    /// Tints and states that depend on a value of bad or uncertain quality are drawn as unknown,
    /// neither certain nor healthy.
    pub(crate) fn update(
        &mut self,
        graph: &SceneGraph,
        overlay_frame: &OverlayFrame,
        snapshot: Snapshot<'_>,
        selection: &BTreeSet<NodeIndex>,
    ) {
        let conditions = conditions_of(overlay_frame, snapshot);
        let states = states_of(&overlay_frame.states, snapshot);
        // Most frames change none.
        let was = (&self.conditions, &self.states, &self.selection);
        if (&conditions, &states, selection) == was {
            return;
        }
        (self.conditions, self.states, self.selection) = (conditions, states, selection.clone());
        self.revision += 1;
        let is_normal = |condition: &Condition| *condition == Condition::Normal;
        let has_states = !self.states.is_empty();
        if !has_states && selection.is_empty() && self.conditions.values().all(is_normal) {
            self.of_nodes = Vec::new();
            return;
        }
        let mut inherited: Vec<Inherited> = Vec::with_capacity(graph.node_count());
        for (node, index) in graph.nodes().zip(0..) {
            let above = node.parent().map_or_else(Inherited::default, |p| inherited[p.0 as usize]);
            let own = self.conditions.get(&index).copied().unwrap_or_default();
            inherited.push(Inherited {
                condition: own.max(above.condition),
                is_selected: above.is_selected || selection.contains(&NodeIndex(index)),
                state: self.states.get(&index).copied().or(above.state),
            });
        }
        self.of_nodes = inherited.into_iter().map(color).collect();
    }

    /// Returns the revision, which grows with each change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the highlights of all nodes in their order; empty if no node has one.
    pub fn of_nodes(&self) -> &[Highlight] {
        &self.of_nodes
    }
}

fn conditions_of(overlay_frame: &OverlayFrame, snapshot: Snapshot<'_>) -> HashMap<u32, Condition> {
    let mut own: HashMap<u32, Condition> = HashMap::new();
    let is_good = |tag| snapshot.state(tag).is_some_and(|state| state.quality.is_good());
    // Most say that all is well, which is so without them.
    let tints = overlay_frame.tints.iter().filter(|tint| tint.severity != Severity::Normal);
    let tints = tints.map(|tint| (tint.node, tint.severity, is_good(tint.tag)));
    // What nobody can judge looks as bad data does.
    for node in &overlay_frame.unknown {
        own.insert(node.0, Condition::Unknown);
    }
    let sourced = overlay_frame.judged_tints.iter();
    let sourced = sourced.map(|tint| (tint.equipment.0, tint.severity, tint.is_certain));
    for (node, severity, good) in tints.chain(sourced) {
        let condition = match severity {
            _ if !good => Condition::Unknown,
            Severity::Normal => Condition::Normal,
            Severity::Warning => Condition::Warning,
            Severity::Alarm => Condition::Alarm,
        };
        let known = own.entry(node).or_default();
        *known = (*known).max(condition);
    }
    own
}

/// Condition, selection and state that a node inherits from its ancestors.
#[derive(Clone, Copy, Default)]
struct Inherited {
    condition: Condition,
    is_selected: bool,
    state: Option<Highlight>,
}

fn color(inherited: Inherited) -> Highlight {
    match inherited.condition {
        Condition::Alarm => ALARM,
        Condition::Warning => WARNING,
        Condition::Unknown => UNKNOWN,
        Condition::Normal => match inherited.state {
            Some(state) => state,
            None if inherited.is_selected => SELECTION,
            None => NONE,
        },
    }
}

/// Returns the highlight of each node with a state; the last overlay's state wins.
fn states_of(states: &[NodeState], snapshot: Snapshot<'_>) -> HashMap<u32, Highlight> {
    let is_good = |state: &NodeState| match state.basis {
        StateBasis::Tag(tag) => snapshot.state(tag).is_some_and(|state| state.quality.is_good()),
        StateBasis::Record { is_valid } => is_valid,
    };
    let highlight = |run: &[NodeState]| {
        let state = run.last()?;
        let good = run.iter().all(is_good);
        let known = highlight_styles::state_style(state.color, state.pattern);
        Some((state.node.0, if good { known } else { UNKNOWN }))
    };
    states.chunk_by(NodeState::is_same).filter_map(highlight).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use busbar_overlay_picture::OverlayTint;
    use busbar_scene::{Placement, Transform};
    use busbar_tags::{Moment, Sample, TagHandle, TagSet, TagSpec, TagTable};
    use busbar_types::{Pattern, Quality, Value, ValueKind};

    use super::*;

    const TAG: TagHandle = TagHandle(0);

    fn graph() -> SceneGraph {
        let placement = |id: &str, parent| Placement {
            id: id.into(),
            parent,
            transform: Transform::default(),
            model: None,
            theta: None,
        };
        let placements = [placement("bay", None), placement("breaker", Some(0))];
        SceneGraph::build(&placements, &[]).unwrap()
    }

    fn table_after(age: Duration) -> TagTable {
        let start = Moment::now();
        let spec = TagSpec {
            id: "a".into(),
            name: "a".into(),
            kind: ValueKind::F64,
            unit: String::new(),
            range: None,
            freshness: Duration::from_secs(1),
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let tags = TagSet::new(vec![spec]).unwrap();
        let mut table = TagTable::new(Arc::new(tags), start);
        let value = Some(Value::F64(1.0));
        let sample = Sample::live(TAG, value, Quality::Good, start);
        table.apply(&sample, |_| {});
        table.advance(start.after(age), |_| {});
        table
    }

    fn tint(node: u32, severity: Severity) -> OverlayTint {
        OverlayTint { node, tag: TAG, severity }
    }

    /// The highlights of both nodes.
    fn shown(tints: &[OverlayTint], table: &TagTable, selected: Option<u32>) -> Vec<Highlight> {
        let mut highlights = Highlights::default();
        let selection = selected.map(NodeIndex).into_iter().collect();
        let overlay_frame = OverlayFrame { tints: tints.to_vec(), ..OverlayFrame::default() };
        highlights.update(&graph(), &overlay_frame, table.snapshot(), &selection);
        of_both(&highlights)
    }

    fn of_both(highlights: &Highlights) -> Vec<Highlight> {
        match highlights.of_nodes() {
            [] => vec![NONE; 2],
            of_nodes => of_nodes.to_vec(),
        }
    }

    #[test]
    fn an_alarm_gone_stale_looks_neither_alarmed_nor_healthy() {
        let tints = [tint(1, Severity::Alarm)];
        assert_eq!(shown(&tints, &table_after(Duration::ZERO), None), [NONE, ALARM]);
        assert_eq!(shown(&tints, &table_after(Duration::from_secs(2)), None), [NONE, UNKNOWN]);
    }

    #[test]
    fn the_more_urgent_of_own_and_inherited_state_is_shown_even_under_selection() {
        let table = table_after(Duration::ZERO);
        let tints = [tint(0, Severity::Alarm), tint(1, Severity::Warning)];
        assert_eq!(shown(&tints, &table, Some(1)), [ALARM, ALARM]);
        assert_eq!(shown(&[], &table, Some(0)), [SELECTION, SELECTION]);
    }

    #[test]
    fn changed_highlights_are_updated_and_unchanged_ones_kept() {
        let (graph, mut highlights) = (graph(), Highlights::default());
        let fresh = table_after(Duration::ZERO);
        let stale = table_after(Duration::from_secs(2));
        let tints = [tint(1, Severity::Alarm)];
        let mut shown = |tints: &[OverlayTint], table: &TagTable, selected: Option<NodeIndex>| {
            let selection = selected.into_iter().collect();
            let overlay_frame = OverlayFrame { tints: tints.to_vec(), ..OverlayFrame::default() };
            highlights.update(&graph, &overlay_frame, table.snapshot(), &selection);
            of_both(&highlights)
        };
        assert_eq!(shown(&[], &fresh, None), [NONE, NONE]);
        assert_eq!(shown(&tints, &fresh, None), [NONE, ALARM]);
        assert_eq!(shown(&tints, &fresh, None), [NONE, ALARM]);
        assert_eq!(shown(&tints, &stale, None), [NONE, UNKNOWN], "the same tints, gone stale");
        assert_eq!(shown(&[], &stale, None), [NONE, NONE]);
        assert_eq!(shown(&[], &stale, Some(NodeIndex(1))), [NONE, SELECTION]);
    }

    #[test]
    fn an_overlay_state_is_shown_without_alarms_and_hidden_once_stale() {
        let node = NodeIndex(0);
        let shown = |tints: &[OverlayTint], table: &TagTable, selected: &[NodeIndex]| {
            let (color, pattern) = ([255, 0, 0], Pattern::Dotted);
            let overlay_frame = OverlayFrame {
                tints: tints.to_vec(),
                states: vec![NodeState {
                    node,
                    basis: StateBasis::Tag(TAG),
                    color,
                    pattern,
                    legend: None,
                }],
                ..OverlayFrame::default()
            };
            let mut highlights = Highlights::default();
            let selection = selected.iter().copied().collect();
            highlights.update(&graph(), &overlay_frame, table.snapshot(), &selection);
            of_both(&highlights)
        };
        let fresh = table_after(Duration::ZERO);
        let stale = table_after(Duration::from_secs(2));
        let red = highlight_styles::state_style([255, 0, 0], Pattern::Dotted);
        assert_eq!(shown(&[], &fresh, &[]), [red, red], "and at what is under it");
        assert_eq!(shown(&[tint(1, Severity::Alarm)], &fresh, &[]), [red, ALARM]);
        assert_eq!(shown(&[], &stale, &[]), [UNKNOWN; 2]);
        assert_eq!(shown(&[], &fresh, &[node]), [red, red], "selection hides no state");
        assert_eq!(shown(&[], &stale, &[node]), [UNKNOWN; 2], "nor that it is not known");
    }
}
