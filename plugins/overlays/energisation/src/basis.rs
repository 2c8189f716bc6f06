//! Bindings that judgments rest on: those of the inputs that hold a state, shared by all
//! equipment at a node or in a part without feeding.

use smallvec::SmallVec;

use crate::judgment::Judge;
use crate::reachability::{NONE, SureStep};
use crate::state::{Input, State};
use crate::switch_condition::SwitchCondition;
use crate::topology::{Equipment, Node, Switch};

/// Bindings in all lists of one frame. What rests on more is unknown: nobody could tell in
/// time when it holds no longer.
pub const MAX_BASIS: usize = 1 << 22;

/// Bindings in the lists of nodes that are fed; the rest is for all other lists.
const MAX_BASIS_OF_FED: usize = MAX_BASIS / 2;

/// Index of a list of bindings.
pub(crate) type List = u32;

/// List that is empty.
const EMPTY: List = 0;
/// Mark of a list that found no room.
const TOO_LONG: List = u32::MAX - 1;
/// Mark of a list that is not made yet.
const NOT_MADE: List = u32::MAX;

/// Lists of bindings, each sorted, in memory that is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct BasisLists {
    bindings: Vec<u32>,
    /// Begin and end of each list among the bindings.
    lists: Vec<[u32; 2]>,
    /// Basis of each node that is fed.
    of_fed: Vec<NodeBasis>,
    /// Basis of each part without feeding.
    of_parts: Vec<NodeBasis>,
    /// Basis of nodes that are earthed or in doubt; empty until one is asked for.
    of_others: Vec<NodeBasis>,
    /// Bindings that lists of fed nodes may still have.
    room: usize,
    /// Bindings that other lists may still have.
    room_of_others: usize,
    has_no_room: bool,
}

/// List of a node, and what is remarkable of its inputs.
#[derive(Clone, Copy, Debug)]
struct NodeBasis {
    list: List,
    /// Switch on the way whose position is set by hand, or [`NONE`].
    hand_dressed: u32,
    /// Source on the way that was taken to feed by a default, or [`NONE`].
    assumed: u32,
}

const UNKNOWN_BASIS: NodeBasis = NodeBasis { list: NOT_MADE, hand_dressed: NONE, assumed: NONE };

/// Basis of a piece of equipment.
#[derive(Clone, Debug, Default)]
pub(crate) struct PieceBasis {
    /// List of its bindings; none where there was no room for it.
    pub(crate) list: Option<List>,
    /// Switches that it rests on whose position is set by hand.
    pub(crate) hand_dressed: SmallVec<[Switch; 2]>,
    /// Source that was taken to feed by a default.
    pub(crate) assumed: Option<usize>,
}

impl BasisLists {
    /// Returns the bindings of a list.
    #[inline]
    pub(crate) fn get(&self, list: List) -> &[u32] {
        let [start, end] = self.lists[list as usize];
        &self.bindings[start as usize..end as usize]
    }

    /// Returns the number of lists.
    pub(crate) fn len(&self) -> usize {
        self.lists.len()
    }

    /// Returns the number of bindings in all lists.
    pub(crate) fn binding_count(&self) -> usize {
        self.bindings.len()
    }

    /// Empties all lists for another frame.
    pub(crate) fn clear(&mut self, nodes: usize, parts: usize) {
        self.bindings.clear();
        self.lists.clear();
        self.lists.push([0, 0]);
        // Only nodes that are surely fed are read, and all of them are written before.
        self.of_fed.resize(nodes, UNKNOWN_BASIS);
        self.of_parts.clear();
        self.of_parts.resize(parts, UNKNOWN_BASIS);
        self.of_others.clear();
        self.room = MAX_BASIS_OF_FED;
        self.room_of_others = MAX_BASIS - MAX_BASIS_OF_FED;
        self.has_no_room = false;
    }

    /// Prepares for the next frame, and keeps the lists of nodes that are fed and of pieces.
    pub(crate) fn go_on(&mut self, parts: usize) {
        self.of_parts.clear();
        self.of_parts.resize(parts, UNKNOWN_BASIS);
        self.of_others.clear();
    }

    /// Reports whether a list found no room since the last time that all were made.
    pub(crate) fn has_no_room(&self) -> bool {
        self.has_no_room
    }

