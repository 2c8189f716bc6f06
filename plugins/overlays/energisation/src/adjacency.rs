//! Adjacency of nodes, as compressed sparse rows.

use crate::topology::{Branch, MAX_BRANCHES, MAX_NODES, Node, Switch};

/// Branches by the nodes at their ends, as compressed rows.
#[derive(Clone, Debug, Default)]
pub struct Adjacency {
    offsets: Vec<u32>,
    arcs: Vec<Arc>,
}

/// Branch as one of its nodes sees it, packed into 8 bytes: a network of 100,000 branches
/// fits a processor's second cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arc(u64);

/// Bits of an index in an [`Arc`].
const INDEX_BITS: u32 = 20;
const INDEX_MASK: u64 = (1 << INDEX_BITS) - 1;
/// Bit of branches that stop an earth.
const STOPS_EARTH: u64 = 1 << (3 * INDEX_BITS);

/// Indices of an arc at most: nodes, branches and their switches.
const MAX_INDEX: usize = if MAX_NODES > MAX_BRANCHES { MAX_NODES } else { MAX_BRANCHES };

/// Nodes whose rows are loaded at once.
pub(crate) const ROWS_AT_ONCE: usize = 32;

/// Rows of the next nodes of a search, as begin and end among all ends of branches.
pub(crate) type NextRows = [[u32; 2]; ROWS_AT_ONCE];

const _: () = assert!(MAX_INDEX < INDEX_MASK as usize);

impl Arc {
    fn new(to: Node, branch: usize, switch: Option<Switch>, stops_earth: bool) -> Self {
        let switch = switch.map_or(INDEX_MASK, |switch| switch as u64);
        let flag = if stops_earth { STOPS_EARTH } else { 0 };
        let indices = to as u64 | (branch as u64) << INDEX_BITS | switch << (2 * INDEX_BITS);
        Self(indices | flag)
    }

    /// Returns the node at the other end.
    #[inline]
    pub fn to(self) -> Node {
        (self.0 & INDEX_MASK) as usize
    }

    /// Returns the index of the branch.
    #[inline]
    pub fn branch(self) -> usize {
        (self.0 >> INDEX_BITS & INDEX_MASK) as usize
    }

    /// Returns the switch of the branch, if it has one.
    #[inline]
    pub fn switch(self) -> Option<Switch> {
        let switch = self.0 >> (2 * INDEX_BITS) & INDEX_MASK;
        (switch != INDEX_MASK).then_some(switch as usize)
    }

    /// Reports whether no earth passes.
    #[inline]
    pub fn stops_earth(self) -> bool {
        self.0 & STOPS_EARTH != 0
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
        let mut arcs = vec![Arc::default(); branches.len() * 2];
        let mut next = offsets.clone();
        for (index, branch) in branches.iter().enumerate() {
            let [a, b] = branch.ends;
            for (from, to) in [(a, b), (b, a)] {
                let arc = Arc::new(to, index, branch.switch, branch.stops_earth);
                arcs[next[from] as usize] = arc;
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

    /// Loads the rows of at most [`ROWS_AT_ONCE`] nodes into the processor's caches and gives
    /// their ranges. A search reads rows in no order of memory: one by one, each would be waited
    /// for, and these loads overlap. Returns the number of rows.
    #[inline]
    pub(crate) fn load_rows(&self, nodes: &[u32], rows: &mut NextRows) -> usize {
        let count = nodes.len().min(ROWS_AT_ONCE);
        for (row, &node) in rows.iter_mut().zip(nodes) {
            *row = [self.offsets[node as usize], self.offsets[node as usize + 1]];
        }
        let mut touched = 0;
        for &[begin, end] in &rows[..count] {
            let arc = |index: u32| self.arcs.get(index as usize).map_or(0, |arc| arc.0);
            touched ^= arc(begin) ^ arc(end.saturating_sub(1));
        }
        std::hint::black_box(touched);
        count
    }

    /// Gives the branches of a row by [`Adjacency::load_rows`].
    #[inline]
    pub(crate) fn row(&self, [begin, end]: [u32; 2]) -> &[Arc] {
        &self.arcs[begin as usize..end as usize]
    }

    /// Gives all ends of branches.
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs
    }
}
