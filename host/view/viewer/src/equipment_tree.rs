//! The scene's equipment as a tree to open, or as what a search finds.

use std::collections::HashSet;

use busbar_scene::{NodeIndex, SceneGraph};
use busbar_ui::{EquipmentRow, EquipmentRows};

use crate::search_index::SearchIndex;
use busbar_scene_loader::{EquipmentIndex, is_designation};

/// Branches at the top are open from the start where that gives so many rows at most.
const MAX_ROWS_OPEN: usize = 40;

/// The equipment of a scene in the order of its tree, and which rows of it are shown. Rows
/// are listed anew when that changes, not each frame.
#[derive(Debug, Default)]
pub(crate) struct EquipmentTree {
    entries: Vec<Entry>,
    /// Entries in the order of their nodes.
    by_node: Vec<u32>,
    /// Search index, kept only while a search is active: for a large site it takes megabytes.
    text: Option<SearchIndex>,
    is_open: Vec<bool>,
    query: String,
    /// Entries of the visible rows.
    rows: Vec<u32>,
    /// True if the search found more than the rows.
    is_truncated: bool,
    selected: Option<u32>,
    selected_row: Option<usize>,
}

/// Placeholder for no entry.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Entry {
    node: NodeIndex,
    /// The entry it hangs under, or [`NONE`].
    parent: u32,
    /// The entry behind the last one under it.
    end: u32,
}

impl EquipmentTree {
    /// Builds the tree of all placements and of model parts that are equipment. Such parts have a
    /// designation or a name, or are among `involved`.
    pub(crate) fn new(
        graph: &SceneGraph,
        equipment: &EquipmentIndex,
        involved: &HashSet<NodeIndex>,
    ) -> Self {
        let is_listed = |node: NodeIndex| {
            let shown = graph.node(node);
            !shown.is_part()
                || is_designation(shown.name())
                || equipment.names(node).is_some()
                || involved.contains(&node)
        };
        let listed: Vec<NodeIndex> =
            (0..graph.node_count() as u32).map(NodeIndex).filter(|node| is_listed(*node)).collect();
        let above = |node: &NodeIndex| graph.node(*node).parent();
        let parent_of = |node: NodeIndex| {
            let mut way = std::iter::successors(above(&node), above);
            way.find_map(|node| listed.binary_search(&node).ok())
        };
        let parents: Vec<Option<usize>> = listed.iter().map(|node| parent_of(*node)).collect();
        // How many entries it is with those under it; parents come before.
        let mut sizes = vec![1_u32; listed.len()];
        for (index, parent) in parents.iter().enumerate().rev() {
            if let Some(parent) = *parent {
                sizes[parent] += sizes[index];
            }
        }
        let nowhere = Entry { node: NodeIndex(NONE), parent: NONE, end: 0 };
        let mut tree = Self { entries: vec![nowhere; listed.len()], ..Self::default() };
        tree.by_node.reserve_exact(listed.len());
        let mut next_at_top = 0;
        let mut next_under = vec![0; listed.len()];
        for ((&node, parent), &size) in listed.iter().zip(&parents).zip(&sizes) {
            let next = parent.map_or(&mut next_at_top, |parent| &mut next_under[parent]);
            let entry = *next;
            *next += size;
            next_under[tree.by_node.len()] = entry + 1;
            tree.entries[entry as usize] = Entry {
                node,
                parent: parent.map_or(NONE, |parent| tree.by_node[parent]),
                end: entry + size,
            };
            tree.by_node.push(entry);
        }
        let is_at_top = |entry: &Entry| entry.parent == NONE;
        let parent = |entry: &Entry| tree.entries.get(entry.parent as usize);
        let is_near = |entry: &&Entry| parent(entry).is_none_or(is_at_top);
        let near = tree.entries.iter().filter(is_near).count();
        let opens = |entry: &Entry| near <= MAX_ROWS_OPEN && is_at_top(entry);
        tree.is_open = tree.entries.iter().map(opens).collect();
        tree.list();
        tree
    }