    /// Makes the list of a node from that of the next one on its way, with the bindings of
    /// the switch between.
    fn extend(&mut self, list: List, bindings: &[u32]) -> List {
        if list == TOO_LONG || bindings.is_empty() {
            return list;
        }
        let [from, to] = self.lists[list as usize];
        let Some(room) = self.room.checked_sub((to - from) as usize + bindings.len()) else {
            self.has_no_room = true;
            return TOO_LONG;
        };
        self.room = room;
        let start = self.bindings.len();
        self.bindings.extend_from_within(from as usize..to as usize);
        for &binding in bindings {
            // Neighbours often have neighbouring bindings.
            match self.bindings[start..].last() {
                Some(&last) if last >= binding => {
                    if let Err(at) = self.bindings[start..].binary_search(&binding) {
                        self.bindings.insert(start + at, binding);
                    }
                }
                _ => self.bindings.push(binding),
            }
        }
        self.lists.push([start as u32, self.bindings.len() as u32]);
        self.lists.len() as u32 - 1
    }

    /// Ends a list that begins at an index: sorted, and each binding once. `None` where
    /// there is no room for it.
    fn finish(&mut self, start: usize) -> Option<List> {
        let list = &mut self.bindings[start..];
        let Some(room) = self.room_of_others.checked_sub(list.len()) else {
            self.bindings.truncate(start);
            self.has_no_room = true;
            return None;
        };
        self.room_of_others = room;
        if list.is_empty() {
            return Some(EMPTY);
        }
        if !list.is_sorted_by(|a, b| a < b) {
            list.sort_unstable();
            let mut kept = 1;
            for at in 1..list.len() {
                if list[at] != list[kept - 1] {
                    list[kept] = list[at];
                    kept += 1;
                }
            }
            self.bindings.truncate(start + kept);
        }
        self.lists.push([start as u32, self.bindings.len() as u32]);
        Some(self.lists.len() as u32 - 1)
    }

    /// Reports whether a list has bindings.
    fn has(&self, list: List, bindings: &[u32]) -> bool {
        let list = self.get(list);
        bindings.iter().all(|binding| list.binary_search(binding).is_ok())
    }
}

