//! States against a second way of finding them, and what the overlay shows of them.

use std::time::Duration;

use busbar_plugin_sdk::testing::draw;
use busbar_plugin_sdk::{Reason, ValueKind};
use proptest::prelude::*;

use super::*;

/// Two busbars, a coupler between them, a feeder with an earth switch on each.
const NETWORK: &str = r##"{
    "levels": [{ "name": "220 kV", "color": "#7a4fb5" }],
    "nodes": [
        { "id": "bus 1", "level": "220 kV", "equipment": ["=WA1"] },
        { "id": "bus 2", "level": "220 kV", "equipment": ["=WA2"] },
        { "id": "line", "level": "220 kV", "equipment": ["=FA1"] },
        { "id": "load", "level": "220 kV" }
    ],
    "branches": [
        { "equipment": "=QA1", "between": ["line", "bus 1"], "switch": true },
        { "equipment": "=QA30", "between": ["bus 1", "bus 2"], "switch": true },
        { "equipment": "=QA2", "between": ["bus 2", "load"], "switch": true }
    ],
    "earths": [{ "equipment": "=QC9", "node": "load" }],
    "sources": [{ "node": "line" }]
}"##;

fn settings(text: &str) -> Settings {
    serde_json::from_str(text).unwrap()
}

/// What follows from the definition: all ways in which unknown switches may stand are
/// gone through, and nodes reached from sources and earths one by one.
fn by_definition(topology: &Topology, positions: &[Position], sources: &[Position]) -> Vec<State> {
    let unknown: Vec<usize> = (0..positions.len() + sources.len())
        .filter(|&at| of(positions, sources, at) == Position::Unknown)
        .collect();
    let mut fed = vec![[false; 2]; topology.nodes.len()];
    let mut earthed = fed.clone();
    for case in 0..1_u32 << unknown.len() {
        let is_closed = |at: usize| match of(positions, sources, at) {
            Position::Open => false,
            Position::Closed => true,
            Position::Unknown => case >> unknown.iter().position(|&of| of == at).unwrap() & 1 == 1,
        };
        let from_sources = (0..sources.len())
            .filter(|index| is_closed(positions.len() + index))
            .map(|index| topology.sources[index].node);
        let from_earths =
            topology.earths.iter().filter(|earth| is_closed(earth.switch)).map(|earth| earth.node);
        let is_joined = |branch: &Branch| branch.switch.is_none_or(&is_closed);
        for (starts, found) in [
            (from_sources.collect::<Vec<_>>(), &mut fed),
            (from_earths.collect::<Vec<_>>(), &mut earthed),
        ] {
            let reached = reached(topology, starts, is_joined);
            for (node, found) in found.iter_mut().enumerate() {
                found[usize::from(reached[node])] = true;
            }
        }
    }
    let state = |node: usize| match (fed[node], earthed[node]) {
        ([false, true], [false, true]) => State::Unknown,
        ([false, true], _) => State::Energised,
        ([true, true], _) => State::Unknown,
        ([true, false], [false, true]) => State::Earthed,
        _ => State::Dead,
    };
    (0..topology.nodes.len()).map(state).collect()
}

fn of(positions: &[Position], sources: &[Position], at: usize) -> Position {
    positions.iter().chain(sources).copied().nth(at).unwrap()
}

fn reached(
    topology: &Topology,
    mut to_visit: Vec<usize>,
    is_joined: impl Fn(&Branch) -> bool,
) -> Vec<bool> {
    let mut reached = vec![false; topology.nodes.len()];
    while let Some(node) = to_visit.pop() {
        if std::mem::replace(&mut reached[node], true) {
            continue;
        }
        for branch in topology.branches.iter().filter(|branch| is_joined(branch)) {
            let [a, b] = branch.ends;
            to_visit.extend([(a, b), (b, a)].iter().filter(|(from, _)| *from == node).map(|w| w.1));
        }
    }
    reached
}