    /// The equipment below a node, in the order of the tree.
    pub(crate) fn below(&self, node: NodeIndex) -> impl Iterator<Item = NodeIndex> + use<'_> {
        let range = self
            .entry_of(node)
            .map_or(0..0, |entry| entry as usize + 1..self.entries[entry as usize].end as usize);
        self.entries[range].iter().map(|entry| entry.node)
    }

    fn entry_of(&self, node: NodeIndex) -> Option<u32> {
        let node_of = |entry: &u32| self.entries[*entry as usize].node;
        Some(self.by_node[self.by_node.binary_search_by_key(&node, node_of).ok()?])
    }

    /// Returns the ancestors of an entry, the nearest first.
    fn above(&self, entry: u32) -> impl Iterator<Item = u32> + use<'_> {
        let parent = |entry: &u32| {
            let Entry { parent, .. } = self.entries[*entry as usize];
            (parent != NONE).then_some(parent)
        };
        std::iter::successors(parent(&entry), parent)
    }

    /// The names of all entries, to be searched.
    fn text(&self, graph: &SceneGraph, equipment: &EquipmentIndex) -> SearchIndex {
        let mut text = SearchIndex::default();
        for &Entry { node, .. } in &self.entries {
            let id = graph.node(node).id();
            let names = equipment.names(node);
            let aliases = names.into_iter().flat_map(|names| &names.aliases);
            let name = names.map(|names| &names.name).filter(|name| !name.is_empty());
            text.add([&id].into_iter().chain(name).chain(aliases).map(String::as_str));
        }
        text
    }

    /// Searches for the words of a query; an empty query restores the tree.
    pub(crate) fn search(&mut self, query: &str, graph: &SceneGraph, equipment: &EquipmentIndex) {
        if query.trim() == self.query.trim() {
            return;
        }
        query.clone_into(&mut self.query);
        if query.trim().is_empty() {
            self.text = None;
        } else if self.text.is_none() {
            self.text = Some(self.text(graph, equipment));
        }
        self.list();
    }

    pub(crate) fn query(&self) -> &str {
        &self.query
    }

    /// Opens or closes a branch.
    pub(crate) fn toggle(&mut self, entry: u32) {
        if let Some(open) = self.is_open.get_mut(entry as usize) {
            *open = !*open;
            self.list();
        }
    }

    /// Rows that are listed.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Opens the branches that are open in another tree; `now`: where a node is now.
    pub(crate) fn inherit(&mut self, before: &Self, now: impl Fn(NodeIndex) -> Option<NodeIndex>) {
        for (entry, is_open) in before.entries.iter().zip(&before.is_open) {
            if let Some(own) = now(entry.node).and_then(|node| self.entry_of(node)) {
                self.is_open[own as usize] = *is_open;
            }
        }
        self.list();
    }

    /// Selects the row of a node, or else of its device, and opens its ancestors.
    pub(crate) fn select(&mut self, node: Option<NodeIndex>, device: Option<NodeIndex>) {
        let entry_of = |node: Option<NodeIndex>| node.and_then(|node| self.entry_of(node));
        self.selected = entry_of(node).or_else(|| entry_of(device));
        self.find_selected();
        let Some(selected) = self.selected else { return };
        let above: Vec<u32> = self.above(selected).collect();
        let mut has_opened = false;
        for entry in above {
            has_opened |= !std::mem::replace(&mut self.is_open[entry as usize], true);
        }
        if has_opened {
            self.list();
        }
    }

    fn list(&mut self) {
        self.rows.clear();
        self.is_truncated = false;
        if let Some(text) = &self.text {
            (self.rows, self.is_truncated) = text.find(&self.query);
        } else {
            let mut entry = 0;
            while let Some(Entry { end, .. }) = self.entries.get(entry as usize) {
                self.rows.push(entry);
                entry = if self.is_open[entry as usize] { entry + 1 } else { *end };
            }
        }
        self.find_selected();
    }

    fn find_selected(&mut self) {
        let Self { rows, selected, .. } = self;
        self.selected_row =
            selected.and_then(|selected| rows.iter().position(|entry| *entry == selected));
    }
}

/// The rows of a tree as panels ask for them.
#[derive(Clone, Copy)]
pub(crate) struct EquipmentTreeRows<'a> {
    pub(crate) tree: &'a EquipmentTree,
    pub(crate) graph: &'a SceneGraph,
    pub(crate) equipment: &'a EquipmentIndex,
}

