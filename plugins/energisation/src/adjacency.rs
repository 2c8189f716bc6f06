//! Adjacency of nodes, as compressed sparse rows.

use crate::topology::{Branch, Node, Switch};

/// Branches by the nodes at their ends, as compressed rows.
#[derive(Clone, Debug, Default)]
pub struct Adjacency {
    offsets: Vec<u32>,
    arcs: Vec<Arc>,
}

/// A branch as one of its nodes sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arc {
    /// The node at the other end.
    pub to: u32,
    /// Index of the branch.
    pub branch: u32,
    /// The switch, or [`Arc::ALWAYS`].
    pub switch: u32,
    /// Reports whether no earth passes.
    pub stops_earth: bool,
}

impl Arc {
    /// Switch of a branch that always joins its nodes.
    pub const ALWAYS: u32 = u32::MAX;

    /// Gives its switch, if it has one.
    pub fn switch(self) -> Option<Switch> {
        (self.switch != Self::ALWAYS).then_some(self.switch as usize)
    }
}

impl Adjacency {
    /// Sorts branches by their ends.
    pub fn new(nodes: usize, branches: &[Branch]) -> Self {
        let mut offsets = vec![0_u32; nodes + 1];
        for end in branches.iter().flat_map(|branch| branch.ends) {
            offsets[end + 1] += 1;
        }
        for node in 0..nodes {
            offsets[node + 1] += offsets[node];
        }
        let none = Arc { to: 0, branch: 0, switch: Arc::ALWAYS, stops_earth: false };
        let mut arcs = vec![none; branches.len() * 2];
        let mut next = offsets.clone();
        for (branch, index) in branches.iter().zip(0..) {
            let switch = branch.switch.map_or(Arc::ALWAYS, |switch| switch as u32);
            let [a, b] = branch.ends;
            for (from, to) in [(a, b), (b, a)] {
                let stops_earth = branch.stops_earth;
                arcs[next[from] as usize] =
                    Arc { to: to as u32, branch: index, switch, stops_earth };
                next[from] += 1;
            }
        }
        Self { offsets, arcs }
    }

    /// Gives the branches at a node.
    pub fn at(&self, node: Node) -> &[Arc] {
        &self.arcs[self.range(node)]
    }

    /// Gives the indices of the branches at a node, among all ends of branches.
    pub fn range(&self, node: Node) -> std::ops::Range<usize> {
        self.offsets[node] as usize..self.offsets[node + 1] as usize
    }

    /// Gives all ends of branches.
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs
    }
}
