//! Outlines of selected, hovered and brushed equipment, its descendants included.

use std::collections::BTreeSet;

use busbar_renderer::{OutlineKind, OutlinedObject};
use busbar_scene::{NodeIndex, SceneGraph};

/// The list, as it was last worked out.
#[derive(Default)]
pub(crate) struct Outlines {
    selection: BTreeSet<NodeIndex>,
    hovered: Option<NodeIndex>,
    brushed: BTreeSet<NodeIndex>,
    list: Vec<OutlinedObject>,
}

impl Outlines {
    /// Updates the list; selection takes precedence over hovering.
    pub(crate) fn update(
        &mut self,
        graph: &SceneGraph,
        selection: &BTreeSet<NodeIndex>,
        hovered: Option<NodeIndex>,
        brushed: &BTreeSet<NodeIndex>,
    ) {
        if (&self.selection, self.hovered, &self.brushed) == (selection, hovered, brushed) {
            return;
        }
        (self.selection, self.hovered) = (selection.clone(), hovered);
        self.brushed.clone_from(brushed);
        self.list.clear();
        if selection.is_empty() && hovered.is_none() && brushed.is_empty() {
            return;
        }
        let mut inherited: Vec<Option<OutlineKind>> = Vec::with_capacity(graph.node_count());
        for (node, index) in graph.nodes().zip(0..) {
            let here = NodeIndex(index);
            let above = node.parent().and_then(|parent| inherited[parent.0 as usize]);
            let kind = match above {
                Some(OutlineKind::Selected) => above,
                _ if selection.contains(&here) => Some(OutlineKind::Selected),
                _ if Some(here) == hovered || brushed.contains(&here) => Some(OutlineKind::Hovered),
                _ => above,
            };
            inherited.push(kind);
            // Objects count from 1, nodes from 0.
            self.list.extend(kind.map(|kind| OutlinedObject { object: index + 1, kind }));
        }
    }

    pub(crate) fn list(&self) -> &[OutlinedObject] {
        &self.list
    }
}

#[cfg(test)]
mod tests {
    use busbar_scene::{Placement, Transform};

    use super::*;

    #[test]
    fn descendants_have_the_outline_and_selection_takes_precedence() {
        let placement = |id: &str, parent| Placement {
            id: id.into(),
            parent,
            transform: Transform::default(),
            model: None,
            theta: None,
        };
        let placements =
            [placement("bay", None), placement("breaker", Some(0)), placement("pole", Some(1))];
        let graph = SceneGraph::build(&placements, &[]).unwrap();
        let mut outlines = Outlines::default();
        let mut kinds = |selected: Option<u32>, hovered: Option<u32>| {
            let selection = selected.into_iter().map(NodeIndex).collect();
            outlines.update(&graph, &selection, hovered.map(NodeIndex), &BTreeSet::new());
            let list = outlines.list().iter().map(|one| (one.object, one.kind));
            list.collect::<Vec<_>>()
        };
        use OutlineKind::{Hovered, Selected};
        assert_eq!(kinds(None, None), []);
        assert_eq!(kinds(Some(1), None), [(2, Selected), (3, Selected)]);
        assert_eq!(kinds(Some(1), Some(0)), [(1, Hovered), (2, Selected), (3, Selected)]);
        assert_eq!(kinds(Some(1), Some(2)), [(2, Selected), (3, Selected)]);
        assert_eq!(kinds(None, Some(2)), [(3, Hovered)]);
        assert_eq!(kinds(None, None), []);
    }
}
