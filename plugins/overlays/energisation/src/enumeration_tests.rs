//! States, reasons, bases and contradictions of random networks, judged by enumeration of
//! all completions. `BUSBAR_TOPOLOGY_CASES` sets their number.

use std::io::Write;

use fastrand::Rng;
use serde_json::json;

use crate::random_network::{Bits, RandomNetwork};
use crate::*;

pub(crate) const SEED: u64 = 39;
/// Networks of one run, unless the environment says otherwise.
const CASES: u64 = 2_000;

/// Variable that names the file of networks for another implementation.
const FILE_VARIABLE: &str = "BUSBAR_TOPOLOGY_FILE";

pub(crate) fn cases() -> u64 {
    std::env::var("BUSBAR_TOPOLOGY_CASES").map_or(CASES, |cases| cases.parse().unwrap())
}

fn certainty([no, yes]: [bool; 2]) -> Certainty {
    match (no, yes) {
        (false, _) => Certainty::Surely,
        (true, true) => Certainty::Perhaps,
        (true, false) => Certainty::Not,
    }
}

#[test]
fn states_are_those_of_all_completions() {
    let (mut energisation, mut counts) = (Energisation::default(), [0_u64; 5]);
    for case in 0..cases() {
        let network = RandomNetwork::generate(&mut Rng::with_seed(SEED << 32 | case));
        let topology = Topology::new(&network.settings()).unwrap();
        let RandomNetwork { positions, feeds, .. } = &network;
        let bits = network.enumerate();
        energisation.states(&topology, positions, feeds);
        for (node, bits) in bits.iter().enumerate() {
            let place = || format!("case {case}, node {node}: {network:#?}");
            let state = energisation.last_states()[node];
            assert_eq!(state, bits.state(), "{}", place());
            assert_eq!(energisation.fed(node), certainty(bits.fed), "{}", place());
            assert_eq!(energisation.earthed(node), certainty(bits.earthed), "{}", place());
            counts[state as usize] += 1;
        }
        check_doubts(&network, &energisation, case);
        check_contradictions(&network, &topology, &energisation, &bits, case);
        check_bases(&network, &topology, &mut energisation, &bits, case);
    }
    // Each kind of state is met often, or the test says nothing.
    assert!(counts.iter().all(|&count| count > cases() / 20), "{counts:?}");
}

/// Writes networks without unknown inputs, with what is fed and earthed, for another implementation
/// (`references/compare.py`).
#[test]
#[ignore = "writes a file for `cargo xtask references`"]
fn networks_for_another_implementation() {
    let path = std::env::var_os(FILE_VARIABLE).expect("the file is named");
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut energisation = Energisation::default();
    for case in 0..cases() {
        let network = RandomNetwork::generate(&mut Rng::with_seed(SEED << 32 | case));
        let RandomNetwork { positions, feeds, .. } = &network;
        if positions.iter().chain(feeds).any(|position| *position == Position::Unknown) {
            continue;
        }
        let topology = Topology::new(&network.settings()).unwrap();
        energisation.states(&topology, positions, feeds);
        let is_closed = |position: &Position| *position == Position::Closed;
        let branches = network.branches.iter().map(|branch| {
            let [one, other] = branch.ends;
            let is_closed = branch.switch.is_none_or(|switch| is_closed(&positions[switch]));
            json!([one, other, is_closed, branch.stops_earth])
        });
        let earths =
            network.earths.iter().zip(&positions[positions.len() - network.earths.len()..]);
        let earths = earths.filter(|(_, position)| is_closed(position)).map(|(node, _)| *node);
        let sources = network.sources.iter().zip(feeds);
        let sources = sources.filter(|(_, feeds)| is_closed(feeds)).map(|((node, _), _)| *node);
        let nodes = 0..network.levels.len();
        for node in nodes.clone() {
            let certainties = [energisation.fed(node), energisation.earthed(node)];
            assert!(!certainties.contains(&Certainty::Perhaps), "case {case}: all is known");
        }
        let fed = nodes.clone().map(|node| energisation.fed(node) == Certainty::Surely);
        let earthed = nodes.clone().map(|node| energisation.earthed(node) == Certainty::Surely);
        let line = json!({
            "nodes": nodes.len(),
            "branches": branches.collect::<Vec<_>>(),
            "sources": sources.collect::<Vec<_>>(),
            "earths": earths.collect::<Vec<_>>(),
            "fed": fed.collect::<Vec<_>>(),
            "earthed": earthed.collect::<Vec<_>>(),
        });
        writeln!(file, "{line}").unwrap();
    }
    file.flush().unwrap();
}

