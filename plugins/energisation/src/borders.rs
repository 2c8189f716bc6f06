//! Borders of parts without feeding: the open switches, and the sources that do not feed,
//! that keep a part from being fed whatever becomes of all other inputs.

use crate::reachability::{Certainty, Passage, Reachability};
use crate::state::{Input, Position};
use crate::topology::{Node, Topology};

/// Parts without feeding, each joined within by branches that may be closed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Borders {
    /// The part of each node, or [`NONE`]; empty until they are found.
    parts: Vec<u32>,
    borders: Vec<Vec<Input>>,
    stack: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Borders {
    /// Forgets parts of other states.
    pub(crate) fn forget(&mut self) {
        self.parts.clear();
    }

    /// Finds all parts and their borders. Linear in the network.
    pub(crate) fn find(&mut self, topology: &Topology, passage: Passage<'_>, fed: &Reachability) {
        let nodes = topology.nodes.len();
        self.parts.clear();
        self.parts.resize(nodes, NONE);
        self.borders.clear();
        for node in 0..nodes {
            if self.parts[node] == NONE && fed.certainty(node) == Certainty::Not {
                self.find_part(node, passage);
            }
        }
        self.find_open_switches(topology, passage);
        for (index, source) in topology.sources.iter().enumerate() {
            if let Some(part) = self.part(source.node) {
                self.borders[part].push(Input::Source(index));
            }
        }
        for border in &mut self.borders {
            border.sort_unstable();
            border.dedup();
        }
    }

    fn find_part(&mut self, node: Node, passage: Passage<'_>) {
        let part = self.borders.len() as u32;
        self.borders.push(Vec::new());
        self.parts[node] = part;
        self.stack.push(node as u32);
        while let Some(node) = self.stack.pop() {
            for &arc in passage.adjacency.at(node as usize) {
                let to = arc.to as usize;
                if self.parts[to] == NONE && passage.position(arc) != Position::Open {
                    self.parts[to] = part;
                    self.stack.push(arc.to);
                }
            }
        }
    }

    fn find_open_switches(&mut self, topology: &Topology, passage: Passage<'_>) {
        for node in 0..self.parts.len() {
            let part = self.parts[node];
            if part == NONE {
                continue;
            }
            for index in topology.adjacency.range(node) {
                let arc = topology.adjacency.arcs()[index];
                let is_border = self.parts[arc.to as usize] != part
                    && passage.position(arc) == Position::Open
                    && topology.leads_to_source[index];
                if let Some(switch) = arc.switch().filter(|_| is_border) {
                    self.borders[part as usize].push(Input::Switch(switch));
                }
            }
        }
    }

    /// The part that a node is in; none where it is fed, or perhaps.
    pub(crate) fn part(&self, node: Node) -> Option<usize> {
        self.parts.get(node).filter(|part| **part != NONE).map(|part| *part as usize)
    }

    /// The border of the part that a node is in.
    pub(crate) fn of(&self, node: Node) -> &[Input] {
        self.part(node).map_or(&[], |part| &self.borders[part])
    }
}
