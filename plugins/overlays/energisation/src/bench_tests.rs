//! Time of a change in a network of 100,000 branches: printed, and no test's to hold.
//! `cargo test --release -p energisation -- --ignored --nocapture bench`.

use std::time::Duration;

use fastrand::Rng;
use serde_json::json;

use crate::*;

/// Nodes of the network; each but the first of a station hangs at an earlier one.
const NODES: usize = 80_000;
/// Branches: those that make a tree of each station, and others that close rings.
const BRANCHES: usize = 100_000;
/// Nodes of one station, each with a source and earth switches.
const STATION: usize = 100;
const ROUNDS: usize = 51;

fn network(random: &mut Rng) -> Settings {
    let node = |node: usize| {
        let level = if (node / STATION).is_multiple_of(2) { "110 kV" } else { "20 kV" };
        json!({ "id": node.to_string(), "level": level, "equipment": [format!("N{node}")] })
    };
    let branch = |branch: usize, random: &mut Rng| {
        let [a, b] = if branch < NODES && !branch.is_multiple_of(STATION) {
            let first = branch / STATION * STATION;
            [branch, random.usize(first..branch)]
        } else {
            let a = random.usize(0..NODES);
            [a, (a + random.usize(1..STATION)) % NODES]
        };
        let ends = [a.to_string(), b.to_string()];
        json!({ "equipment": format!("Q{branch}"), "between": ends, "switch": !branch.is_multiple_of(4) })
    };
    let station = |station: usize| (station * STATION).to_string();
    let settings = json!({
        "levels": [{ "name": "110 kV", "color": "#aa2200" }, { "name": "20 kV", "color": "#2200aa" }],
        "nodes": (0..NODES).map(node).collect::<Vec<_>>(),
        "branches": (0..BRANCHES).map(|of| branch(of, random)).collect::<Vec<_>>(),
        "earths": (0..NODES / STATION)
            .map(|of| json!({ "equipment": format!("QC{of}"), "node": station(of) }))
            .collect::<Vec<_>>(),
        "sources": (0..NODES / STATION)
            .map(|of| json!({ "node": station(of), "equipment": format!("G{of}") }))
            .collect::<Vec<_>>(),
    });
    serde_json::from_value(settings).unwrap()
}

/// Time that this thread was on a processor: other work on the machine hardly counts.
struct Stopwatch(Duration);

impl Stopwatch {
    fn start() -> Self {
        Self(processor_time())
    }

    fn elapsed(&self) -> Duration {
        processor_time() - self.0
    }
}

fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

fn report(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let [least, median, most] = [0, times.len() / 2, times.len() - 1].map(|at| times[at]);
    println!("{what}: median {median:?}, least {least:?}, most {most:?}");
}

#[test]
#[ignore = "a measurement"]
fn bench_a_change_in_a_network_of_100_000_branches() {
    let random = &mut Rng::with_seed(39);
    let settings = network(random);
    let topology = Topology::new(&settings).unwrap();
    let wired = Network::new(&settings, &topology, &[]).unwrap();
    println!(
        "{} nodes, {} branches, {} switches, {} sources",
        topology.nodes.len(),
        topology.branches.len(),
        topology.switches.len(),
        topology.sources.len()
    );
    for (what, unknown, closed) in
        [("most closed", 0.01, 0.95), ("most open", 0.01, 0.3), ("much unknown", 0.3, 0.6)]
    {
        let mut any = |_| match random.f64() {
            share if share < unknown => Position::Unknown,
            share if share < unknown + closed => Position::Closed,
            _ => Position::Open,
        };
        let mut positions: Vec<Position> = (0..topology.switches.len()).map(&mut any).collect();
        let first_earth = positions.len() - topology.earths.len();
        positions[first_earth..].fill(Position::Open);
        let feeds: Vec<Position> = (0..topology.sources.len()).map(&mut any).collect();
        let reading = |position: Position, index: usize| SwitchReading {
            position,
            condition: match position {
                Position::Unknown => SwitchCondition::InMotion,
                _ => SwitchCondition::Settled,
            },
            basis: smallvec::smallvec![index as u32],
        };
        let source = |position: &Position, index: u32| SourceReading {
            position: *position,
            condition: SourceCondition::Told,
            basis: smallvec::smallvec![index],
            is_assumed: false,
        };
        let sources: Vec<_> = feeds.iter().zip(0..).map(|(of, at)| source(of, at)).collect();
        let mut energisation = Energisation::default();
        let mut judgments = Judgments::default();
        let times: &mut [Vec<Duration>; 4] = &mut Default::default();
        for round in 0..ROUNDS {
            let switch = round * 7;
            positions[switch] = match positions[switch] {
                Position::Open => Position::Closed,
                Position::Closed | Position::Unknown => Position::Open,
            };
            let start = Stopwatch::start();
            energisation.states(&topology, &positions, &feeds);
            times[0].push(start.elapsed());
            let start = Stopwatch::start();
            energisation.find_borders(&topology, &positions);
            times[1].push(start.elapsed());
            if round % 5 == 0 {
                let switches = positions.iter().enumerate().map(|(at, of)| reading(*of, at));
                let (switches, sources) = (switches.collect(), sources.clone());
                let readings = Readings { switches, sources, voltages: Vec::new() };
                let start = Stopwatch::start();
                judgments.judge(&wired, readings);
                times[2].push(start.elapsed());
            } else {
                let switches = vec![(switch, reading(positions[switch], switch))];
                let sources = sources.clone();
                let changes = ChangedReadings { switches, sources, voltages: Vec::new() };
                let start = Stopwatch::start();
                let is_changed = judgments.update(&wired, changes);
                times[3].push(start.elapsed());
                assert!(is_changed && judgments.was_partial());
            }
            assert_eq!(judgments.pieces.len(), topology.equipment.len());
        }
        let pieces = judgments.pieces.iter().flatten();
        let lists = pieces.map(|piece| judgments.basis(piece.basis).len().max(1));
        println!("{what}: {} bindings under the states of a frame", lists.sum::<usize>());
        let names = [
            "states of all nodes",
            "borders of what is dead",
            "all judgments anew, with bases and reasons",
            "judgments after a switch changed, with bases and reasons",
        ];
        for (name, times) in names.into_iter().zip(times) {
            report(&format!("{what}: {name}"), std::mem::take(times));
        }
    }
}