/// The input that a reason names decides alone in some completion, where no switch is in
/// two branches.
fn check_doubts(network: &RandomNetwork, energisation: &Energisation, case: u64) {
    let all: Vec<Position> = network.positions.iter().chain(&network.feeds).copied().collect();
    let unknown: Vec<usize> =
        (0..all.len()).filter(|&input| all[input] == Position::Unknown).collect();
    for node in 0..network.levels.len() {
        for (which, doubt, certainty) in [
            (0, energisation.feeding_doubt(node), energisation.fed(node)),
            (1, energisation.earthing_doubt(node), energisation.earthed(node)),
        ] {
            assert_eq!(doubt.is_some(), certainty == Certainty::Perhaps, "case {case}");
            let Some(doubt) = doubt else { continue };
            let doubt = match doubt {
                Input::Switch(switch) => switch,
                Input::Source(source) => network.positions.len() + source,
            };
            assert_eq!(all[doubt], Position::Unknown, "case {case}, node {node}");
            if network.has_shared_switch() {
                continue;
            }
            let decides = (0..1_u32 << unknown.len()).any(|completion| {
                let reaches = |is_closed: bool| {
                    let closed: Vec<bool> = (0..all.len())
                        .map(|input| match unknown.iter().position(|&of| of == input) {
                            _ if input == doubt => is_closed,
                            Some(bit) => completion >> bit & 1 == 1,
                            None => all[input] == Position::Closed,
                        })
                        .collect();
                    network.flood(&closed)[which][node]
                };
                reaches(true) && !reaches(false)
            });
            assert!(decides, "case {case}, node {node}, {doubt}: {network:#?}");
        }
    }
}

/// Each node in doubt is told a source and an earth with a shortest way between; no other
/// node is in doubt.
fn check_contradictions(
    network: &RandomNetwork,
    topology: &Topology,
    energisation: &Energisation,
    bits: &[Bits],
    case: u64,
) {
    let found = Contradictions::find(energisation, topology, &network.positions);
    let is_closed = |branch: &random_network::RandomBranch| {
        branch.switch.is_none_or(|switch| network.positions[switch] == Position::Closed)
    };
    let feeding = network.sources.iter().zip(&network.feeds);
    let feeding = feeding.filter(|(_, feeds)| **feeds == Position::Closed);
    let from_source = network.distances(feeding.map(|(source, _)| source.0).collect(), is_closed);
    let first_earth = network.positions.len() - network.earths.len();
    for (node, bits) in bits.iter().enumerate() {
        let at = found.at(node);
        let is_in_doubt = bits.state() == State::Contradiction;
        assert_eq!(at.is_some(), is_in_doubt, "case {case}, node {node}: {network:#?}");
        let Some(at) = at else { continue };
        let Contradiction { source, earth, path } = &found.all()[at];
        assert_eq!(network.feeds[*source], Position::Closed, "case {case}");
        let earths = network.earths.iter().zip(&network.positions[first_earth..]);
        let earths: Vec<usize> = {
            let part = network.distances(vec![node], |of| !of.stops_earth && is_closed(of));
            let closed = earths.filter(|(_, position)| **position == Position::Closed);
            closed.map(|(node, _)| *node).filter(|node| part[*node].is_some()).collect()
        };
        let earth_node = topology.earths[*earth].node;
        assert!(earths.contains(&earth_node), "case {case}: an earth that reaches the node");
        let shortest = earths.iter().filter_map(|&node| from_source[node]).min();
        assert_eq!(Some(path.len()), shortest, "case {case}: {network:#?}");
        let mut end = network.sources[*source].0;
        for &branch in path {
            let branch = &network.branches[branch];
            assert!(is_closed(branch) && branch.ends.contains(&end), "case {case}");
            end = branch.ends[usize::from(branch.ends[0] == end)];
        }
        assert_eq!(end, earth_node, "case {case}: the way leads to the earth");
    }
}

/// A state stays whatever becomes of the inputs that it does not rest on.
fn check_bases(
    network: &RandomNetwork,
    topology: &Topology,
    energisation: &mut Energisation,
    bits: &[Bits],
    case: u64,
) {
    let RandomNetwork { positions, feeds, sources, .. } = network;
    energisation.find_borders(topology, positions);
    let mut others = Energisation::default();
    for (node, bits) in bits.iter().enumerate() {
        let mut basis = Vec::new();
        energisation.basis(topology, node, |input| basis.push(input));
        let state = bits.state();
        assert!(state != State::Unknown || basis.is_empty(), "case {case}");
        let kept = |known: &[Position], input: fn(usize) -> Input| -> Vec<Position> {
            let keep = |(at, position): (usize, &Position)| match basis.contains(&input(at)) {
                true => *position,
                false => Position::Unknown,
            };
            known.iter().enumerate().map(keep).collect()
        };
        let mut feeds = kept(feeds, Input::Source);
        // What is always on rests on nothing.
        for (feed, _) in feeds.iter_mut().zip(sources).filter(|(_, source)| source.1) {
            *feed = Position::Closed;
        }
        let now = others.states(topology, &kept(positions, Input::Switch), &feeds)[node];
        // Feeding that is sure hides an earth that is not.
        let stays = match state {
            State::Dead => matches!(now, State::Dead | State::Earthed),
            State::Energised => matches!(now, State::Energised | State::Contradiction),
            state => now == state,
        };
        assert!(stays, "case {case}, node {node}: {now:?} by {basis:?} in {network:#?}");
    }
}
