//! Doubts that measured voltages cast on the topology: voltage where no source reaches, and
//! none where one does. They change no bit of the network.

use std::collections::HashMap;

use crate::network::Network;
use crate::reachability::{Certainty, Passage, Reachability, Start, Step};
use crate::readings::Readings;
use crate::state::{Energisation, Input, Position, State};
use crate::topology::Node;
use crate::voltage::VoltageEvidence;

/// Doubts that voltages cast on nodes.
#[derive(Clone, Debug, Default)]
pub(crate) struct VoltageDoubts {
    /// Reach of measured voltages over nodes without feeding; none where there are none.
    reach: Option<Reachability>,
    /// Instrument transformer whose voltage reaches each node.
    origins: Vec<Option<u32>>,
    /// Binding of each instrument transformer that has voltage, or had; and whether it has.
    live: Vec<Option<(usize, bool)>>,
    /// Words at nodes that are fed.
    unconfirmed: HashMap<Node, String>,
}

impl VoltageDoubts {
    /// Compares measured voltages with states. All that may be joined to a voltage is in
    /// doubt with it, where no source reaches it.
    pub(crate) fn find(
        network: &Network,
        readings: &Readings,
        energisation: &Energisation,
        positions: &[Position],
    ) -> Self {
        let mut doubts = Self::default();
        let mut starts = Vec::new();
        for (index, (wiring, evidence)) in
            network.voltages.iter().zip(&readings.voltages).enumerate()
        {
            let position = match (evidence.present, evidence.was_present) {
                (Some(_), _) => Position::Closed,
                (None, Some(_)) => Position::Unknown,
                (None, None) => Position::Open,
            };
            match energisation.last_states()[wiring.node] {
                State::Dead | State::Earthed if position != Position::Open => {
                    let input = Input::Source(index);
                    starts.push(Start { node: wiring.node, input, position, index });
                }
                State::Energised => {
                    if let Some(doubt) = &evidence.doubt {
                        doubts.unconfirmed.entry(wiring.node).or_insert_with(|| doubt.clone());
                    }
                }
                _ => {}
            }
        }
        if starts.is_empty() {
            return doubts;
        }
        let topology = &network.topology;
        let passage = Passage { adjacency: &topology.adjacency, positions, passes_windings: true };
        let mut reach = Reachability::default();
        reach.search(topology.nodes.len(), passage, starts.iter().copied());
        doubts.origins = reach.origins();
        doubts.reach = Some(reach);
        doubts.live = readings.voltages.iter().map(live_binding).collect();
        doubts
    }

    /// Lists the nodes that voltages cast doubt on.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = Node> + '_ {
        let reached = 0..self.origins.len();
        let reached = reached.filter(|&node| self.certainty(node) != Certainty::Not);
        self.unconfirmed.keys().copied().chain(reached)
    }

    fn certainty(&self, node: Node) -> Certainty {
        self.reach.as_ref().map_or(Certainty::Not, |reach| reach.certainty(node))
    }

    /// The instrument transformer whose voltage reaches a node.
    fn voltage_at(&self, node: Node) -> Option<usize> {
        self.origins.get(node).copied().flatten().map(|voltage| voltage as usize)
    }

    /// The state of a node that no source reaches, and a measured voltage does.
    pub(crate) fn override_state(&self, node: Node) -> Option<State> {
        match self.certainty(node) {
            Certainty::Surely => Some(State::Contradiction),
            Certainty::Perhaps => Some(State::Unknown),
            Certainty::Not => None,
        }
    }

    /// Tells of the voltage that is measured where no source reaches.
    pub(crate) fn reason_of_dead(&self, network: &Network, node: Node) -> Option<String> {
        let voltage = self.voltage_at(node)?;
        let (_, is_now) = self.live[voltage]?;
        let id = &network.voltages[voltage].equipment;
        Some(match (is_now, self.certainty(node)) {
            (true, Certainty::Surely) => {
                format!("{id} measures voltage, though no source reaches it")
            }
            (true, _) => format!("perhaps joined to {id}, which measures voltage without a source"),
            (false, _) => {
                format!("{id} measured voltage when it was last good, though no source reaches it")
            }
        })
    }

    /// The binding of the voltage that surely reaches a node without feeding, and the
    /// switches on the way.
    pub(crate) fn bindings(&self, network: &Network, node: Node) -> Option<(usize, Vec<Input>)> {
        if self.certainty(node) != Certainty::Surely {
            return None;
        }
        let (binding, _) = self.live[self.voltage_at(node)?]?;
        let branches = &network.topology.branches;
        let inputs = self.reach.as_ref()?.way(node).filter_map(|step| match step {
            Step::Branch { branch, .. } => branches[branch].switch.map(Input::Switch),
            Step::Start(_) => None,
        });
        Some((binding, inputs.collect()))
    }

    /// Tells of a voltage that is missing at a node that is fed.
    pub(crate) fn doubt_of_energised(&self, node: Node) -> Option<&str> {
        self.unconfirmed.get(&node).map(String::as_str)
    }
}

fn live_binding(evidence: &VoltageEvidence) -> Option<(usize, bool)> {
    let now = evidence.present.map(|binding| (binding, true));
    now.or(evidence.was_present.map(|binding| (binding, false)))
}
