//! Reachability over surely closed and over possibly closed branches, in one breadth-first
//! search each way: first over what is surely closed, then on by the fewest unknown inputs.

use crate::adjacency::{Adjacency, Arc, NextRows, ROWS_AT_ONCE};
use crate::state::{ChangedInputs, Input, Position};
use crate::topology::{Node, Switch};

/// Certainty of a fact about a node, over all completions of unknown inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Certainty {
    /// True in no completion.
    #[default]
    Not,
    /// True in some completions.
    Perhaps,
    /// True in all completions.
    Surely,
}

/// Start of a search: a source, or an earth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// The node that it is at.
    pub(crate) node: Node,
    /// Input that decides whether it counts.
    pub(crate) input: Input,
    /// Reports whether it counts: surely where closed.
    pub(crate) position: Position,
    /// Index among sources or earths.
    pub(crate) index: usize,
}

/// Step of a node towards a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Over a branch to the next node.
    Branch {
        /// Index of the branch.
        branch: usize,
        /// Next node on the way.
        to: Node,
    },
    /// Ends at the source or earth of this index.
    Start(usize),
}

/// Certainty of all nodes, and the ways by which they are reached, in room that is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reachability {
    certainty: Vec<Certainty>,
    steps: Vec<RawStep>,
    /// The unknown input nearest to the start, of what is reached perhaps.
    doubts: Vec<u32>,
    queue: Vec<u32>,
    now: Vec<Candidate>,
    next: Vec<Candidate>,
}

/// A step as it is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct RawStep {
    /// The next node, or [`NONE`] at a start.
    to: u32,
    /// The branch, or the index of the start.
    via: u32,
    /// The switch of the branch or of the earth at a start, or [`NONE`].
    switch: u32,
}

impl RawStep {
    #[inline]
    fn over(to: u32, arc: Arc) -> Self {
        let switch = arc.switch().map_or(NONE, |switch| switch as u32);
        Self { to, via: arc.branch() as u32, switch }
    }
}

/// Step of a node that is surely reached, with the switch that it passes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SureStep {
    /// Over a branch to the next node.
    Branch {
        /// The switch of the branch, where it has one.
        switch: Option<Switch>,
        /// Next node on the way.
        to: Node,
    },
    /// Ends at the source or earth of this index.
    Start(usize),
}

/// A node that is reached perhaps.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    node: u32,
    step: RawStep,
    doubt: u32,
}

/// Mark of an index that is not there.
pub(crate) const NONE: u32 = u32::MAX;
/// Bit that tells sources from switches in a stored input.
const SOURCE_BIT: u32 = 1 << 31;

pub(crate) fn pack(input: Input) -> u32 {
    match input {
        Input::Switch(switch) => switch as u32,
        Input::Source(source) => source as u32 | SOURCE_BIT,
    }
}

pub(crate) fn unpack(packed: u32) -> Option<Input> {
    let index = (packed & !SOURCE_BIT) as usize;
    match packed {
        NONE => None,
        _ if packed & SOURCE_BIT != 0 => Some(Input::Source(index)),
        _ => Some(Input::Switch(index)),
    }
}

/// Passage of a search: adjacency, positions of switches, and whether windings count.
#[derive(Clone, Copy)]
pub(crate) struct Passage<'a> {
    pub(crate) adjacency: &'a Adjacency,
    pub(crate) positions: &'a [Position],
    pub(crate) passes_windings: bool,
}

impl Passage<'_> {
    /// The position of a branch; open where the search does not pass it.
    #[inline]
    pub(crate) fn position(&self, arc: Arc) -> Position {
        if arc.stops_earth() && !self.passes_windings {
            return Position::Open;
        }
        arc.switch().map_or(Position::Closed, |switch| self.positions[switch])
    }
}

impl Reachability {
    /// Searches from all starts. Each branch is looked at once from each of its ends.
    pub(crate) fn search(
        &mut self,
        nodes: usize,
        passage: Passage<'_>,
        starts: impl Iterator<Item = Start>,
    ) {
        self.certainty.clear();
        self.certainty.resize(nodes, Certainty::Not);
        // Steps and doubts of nodes that are not reached are never read.
        self.steps.resize(nodes, RawStep { to: NONE, via: NONE, switch: NONE });
        self.doubts.resize(nodes, NONE);
        self.queue.clear();
        self.next.clear();
        for Start { node, input, position, index } in starts {
            let switch = match input {
                Input::Switch(switch) => switch as u32,
                Input::Source(_) => NONE,
            };
            let step = RawStep { to: NONE, via: index as u32, switch };
            match position {
                Position::Open => {}
                Position::Unknown => {
                    let doubt = pack(input);
                    self.next.push(Candidate { node: node as u32, step, doubt });
                }
                Position::Closed => self.settle_surely(node, step),
            }
        }
        self.search_surely(passage);
        self.search_perhaps(passage);
    }

    fn settle_surely(&mut self, node: Node, step: RawStep) {
        if self.certainty[node] == Certainty::Not {
            self.certainty[node] = Certainty::Surely;
            self.steps[node] = step;
            self.queue.push(node as u32);
        }
    }

