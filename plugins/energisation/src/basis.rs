//! Bindings that judgments rest on: those of the inputs that hold a state, shared by all
//! equipment at a node or in a part without feeding.

use std::collections::HashMap;
use std::ops::Range;

use crate::contradiction::name_of_source;
use crate::judgment::{Judge, PieceJudgment, PieceState, Standing};
use crate::state::{Input, State};
use crate::switch_reading::SwitchCondition;
use crate::topology::{Equipment, Node};

/// Bindings in all lists of one frame. Beyond that, what rests on more is unknown: nobody
/// could tell in time when it holds no longer.
pub const MAX_BASIS: usize = 1 << 22;

/// Lists of bindings, one after another.
pub(crate) struct BasisList {
    bindings: Vec<usize>,
    /// List of each node, where it is made.
    of_nodes: Vec<Option<NodeBasis>>,
    /// List of each part without feeding.
    of_parts: HashMap<usize, NodeBasis>,
    /// Bindings that may still be looked at, so that long ways cost no more than lists do.
    room: usize,
}

/// List of a node, and what is remarkable of its inputs.
#[derive(Clone, Debug, Default)]
struct NodeBasis {
    range: Range<usize>,
    /// A switch on it whose position is set by hand.
    hand_dressed: Option<usize>,
    /// A source on it that was taken to feed by a default.
    assumed: Option<usize>,
    /// Reports whether the lists of the frame had no room for it.
    is_too_long: bool,
}

impl BasisList {
    pub(crate) fn new(nodes: usize) -> Self {
        Self {
            bindings: Vec::new(),
            of_nodes: vec![None; nodes],
            of_parts: HashMap::new(),
            room: MAX_BASIS,
        }
    }

    /// Gives all bindings.
    pub(crate) fn into_bindings(self) -> Vec<usize> {
        self.bindings
    }

    /// Adds a list, sorted and each binding once.
    fn add(&mut self, mut bindings: Vec<usize>) -> Option<Range<usize>> {
        self.room = self.room.checked_sub(bindings.len()).unwrap_or_default();
        if self.room == 0 {
            return None;
        }
        bindings.sort_unstable();
        bindings.dedup();
        let start = self.bindings.len();
        self.bindings.append(&mut bindings);
        Some(start..self.bindings.len())
    }
}

impl Judge<'_> {
    /// Fills in what a judgment rests on.
    pub(crate) fn rest(
        &self,
        piece: Equipment,
        (node, state): (Node, State),
        list: &mut BasisList,
        judgment: &mut PieceJudgment,
    ) {
        let nodes = &self.network.nodes_of[piece];
        let switches = &self.network.switches_of[piece];
        let own = switches.iter().map(|&switch| Input::Switch(switch));
        let own: Vec<usize> =
            own.flat_map(|input| self.readings.bindings(input)).copied().collect();
        let decided_by: &[Node] = match state {
            // What is so at one end is so whatever becomes of the other.
            State::Energised | State::Contradiction => std::slice::from_ref(&node),
            State::Dead | State::Earthed => nodes,
            State::Unknown => &[],
        };
        let lists: Vec<NodeBasis> =
            decided_by.iter().map(|&node| self.list_of_node(node, list)).collect();
        let range = match (&*lists, &*own) {
            ([only], []) => Some(only.range.clone()),
            _ => {
                let nodes = lists.iter().flat_map(|of| &list.bindings[of.range.clone()]);
                let bindings = nodes.copied().chain(own).collect();
                list.add(bindings)
            }
        };
        match range {
            Some(range) if !lists.iter().any(|of| of.is_too_long) => judgment.basis = range,
            _ => {
                judgment.state = PieceState::Unknown;
                judgment.standing = Standing::Unknown;
                judgment.reason =
                    "it rests on more tags than are checked in a frame: split the network".into();
                return;
            }
        }
        self.remark(&lists, judgment);
    }

    fn remark(&self, lists: &[NodeBasis], judgment: &mut PieceJudgment) {
        let topology = &self.network.topology;
        if let Some(switch) = lists.iter().find_map(|of| of.hand_dressed) {
            let words = SwitchCondition::HandDressed.explain(&topology.switches[switch]);
            if !judgment.reason.contains(&words) {
                let joint = if judgment.reason.is_empty() { "" } else { "; " };
                judgment.reason += &format!("{joint}{words}");
            }
        }
        if let Some(source) = lists.iter().find_map(|of| of.assumed) {
            let source = name_of_source(topology, source);
            judgment.assumption = format!("any power of {source} is feeding, as it has no rating");
        }
    }

    fn list_of_node(&self, node: Node, list: &mut BasisList) -> NodeBasis {
        if let Some(known) = &list.of_nodes[node] {
            return known.clone();
        }
        let is_dead = self.energisation.last_states()[node] == State::Dead
            && self.voltages.override_state(node).is_none();
        let part = self.energisation.dead_part(node).filter(|_| is_dead);
        let known = part.and_then(|part| list.of_parts.get(&part)).cloned();
        let no_room = || NodeBasis { is_too_long: true, ..NodeBasis::default() };
        let known = known.or_else(|| (list.room == 0).then(no_room));
        let made = known.unwrap_or_else(|| self.make_list(node, list));
        list.of_nodes[node] = Some(made.clone());
        if let Some(part) = part {
            list.of_parts.entry(part).or_insert_with(|| made.clone());
        }
        made
    }

    fn make_list(&self, node: Node, list: &mut BasisList) -> NodeBasis {
        let mut bindings = Vec::new();
        let (mut hand_dressed, mut assumed) = (None, None);
        let mut rest_on = |input: Input| {
            bindings.extend_from_slice(self.readings.bindings(input));
            match input {
                Input::Switch(switch) => {
                    let condition = self.readings.switches[switch].condition;
                    if condition == SwitchCondition::HandDressed {
                        hand_dressed = hand_dressed.or(Some(switch));
                    }
                }
                Input::Source(source) => {
                    if self.readings.sources[source].is_assumed {
                        assumed = assumed.or(Some(source));
                    }
                }
            }
        };
        let topology = &self.network.topology;
        self.energisation.basis(topology, node, &mut rest_on);
        if let Some((binding, inputs)) = self.voltages.bindings(self.network, node) {
            inputs.into_iter().for_each(&mut rest_on);
            bindings.push(binding);
        }
        let range = list.add(bindings);
        let is_too_long = range.is_none();
        NodeBasis { range: range.unwrap_or(0..0), hand_dressed, assumed, is_too_long }
    }
}
