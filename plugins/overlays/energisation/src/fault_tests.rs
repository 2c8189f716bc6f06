//! Silence: tags of all kinds with faults admit exactly what the judgment says, by
//! enumeration of all completions. `BUSBAR_TOPOLOGY_CASES` sets the number of networks.

use busbar_plugin_sdk::{
    Binding, DoublePoint, Origin, Quality, Reason, TagValue, Value, ValueKind,
};
use fastrand::Rng;

use crate::enumeration_tests::{SEED, cases};
use crate::random_network::RandomNetwork;
use crate::test_station::{CLOSED, MOVING, NO, OPEN, YES, text};
use crate::*;

const BAD_STATE: Value = Value::DoublePoint(DoublePoint::BadState);
const GOOD: Quality = Quality::Good;
const STALE: Quality = Quality::Bad(Reason::Stale);
const UNCERTAIN: Quality = Quality::Uncertain(Reason::Unknown);
const POLES: [&str; 3] = ["position_l1", "position_l2", "position_l3"];

/// Tags of one network.
#[derive(Default)]
struct Tags {
    bindings: Vec<Binding>,
    values: Vec<TagValue>,
}

impl Tags {
    fn add(&mut self, id: &str, role: &str, unit: &str, value: Option<Value>, quality: Quality) {
        self.bindings.push(Binding {
            node: 0,
            kind: value.as_ref().map_or(ValueKind::F64, Value::kind),
            limit_low: None,
            limit_high: None,
            tag_id: format!("{id}.{role}"),
            tag_name: String::new(),
            unit: unit.into(),
            node_id: id.into(),
            role: role.into(),
        });
        self.values.push(TagValue {
            value,
            quality,
            age: std::time::Duration::ZERO,
            origin: Origin::LIVE,
        });
    }

    fn good(&mut self, id: &str, role: &str, value: Value) {
        self.add(id, role, "", Some(value), GOOD);
    }

    /// Something that tells no position, or none that may be believed.
    fn faulty(&mut self, id: &str, role: &str, random: &mut Rng) {
        let (value, quality) = match random.usize(0..8) {
            0 => (None, Quality::Bad(Reason::NotConnected)),
            1 => (Some(OPEN), STALE),
            2 => (Some(YES), UNCERTAIN),
            3 => (Some(MOVING), GOOD),
            4 => (Some(BAD_STATE), GOOD),
            5 => (Some(CLOSED), STALE),
            6 => (Some(text(["", "on", "1", "OPEN"][random.usize(0..4)])), GOOD),
            _ => (Some(Value::F64(f64::NAN)), GOOD),
        };
        self.add(id, role, "", value, quality);
    }

    fn any(&mut self, id: &str, role: &str, random: &mut Rng) {
        match random.usize(0..3) {
            0 => self.good(id, role, OPEN),
            1 => self.good(id, role, CLOSED),
            _ => self.faulty(id, role, random),
        }
    }

    /// Tags of a switch that admit these positions and no others.
    fn add_switch(&mut self, id: &str, position: Position, random: &mut Rng) {
        let [double, single] = match position {
            Position::Closed => [CLOSED, YES],
            Position::Open | Position::Unknown => [OPEN, NO],
        };
        match (position, random.usize(0..6)) {
            (Position::Open, 0) => {
                self.good(id, "racked_out", YES);
                self.any(id, "position", random);
            }
            (Position::Open, 1) => {
                self.good(id, "position", double);
                self.faulty(id, "racked_out", random);
            }
            (Position::Closed, 0 | 1) => {
                self.good(id, "position", double);
                self.good(id, "racked_out", NO);
            }
            (Position::Open | Position::Closed, 2) => {
                self.good(id, "hand_dressed", double);
                self.any(id, "position", random);
            }
            (Position::Open | Position::Closed, 3) => {
                POLES.into_iter().for_each(|role| self.good(id, role, double.clone()));
            }
            (Position::Open | Position::Closed, 4) => {
                // Substituted by hand, which devices call uncertain.
                self.good(id, "hand_dressed", YES);
                self.add(id, "position", "", Some(double), UNCERTAIN);
            }
            (Position::Open | Position::Closed, _) => self.good(id, "position", single),
            // No tag at all.
            (Position::Unknown, 0) => {}
            (Position::Unknown, 1) => {
                let mut poles = [YES, NO, if random.bool() { YES } else { NO }];
                random.shuffle(&mut poles);
                POLES.into_iter().zip(poles).for_each(|(role, of)| self.good(id, role, of));
            }
            (Position::Unknown, 2) => {
                let same = if random.bool() { CLOSED } else { OPEN };
                self.good(id, POLES[0], same.clone());
                self.good(id, POLES[1], same);
                if random.bool() {
                    self.faulty(id, POLES[2], random);
                }
            }
            (Position::Unknown, 3) => {
                self.good(id, "position", CLOSED);
                self.faulty(id, "racked_out", random);
            }
            (Position::Unknown, 4) => {
                self.good(id, "position", OPEN);
                self.add(id, "hand_dressed", "", Some(CLOSED), STALE);
            }
            (Position::Unknown, _) => self.faulty(id, "position", random),
        }
    }

