//! Tests of the station's network: the equipment that each switch de-energises, computed in two
//! ways.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use energisation::{Energisation, Position, Settings, State, Topology};
use substation::{Network, Station, network};

const MEASURED: u32 = 200;

fn topology(network: &Network) -> Topology {
    let settings: Settings = serde_json::from_value(network.settings.clone()).expect("settings");
    Topology::new(&settings).expect("a network")
}

/// Returns the nodes that are joined to a source, by walking from node to node over the JSON text
/// itself.
fn energised(network: &Network, open: &BTreeSet<&str>) -> BTreeSet<String> {
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_owned();
    let list = |key: &str| network.settings[key].as_array().expect("a list");
    let mut joined: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for branch in list("branches") {
        if open.contains(branch["equipment"].as_str().expect("an id")) {
            continue;
        }
        let [a, b] = [0, 1].map(|end| text(&branch["between"][end]));
        joined.entry(a.clone()).or_default().push(b.clone());
        joined.entry(b).or_default().push(a);
    }
    let mut to_visit: Vec<String> = list("sources").iter().map(|of| text(&of["node"])).collect();
    let mut reached = BTreeSet::new();
    while let Some(node) = to_visit.pop() {
        if reached.insert(node.clone()) {
            to_visit.extend(joined.get(&node).into_iter().flatten().cloned());
        }
    }
    reached
}

#[test]
fn every_single_switch_toggle_energises_what_a_walk_reaches() {
    let network = network();
    let topology = topology(&network);
    assert_eq!(topology.switches.len(), network.switches.len());
    let sources = vec![Position::Closed; topology.sources.len()];
    let mut energisation = Energisation::default();
    let mut differences = 0;
    let mut normal = None;
    for toggled in std::iter::once(None).chain((0..network.switches.len()).map(Some)) {
        let is_closed = |index: usize| network.switches[index].closed != (toggled == Some(index));
        let open: BTreeSet<&str> = (0..network.switches.len())
            .filter(|&index| !is_closed(index))
            .map(|index| network.switches[index].equipment.as_str())
            .collect();
        let position = |id: &String| match open.contains(id.as_str()) {
            true => Position::Open,
            false => Position::Closed,
        };
        let positions: Vec<Position> = topology.switches.iter().map(position).collect();
        let states = energisation.states(&topology, &positions, &sources).to_vec();
        let reached = energised(&network, &open);
        for (node, state) in topology.nodes.iter().zip(&states) {
            let expected = if reached.contains(node) { State::Energised } else { State::Dead };
            assert_eq!(*state, expected, "{node} with {toggled:?} toggled");
        }
        let normal = normal.get_or_insert_with(|| states.clone());
        differences += usize::from(*normal != states);
    }
    assert!(differences > 20, "switches make a difference: {differences}");
}

#[test]
fn all_that_is_shown_is_in_the_scene() {
    let topology = topology(&network());
    let station = Station::generate(1).expect("a station");
    let devices: BTreeSet<String> = station.placements.iter().map(|p| p.device_id()).collect();
    for id in topology.equipment.iter().chain(&topology.switches) {
        assert!(devices.contains(id), "{id}");
    }
    assert_eq!(topology.switches.len(), 78);
}

#[test]
fn a_live_station_is_a_valid_configuration() {
    let station = Station::generate(1).expect("a station");
    let live = station.live_configuration(|switch| switch.closed);
    busbar_config::parse(&live.to_string()).expect("it is valid");
}

/// Prints what a change costs: a bar of the issue, and no test's to hold.
#[test]
fn a_change_is_worked_out_in_no_time() {
    let network = network();
    let topology = topology(&network);
    let sources = vec![Position::Closed; topology.sources.len()];
    let mut positions: Vec<Position> = topology.switches.iter().map(|_| Position::Closed).collect();
    let mut energisation = Energisation::default();
    let start = Instant::now();
    for round in 0..MEASURED as usize {
        let switch = round % positions.len();
        positions[switch] = [Position::Open, Position::Unknown, Position::Closed][round % 3];
        assert_eq!(
            energisation.states(&topology, &positions, &sources).len(),
            topology.nodes.len()
        );
    }
    let each = start.elapsed() / MEASURED;
    println!("{} nodes, {} switches: {each:?} a change", topology.nodes.len(), positions.len());
}
