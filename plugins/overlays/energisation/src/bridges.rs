//! Bridges of the network (R. E. Tarjan, "A note on finding the bridges of a graph", IPL 2,
//! 1974): behind a bridge without a source, nothing can feed.

use crate::topology::{Node, Topology};

/// Depth-first search of one network.
struct Search<'a> {
    topology: &'a Topology,
    /// Order in which nodes are entered, from 1; 0 where they were not.
    entered: Vec<u32>,
    /// The earliest node that a node's subtree leads back to.
    lowest: Vec<u32>,
    /// Sources in a node's subtree.
    sources: Vec<u32>,
    /// Bridges: the end from above, the end from below, the node below.
    bridges: Vec<[usize; 3]>,
    leads: Vec<bool>,
    count: u32,
}

/// A node that is being visited.
struct Visit {
    node: Node,
    /// The end of the branch that it was entered by, and the branch.
    by: Option<(usize, usize)>,
    /// The next of its branches.
    next: usize,
}

/// Tells by each end of a branch whether a source may lie beyond it, with all switches
/// closed and this branch as the only way back.
pub(crate) fn find_arcs_to_sources(topology: &Topology) -> Vec<bool> {
    let nodes = topology.nodes.len();
    let mut sources = vec![0; nodes];
    for source in &topology.sources {
        sources[source.node] += 1;
    }
    let mut search = Search {
        topology,
        entered: vec![0; nodes],
        lowest: vec![0; nodes],
        sources,
        bridges: Vec::new(),
        leads: vec![false; topology.adjacency.arcs().len()],
        count: 0,
    };
    for node in 0..nodes {
        if search.entered[node] == 0 {
            search.visit_component(node);
        }
    }
    search.leads
}

impl Search<'_> {
    fn visit_component(&mut self, root: Node) {
        let mut members = vec![root];
        let mut visits = vec![self.enter(root, None)];
        while let Some(visit) = visits.last_mut() {
            let node = visit.node;
            if visit.next < self.topology.adjacency.range(node).end {
                let index = visit.next;
                visit.next += 1;
                let arc = self.topology.adjacency.arcs()[index];
                let to = arc.to();
                if visit.by.is_some_and(|(_, branch)| branch == arc.branch()) {
                    continue;
                }
                if self.entered[to] == 0 {
                    members.push(to);
                    let entered = self.enter(to, Some((index, arc.branch())));
                    visits.push(entered);
                } else {
                    self.lowest[node] = self.lowest[node].min(self.entered[to]);
                }
            } else {
                let by = visit.by;
                visits.pop();
                if let Some((above, visit)) = visits.last().zip(by) {
                    self.leave(above.node, node, visit);
                }
            }
        }
        self.mark(&members, self.sources[root]);
    }

    fn enter(&mut self, node: Node, by: Option<(usize, usize)>) -> Visit {
        self.count += 1;
        self.entered[node] = self.count;
        self.lowest[node] = self.count;
        Visit { node, by, next: self.topology.adjacency.range(node).start }
    }

    fn leave(&mut self, above: Node, below: Node, (down, branch): (usize, usize)) {
        self.lowest[above] = self.lowest[above].min(self.lowest[below]);
        self.sources[above] += self.sources[below];
        if self.lowest[below] > self.entered[above] {
            let mut ends = self.topology.adjacency.range(below);
            let arcs = self.topology.adjacency.arcs();
            let up = ends.find(|&index| arcs[index].branch() == branch);
            self.bridges.extend(up.map(|up| [down, up, below]));
        }
    }

    fn mark(&mut self, members: &[Node], all: u32) {
        for &node in members {
            self.leads[self.topology.adjacency.range(node)].fill(all > 0);
        }
        for [down, up, below] in self.bridges.drain(..) {
            self.leads[down] = self.sources[below] > 0;
            self.leads[up] = all > self.sources[below];
        }
    }
}
