//! Judgments after changes are those of all equipment judged anew.

use fastrand::Rng;
use smallvec::SmallVec;

use crate::enumeration_tests::{SEED, cases};
use crate::random_network::RandomNetwork;
use crate::test_station::*;
use crate::*;

/// Rounds of changes in each network.
const ROUNDS: usize = 12;

/// Judgment on a piece without indices: state, level, standing, texts and bindings.
type Told = Option<(PieceState, usize, Standing, String, String, Vec<u32>)>;

fn told(judgments: &Judgments) -> Vec<Told> {
    let tell = |judgment: &PieceJudgment| {
        let PieceJudgment { state, level, standing, reason, assumption, basis } = *judgment;
        let [reason, assumption] = [reason, assumption].map(|of| judgments.text(of).to_owned());
        (state, level, standing, reason, assumption, judgments.basis(basis).to_vec())
    };
    judgments.pieces.iter().map(|judgment| judgment.as_ref().map(tell)).collect()
}

fn anew(network: &Network, readings: &Readings) -> Vec<Told> {
    let mut judgments = Judgments::default();
    judgments.judge(network, readings.clone());
    told(&judgments)
}

fn any_basis(random: &mut Rng) -> BindingList {
    (0..random.usize(0..4)).map(|_| random.u32(0..30)).collect()
}

fn any_switch(random: &mut Rng) -> SwitchReading {
    let basis = any_basis(random);
    let (position, condition) = match random.usize(0..12) {
        0 => (Position::Unknown, SwitchCondition::InMotion),
        1 => (Position::Unknown, SwitchCondition::BadState),
        2 => {
            let (open, closed) = (Pole::L1, [Pole::L2, Pole::L3][random.usize(0..2)]);
            (Position::Unknown, SwitchCondition::PolesDisagree { open, closed })
        }
        3 => (Position::Open, SwitchCondition::RackedOut),
        4 => (Position::Open, SwitchCondition::HandDressed),
        5 => (Position::Closed, SwitchCondition::HandDressed),
        6 => (Position::Unknown, SwitchCondition::PortableEarthPlaced),
        at => ([Position::Open, Position::Closed][at % 2], SwitchCondition::Settled),
    };
    SwitchReading { position, condition, basis }
}

fn any_source(random: &mut Rng) -> SourceReading {
    let basis = any_basis(random);
    let (position, condition) = match random.usize(0..8) {
        0 => (Position::Unknown, SourceCondition::NotGood),
        1 => (Position::Unknown, SourceCondition::NoPower),
        2 | 3 => (Position::Open, SourceCondition::Told),
        _ => (Position::Closed, SourceCondition::Told),
    };
    let is_assumed = position == Position::Closed && random.bool();
    SourceReading { position, condition, basis, is_assumed }
}

#[test]
fn judgments_after_changes_are_those_of_a_network_judged_anew() {
    let mut partly = 0;
    for case in 0..cases() {
        let random = &mut Rng::with_seed(SEED << 48 | case);
        let network = RandomNetwork::generate(random);
        let settings = network.settings();
        let topology = Topology::new(&settings).unwrap();
        let wired = Network::new(&settings, &topology, &[]).unwrap();
        let readings = Readings {
            switches: (0..topology.switches.len()).map(|_| any_switch(random)).collect(),
            sources: (0..topology.sources.len()).map(|_| any_source(random)).collect(),
            voltages: Vec::new(),
        };
        let mut judgments = Judgments::default();
        judgments.judge(&wired, readings.clone());
        assert_eq!(told(&judgments), anew(&wired, &readings), "case {case}");
        for round in 0..ROUNDS {
            let before = judgments.readings().clone();
            let mut sources = before.sources.clone();
            if random.usize(0..3) == 0 {
                let source = random.usize(0..sources.len());
                sources[source] = any_source(random);
            }
            let count = topology.switches.len();
            let mut changed: Vec<usize> = match count {
                0 => Vec::new(),
                _ => (0..random.usize(0..3)).map(|_| random.usize(0..count)).collect(),
            };
            changed.dedup();
            let switches: Vec<(usize, SwitchReading)> =
                changed.into_iter().map(|switch| (switch, any_switch(random))).collect();
            let mut after = Readings { sources: sources.clone(), ..before.clone() };
            for (switch, reading) in &switches {
                after.switches[*switch] = reading.clone();
            }
            let changes = ChangedReadings { switches, sources, voltages: Vec::new() };
            assert_eq!(judgments.update(&wired, changes), after != before, "case {case}");
            assert_eq!(*judgments.readings(), after, "case {case}, round {round}");
            let expected = anew(&wired, &after);
            assert_eq!(told(&judgments), expected, "case {case}, round {round}: {network:#?}");
            partly += usize::from(judgments.was_partial());
        }
    }
    // Most rounds judge only some of the equipment, or the test says nothing.
    assert!(partly > cases() as usize * ROUNDS / 2, "{partly}");
}