impl Judge<'_> {
    /// Makes the lists of all nodes that are surely fed, or of those that changed, each from
    /// that of the next node towards the source.
    pub(crate) fn make_lists_of_fed(&self, changed: Option<&[bool]>, lists: &mut BasisLists) {
        let Self { readings, energisation, .. } = self;
        for node in energisation.surely_fed() {
            if changed.is_some_and(|changed| !changed[node]) {
                continue;
            }
            lists.of_fed[node] = match energisation.step_to_source(node) {
                SureStep::Start(source) => {
                    let reading = &readings.sources[source];
                    NodeBasis {
                        list: lists.extend(EMPTY, &reading.basis),
                        hand_dressed: NONE,
                        assumed: if reading.is_assumed { source as u32 } else { NONE },
                    }
                }
                SureStep::Branch { switch: None, to } => lists.of_fed[to],
                SureStep::Branch { switch: Some(switch), to } => {
                    let reading = &readings.switches[switch];
                    let next = lists.of_fed[to];
                    let is_hand_dressed = reading.condition == SwitchCondition::HandDressed;
                    NodeBasis {
                        list: lists.extend(next.list, &reading.basis),
                        hand_dressed: if is_hand_dressed {
                            switch as u32
                        } else {
                            next.hand_dressed
                        },
                        assumed: next.assumed,
                    }
                }
            };
        }
    }

    /// Finds what the judgment on a piece rests on.
    pub(crate) fn piece_basis(
        &self,
        piece: Equipment,
        (node, state): (Node, State),
        lists: &mut BasisLists,
    ) -> PieceBasis {
        let decided_by: &[Node] = match state {
            // What is so at one end is so whatever becomes of the other.
            State::Energised | State::Contradiction => std::slice::from_ref(&node),
            State::Dead | State::Earthed => self.network.nodes_of.row(piece),
            State::Unknown => &[],
        };
        let mut basis = PieceBasis::default();
        let mut of_nodes: SmallVec<[List; 4]> = SmallVec::new();
        for &node in decided_by {
            let NodeBasis { list, hand_dressed, assumed } = self.basis_of_node(node, lists);
            if list == TOO_LONG {
                return PieceBasis::default();
            }
            // Nodes of one part without feeding have one list.
            if !of_nodes.contains(&list) {
                of_nodes.push(list);
            }
            if hand_dressed != NONE {
                basis.hand_dressed.push(hand_dressed as usize);
            }
            if assumed != NONE {
                basis.assumed = Some(assumed as usize);
            }
        }
        let switches = self.network.switches_of.row(piece);
        basis.list = match (switches, of_nodes.as_slice()) {
            ([], [list]) => Some(*list),
            ([], []) => Some(EMPTY),
            _ => self.list_with_own(piece, switches, (node, state), &of_nodes, lists),
        };
        basis
    }

    /// Makes a list of those of nodes and the bindings of a piece's own switches.
    fn list_with_own(
        &self,
        piece: Equipment,
        switches: &[Switch],
        (node, state): (Node, State),
        of_nodes: &[List],
        lists: &mut BasisLists,
    ) -> Option<List> {
        let own = |switch: &Switch| self.readings.switches[*switch].basis.as_slice();
        if let [list] = of_nodes {
            if switches.iter().all(|switch| lists.has(*list, own(switch))) {
                return Some(*list);
            }
            // A switch by which its other end is fed rests on what that end rests on.
            if let ([switch], State::Energised) = (switches, state) {
                for &other in self.network.nodes_of.row(piece) {
                    if self.energisation.last_states()[other] == State::Energised
                        && let SureStep::Branch { switch: Some(passed), to } =
                            self.energisation.step_to_source(other)
                        && (passed, to) == (*switch, node)
                        && lists.of_fed[other].list != TOO_LONG
                    {
                        return Some(lists.of_fed[other].list);
                    }
                }
            }
        }
        let start = lists.bindings.len();
        for &list in of_nodes {
            let [from, to] = lists.lists[list as usize];
            lists.bindings.extend_from_within(from as usize..to as usize);
        }
        for switch in switches {
            lists.bindings.extend_from_slice(own(switch));
        }
        lists.finish(start)
    }

    fn basis_of_node(&self, node: Node, lists: &mut BasisLists) -> NodeBasis {
        let state = self.energisation.last_states()[node];
        if state == State::Energised {
            return lists.of_fed[node];
        }
        let is_dead = state == State::Dead && self.voltages.override_state(node).is_none();
        if let Some(part) = self.energisation.dead_part(node).filter(|_| is_dead) {
            if lists.of_parts[part].list == NOT_MADE {
                lists.of_parts[part] = self.make_list(node, lists);
            }
            return lists.of_parts[part];
        }
        if lists.of_others.is_empty() {
            lists.of_others.resize(lists.of_fed.len(), UNKNOWN_BASIS);
        }
        if lists.of_others[node].list == NOT_MADE {
            lists.of_others[node] = self.make_list(node, lists);
        }
        lists.of_others[node]
    }

    fn make_list(&self, node: Node, lists: &mut BasisLists) -> NodeBasis {
        let start = lists.bindings.len();
        let mut made = NodeBasis { list: TOO_LONG, hand_dressed: NONE, assumed: NONE };
        if lists.room_of_others == 0 {
            lists.has_no_room = true;
            return made;
        }
        let mut rest_on = |input: Input| {
            lists.bindings.extend_from_slice(self.readings.bindings(input));
            match input {
                Input::Switch(switch) => {
                    let condition = self.readings.switches[switch].condition;
                    if condition == SwitchCondition::HandDressed && made.hand_dressed == NONE {
                        made.hand_dressed = switch as u32;
                    }
                }
                Input::Source(source) => {
                    if self.readings.sources[source].is_assumed && made.assumed == NONE {
                        made.assumed = source as u32;
                    }
                }
            }
        };
        self.energisation.basis(&self.network.topology, node, &mut rest_on);
        if let Some((binding, inputs)) = self.voltages.bindings(self.network, node) {
            inputs.into_iter().for_each(&mut rest_on);
            lists.bindings.push(binding as u32);
        }
        if let Some(list) = lists.finish(start) {
            made.list = list;
        }
        made
    }
}
