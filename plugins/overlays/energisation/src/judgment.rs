//! Judgments on equipment: state, reason, and the bindings that it rests on.

use std::cmp::Reverse;

use crate::basis::BasisLists;
use crate::contradiction::Contradictions;
use crate::network::Network;
use crate::readings::{ChangedReadings, Readings};
use crate::reasons::{Parts, ReasonTexts, Text};
use crate::state::{ChangedInputs, ChangedNodes, Energisation, Position, State};
use crate::switch_condition::SwitchCondition;
use crate::topology::{Equipment, Node, Switch};
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
    /// Consistent inputs: nothing contradicts the judged state.
    Normal,
    /// Contradictory inputs that leave the judged state valid.
    Abnormal,
    /// No judgment, because the inputs do not suffice.
    Unknown,
}

/// Judgment on a piece of equipment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PieceJudgment {
    /// State that is shown.
    pub state: PieceState,
    /// Index of the voltage level.
    pub level: usize,
    /// Verdict on the piece.
    pub standing: Standing,
    /// Reason, for people, by [`Judgments::text`]: never empty where the standing is unknown.
    pub reason: Text,
    /// Default that it rests on, by [`Judgments::text`]; empty for none.
    pub assumption: Text,
    /// List of the bindings that it rests on, by [`Judgments::basis`].
    pub basis: u32,
}

/// Judgments on all equipment, in its order.
#[derive(Clone, Debug, Default)]
pub struct Judgments {
    /// One for each piece; none for a piece at no node.
    pub pieces: Vec<Option<PieceJudgment>>,
    /// Bindings that they rest on, which judgments share.
    lists: BasisLists,
    /// Texts of reasons and assumptions, which judgments share.
    texts: ReasonTexts,
    /// Sources and earths that are surely connected.
    pub contradictions: Contradictions,
    energisation: Energisation,
    readings: Readings,
    positions: Vec<Position>,
    sources: Vec<Position>,
    /// Inputs whose readings changed since the last round.
    changed_inputs: ChangedInputs,
    changed_nodes: ChangedNodes,
    changed_pieces: Vec<Equipment>,
    /// Nodes that voltages cast doubt on in the last round.
    doubtful: Vec<u32>,
    /// Reports whether the last round judged only what had changed.
    was_partial: bool,
    /// Length of all texts when all were made last, bytes.
    text_base: usize,
    /// Number of lists when all were made last.
    list_base: usize,
}

/// Bytes of texts that nothing shows any more, besides as many as all texts had.
const MIN_TEXT_GARBAGE: usize = 1 << 20;
/// Lists that nothing rests on any more, besides as many as all lists were.
const MIN_LIST_GARBAGE: usize = 1 << 16;

impl Judgments {
    /// Returns the bindings of a list, sorted. Judgments may share one.
    #[inline]
    pub fn basis(&self, list: u32) -> &[u32] {
        self.lists.get(list)
    }

    /// Returns the number of lists, each of which is known by its index.
    pub fn list_count(&self) -> usize {
        self.lists.len()
    }

    /// Returns the number of bindings in all lists, at most [`MAX_BASIS`](crate::MAX_BASIS).
    pub fn binding_count(&self) -> usize {
        self.lists.binding_count()
    }

    /// Returns a reason or an assumption.
    pub fn text(&self, text: Text) -> &str {
        self.texts.get(text)
    }

    /// Returns the readings that the judgments rest on.
    pub fn readings(&self) -> &Readings {
        &self.readings
    }

    /// Reports whether the last round judged only what had changed.
    pub fn was_partial(&self) -> bool {
        self.was_partial
    }

    /// Returns the length of all texts, bytes.
    pub fn text_bytes(&self) -> usize {
        self.texts.len()
    }

    /// Returns the states of all nodes.
    pub fn energisation(&self) -> &Energisation {
        &self.energisation
    }

    /// Judges all equipment of a network anew, in the memory that is kept. Linear in the
    /// network and in the lists of bindings.
    pub fn judge(&mut self, network: &Network, readings: Readings) {
        self.readings = readings;
        self.positions.clear();
        self.positions.extend(self.readings.switches.iter().map(|reading| reading.position));
        self.sources.clear();
        self.sources.extend(self.readings.sources.iter().map(|reading| reading.position));
        self.changed_inputs.switches.clear();
        self.changed_inputs.switches.resize(self.positions.len(), false);
        self.changed_inputs.sources.clear();
        self.changed_inputs.sources.resize(self.sources.len(), false);
        let voltages = self.find_states(network);
        self.judge_all(network, voltages);
    }

