//! Judgments on equipment: state, reason, and the bindings that it rests on.

use std::cmp::Reverse;
use std::ops::Range;

use crate::basis::BasisList;
use crate::contradiction::{Contradictions, name_of_source};
use crate::network::Network;
use crate::source_reading::SourceReading;
use crate::state::{Energisation, Input, Position, State};
use crate::switch_condition::SwitchCondition;
use crate::switch_reading::SwitchReading;
use crate::topology::{Equipment, Node, Topology};
use crate::voltage::VoltageEvidence;
use crate::voltage_doubt::VoltageDoubts;

/// State that a piece of equipment is shown in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceState {
    /// Energised, at the piece's level.
    Energised,
    /// Surely not fed, and perhaps earthed.
    Dead,
    /// Surely not fed, and surely earthed.
    Earthed,
    /// Fed in some completions only.
    Unknown,
    /// In doubt, as inputs contradict each other.
    Contradiction,
    /// Switch whose poles disagree.
    PolesDisagree,
    /// Switch between its end positions.
    InMotion,
    /// Portable earth, or the piece that it is placed at.
    PortableEarth,
    /// Switch that is racked out.
    RackedOut,
    /// Switch whose position is set by hand.
    HandDressed,
}

/// Verdict on a piece of equipment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// As it should be: nothing contradicts.
    Normal,
    /// Inputs contradict each other, and the state holds all the same.
    Abnormal,
    /// Not to be judged.
    Unknown,
}

/// Judgment on a piece of equipment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PieceJudgment {
    /// State that is shown.
    pub state: PieceState,
    /// Index of the voltage level.
    pub level: usize,
    /// Verdict on the piece.
    pub standing: Standing,
    /// Reason, for people: never empty where the standing is unknown.
    pub reason: String,
    /// Default that it rests on; empty for none.
    pub assumption: String,
    /// Bindings that it rests on, as a range of [`Judgments::basis`].
    pub basis: Range<usize>,
}

/// Judgments on all equipment, in its order.
#[derive(Clone, Debug, Default)]
pub struct Judgments {
    /// One for each piece; none for a piece at no node.
    pub pieces: Vec<Option<PieceJudgment>>,
    /// Bindings that they rest on, which judgments share.
    lists: BasisList,
    /// Sources and earths that are surely connected.
    pub contradictions: Contradictions,
}

/// Readings of all inputs of one frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    /// Readings of switches, in the topology's order.
    pub switches: Vec<SwitchReading>,
    /// Readings of all sources.
    pub sources: Vec<SourceReading>,
    /// Readings of all instrument transformers.
    pub voltages: Vec<VoltageEvidence>,
}

impl Readings {
    /// Tells why an input is unknown, or what is remarkable of it.
    pub fn explain(&self, topology: &Topology, input: Input) -> String {
        let (id, words) = match input {
            Input::Switch(switch) => {
                let id = topology.switches[switch].as_str();
                (id, self.switches[switch].condition.explain(id))
            }
            Input::Source(source) => {
                let id = name_of_source(topology, source);
                (id, self.sources[source].condition.explain(id))
            }
        };
        if words.is_empty() { format!("{id} is not known") } else { words }
    }

    /// Bindings that an input rests on.
    pub fn bindings(&self, input: Input) -> &[usize] {
        match input {
            Input::Switch(switch) => &self.switches[switch].basis,
            Input::Source(source) => &self.sources[source].basis,
        }
    }
}

impl Judgments {
    /// Bindings that all judgments rest on, each a range of them. Judgments may share one.
    pub fn basis(&self) -> &[usize] {
        &self.lists.bindings
    }

    /// Judges all equipment of a network anew, in the room that is there.
    pub fn judge(
        &mut self,
        network: &Network,
        readings: &Readings,
        energisation: &mut Energisation,
    ) {
        let topology = &network.topology;
        let positions: Vec<Position> = readings.switches.iter().map(|of| of.position).collect();
        let sources: Vec<Position> = readings.sources.iter().map(|of| of.position).collect();
        energisation.states(topology, &positions, &sources);
        energisation.find_borders(topology, &positions);
        self.contradictions = Contradictions::find(energisation, topology, &positions);
        let voltages = VoltageDoubts::find(network, readings, energisation, &positions);
        self.lists.clear(topology.nodes.len(), energisation.dead_part_count());
        self.pieces.clear();
        let Self { pieces, lists, contradictions } = self;
        let judge = Judge { network, readings, energisation, contradictions, voltages };
        let equipment = 0..topology.equipment.len();
        pieces.extend(equipment.map(|piece| judge.judge_piece(piece, lists)));
    }
}

/// Results of one frame that judgments are made of.
pub(crate) struct Judge<'a> {
    pub(crate) network: &'a Network,
    pub(crate) readings: &'a Readings,
    pub(crate) energisation: &'a Energisation,
    contradictions: &'a Contradictions,
    pub(crate) voltages: VoltageDoubts,
}

