//! States of nodes: two monotone bits, fed and earthed, over all completions of unknown
//! inputs.
//!
//! A completion assigns open or closed to each unknown input, and to nothing else. More
//! closed inputs feed and earth more, so a bit is certain where the search over surely
//! closed branches and that over possibly closed ones agree. Feeding passes every branch;
//! an earth passes no winding. Measurements and contradictions rule out no completion: to
//! decide with such pruning is NP-hard.

use crate::borders::Borders;
use crate::reachability::{Certainty, NONE, Passage, Reachability, Start, Step, SureStep};
use crate::topology::{Node, Topology};

/// Position of a switch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Position {
    /// Open in every completion.
    Open,
    /// Closed in every completion.
    Closed,
    /// Open or closed: in motion, contradictory, or of bad quality.
    #[default]
    Unknown,
}

/// State of a node, the most urgent to know last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum State {
    /// Surely not fed, and surely earthed.
    Earthed,
    /// Surely not fed, and perhaps earthed.
    Dead,
    /// Fed in some completions only.
    Unknown,
    /// Surely fed, not surely earthed.
    Energised,
    /// Surely fed and surely earthed, which cannot be.
    Contradiction,
}

/// Input that a state may rest on, by its index in the topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Input {
    /// Position of a switch, or the placing of an earth.
    Switch(usize),
    /// Feeding of a source.
    Source(usize),
}

/// States of all nodes, in room that is kept.
#[derive(Clone, Debug, Default)]
pub struct Energisation {
    fed: Reachability,
    earthed: Reachability,
    states: Vec<State>,
    borders: Borders,
    /// Results before those, to find what changed.
    before: Box<Results>,
}

/// Results of one round.
#[derive(Clone, Debug, Default)]
struct Results {
    fed: Reachability,
    earthed: Reachability,
    states: Vec<State>,
    borders: Borders,
}

/// Inputs whose readings changed since the last round.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChangedInputs {
    /// Flags of switches, in their order.
    pub(crate) switches: Vec<bool>,
    /// Flags of sources, in their order.
    pub(crate) sources: Vec<bool>,
}

impl ChangedInputs {
    /// Reports whether the reading of an input changed.
    #[inline]
    pub(crate) fn has(&self, input: Input) -> bool {
        match input {
            Input::Switch(switch) => self.switches[switch],
            Input::Source(source) => self.sources[source],
        }
    }
}

/// Nodes whose judgment may differ from that of the last round.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChangedNodes {
    /// Nodes whose state, doubt or basis may differ.
    pub(crate) nodes: Vec<u32>,
    /// Flags of nodes that are surely fed, by a way that differs.
    pub(crate) fed: Vec<bool>,
    earthed: Vec<bool>,
    /// Part of the last round that a part has the border of, or a mark.
    same_parts: Vec<u32>,
}

/// Mark of a part that no part of the last round has the border of.
const NO_SAME_PART: u32 = u32::MAX - 1;

impl Energisation {
    /// Works out the states of all nodes. `positions`: of switches; `sources`: feeding, as
    /// the position of a switch between each source and its node. Both are in the
    /// topology's order. Linear in the network.
    pub fn states(
        &mut self,
        topology: &Topology,
        positions: &[Position],
        sources: &[Position],
    ) -> &[State] {
        let nodes = topology.nodes.len();
        let adjacency = &topology.adjacency;
        let Self { fed, earthed, states, borders, before } = self;
        std::mem::swap(fed, &mut before.fed);
        std::mem::swap(earthed, &mut before.earthed);
        std::mem::swap(states, &mut before.states);
        std::mem::swap(borders, &mut before.borders);
        let feeding =
            topology.sources.iter().zip(sources).enumerate().map(|(index, (source, &position))| {
                Start { node: source.node, input: Input::Source(index), position, index }
            });
        let passage = Passage { adjacency, positions, passes_windings: true };
        self.fed.search(nodes, passage, feeding);
        let earthing = topology.earths.iter().enumerate().map(|(index, earth)| Start {
            node: earth.node,
            input: Input::Switch(earth.switch),
            position: positions[earth.switch],
            index,
        });
        let passage = Passage { passes_windings: false, ..passage };
        self.earthed.search(nodes, passage, earthing);
        self.states.clear();
        self.states.extend((0..nodes).map(|node| {
            let is_earthed = self.earthed.certainty(node) == Certainty::Surely;
            match (self.fed.certainty(node), is_earthed) {
                (Certainty::Surely, true) => State::Contradiction,
                (Certainty::Surely, false) => State::Energised,
                (Certainty::Perhaps, _) => State::Unknown,
                (Certainty::Not, true) => State::Earthed,
                (Certainty::Not, false) => State::Dead,
            }
        }));
        self.borders.forget();
        &self.states
    }

    /// The states that were worked out last.
    pub fn last_states(&self) -> &[State] {
        &self.states
    }

    /// Tells whether a source reaches a node.
    pub fn fed(&self, node: Node) -> Certainty {
        self.fed.certainty(node)
    }

    /// Tells whether a working earth reaches a node.
    pub fn earthed(&self, node: Node) -> Certainty {
        self.earthed.certainty(node)
    }