    /// Judges the equipment anew that changed readings may concern; the others keep their
    /// judgments. The result is that of [`Judgments::judge`], but for the indices of lists
    /// and texts. Reports whether any reading differs from the one before.
    pub fn update(&mut self, network: &Network, changes: ChangedReadings) -> bool {
        let ChangedReadings { switches, sources, voltages } = changes;
        let mut changed_switches = Vec::new();
        for (switch, reading) in switches {
            if self.readings.switches[switch] != reading {
                self.positions[switch] = reading.position;
                self.readings.switches[switch] = reading;
                changed_switches.push(switch);
            }
        }
        let mut changed_sources = Vec::new();
        for (source, reading) in sources.into_iter().enumerate() {
            if self.readings.sources[source] != reading {
                self.sources[source] = reading.position;
                self.readings.sources[source] = reading;
                changed_sources.push(source);
            }
        }
        let has_other_voltages = self.readings.voltages != voltages;
        self.readings.voltages = voltages;
        if changed_switches.is_empty() && changed_sources.is_empty() && !has_other_voltages {
            return false;
        }
        let contradictions = std::mem::take(&mut self.contradictions);
        let voltages = self.find_states(network);
        if self.lists.has_no_room() || self.has_garbage() {
            self.judge_all(network, voltages);
            return true;
        }
        for &switch in &changed_switches {
            self.changed_inputs.switches[switch] = true;
        }
        for &source in &changed_sources {
            self.changed_inputs.sources[source] = true;
        }
        self.energisation.find_changes(&self.changed_inputs, &mut self.changed_nodes);
        let changed = &mut self.changed_nodes.nodes;
        // What voltages cast doubt on, now or before, is always judged anew.
        changed.append(&mut self.doubtful);
        self.doubtful.extend(voltages.nodes().map(|node| node as u32));
        changed.extend_from_slice(&self.doubtful);
        if self.contradictions != contradictions {
            let nodes = self.contradictions.nodes().chain(contradictions.nodes());
            changed.extend(nodes.map(|node| node as u32));
        }
        let contradictions = self.contradictions.all().len();
        self.texts.go_on(&changed_switches, &changed_sources, contradictions);
        self.judge_changed(network, voltages, &changed_switches);
        self.was_partial = true;
        for &switch in &changed_switches {
            self.changed_inputs.switches[switch] = false;
        }
        for &source in &changed_sources {
            self.changed_inputs.sources[source] = false;
        }
        if self.lists.has_no_room() {
            let Self { energisation, readings, positions, .. } = self;
            let voltages = VoltageDoubts::find(network, readings, energisation, positions);
            self.judge_all(network, voltages);
        }
        true
    }

    /// Reports whether texts and lists that nothing shows any more take more room than the
    /// others.
    fn has_garbage(&self) -> bool {
        self.texts.len() > self.text_base * 2 + MIN_TEXT_GARBAGE
            || self.lists.len() > self.list_base * 2 + MIN_LIST_GARBAGE
    }

    /// Finds states, borders and contradictions.
    fn find_states(&mut self, network: &Network) -> VoltageDoubts {
        let Self { energisation, readings, positions, sources, .. } = self;
        let topology = &network.topology;
        energisation.states(topology, positions, sources);
        energisation.find_borders(topology, positions);
        self.contradictions = Contradictions::find(energisation, topology, positions);
        VoltageDoubts::find(network, readings, energisation, positions)
    }

    fn judge_all(&mut self, network: &Network, voltages: VoltageDoubts) {
        let Self { pieces, lists, texts, contradictions, energisation, readings, .. } = self;
        let topology = &network.topology;
        lists.clear(topology.nodes.len(), energisation.dead_part_count());
        texts.clear(topology, contradictions.all().len());
        self.doubtful.clear();
        self.doubtful.extend(voltages.nodes().map(|node| node as u32));
        let judge = Judge { network, readings, energisation, contradictions, voltages };
        judge.make_lists_of_fed(None, lists);
        pieces.clear();
        let equipment = 0..topology.equipment.len();
        pieces.extend(equipment.map(|piece| judge.judge_piece(piece, lists, texts)));
        (self.text_base, self.list_base) = (texts.len(), lists.len());
        self.was_partial = false;
    }

