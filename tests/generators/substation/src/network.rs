//! Network of the station: connectivity nodes, branches, and the normal positions of switches.

use serde_json::{Value, json};

use crate::layout::{BayKind, YARDS, Yard};

/// Switch with its position in normal operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkSwitch {
    /// Id of the switch's equipment.
    pub equipment: String,
    /// Position in normal operation: true if closed.
    pub closed: bool,
}

/// Network in the form of an overlay's settings, with its switches.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Settings `levels`, `nodes`, `branches`, `earths` and `sources`.
    pub settings: Value,
    /// Switches of the whole station.
    pub switches: Vec<NetworkSwitch>,
}

#[derive(Default)]
struct Builder {
    nodes: Vec<Value>,
    branches: Vec<Value>,
    sources: Vec<Value>,
    switches: Vec<NetworkSwitch>,
}

impl Builder {
    fn node(&mut self, id: &str, level: &str, equipment: &[String]) {
        self.nodes.push(json!({ "id": id, "level": level, "equipment": equipment }));
    }

    fn switch(&mut self, equipment: String, between: [&str; 2], closed: bool) {
        self.branches.push(json!({ "equipment": equipment, "between": between, "switch": true }));
        self.switches.push(NetworkSwitch { equipment, closed });
    }

    fn joint(&mut self, equipment: String, between: [&str; 2]) {
        self.branches.push(json!({ "equipment": equipment, "between": between }));
    }

    fn yard(&mut self, yard: &Yard, level: &str) {
        let bus = |number: usize| format!("{}W{number}", yard.level);
        for number in [1, 2] {
            let tubes = (1..=yard.bays.len()).map(|slot| format!("{}-WA{slot}", bus(number)));
            self.node(&bus(number), level, &tubes.collect::<Vec<_>>());
        }
        let mut numbers = [0_u8; 5];
        for &kind in yard.bays {
            let number = &mut numbers[kind as usize];
            *number += 1;
            let bay = format!("{}{}", yard.level, kind.designation(*number));
            let buses = [&*bus(1), &*bus(2)];
            self.bay(kind, (&bay, *number), level, buses);
        }
    }

    fn bay(&mut self, kind: BayKind, (bay, number): (&str, u8), level: &str, bus: [&str; 2]) {
        let device = |name: &str| format!("{bay}-{name}");
        let node = |name: &str| format!("{bay}.{name}");
        let (near, middle, far) = (node("1"), node("2"), node("3"));
        // Bays stand on the busbars by turns.
        let on_first = number % 2 == 1;
        match kind {
            BayKind::Line | BayKind::Transformer => {
                self.node(&near, level, &[device("UP1")]);
                self.node(&middle, level, &[]);
                self.switch(device("QB1"), [bus[0], &near], on_first);
                self.switch(device("QB2"), [bus[1], &near], !on_first);
                self.switch(device("QA1"), [&near, &middle], true);
                let end = match kind {
                    BayKind::Line => {
                        self.node(&far, level, &[]);
                        let line = node("line");
                        self.node(&line, level, &["BV1", "FA1", "UT1"].map(device));
                        self.switch(device("QB9"), [&far, &line], true);
                        // Power comes in by some of the 220 kV lines.
                        if level == "220 kV" && number <= 2 {
                            self.sources.push(json!({ "node": line }));
                        }
                        far
                    }
                    _ => {
                        let end = winding(number, level);
                        self.node(&end, level, &["FA1", "UT1"].map(device));
                        end
                    }
                };
                self.joint(device("BC1"), [&middle, &end]);
            }
            BayKind::Coupler => {
                self.node(&near, level, &[]);
                self.node(&middle, level, &[]);
                self.node(&far, level, &["UP1", "UP2"].map(device));
                self.switch(device("QB1"), [bus[0], &near], true);
                self.switch(device("QA1"), [&near, &middle], true);
                self.joint(device("BC1"), [&middle, &far]);
                self.switch(device("QB2"), [bus[1], &far], true);
            }
            BayKind::VoltageOne | BayKind::VoltageTwo => {
                self.node(&near, level, &["BV1", "FA1"].map(device));
                let (name, bus) = match kind {
                    BayKind::VoltageOne => ("QB1", bus[0]),
                    _ => ("QB2", bus[1]),
                };
                self.switch(device(name), [bus, &near], true);
            }
        }
    }

    fn transformer(&mut self, number: u8) {
        let bay = format!("=S12T{number}");
        let low = format!("{bay}.low");
        self.node(&low, "35 kV", &[format!("{bay}-WB1")]);
        let windings = [winding(number, "220 kV"), winding(number, "110 kV"), low];
        for end in &windings[1..] {
            self.joint(format!("{bay}-TA1"), [&windings[0], end]);
        }
    }
}

/// Returns the connectivity node of a transformer's winding.
fn winding(number: u8, level: &str) -> String {
    format!("=S12T{number}.{}", level.trim_end_matches(" kV"))
}

/// Returns the station's network in normal operation.
pub fn network() -> Network {
    let mut builder = Builder::default();
    for (yard, level) in YARDS.iter().zip(["220 kV", "110 kV"]) {
        builder.yard(yard, level);
    }
    for number in [1, 2] {
        builder.transformer(number);
    }
    let Builder { nodes, branches, sources, switches } = builder;
    let settings = json!({
        "levels": [
            // Muted: the saturated is for what is abnormal; and so far from each other in
            // grey that a picture without colour tells them apart.
            { "name": "220 kV", "color": "#1c1430" },
            { "name": "110 kV", "color": "#8a7568" },
            { "name": "35 kV", "color": "#b3a878" }
        ],
        "nodes": nodes,
        "branches": branches,
        "sources": sources,
    });
    Network { settings, switches }
}