    /// The unknown input nearest to the source that a node is perhaps fed by: in some
    /// completion it decides alone.
    pub fn feeding_doubt(&self, node: Node) -> Option<Input> {
        self.fed.doubt(node)
    }

    /// The same of the earth that a node is perhaps earthed by.
    pub fn earthing_doubt(&self, node: Node) -> Option<Input> {
        self.earthed.doubt(node)
    }

    /// Nodes that are surely fed, the nearest to a source first.
    pub fn surely_fed(&self) -> impl Iterator<Item = Node> + '_ {
        self.fed.surely_reached()
    }

    /// The first step of a node that is surely fed to the source that feeds it.
    #[inline]
    pub(crate) fn step_to_source(&self, node: Node) -> SureStep {
        self.fed.sure_step(node)
    }

    /// Steps of a node to the source that feeds it.
    pub fn way_to_source(&self, node: Node) -> impl Iterator<Item = Step> + '_ {
        self.fed.way(node)
    }

    /// Steps of a node to the earth that earths it.
    pub fn way_to_earth(&self, node: Node) -> impl Iterator<Item = Step> + '_ {
        self.earthed.way(node)
    }

    /// Prepares [`Energisation::basis`] for what is dead or earthed. `positions` are those
    /// that the states were worked out of.
    pub fn find_borders(&mut self, topology: &Topology, positions: &[Position]) {
        let passage = Passage { adjacency: &topology.adjacency, positions, passes_windings: true };
        self.borders.find(topology, passage, &self.fed);
    }

    /// The part of the network without feeding that a node is in, after
    /// [`Energisation::find_borders`]. All nodes of a part have one border.
    pub fn dead_part(&self, node: Node) -> Option<usize> {
        self.borders.part(node)
    }

    /// Number of parts without feeding, after [`Energisation::find_borders`].
    pub fn dead_part_count(&self) -> usize {
        self.borders.part_count()
    }

    /// Finds the nodes whose judgment may differ from that of the last round, after
    /// [`Energisation::find_borders`] in both: another state, another input that it is in
    /// doubt by, another way, another border, or one with an input that changed. Linear in
    /// the network and its borders.
    pub(crate) fn find_changes(&self, inputs: &ChangedInputs, changed: &mut ChangedNodes) {
        let Self { fed, earthed, states, borders, before } = self;
        let nodes = states.len();
        let ChangedNodes { nodes: found, fed: fed_flags, earthed: earthed_flags, same_parts } =
            changed;
        fed.find_changed_ways(&before.fed, fed_flags, inputs);
        earthed.find_changed_ways(&before.earthed, earthed_flags, inputs);
        same_parts.clear();
        same_parts.resize(borders.part_count(), NONE);
        let mut is_other_border = |node: Node| {
            let (Some(part), Some(old)) = (borders.part(node), before.borders.part(node)) else {
                return true;
            };
            if same_parts[part] == NONE {
                let is_same = borders.is_same(part, &before.borders, old)
                    && !borders.inputs_at(node).any(|input| inputs.has(input));
                same_parts[part] = if is_same { old as u32 } else { NO_SAME_PART };
            }
            same_parts[part] != old as u32
        };
        let is_other_doubt = |now: Option<Input>, then: Option<Input>| {
            now != then || now.is_some_and(|input| inputs.has(input))
        };
        let mut is_changed = |node: Node| {
            let state = states[node];
            state != before.states[node]
                || match state {
                    State::Energised => fed_flags[node],
                    State::Contradiction => fed_flags[node] || earthed_flags[node],
                    State::Unknown => is_other_doubt(fed.doubt(node), before.fed.doubt(node)),
                    State::Dead => {
                        is_other_border(node)
                            || is_other_doubt(earthed.doubt(node), before.earthed.doubt(node))
                    }
                    State::Earthed => is_other_border(node) || earthed_flags[node],
                }
        };
        found.clear();
        found.extend((0..nodes).filter(|&node| is_changed(node)).map(|node| node as u32));
    }

    /// Names the inputs that the state of a node rests on: while all of them stay as they
    /// are, and whatever becomes of the others, the node stays in its state. Names nothing
    /// for what is unknown.
    pub fn basis(&self, topology: &Topology, node: Node, mut each: impl FnMut(Input)) {
        let state = self.states[node];
        if matches!(state, State::Energised | State::Contradiction) {
            inputs_of_way(topology, self.way_to_source(node), Input::Source, &mut each);
        }
        if matches!(state, State::Earthed | State::Contradiction) {
            let earth = |earth: usize| Input::Switch(topology.earths[earth].switch);
            inputs_of_way(topology, self.way_to_earth(node), earth, &mut each);
        }
        if matches!(state, State::Dead | State::Earthed) {
            self.borders.inputs_at(node).for_each(&mut each);
        }
    }
}

fn inputs_of_way(
    topology: &Topology,
    way: impl Iterator<Item = Step>,
    start: impl Fn(usize) -> Input,
    each: &mut impl FnMut(Input),
) {
    for step in way {
        match step {
            Step::Start(index) => each(start(index)),
            Step::Branch { branch, .. } => {
                topology.branches[branch]
                    .switch
                    .map(Input::Switch)
                    .into_iter()
                    .for_each(&mut *each);
            }
        }
    }
}