impl EquipmentRows for EquipmentTreeRows<'_> {
    fn len(&self) -> usize {
        self.tree.len()
    }

    fn total(&self) -> usize {
        self.tree.entries.len()
    }

    fn is_truncated(&self) -> bool {
        self.tree.is_truncated
    }

    fn selected(&self) -> Option<usize> {
        self.tree.selected_row
    }

    fn row(&self, index: usize) -> EquipmentRow {
        let Some(&entry) = self.tree.rows.get(index) else { return EquipmentRow::default() };
        let Entry { node, end, .. } = self.tree.entries[entry as usize];
        let is_found = self.tree.text.is_some();
        let above = || self.tree.entries.get(self.tree.above(entry).next()? as usize);
        let names = self.equipment.names(node);
        EquipmentRow {
            entry,
            depth: if is_found { 0 } else { self.tree.above(entry).count() as u16 },
            is_open: (!is_found && end > entry + 1).then(|| self.tree.is_open[entry as usize]),
            is_selected: self.tree.selected == Some(entry),
            label: self.graph.node(node).name().to_owned(),
            id: self.graph.node(node).id(),
            name: names.map(|names| names.name.clone()).unwrap_or_default(),
            aliases: names.map(|names| names.aliases.clone()).unwrap_or_default(),
            within: above().filter(|_| is_found).map(|above| self.graph.node(above.node).id()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use busbar_scene::{Placement, Transform};

    use super::*;

    fn placement(id: String, parent: Option<usize>) -> Placement {
        Placement { id, parent, transform: Transform::default(), model: None, theta: None }
    }

    fn station(bays: usize, devices: usize) -> SceneGraph {
        let mut placements = Vec::new();
        for bay in 0..bays {
            let parent = placements.len();
            placements.push(placement(format!("=Q{bay}"), None));
            let of_bay = (0..devices).map(|device| format!("=Q{bay}-QA{device}"));
            placements.extend(of_bay.map(|id| placement(id, Some(parent))));
        }
        SceneGraph::build(&placements, &[]).expect("ids are used once")
    }

    fn ids(graph: &SceneGraph, tree: &EquipmentTree) -> Vec<String> {
        let equipment = &EquipmentIndex::default();
        let rows = EquipmentTreeRows { tree, graph, equipment };
        (0..rows.len()).map(|row| rows.row(row).id).collect()
    }

    #[test]
    fn branches_open_and_the_selection_is_visible() {
        let graph = station(30, 3);
        let mut tree = EquipmentTree::new(&graph, &EquipmentIndex::default(), &HashSet::new());
        assert_eq!(ids(&graph, &tree).len(), 30, "closed: they would be 120");
        tree.toggle(0);
        assert_eq!(ids(&graph, &tree)[..5], ["=Q0", "=Q0-QA0", "=Q0-QA1", "=Q0-QA2", "=Q1"]);
        tree.toggle(0);
        tree.select(graph.find("=Q2-QA1"), None);
        assert_eq!(ids(&graph, &tree)[2..6], ["=Q2", "=Q2-QA0", "=Q2-QA1", "=Q2-QA2"]);
        let equipment = &EquipmentIndex::default();
        assert_eq!(EquipmentTreeRows { tree: &tree, graph: &graph, equipment }.selected(), Some(4));
    }

    #[test]
    fn a_search_lists_matches_and_clearing_it_restores_the_tree() {
        let graph = station(3, 2);
        let equipment = &EquipmentIndex::default();
        let mut tree = EquipmentTree::new(&graph, equipment, &HashSet::new());
        assert_eq!(ids(&graph, &tree).len(), 9, "few enough to be open");
        tree.search("qa1", &graph, equipment);
        assert_eq!(ids(&graph, &tree), ["=Q0-QA1", "=Q1-QA1", "=Q2-QA1"]);
        tree.search(" ", &graph, equipment);
        assert_eq!(ids(&graph, &tree).len(), 9);
    }

    #[test]
    fn a_hundred_thousand_pieces_of_equipment_are_searched_within_a_frame() {
        let graph = station(1000, 99);
        let equipment = &EquipmentIndex::default();
        let mut tree = EquipmentTree::new(&graph, equipment, &HashSet::new());
        assert_eq!(tree.entries.len(), 100_000);
        let mut longest = Duration::ZERO;
        for query in ["q", "q9", "q99-", "q999-qa98", "q999-qa98 nothing", "zzz"] {
            let start = Instant::now();
            tree.search(query, &graph, equipment);
            longest = longest.max(start.elapsed());
        }
        println!("longest search {:.2} ms", longest.as_secs_f64() * 1e3);
        assert!(longest < Duration::from_millis(100), "{longest:?}");
    }
}