    /// Tags of a source that admit this feeding and no other.
    fn add_source(&mut self, id: &str, feeds: Position, random: &mut Rng) {
        let sign = if random.bool() { 1.0 } else { -1.0 };
        let mut number = |role: &str, unit: &str, value: f64| {
            self.add(id, role, unit, Some(Value::F64(value)), GOOD);
        };
        match (feeds, random.usize(0..5)) {
            (Position::Closed, 0) => number("active_power", "MW", 12.0 * sign),
            (Position::Closed, 1) => {
                number("active_power", "MW", 0.0);
                number("reactive_power", "kvar", 800.0 * sign);
            }
            // Levels have 10 to 12 kV.
            (Position::Closed, 2) => number("source", "V", 9_000.0),
            (Position::Closed, _) => self.good(id, "source", YES),
            (Position::Open, 0) => {
                self.good(id, "source", OPEN);
                self.add(id, "active_power", "MW", Some(Value::F64(0.0)), GOOD);
            }
            (Position::Open, _) => self.good(id, "source", NO),
            (Position::Unknown, 0) => {}
            (Position::Unknown, 1) => number("active_power", "MW", 0.0),
            (Position::Unknown, 2) => number("source", "kV", [0.02, 3.0][random.usize(0..2)]),
            (Position::Unknown, 3) => {
                number("active_power", "MW", 9.0 * sign);
                self.good(id, "source", NO);
            }
            (Position::Unknown, _) => self.faulty(id, "source", random),
        }
    }
}

#[test]
fn faulty_tags_admit_what_the_judgment_says() {
    for case in 0..cases() {
        let random = &mut Rng::with_seed(SEED << 40 | case);
        let network = RandomNetwork::generate(random);
        let mut tags = Tags::default();
        for (switch, &position) in network.positions.iter().enumerate() {
            tags.add_switch(&network.switch_id(switch), position, random);
        }
        let sources = network.feeds.iter().zip(&network.sources).enumerate();
        for (index, (&feeds, (_, is_always_on))) in sources {
            if !is_always_on {
                tags.add_source(&format!("G{index}"), feeds, random);
            }
        }
        check(&network, &tags, case);
    }
}

fn check(network: &RandomNetwork, Tags { bindings, values }: &Tags, case: u64) {
    let settings = network.settings();
    let topology = Topology::new(&settings).unwrap();
    let wired = Network::new(&settings, &topology, bindings).unwrap();
    let source = |source: &SourceWiring| source.read(values, &mut VoltageMemory::default());
    let readings = Readings {
        switches: wired.switches.iter().map(|switch| switch.read(values)).collect(),
        sources: wired.sources.iter().map(source).collect(),
        voltages: Vec::new(),
    };
    let mut judgments = Judgments::default();
    judgments.judge(&wired, readings);
    for (node, bits) in network.enumerate().iter().enumerate() {
        let id = format!("N{node}");
        let piece = topology.equipment.iter().position(|of| *of == id).unwrap();
        let judgment = judgments.pieces[piece].as_ref().unwrap();
        let expected = match bits.state() {
            State::Energised => (PieceState::Energised, Standing::Normal),
            State::Dead => (PieceState::Dead, Standing::Normal),
            State::Earthed => (PieceState::Earthed, Standing::Normal),
            State::Unknown => (PieceState::Unknown, Standing::Unknown),
            State::Contradiction => (PieceState::Contradiction, Standing::Unknown),
        };
        let found = (judgment.state, judgment.standing);
        let place = || format!("case {case}, {id}: {judgment:?}\n{network:#?}\n{bindings:#?}");
        assert_eq!(found, expected, "{}", place());
        let needs_reason = judgment.standing != Standing::Normal;
        assert!(!needs_reason || !judgment.reason.is_empty(), "{}", place());
        // What it rests on is good.
        let basis = judgments.basis(judgment.basis);
        assert!(
            basis.iter().all(|&binding| values[binding as usize].quality == GOOD),
            "{}",
            place()
        );
    }
    // Every piece that the settings name is judged.
    assert!(judgments.pieces.iter().all(Option::is_some), "case {case}");
}
