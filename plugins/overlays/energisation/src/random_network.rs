//! Seeded random networks of several voltages for tests, with a second way of finding their
//! states: all completions of unknown inputs, one by one.

use std::collections::VecDeque;

use fastrand::Rng;
use serde_json::{Value, json};

use crate::{Position, Settings, State};

/// Unknown inputs of one network at most: each doubles the completions.
const MAX_UNKNOWN: usize = 8;
/// Kinds of branches within a voltage level, and whether an earth stops at them.
const KINDS: [(Option<&str>, bool); 12] = [
    (None, false),
    (None, false),
    (Some("line"), false),
    (Some("busbar"), false),
    (Some("cable"), false),
    (Some("current_transformer"), false),
    (Some("transformer"), true),
    (Some("autotransformer"), true),
    (Some("auxiliary_transformer"), true),
    (Some("reactor"), true),
    (Some("instrument_transformer"), true),
    (Some("zig_zag"), true),
];

/// A network and its inputs, independent of the code under test.
#[derive(Clone, Debug)]
pub(crate) struct RandomNetwork {
    pub(crate) levels: Vec<usize>,
    pub(crate) branches: Vec<RandomBranch>,
    /// Nodes of earths; the switch of each comes after those of the branches.
    pub(crate) earths: Vec<usize>,
    /// Nodes of sources, and whether each is always on.
    pub(crate) sources: Vec<(usize, bool)>,
    /// Positions of switches: those of branches, then those of earths.
    pub(crate) positions: Vec<Position>,
    /// Feeding of sources, as positions.
    pub(crate) feeds: Vec<Position>,
}

#[derive(Clone, Debug)]
pub(crate) struct RandomBranch {
    pub(crate) ends: [usize; 2],
    pub(crate) switch: Option<usize>,
    kind: Option<&'static str>,
    pub(crate) stops_earth: bool,
}

/// Bits of a node over all completions.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bits {
    /// Fed in no completion, in some.
    pub(crate) fed: [bool; 2],
    /// Earthed in no completion, in some.
    pub(crate) earthed: [bool; 2],
}

fn any_position(random: &mut Rng, unknown_share: f64) -> Position {
    match () {
        () if random.f64() < unknown_share => Position::Unknown,
        () if random.bool() => Position::Closed,
        () => Position::Open,
    }
}

impl RandomNetwork {
    pub(crate) fn generate(random: &mut Rng) -> Self {
        let nodes = random.usize(2..10);
        let level_count = random.usize(1..4);
        let levels: Vec<usize> = (0..nodes).map(|_| random.usize(0..level_count)).collect();
        let mut switches = 0;
        let mut branches = Vec::new();
        for _ in 0..random.usize(0..15) {
            let a = random.usize(0..nodes);
            let b = (a + random.usize(1..nodes)) % nodes;
            let (kind, stops_earth) = KINDS[random.usize(0..KINDS.len())];
            let switch = random.bool().then(|| {
                // A few switches are in two branches.
                let is_shared = switches > 0 && random.usize(0..8) == 0;
                if !is_shared {
                    switches += 1;
                }
                if is_shared { random.usize(0..switches) } else { switches - 1 }
            });
            let stops_earth = stops_earth || levels[a] != levels[b];
            branches.push(RandomBranch { ends: [a, b], switch, kind, stops_earth });
        }
        let earths: Vec<usize> = (0..random.usize(0..5)).map(|_| random.usize(0..nodes)).collect();
        let sources: Vec<(usize, bool)> = (0..random.usize(1..4))
            .map(|_| (random.usize(0..nodes), random.usize(0..4) == 0))
            .collect();
        let share = [0.0, 0.1, 0.3][random.usize(0..3)];
        let mut positions: Vec<Position> =
            (0..switches + earths.len()).map(|_| any_position(random, share)).collect();
        let feed = |(_, is_always_on): &(usize, bool)| match is_always_on {
            true => Position::Closed,
            false => any_position(random, share),
        };
        let mut feeds: Vec<Position> = sources.iter().map(feed).collect();
        let inputs = positions.iter_mut().chain(&mut feeds);
        let unknown = inputs.filter(|position| **position == Position::Unknown);
        unknown.skip(MAX_UNKNOWN).for_each(|position| *position = Position::Open);
        Self { levels, branches, earths, sources, positions, feeds }
    }

    /// The equipment id of a switch of branches, or of an earth switch.
    pub(crate) fn switch_id(&self, switch: usize) -> String {
        let first_earth = self.positions.len() - self.earths.len();
        match switch.checked_sub(first_earth) {
            Some(earth) => format!("QC{earth}"),
            None => format!("Q{switch}"),
        }
    }

    /// Reports whether a switch is in two branches.
    pub(crate) fn has_shared_switch(&self) -> bool {
        let mut switches: Vec<usize> =
            self.branches.iter().filter_map(|branch| branch.switch).collect();
        let count = switches.len();
        switches.sort_unstable();
        switches.dedup();
        switches.len() < count
    }