#[test]
fn tags_that_change_are_read_and_judged_as_all_tags_are() {
    let equipment = ["LINE", "HIGH", "VT", "BUS", "QA1", "QA2", "T1", "QC1", "QC2", "G1"];
    let roles = [
        "position",
        "position",
        "position_l1",
        "racked_out",
        "hand_dressed",
        "portable_earth",
        "source",
        "active_power",
        "voltage_l1",
        "fuse_fault",
    ];
    let [yes, no, moving, word] = [YES, NO, MOVING, text("on")].map(Some);
    let values = [None, yes, no, moving, Some(CLOSED), Some(OPEN), word];
    let mut counts = [0; 2];
    for case in 0..500 {
        let random = &mut Rng::with_seed(SEED << 52 | case);
        let value = |random: &mut Rng, role: &str| match role {
            "active_power" | "voltage_l1" => {
                Some(busbar_plugin_sdk::Value::F64([0.0, 5.0, 12.0, 64.0][random.usize(0..4)]))
            }
            _ => values[random.usize(0..values.len())].clone(),
        };
        let qualities = {
            let good = tag("", "", YES).4;
            [good, good, good, bad(tag("", "", YES)).4]
        };
        let mut tags: Vec<Tag> = (0..16)
            .map(|_| {
                let role = roles[random.usize(0..roles.len())];
                let unit = if role == "voltage_l1" { "kV" } else { "" };
                let id = equipment[random.usize(0..equipment.len())];
                Tag(id, role, unit, value(random, role), qualities[random.usize(0..4)])
            })
            .collect();
        let mut station = Station::new(&generator(), &tags);
        for _ in 0..ROUNDS {
            station.update(&tags);
            let judgments = station.overlay.judgments();
            let readings = judgments.readings();
            let network = &station.overlay.network;
            let values = crate::test_station::values(&tags);
            let switches: SmallVec<[_; 8]> =
                network.switches.iter().map(|switch| switch.read(&values)).collect();
            assert_eq!(readings.switches, switches.to_vec(), "case {case}");
            assert_eq!(told(judgments), anew(network, readings), "case {case}");
            counts[usize::from(judgments.was_partial())] += 1;
            for _ in 0..random.usize(0..3) {
                let at = random.usize(0..tags.len());
                let role = tags[at].1;
                tags[at].3 = value(random, role);
                tags[at].4 = qualities[random.usize(0..4)];
            }
        }
    }
    assert!(counts.iter().all(|&count| count >= 500), "{counts:?}");
}

/// Runs rounds in which a switch changes between two values; returns the most bytes of texts
/// and the most lists.
fn most_kept(station: &mut Station, values: &[busbar_plugin_sdk::Value; 2]) -> [usize; 2] {
    let mut most = [0; 2];
    for round in 0..120_000 {
        station.update(&switches(CLOSED, values[round % 2].clone(), OPEN, OPEN));
        let judgments = station.overlay.judgments();
        most = [most[0].max(judgments.text_bytes()), most[1].max(judgments.list_count())];
    }
    most
}

#[test]
fn texts_and_lists_that_nothing_shows_any_more_are_removed() {
    let tags = switches(CLOSED, CLOSED, OPEN, OPEN);
    let mut station = station(&two_levels(), &tags);
    let [texts, _] = most_kept(&mut station, &[MOVING, CLOSED]);
    assert!((1 << 20..2 << 20).contains(&texts), "{texts}");
    assert_eq!(station.judgment("BUS").reason, "");
    let [texts, lists] = most_kept(&mut station, &[OPEN, CLOSED]);
    assert!((1 << 16..1 << 17).contains(&lists), "{texts} {lists}");
    assert_eq!(station.state("BUS"), PieceState::Energised);
}
