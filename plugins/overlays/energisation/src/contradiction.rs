//! Contradictions: sources and working earths that are surely connected.

use std::collections::HashMap;

use crate::reachability::{NONE, Passage, Step};
use crate::state::{Energisation, Position, State};
use crate::topology::{Node, Topology};

/// Pieces of a path that are told at each of its ends, where it is long.
const TOLD_PIECES: usize = 5;

/// A source and an earth that are surely connected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// Index of the source.
    pub source: usize,
    /// Index of the earth.
    pub earth: usize,
    /// Branches of a shortest way from the source to the earth.
    pub path: Vec<usize>,
}

/// Contradictions of a network, each with the nodes that are in doubt by it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contradictions {
    all: Vec<Contradiction>,
    /// Index of the one at each node, or [`NONE`]; empty where there are none.
    of_nodes: Vec<u32>,
}

impl Contradictions {
    /// Finds one for each part that an earth surely reaches and a source too. `positions`
    /// are those that the states were worked out of.
    pub fn find(energisation: &Energisation, topology: &Topology, positions: &[Position]) -> Self {
        let mut found = Self::default();
        if !energisation.last_states().contains(&State::Contradiction) {
            return found;
        }
        found.of_nodes.resize(topology.nodes.len(), NONE);
        let mut earths: HashMap<Node, usize> = HashMap::new();
        for (index, earth) in topology.earths.iter().enumerate() {
            if positions[earth.switch] == Position::Closed {
                earths.entry(earth.node).or_insert(index);
            }
        }
        let passage = Passage { adjacency: &topology.adjacency, positions, passes_windings: false };
        // The first earth of a part that feeding comes to is the nearest to a source.
        for node in energisation.surely_fed() {
            if let Some(&earth) = earths.get(&node)
                && found.of_nodes[node] == NONE
            {
                found.add(energisation, passage, (node, earth));
            }
        }
        found
    }

    fn add(
        &mut self,
        energisation: &Energisation,
        passage: Passage<'_>,
        (node, earth): (Node, usize),
    ) {
        let (mut source, mut path) = (0, Vec::new());
        for step in energisation.way_to_source(node) {
            match step {
                Step::Branch { branch, .. } => path.push(branch),
                Step::Start(index) => source = index,
            }
        }
        path.reverse();
        let index = self.all.len() as u32;
        self.all.push(Contradiction { source, earth, path });
        let mut to_visit = vec![node];
        self.of_nodes[node] = index;
        while let Some(node) = to_visit.pop() {
            for &arc in passage.adjacency.at(node) {
                let to = arc.to();
                if passage.position(arc) == Position::Closed && self.of_nodes[to] == NONE {
                    self.of_nodes[to] = index;
                    to_visit.push(to);
                }
            }
        }
    }

    /// Lists the nodes that are in doubt.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = Node> + '_ {
        self.of_nodes.iter().enumerate().filter(|(_, of)| **of != NONE).map(|(node, _)| node)
    }

    /// All contradictions of the network.
    pub fn all(&self) -> &[Contradiction] {
        &self.all
    }

    /// The index of the one that a node is in doubt by.
    pub fn at(&self, node: Node) -> Option<usize> {
        self.of_nodes.get(node).filter(|index| **index != NONE).map(|index| *index as usize)
    }
}

impl Contradiction {
    /// Tells source, earth, and the equipment on the way between.
    pub fn explain(&self, topology: &Topology) -> String {
        let source = name_of_source(topology, self.source);
        let earth = topology.earths[self.earth].equipment;
        let on_way = self.path.iter().map(|&branch| topology.branches[branch].equipment);
        let mut pieces: Vec<usize> = on_way.chain([earth]).collect();
        pieces.dedup();
        let names: Vec<&str> =
            pieces.iter().map(|&piece| topology.equipment[piece].as_str()).collect();
        let way = match names.len().checked_sub(2 * TOLD_PIECES) {
            Some(more) if more > 1 => format!(
                "{} - {more} more - {}",
                names[..TOLD_PIECES].join(" - "),
                names[TOLD_PIECES + more..].join(" - ")
            ),
            _ => names.join(" - "),
        };
        let earth = &topology.equipment[earth];
        format!("source {source} and earth {earth} are surely connected: {source} - {way}")
    }
}

/// The name of a source: its equipment, or its node.
pub(crate) fn name_of_source(topology: &Topology, source: usize) -> &str {
    let source = &topology.sources[source];
    source.equipment.as_deref().unwrap_or(&topology.nodes[source.node])
}
