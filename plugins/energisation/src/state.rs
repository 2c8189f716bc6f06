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
    /// Why nodes are fed, and why they are earthed.
    ways: [Vec<Option<Step>>; 2],
    /// What keeps each set of nodes, by its root, from being fed.
    borders: Vec<Vec<Input>>,
}

/// What a state may rest on, by its index in the topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Input {
    /// The position of a switch.
    Switch(usize),
    /// Whether a source feeds.
    Source(usize),
}

/// How a node is joined to what feeds or earths it.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// What holds the step; none where it always holds.
    by: Option<Input>,
    /// The next node on the way; none where it is at its end.
    to: Option<usize>,
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
        self.find_ways(topology, positions, sources);
        self.find_borders(topology, positions);
        &self.states
    }

    /// What the state of a node rests on: while all of it stays as it is known now, and
    /// whatever becomes of the rest, the node stays in its state. Nothing for what is
    /// unknown.
    pub fn basis(&mut self, node: usize, mut each: impl FnMut(Input)) {
        let state = self.states[node];
        if matches!(state, State::Dead | State::Earthed) {
            let root = self.sets[1].root(node);
            self.borders[root].iter().copied().for_each(&mut each);
        }
        let ways = match state {
            State::Energised => &self.ways[0],
            State::Earthed => &self.ways[1],
            State::Dead | State::Unknown => return,
        };
        let mut at = Some(node);
        while let Some(step) = at.and_then(|node| ways[node]) {
            step.by.into_iter().for_each(&mut each);
            at = step.to;
        }
    }

    /// The shortest ways over closed switches to what feeds and earths for certain.
    fn find_ways(&mut self, topology: &Topology, positions: &[Position], sources: &[Position]) {
        let closed = |position: Position| position == Position::Closed;
        let feeding = topology.sources.iter().zip(sources).enumerate();
        let feeding = feeding.filter(|(_, (_, feeds))| closed(**feeds));
        let feeding = feeding.map(|(index, (source, _))| {
            (source.node, source.equipment.as_ref().map(|_| Input::Source(index)))
        });
        let earthing = topology.earths.iter().filter(|earth| closed(positions[earth.switch]));
        let earthing = earthing.map(|earth| (earth.node, Some(Input::Switch(earth.switch))));
        spread(&mut self.ways[0], topology, positions, feeding);
        spread(&mut self.ways[1], topology, positions, earthing);
    }

    /// Open switches between sets that may each be joined within, and sources that do not
    /// feed.
    fn find_borders(&mut self, topology: &Topology, positions: &[Position]) {
        let perhaps = &mut self.sets[1];
        self.borders.iter_mut().for_each(Vec::clear);
        self.borders.resize(topology.nodes.len(), Vec::new());
        for branch in &topology.branches {
            let Some(switch) = branch.switch else { continue };
            let [a, b] = branch.ends.map(|end| perhaps.root(end));
            if positions[switch] == Position::Open && a != b {
                self.borders[a].push(Input::Switch(switch));
                self.borders[b].push(Input::Switch(switch));
            }
        }
        for (index, source) in topology.sources.iter().enumerate() {
            if source.equipment.is_some() {
                let root = perhaps.root(source.node);
                self.borders[root].push(Input::Source(index));
            }
        }
    }
}

/// Fills in the next step of each node towards one of some ends, breadth first.
fn spread(
    ways: &mut Vec<Option<Step>>,
    topology: &Topology,
    positions: &[Position],
    ends: impl Iterator<Item = (usize, Option<Input>)>,
) {
    ways.clear();
    ways.resize(topology.nodes.len(), None);
    let mut reached = Vec::new();
    for (node, by) in ends {
        if ways[node].is_none() {
            ways[node] = Some(Step { by, to: None });
            reached.push(node);
        }
    }
    let mut next = 0;
    while let Some(&node) = reached.get(next) {
        next += 1;
        for &branch in &topology.branches_at[node] {
            let Branch { ends: [a, b], switch, .. } = topology.branches[branch];
            let other = if a == node { b } else { a };
            let is_closed = switch.is_none_or(|switch| positions[switch] == Position::Closed);
            if is_closed && ways[other].is_none() {
                ways[other] = Some(Step { by: switch.map(Input::Switch), to: Some(node) });
                reached.push(other);
            }
        }
    }
}
