//! What state each node is in.
//!
//! A switch whose position is not known may be open or closed. What holds either way is
//! known; what does not is unknown, and shown as that. More closed switches energise
//! more, so two networks tell it all: unknown switches open in one, closed in the other.

use crate::topology::{Branch, Topology};
use crate::union_find::UnionFind;

/// Where a switch stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Open.
    Open,
    /// Closed.
    Closed,
    /// Travelling, contradictory, or of bad quality.
    Unknown,
}

impl Position {
    fn is_closed(self, if_unknown: bool) -> bool {
        match self {
            Self::Open => false,
            Self::Closed => true,
            Self::Unknown => if_unknown,
        }
    }
}

/// The state of a node, the most urgent to know last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum State {
    /// Joined to no source, and earthed.
    Earthed,
    /// Joined to no source, and not known to be earthed.
    Dead,
    /// Perhaps joined to a source; or to one and to earth, which cannot be.
    Unknown,
    /// Joined to a source.
    Energised,
}

/// Works out states, in room that is kept.
#[derive(Clone, Debug, Default)]
pub struct Energisation {
    /// Unknown switches open, and closed.
    sets: [UnionFind; 2],
    fed: [Vec<bool>; 2],
    earthed: [Vec<bool>; 2],
    states: Vec<State>,
}

impl Energisation {
    /// The states of all nodes. `positions`: of switches; `sources`: whether each feeds,
    /// as the position of a switch between it and its node. Both in the topology's
    /// order. Linear in the network, but for the inverse of Ackermann's function.
    pub fn states(
        &mut self,
        topology: &Topology,
        positions: &[Position],
        sources: &[Position],
    ) -> &[State] {
        let nodes = topology.nodes.len();
        for (which, if_unknown) in [false, true].into_iter().enumerate() {
            let sets = &mut self.sets[which];
            sets.part(nodes);
            for &Branch { ends: [a, b], switch, .. } in &topology.branches {
                if switch.is_none_or(|switch| positions[switch].is_closed(if_unknown)) {
                    sets.join(a, b);
                }
            }
            let (fed, earthed) = (&mut self.fed[which], &mut self.earthed[which]);
            for marks in [&mut *fed, &mut *earthed] {
                marks.clear();
                marks.resize(nodes, false);
            }
            for (source, &feeds) in topology.sources.iter().zip(sources) {
                fed[sets.root(source.node)] |= feeds.is_closed(if_unknown);
            }
            for earth in &topology.earths {
                earthed[sets.root(earth.node)] |= positions[earth.switch].is_closed(if_unknown);
            }
        }
        self.states.clear();
        for node in 0..nodes {
            let [surely, perhaps] = [0, 1].map(|which| self.sets[which].root(node));
            let earthed = self.earthed[0][surely];
            self.states.push(match (self.fed[0][surely], self.fed[1][perhaps]) {
                (true, _) if earthed => State::Unknown,
                (true, _) => State::Energised,
                (false, true) => State::Unknown,
                (false, false) if earthed => State::Earthed,
                (false, false) => State::Dead,
            });
        }
        &self.states
    }
}