fn any_position() -> impl Strategy<Value = Position> {
    prop_oneof![4 => Just(Position::Open), 4 => Just(Position::Closed), 1 => Just(Position::Unknown)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn states_are_those_of_the_definition(
        nodes in 2_usize..9,
        branches in prop::collection::vec((0_usize..9, 0_usize..9, any::<bool>()), 0..14),
        earths in prop::collection::vec(0_usize..9, 0..4),
        sources in prop::collection::vec((0_usize..9, any_position()), 1..3),
        positions in prop::collection::vec(any_position(), 20),
    ) {
        let mut topology = Topology {
            nodes: (0..nodes).map(|node| node.to_string()).collect(),
            levels: vec![0; nodes],
            ..Topology::default()
        };
        let mut switches = 0;
        let mut next = || { switches += 1; switches - 1 };
        for (equipment, (a, b, switch)) in branches.into_iter().enumerate() {
            let switch = switch.then(&mut next);
            topology.branches.push(Branch { ends: [a % nodes, b % nodes], switch, equipment });
        }
        for node in earths {
            topology.earths.push(Earth { node: node % nodes, switch: next(), equipment: 0 });
        }
        for (node, _) in &sources {
            topology.sources.push(Source { node: node % nodes, equipment: Some("=G".into()) });
        }
        topology.find_branches_at();
        let feeds: Vec<Position> = sources.iter().map(|(_, feeds)| *feeds).collect();
        // Where many are unknown, there are too many cases to go through.
        let mut positions = positions[..switches].to_vec();
        let unknown = positions.iter_mut().filter(|position| **position == Position::Unknown);
        unknown.skip(6).for_each(|position| *position = Position::Open);
        let expected = by_definition(&topology, &positions, &feeds);
        let mut energisation = Energisation::default();
        prop_assert_eq!(energisation.states(&topology, &positions, &feeds), &*expected);
        // And again in the room of the last one.
        prop_assert_eq!(energisation.states(&topology, &positions, &feeds), &*expected);
        for (node, &state) in expected.iter().enumerate() {
            let mut basis = Vec::new();
            energisation.basis(node, |input| basis.push(input));
            prop_assert!(state != State::Unknown || basis.is_empty());
            // All else may be anything.
            let kept = |known: &[Position], input: fn(usize) -> Input| -> Vec<Position> {
                let known = known.iter().enumerate();
                let keep = |(at, position): (usize, &Position)| {
                    if basis.contains(&input(at)) { *position } else { Position::Unknown }
                };
                known.map(keep).collect()
            };
            let (positions, feeds) = (kept(&positions, Input::Switch), kept(&feeds, Input::Source));
            let now = Energisation::default().states(&topology, &positions, &feeds)[node];
            prop_assert_eq!(now, state, "node {} by {:?}", node, basis);
        }
    }
}

const OPEN: Value = Value::DoublePoint(DoublePoint::Off);
const CLOSED: Value = Value::DoublePoint(DoublePoint::On);
const TRAVELLING: Value = Value::DoublePoint(DoublePoint::Intermediate);

fn binding(id: &str) -> Binding {
    Binding {
        node: 0,
        kind: ValueKind::DoublePoint,
        limit_low: None,
        limit_high: None,
        tag_id: format!("{id}.Pos"),
        tag_name: String::new(),
        unit: String::new(),
        node_id: id.into(),
        role: POSITION.into(),
    }
}

/// What the overlay shows of each piece of equipment, and the bindings that it rests on.
fn shown(values: [(Value, Quality); 4]) -> Vec<(String, String, Vec<usize>)> {
    let settings = settings(NETWORK);
    let mut overlay =
        EnergisationOverlay::create(settings, busbar_plugin_sdk::testing::host()).unwrap();
    let Description { legend, equipment, .. } = overlay.describe();
    let bindings = ["=QA1", "=QA30", "=QA2", "=QC9"].map(binding).to_vec();
    let values = values.map(|(value, quality)| TagValue {
        value: Some(value),
        quality,
        age: Duration::ZERO,
    });
    let drawing = draw(&mut overlay, bindings, &values).unwrap();
    let name = |states: &[busbar_plugin_sdk::testing::DrawnState]| {
        let entry = legend[states[0].entry].name.clone();
        let bindings = states.iter().map(|state| state.binding).collect();
        (equipment[states[0].equipment].clone(), entry, bindings)
    };
    drawing.states.chunk_by(|a, b| a.equipment == b.equipment).map(name).collect()
}

fn states_of(shown: &[(String, String, Vec<usize>)]) -> Vec<(&str, &str)> {
    shown.iter().map(|(id, state, _)| (id.as_str(), state.as_str())).collect()
}

#[test]
fn equipment_shows_the_more_urgent_of_its_ends() {
    let good = |value| (value, Quality::Good);
    let all = shown([good(CLOSED), good(OPEN), good(OPEN), good(CLOSED)]);
    let expected = [
        ("=WA1", "220 kV energised"),
        ("=WA2", "dead"),
        ("=FA1", "220 kV energised"),
        ("=QA1", "220 kV energised"),
        ("=QA30", "220 kV energised"),
        ("=QA2", "dead"),
        ("=QC9", "earthed"),
    ];
    assert_eq!(states_of(&all), expected);
    // On what each rests: the second busbar on what parts it from the first, the earth
    // switch on itself and on what parts the load.
    let basis = |at: usize| all[at].2.as_slice();
    assert_eq!(
        [0, 1, 2, 4, 5, 6].map(basis),
        [&[0][..], &[1, 2], &[0], &[0, 1], &[1, 2, 3], &[2, 3]]
    );
}

#[test]
fn what_rests_on_an_unknown_position_is_unknown() {
    let good = |value| (value, Quality::Good);
    for unknown in [(TRAVELLING, Quality::Good), (CLOSED, Quality::Bad(Reason::Stale))] {
        let all = shown([good(CLOSED), unknown, good(OPEN), good(OPEN)]);
        let states = states_of(&all);
        assert_eq!(states[0], ("=WA1", "220 kV energised"), "whatever the coupler does");
        assert_eq!(states[1], ("=WA2", "unknown"));
        assert_eq!(states[6], ("=QC9", "dead"), "not earthed");
        // A switch rests on its own position, too; what is unknown on one that is good.
        assert_eq!((all[4].0.as_str(), all[4].2.as_slice()), ("=QA30", &[0, 1][..]));
        assert_eq!(all[1].2, [0]);
    }
}

#[test]
fn a_source_that_earth_is_joined_to_is_a_contradiction() {
    let good = |value| (value, Quality::Good);
    let all = shown([good(CLOSED), good(CLOSED), good(CLOSED), good(CLOSED)]);
    assert!(all.iter().all(|(_, state, _)| state == "unknown"), "{all:?}");
}

#[test]
fn a_network_that_contradicts_itself_is_refused_by_name() {
    let check = |from: &str, to: &str, words: &str| {
        assert!(NETWORK.contains(from), "{from}");
        let fault = Topology::new(&settings(&NETWORK.replacen(from, to, 1))).unwrap_err();
        assert!(fault.to_string().contains(words), "{fault}");
    };
    check(r#""node": "load""#, r#""node": "lode""#, "the node 'lode', which is not there");
    check(r#"["line", "bus 1"]"#, r#"["line", "line"]"#, "'=QA1' joins a node to itself");
    check(r#""id": "bus 2""#, r#""id": "bus 1""#, "the node 'bus 1' is there twice");
    check(r#""level": "220 kV""#, r#""level": "110 kV""#, "the voltage level '110 kV'");
    check(r#"{ "node": "line" }"#, "", "no source feeds the network");
    check(r#"["=WA2"]"#, r#"["=WA1"]"#, "the equipment '=WA1' is there twice");
    check(r#""equipment": "=QC9""#, r#""equipment": "=QA1""#, "the switch '=QA1' is there twice");
    let color = NETWORK.replace("#7a4fb5", "violet");
    let fault = serde_json::from_str::<Settings>(&color).unwrap_err();
    assert!(fault.to_string().contains("'violet' is no colour"), "{fault}");
}
