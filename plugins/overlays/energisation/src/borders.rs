//! Borders of parts without feeding: the open switches, and the sources that do not feed,
//! that keep a part from being fed whatever becomes of all other inputs.

use crate::adjacency::NextRows;
use crate::reachability::{Certainty, Passage, Reachability, pack, unpack};
use crate::state::{Input, Position};
use crate::topology::{Node, Topology};

/// Parts without feeding, each joined within by branches that may be closed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Borders {
    /// The part of each node, or [`NONE`]; empty until they are found.
    parts: Vec<u32>,
    /// Inputs on the borders, part by part; one may be there twice.
    inputs: Vec<u32>,
    /// Begin of each part among the inputs, and the end of the last.
    offsets: Vec<u32>,
    /// Nodes of the part that is being found, those that were visited first.
    members: Vec<u32>,
    /// Open switches at the part that is being found, and the nodes behind them.
    open_switches: Vec<[u32; 2]>,
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
        self.inputs.clear();
        self.offsets.clear();
        self.offsets.push(0);
        let mut rows = NextRows::default();
        for node in 0..nodes {
            if self.parts[node] == NONE && fed.certainty(node) == Certainty::Not {
                self.find_part(node, topology, passage, &mut rows);
            }
        }
    }

    fn find_part(
        &mut self,
        node: Node,
        topology: &Topology,
        passage: Passage<'_>,
        rows: &mut NextRows,
    ) {
        let part = self.part_count() as u32;
        self.parts[node] = part;
        self.members.clear();
        self.members.push(node as u32);
        let mut done = 0;
        while done < self.members.len() {
            let count = passage.adjacency.load_rows(&self.members[done..], rows);
            for row in &rows[..count] {
                let node = self.members[done] as usize;
                done += 1;
                let sources = topology.sources_at.row(node).iter();
                self.inputs.extend(sources.map(|&source| pack(Input::Source(source))));
                for (&arc, index) in passage.adjacency.row(*row).iter().zip(row[0] as usize..) {
                    let to = arc.to();
                    if passage.position(arc) == Position::Open {
                        if let Some(switch) = arc.switch()
                            && topology.leads_to_source[index]
                        {
                            self.open_switches.push([switch as u32, to as u32]);
                        }
                    } else if self.parts[to] == NONE {
                        self.parts[to] = part;
                        self.members.push(to as u32);
                    }
                }
            }
        }
        // An open switch between two nodes of the part is on no border.
        let Self { open_switches, parts, inputs, offsets, .. } = self;
        let on_border = open_switches.drain(..).filter(|&[_, to]| parts[to as usize] != part);
        inputs.extend(on_border.map(|[switch, _]| pack(Input::Switch(switch as usize))));
        offsets.push(inputs.len() as u32);
    }

    /// The part that a node is in; none where it is fed, or perhaps.
    #[inline]
    pub(crate) fn part(&self, node: Node) -> Option<usize> {
        self.parts.get(node).filter(|part| **part != NONE).map(|part| *part as usize)
    }

    /// Number of parts that were found.
    pub(crate) fn part_count(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Reports whether two parts of different rounds have the same inputs on their borders.
    pub(crate) fn is_same(&self, part: usize, other: &Self, other_part: usize) -> bool {
        self.row(part) == other.row(other_part)
    }

    fn row(&self, part: usize) -> &[u32] {
        &self.inputs[self.offsets[part] as usize..self.offsets[part + 1] as usize]
    }

    /// Inputs on the border of the part that a node is in.
    pub(crate) fn inputs_at(&self, node: Node) -> impl Iterator<Item = Input> + '_ {
        let row = self.part(node).map_or(&[][..], |part| self.row(part));
        row.iter().filter_map(|&input| unpack(input))
    }
}
