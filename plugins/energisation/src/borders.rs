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
    part_count: usize,
    /// Inputs with the part whose border they are on, as they are found.
    pairs: Vec<(u32, Input)>,
    /// The same inputs by parts; one may be there twice.
    inputs: Vec<Input>,
    /// Begin of each part among the inputs, and the end of the last.
    offsets: Vec<u32>,
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
        self.part_count = 0;
        self.pairs.clear();
        for node in 0..nodes {
            if self.parts[node] == NONE && fed.certainty(node) == Certainty::Not {
                self.find_part(node, passage);
            }
        }
        self.find_open_switches(topology, passage);
        for (index, source) in topology.sources.iter().enumerate() {
            if let Some(part) = self.part(source.node) {
                self.pairs.push((part as u32, Input::Source(index)));
            }
        }
        self.sort_pairs();
    }

    /// Sorts inputs by parts, by counting.
    fn sort_pairs(&mut self) {
        let Self { pairs, offsets, inputs, part_count, .. } = self;
        offsets.clear();
        offsets.resize(*part_count + 2, 0);
        for (part, _) in &*pairs {
            offsets[*part as usize + 2] += 1;
        }
        for part in 1..offsets.len() {
            offsets[part] += offsets[part - 1];
        }
        inputs.clear();
        inputs.resize(pairs.len(), Input::Switch(0));
        for &(part, input) in &*pairs {
            let next = &mut offsets[part as usize + 1];
            inputs[*next as usize] = input;
            *next += 1;
        }
    }

    fn find_part(&mut self, node: Node, passage: Passage<'_>) {
        let part = self.part_count as u32;
        self.part_count += 1;
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
                    self.pairs.push((part, Input::Switch(switch)));
                }
            }
        }
    }

    /// The part that a node is in; none where it is fed, or perhaps.
    pub(crate) fn part(&self, node: Node) -> Option<usize> {
        self.parts.get(node).filter(|part| **part != NONE).map(|part| *part as usize)
    }

    /// Number of parts that were found.
    pub(crate) fn part_count(&self) -> usize {
        self.part_count
    }

    /// Inputs on the border of the part that a node is in.
    pub(crate) fn of(&self, node: Node) -> impl Iterator<Item = Input> + '_ {
        let range = self
            .part(node)
            .map_or(0..0, |part| self.offsets[part] as usize..self.offsets[part + 1] as usize);
        self.inputs[range].iter().copied()
    }
}