    /// Judges the pieces at nodes that changed, and switches whose readings did.
    fn judge_changed(&mut self, network: &Network, voltages: VoltageDoubts, switches: &[Switch]) {
        let Self { pieces, lists, texts, contradictions, energisation, readings, .. } = self;
        let Self { changed_nodes, changed_pieces, .. } = self;
        lists.go_on(energisation.dead_part_count());
        let judge = Judge { network, readings, energisation, contradictions, voltages };
        judge.make_lists_of_fed(Some(&changed_nodes.fed), lists);
        changed_pieces.clear();
        for &node in &changed_nodes.nodes {
            changed_pieces.extend_from_slice(network.pieces_at.row(node as usize));
        }
        for &switch in switches {
            changed_pieces.extend_from_slice(network.pieces_of_switch.row(switch));
        }
        changed_pieces.sort_unstable();
        changed_pieces.dedup();
        for &piece in &*changed_pieces {
            pieces[piece] = judge.judge_piece(piece, lists, texts);
        }
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

    fn judge_piece(
        &self,
        piece: Equipment,
        lists: &mut BasisLists,
        texts: &mut ReasonTexts,
    ) -> Option<PieceJudgment> {
        let nodes = self.network.nodes_of.row(piece);
        let levels = &self.network.topology.levels;
        // Of what is between nodes, the more urgent one shows; then the first level.
        let urgency = |node: Node| (self.state_of(node), Reverse(levels[node]));
        let (&first, others) = nodes.split_first()?;
        let (mut node, mut most) = (first, urgency(first));
        for &other in others {
            let urgency = urgency(other);
            if urgency > most {
                (node, most) = (other, urgency);
            }
        }
        let (state, Reverse(level)) = most;
        let own = self.own_condition(piece);
        let (shown, standing) = shown_state(state, own.map(|(_, condition)| condition));
        let standing = match self.voltages.doubt_of_energised(node) {
            Some(_) if standing == Standing::Normal && state == State::Energised => {
                Standing::Abnormal
            }
            _ => standing,
        };
        let basis = self.piece_basis(piece, (node, state), lists);
        let Some(list) = basis.list else {
            return Some(PieceJudgment {
                state: PieceState::Unknown,
                level,
                standing: Standing::Unknown,
                reason: texts.too_long(),
                assumption: Text::default(),
                basis: 0,
            });
        };
        let topology = &self.network.topology;
        let source = basis.assumed;
        Some(PieceJudgment {
            state: shown,
            level,
            standing,
            reason: self.reason((node, state), own, &basis.hand_dressed, texts),
            assumption: source.map_or_else(Text::default, |of| texts.of_assumption(topology, of)),
            basis: list,
        })
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
        own: Option<(Switch, SwitchCondition)>,
        hand_dressed: &[Switch],
        texts: &mut ReasonTexts,
    ) -> Text {
        let (topology, readings) = (&self.network.topology, self.readings);
        let mut parts = Parts::new();
        if let Some((switch, condition)) = own
            && condition != SwitchCondition::Settled
        {
            parts.push(texts.of_switch(topology, readings, switch));
        }
        // Words that parts are made of, to say each once.
        let mut said = parts.clone();
        if let Some(words) = self.voltages.reason_of_dead(self.network, node) {
            parts.push(texts.add(&words));
        } else {
            match state {
                State::Contradiction => {
                    let index = self.contradictions.at(node);
                    parts.extend(
                        index.map(|index| {
                            texts.of_contradiction(topology, self.contradictions, index)
                        }),
                    );
                }
                State::Unknown => {
                    if let Some(input) = self.energisation.feeding_doubt(node) {
                        let words = texts.of_input(topology, readings, input);
                        if !texts.says(&said, words) {
                            parts.push(words);
                            said.push(words);
                        }
                    }
                }
                State::Dead => {
                    if let Some(input) = self.energisation.earthing_doubt(node) {
                        let words = texts.of_input(topology, readings, input);
                        if !texts.says(&said, words) {
                            parts.push(texts.of_earth(input, words));
                            said.push(words);
                        }
                    }
                }
                State::Energised => {
                    if let Some(doubt) = self.voltages.doubt_of_energised(node) {
                        parts.push(texts.add(&format!("fed by the topology, but {doubt}")));
                    } else if !parts.is_empty() {
                        parts.push(texts.at_an_end());
                    }
                }
                State::Earthed => {}
            }
        }
        for &switch in hand_dressed {
            let words = texts.of_switch(topology, readings, switch);
            if !texts.says(&said, words) {
                parts.push(words);
                said.push(words);
            }
        }
        texts.join(&parts)
    }
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