impl Judge<'_> {
    /// The state of a node, measured voltages included.
    fn state_of(&self, node: Node) -> State {
        let state = self.energisation.last_states()[node];
        self.voltages.override_state(node).unwrap_or(state)
    }

    fn judge_piece(&self, piece: Equipment, basis: &mut BasisList) -> Option<PieceJudgment> {
        let nodes = self.network.nodes_of.row(piece);
        let levels = &self.network.topology.levels;
        // Of what is between nodes, the more urgent one shows; then the first level.
        let urgency = |node: Node| (self.state_of(node), Reverse(levels[node]));
        let most = nodes.iter().map(|&node| urgency(node)).max()?;
        let node = nodes.iter().copied().find(|&node| urgency(node) == most)?;
        let (state, Reverse(level)) = most;
        let own = self.own_condition(piece);
        let (shown, standing) = shown_state(state, own.map(|(_, condition)| condition));
        let standing = match self.voltages.doubt_of_energised(node) {
            Some(_) if standing == Standing::Normal && state == State::Energised => {
                Standing::Abnormal
            }
            _ => standing,
        };
        let mut judgment = PieceJudgment {
            state: shown,
            level,
            standing,
            reason: self.reason((node, state), own),
            assumption: String::new(),
            basis: 0..0,
        };
        self.rest(piece, (node, state), basis, &mut judgment);
        Some(judgment)
    }

    /// The condition of the switch that a piece is, or of the portable earth at it: the
    /// most urgent one.
    fn own_condition(&self, piece: Equipment) -> Option<(usize, SwitchCondition)> {
        let switches = self.network.switches_of.row(piece).iter();
        let conditions = switches.map(|&switch| (switch, self.readings.switches[switch].condition));
        conditions.max_by_key(|(_, condition)| urgency_of(*condition))
    }

    fn reason(
        &self,
        (node, state): (Node, State),
        own: Option<(usize, SwitchCondition)>,
    ) -> String {
        let topology = &self.network.topology;
        let mut reason = String::new();
        if let Some((switch, condition)) = own {
            add(&mut reason, &condition.explain(&topology.switches[switch]));
        }
        if let Some(words) = self.voltages.reason_of_dead(self.network, node) {
            add(&mut reason, &words);
            return reason;
        }
        match state {
            State::Contradiction => {
                let contradiction = self.contradictions.at(node);
                if let Some(contradiction) = contradiction {
                    let contradiction = &self.contradictions.all()[contradiction];
                    add(&mut reason, &contradiction.explain(topology));
                }
            }
            State::Unknown => {
                if let Some(input) = self.energisation.feeding_doubt(node) {
                    add(&mut reason, &self.readings.explain(topology, input));
                }
            }
            State::Dead => {
                if let Some(input) = self.energisation.earthing_doubt(node) {
                    let words = self.readings.explain(topology, input);
                    if !reason.contains(&words) {
                        add(&mut reason, &format!("perhaps earthed: {words}"));
                    }
                }
            }
            State::Energised => {
                if let Some(doubt) = self.voltages.doubt_of_energised(node) {
                    add(&mut reason, &format!("fed by the topology, but {doubt}"));
                } else if !reason.is_empty() {
                    add(&mut reason, "energised at an end");
                }
            }
            State::Earthed => {}
        }
        reason
    }
}

/// Adds words to a reason, once.
fn add(reason: &mut String, words: &str) {
    if words.is_empty() || reason.contains(words) {
        return;
    }
    if !reason.is_empty() {
        reason.push_str("; ");
    }
    reason.push_str(words);
}

fn urgency_of(condition: SwitchCondition) -> u8 {
    match condition {
        SwitchCondition::PolesDisagree { .. } => 5,
        SwitchCondition::InMotion => 4,
        condition if condition.is_fault() => 3,
        SwitchCondition::PortableEarthPlaced => 2,
        SwitchCondition::RackedOut | SwitchCondition::HandDressed => 1,
        _ => 0,
    }
}

/// The state that is shown of a piece, by its nodes and its own condition.
fn shown_state(state: State, own: Option<SwitchCondition>) -> (PieceState, Standing) {
    let of_nodes = match state {
        State::Energised => (PieceState::Energised, Standing::Normal),
        State::Dead => (PieceState::Dead, Standing::Normal),
        State::Earthed => (PieceState::Earthed, Standing::Normal),
        State::Unknown => (PieceState::Unknown, Standing::Unknown),
        State::Contradiction => (PieceState::Contradiction, Standing::Unknown),
    };
    let Some(own) = own.filter(|_| state != State::Contradiction) else { return of_nodes };
    match own {
        SwitchCondition::PolesDisagree { .. } => (PieceState::PolesDisagree, Standing::Abnormal),
        SwitchCondition::InMotion => (PieceState::InMotion, Standing::Unknown),
        own if own.is_fault() => (of_nodes.0, Standing::Unknown),
        // A portable earth or a position set by hand must not hide that feeding is possible.
        _ if state == State::Unknown => of_nodes,
        SwitchCondition::PortableEarthPlaced if state == State::Earthed => {
            (PieceState::PortableEarth, Standing::Normal)
        }
        SwitchCondition::RackedOut => (PieceState::RackedOut, Standing::Normal),
        SwitchCondition::HandDressed => (PieceState::HandDressed, Standing::Normal),
        _ => of_nodes,
    }
}