    /// Settings of the plugin for it. Each node has a piece of equipment of its own.
    pub(crate) fn settings(&self) -> Settings {
        let level =
            |level: usize| json!({ "name": format!("{} kV", 10 + level), "color": "#101010" });
        let node = |(node, level): (usize, &usize)| {
            json!({
                "id": node.to_string(),
                "level": format!("{} kV", 10 + level),
                "equipment": [format!("N{node}")],
            })
        };
        let branch = |(index, branch): (usize, &RandomBranch)| {
            let [a, b] = branch.ends.map(|end| end.to_string());
            let id = branch.switch.map_or(format!("B{index}"), |switch| self.switch_id(switch));
            let mut value = json!({ "equipment": id, "between": [a, b] });
            if branch.switch.is_some() {
                value["switch"] = true.into();
            }
            if let Some(kind) = branch.kind {
                value["kind"] = kind.into();
            }
            value
        };
        let earth = |(index, node): (usize, &usize)| json!({ "equipment": format!("QC{index}"), "node": node.to_string() });
        let source = |(index, (node, is_always_on)): (usize, &(usize, bool))| match is_always_on {
            true => json!({ "node": node.to_string() }),
            false => json!({ "node": node.to_string(), "equipment": format!("G{index}") }),
        };
        let list = |values: &mut dyn Iterator<Item = Value>| Value::Array(values.collect());
        let level_count = self.levels.iter().max().map_or(0, |level| level + 1);
        let settings = json!({
            "levels": list(&mut (0..level_count).map(level)),
            "nodes": list(&mut self.levels.iter().enumerate().map(node)),
            "branches": list(&mut self.branches.iter().enumerate().map(branch)),
            "earths": list(&mut self.earths.iter().enumerate().map(earth)),
            "sources": list(&mut self.sources.iter().enumerate().map(source)),
        });
        serde_json::from_value(settings).unwrap()
    }

    /// Bits of all nodes, by going through all completions.
    pub(crate) fn enumerate(&self) -> Vec<Bits> {
        let all = || self.positions.iter().chain(&self.feeds);
        let unknown = all().filter(|position| **position == Position::Unknown).count();
        let mut bits = vec![Bits::default(); self.levels.len()];
        for case in 0..1_u32 << unknown {
            let mut asked = 0;
            let closed: Vec<bool> = all()
                .map(|position| match position {
                    Position::Open => false,
                    Position::Closed => true,
                    Position::Unknown => {
                        asked += 1;
                        case >> (asked - 1) & 1 == 1
                    }
                })
                .collect();
            let [fed, earthed] = self.flood(&closed);
            for (bits, (fed, earthed)) in bits.iter_mut().zip(fed.into_iter().zip(earthed)) {
                bits.fed[usize::from(fed)] = true;
                bits.earthed[usize::from(earthed)] = true;
            }
        }
        bits
    }

    /// Nodes that are fed and that are earthed in one completion.
    pub(crate) fn flood(&self, closed: &[bool]) -> [Vec<bool>; 2] {
        let feeds = &closed[self.positions.len()..];
        let sources = self.sources.iter().zip(feeds).filter(|(_, feeds)| **feeds);
        let fed = sources.map(|(source, _)| source.0).collect();
        let first_earth = self.positions.len() - self.earths.len();
        let earths = self.earths.iter().zip(&closed[first_earth..]).filter(|(_, closed)| **closed);
        let earthed = earths.map(|(node, _)| *node).collect();
        let is_closed = |branch: &RandomBranch| branch.switch.is_none_or(|switch| closed[switch]);
        [
            self.distances(fed, is_closed),
            self.distances(earthed, |branch| !branch.stops_earth && is_closed(branch)),
        ]
        .map(|distances| distances.into_iter().map(|of| of.is_some()).collect())
    }

    /// Branches from each node to the nearest of some nodes.
    pub(crate) fn distances(
        &self,
        starts: Vec<usize>,
        is_joined: impl Fn(&RandomBranch) -> bool,
    ) -> Vec<Option<usize>> {
        let mut distances = vec![None; self.levels.len()];
        let mut to_visit: VecDeque<(usize, usize)> =
            starts.into_iter().map(|node| (node, 0)).collect();
        while let Some((node, distance)) = to_visit.pop_front() {
            if distances[node].is_some() {
                continue;
            }
            distances[node] = Some(distance);
            for branch in self.branches.iter().filter(|branch| is_joined(branch)) {
                let [a, b] = branch.ends;
                for (from, to) in [(a, b), (b, a)] {
                    if from == node {
                        to_visit.push_back((to, distance + 1));
                    }
                }
            }
        }
        distances
    }
}

impl Bits {
    /// The state that follows from the definition.
    pub(crate) fn state(self) -> State {
        match (self.fed, self.earthed) {
            ([false, true], [false, true]) => State::Contradiction,
            ([false, true], _) => State::Energised,
            ([true, true], _) => State::Unknown,
            (_, [false, true]) => State::Earthed,
            _ => State::Dead,
        }
    }
}