    fn search_surely(&mut self, passage: Passage<'_>) {
        let (mut done, mut rows) = (0, NextRows::default());
        while done < self.queue.len() {
            let count = passage.adjacency.load_rows(&self.queue[done..], &mut rows);
            for row in &rows[..count] {
                let from = self.queue[done];
                done += 1;
                for &arc in passage.adjacency.row(*row) {
                    let to = arc.to();
                    if self.certainty[to] != Certainty::Not {
                        continue;
                    }
                    let step = RawStep::over(from, arc);
                    match passage.position(arc) {
                        Position::Open => {}
                        Position::Closed => self.settle_surely(to, step),
                        Position::Unknown => {
                            let doubt = step.switch;
                            self.next.push(Candidate { node: to as u32, step, doubt });
                        }
                    }
                }
            }
        }
    }

    /// Goes on over unknown inputs, by the fewest of them.
    fn search_perhaps(&mut self, passage: Passage<'_>) {
        while !self.next.is_empty() {
            std::mem::swap(&mut self.now, &mut self.next);
            let (mut done, mut rows, mut nodes) = (0, NextRows::default(), [0; ROWS_AT_ONCE]);
            while done < self.now.len() {
                let ahead = (self.now.len() - done).min(ROWS_AT_ONCE);
                for (node, of) in nodes.iter_mut().zip(&self.now[done..]) {
                    *node = of.node;
                }
                let count = passage.adjacency.load_rows(&nodes[..ahead], &mut rows);
                for row in &rows[..count] {
                    let Candidate { node, step, doubt } = self.now[done];
                    done += 1;
                    if self.certainty[node as usize] != Certainty::Not {
                        continue;
                    }
                    self.certainty[node as usize] = Certainty::Perhaps;
                    self.steps[node as usize] = step;
                    self.doubts[node as usize] = doubt;
                    for &arc in passage.adjacency.row(*row) {
                        let to = arc.to();
                        if self.certainty[to] != Certainty::Not {
                            continue;
                        }
                        let step = RawStep::over(node, arc);
                        let candidate = Candidate { node: to as u32, step, doubt };
                        match passage.position(arc) {
                            Position::Open => {}
                            Position::Closed => self.now.push(candidate),
                            Position::Unknown => self.next.push(candidate),
                        }
                    }
                }
            }
            self.now.clear();
        }
    }

    /// Tells whether a node is reached.
    #[inline]
    pub(crate) fn certainty(&self, node: Node) -> Certainty {
        self.certainty[node]
    }

    /// The first step of a node that is surely reached.
    #[inline]
    pub(crate) fn sure_step(&self, node: Node) -> SureStep {
        let RawStep { to, via, switch } = self.steps[node];
        match to {
            NONE => SureStep::Start(via as usize),
            _ => SureStep::Branch {
                switch: (switch != NONE).then_some(switch as usize),
                to: to as usize,
            },
        }
    }

    /// Finds the nodes that are surely reached by a way that differs from that of the last
    /// round, or that passes an input which changed.
    pub(crate) fn find_changed_ways(
        &self,
        before: &Self,
        flags: &mut Vec<bool>,
        inputs: &ChangedInputs,
    ) {
        flags.clear();
        flags.resize(self.certainty.len(), false);
        for node in self.surely_reached() {
            let RawStep { to, via, switch } = self.steps[node];
            flags[node] = before.certainty[node] != Certainty::Surely
                || before.steps[node] != self.steps[node]
                || match to {
                    // An earth is known by its switch.
                    NONE if switch == NONE => inputs.sources[via as usize],
                    NONE => inputs.switches[switch as usize],
                    _ => flags[to as usize] || (switch != NONE && inputs.switches[switch as usize]),
                };
        }
    }

    /// Nodes that are surely reached, the nearest to a start first.
    pub(crate) fn surely_reached(&self) -> impl Iterator<Item = Node> + '_ {
        self.queue.iter().map(|node| *node as usize)
    }

    /// The unknown input nearest to the start that a node is perhaps reached by. The node
    /// is reached or not by this input alone in some completion, unless a switch is in two
    /// branches.
    pub(crate) fn doubt(&self, node: Node) -> Option<Input> {
        let is_perhaps = self.certainty[node] == Certainty::Perhaps;
        is_perhaps.then(|| unpack(self.doubts[node])).flatten()
    }

    /// Indices of the starts that nodes are reached from; `None` where they are not. Linear
    /// in the network.
    pub(crate) fn origins(&self) -> Vec<Option<u32>> {
        let mut origins = vec![None; self.certainty.len()];
        let mut way = Vec::new();
        for node in 0..origins.len() {
            let mut at = node;
            let origin = loop {
                if let Some(origin) = origins[at] {
                    break Some(origin);
                }
                if self.certainty[at] == Certainty::Not {
                    break None;
                }
                way.push(at);
                let RawStep { to, via, .. } = self.steps[at];
                if to == NONE {
                    break Some(via);
                }
                at = to as usize;
            };
            way.drain(..).for_each(|node| origins[node] = origin);
        }
        origins
    }

    /// Steps from a node to the start that it is reached from; a shortest way over branches
    /// where it is reached surely. None where it is not reached.
    pub(crate) fn way(&self, node: Node) -> impl Iterator<Item = Step> + '_ {
        let mut at = (self.certainty[node] != Certainty::Not).then_some(node);
        std::iter::from_fn(move || {
            let RawStep { to, via, .. } = self.steps[at?];
            let (branch, next) = (via as usize, to as usize);
            at = (to != NONE).then_some(next);
            Some(at.map_or(Step::Start(branch), |to| Step::Branch { branch, to }))
        })
    }
}
