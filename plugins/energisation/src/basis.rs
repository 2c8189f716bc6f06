//! Bindings that judgments rest on: those of the inputs that hold a state, shared by all
//! equipment at a node or in a part without feeding.

use std::ops::Range;

use crate::contradiction::name_of_source;
use crate::judgment::{Judge, PieceJudgment, PieceState, Standing};
use crate::state::{Input, State};
use crate::switch_condition::SwitchCondition;
use crate::topology::{Equipment, Node};

/// Bindings in all lists of one frame. What rests on more is unknown: nobody could tell in
/// time when it holds no longer.
pub const MAX_BASIS: usize = 1 << 22;

/// Lists of bindings, one after another, in room that is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct BasisList {
    pub(crate) bindings: Vec<usize>,
    /// List of each node, where it is made.
    of_nodes: Vec<Option<NodeBasis>>,
    /// List of each part without feeding.
    of_parts: Vec<Option<NodeBasis>>,
    /// Bindings that may still be looked at, so that long ways cost no more than lists do.
    room: usize,
}

/// List of a node, and what is remarkable of its inputs.
#[derive(Clone, Copy, Debug)]
struct NodeBasis {
    start: usize,
    end: usize,
    /// A switch on it whose position is set by hand.
    hand_dressed: Option<u32>,
    /// A source on it that was taken to feed by a default.
    assumed: Option<u32>,
    /// Reports whether the lists of the frame had no room for it.
    is_too_long: bool,
}

impl BasisList {
    /// Empties all lists for another frame.
    pub(crate) fn clear(&mut self, nodes: usize, parts: usize) {
        self.bindings.clear();
        self.of_nodes.clear();
        self.of_nodes.resize(nodes, None);
        self.of_parts.clear();
        self.of_parts.resize(parts, None);
        self.room = MAX_BASIS;
    }

    /// Ends a list that begins at an index: sorted, and each binding once. `None` where
    /// there is no room for it.
    fn finish(&mut self, start: usize) -> Option<Range<usize>> {
        self.room = self.room.saturating_sub(self.bindings.len() - start);
        if self.room == 0 {
            self.bindings.truncate(start);
            return None;
        }
        let list = &mut self.bindings[start..];
        list.sort_unstable();
        let mut kept = 0;
        for at in 0..list.len() {
            if at == 0 || list[at] != list[kept - 1] {
                list[kept] = list[at];
                kept += 1;
            }
        }
        self.bindings.truncate(start + kept);
        Some(start..start + kept)
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
        let decided_by: &[Node] = match state {
            // What is so at one end is so whatever becomes of the other.
            State::Energised | State::Contradiction => std::slice::from_ref(&node),
            State::Dead | State::Earthed => self.network.nodes_of.row(piece),
            State::Unknown => &[],
        };
        for &node in decided_by {
            let of = self.list_of_node(node, list);
            if of.is_too_long {
                return give_up(judgment);
            }
            self.remark(of, judgment);
        }
        let own = self.network.switches_of.row(piece).iter();
        let mut own = own.map(|&switch| self.readings.bindings(Input::Switch(switch)));
        // Nodes of one part without feeding have one list.
        let first = decided_by.first().map(|&node| self.list_of_node(node, list));
        let is_shared = |&node: &Node| {
            let of = self.list_of_node(node, list);
            first.is_some_and(|first| (first.start, first.end) == (of.start, of.end))
        };
        let has_one_list = decided_by.iter().all(is_shared);
        let range = match first {
            Some(of) if has_one_list && own.clone().all(<[usize]>::is_empty) => {
                Some(of.start..of.end)
            }
            _ => {
                let start = list.bindings.len();
                let lists = if has_one_list { decided_by.get(..1) } else { Some(decided_by) };
                for &node in lists.unwrap_or_default() {
                    let of = self.list_of_node(node, list);
                    list.bindings.extend_from_within(of.start..of.end);
                }
                own.by_ref().for_each(|own| list.bindings.extend_from_slice(own));
                list.finish(start)
            }
        };
        match range {
            Some(range) => judgment.basis = range,
            None => give_up(judgment),
        }
    }

    fn remark(&self, of: NodeBasis, judgment: &mut PieceJudgment) {
        let topology = &self.network.topology;
        if let Some(switch) = of.hand_dressed {
            let words = SwitchCondition::HandDressed.explain(&topology.switches[switch as usize]);
            if !judgment.reason.contains(&words) {
                let joint = if judgment.reason.is_empty() { "" } else { "; " };
                judgment.reason += joint;
                judgment.reason += &words;
            }
        }
        if let Some(source) = of.assumed {
            let source = name_of_source(topology, source as usize);
            judgment.assumption = format!("any power of {source} is feeding, as it has no rating");
        }
    }

    fn list_of_node(&self, node: Node, list: &mut BasisList) -> NodeBasis {
        if let Some(known) = list.of_nodes[node] {
            return known;
        }
        let is_dead = self.energisation.last_states()[node] == State::Dead
            && self.voltages.override_state(node).is_none();
        let part = self.energisation.dead_part(node).filter(|_| is_dead);
        let known = part.and_then(|part| list.of_parts[part]);
        let made = known.unwrap_or_else(|| self.make_list(node, list));
        list.of_nodes[node] = Some(made);
        if let Some(part) = part {
            list.of_parts[part] = Some(made);
        }
        made
    }

    fn make_list(&self, node: Node, list: &mut BasisList) -> NodeBasis {
        let start = list.bindings.len();
        let mut made =
            NodeBasis { start, end: start, hand_dressed: None, assumed: None, is_too_long: true };
        if list.room == 0 {
            return made;
        }
        let mut rest_on = |input: Input| {
            list.bindings.extend_from_slice(self.readings.bindings(input));
            match input {
                Input::Switch(switch) => {
                    let condition = self.readings.switches[switch].condition;
                    if condition == SwitchCondition::HandDressed {
                        made.hand_dressed = made.hand_dressed.or(Some(switch as u32));
                    }
                }
                Input::Source(source) => {
                    if self.readings.sources[source].is_assumed {
                        made.assumed = made.assumed.or(Some(source as u32));
                    }
                }
            }
        };
        self.energisation.basis(&self.network.topology, node, &mut rest_on);
        if let Some((binding, inputs)) = self.voltages.bindings(self.network, node) {
            inputs.into_iter().for_each(&mut rest_on);
            list.bindings.push(binding);
        }
        if let Some(range) = list.finish(start) {
            (made.end, made.is_too_long) = (range.end, false);
        }
        made
    }
}

/// Makes unknown what rests on too much.
fn give_up(judgment: &mut PieceJudgment) {
    judgment.state = PieceState::Unknown;
    judgment.standing = Standing::Unknown;
    judgment.reason = "it rests on more tags than are checked in a frame: split the network".into();
    judgment.basis = 0..0;
}
