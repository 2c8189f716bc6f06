//! Scenarios of the station in quick motion: a timeline for its simulated devices each.

use serde_json::{Value, json};

use crate::points::{Load, bay_loads};

/// Scenario with its file name and events.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Name of the scenario's file, without extension.
    pub name: &'static str,
    /// Scenario as `busbar simulate` reads it.
    pub events: Value,
}

/// Time of the first event, seconds; by then every value has been read once.
const BEGIN: f64 = 4.0;

/// Returns all scenarios of the station.
pub fn scenarios() -> Vec<Scenario> {
    let scenario = |name, description: &str, timeline: Timeline| Scenario {
        name,
        events: json!({ "version": 1, "description": description, "events": timeline.events }),
    };
    let trip = "Busbar protection trips all breakers of busbar I, 110 kV";
    let load = "A 110 kV line takes over its neighbour's load, and a contact heats up";
    let heating = "Transformer T1 loses its fans at 132 % load";
    vec![
        scenario("breaker_trip", trip, breaker_trip()),
        scenario("overload", load, overload()),
        scenario("transformer_heating", heating, transformer_heating()),
        scenario("sf6_leak", "A pole of breaker D1Q3 loses its gas", sf6_leak()),
        scenario("isolation", "Line D1Q3 is switched off, isolated and earthed", isolation()),
        scenario("link_loss", "The gateway of the 110 kV yard is silent", link_loss()),
    ]
}

#[derive(Default)]
struct Timeline {
    events: Vec<Value>,
}

impl Timeline {
    fn jump(&mut self, at: f64, tag: impl Into<String>, value: f64) {
        self.events.push(json!({ "at_seconds": at, "tag": tag.into(), "value": value }));
    }

    fn ramp(&mut self, at: f64, tag: impl Into<String>, value: f64, over: f64) {
        let tag = tag.into();
        self.events
            .push(json!({ "at_seconds": at, "tag": tag, "value": value, "over_seconds": over }));
    }

    /// Sets the power out of a bay's busbar, and the currents that result from it.
    fn load(&mut self, at: f64, bay: &str, megawatts: f64, over: f64) {
        let Some(usual) = bay_loads().into_iter().find(|load| load.bay == bay) else { return };
        let load = Load { megawatts, ..usual };
        let measured = |data: &str| format!("{}MEAS/MMXU1.{data}", bay.trim_start_matches('='));
        self.ramp(at, measured("TotW"), rounded(megawatts), over);
        self.ramp(at, measured("TotVAr"), rounded(0.25 * megawatts), over);
        for phase in ["A", "B", "C"] {
            self.ramp(at, measured(&format!("A.phs{phase}")), rounded(load.amperes()), over);
        }
    }

    /// Sets the voltages at a bay's voltage transformers to zero.
    fn dead(&mut self, at: f64, bay: &str, pairs: &[&str]) {
        let singles = ["PhV.phsA", "PhV.phsB", "PhV.phsC"];
        for data in singles.iter().chain(pairs).chain(&["Hz"]) {
            self.jump(at, format!("{bay}MEAS/MMXU1.{data}"), 0.0);
        }
    }
}

fn rounded(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn breaker_trip() -> Timeline {
    let mut timeline = Timeline::default();
    timeline.jump(BEGIN, "S12E1Q30PROT/PDIF1.Op", 1.0);
    // What stands on busbar I, and the coupler.
    for bay in ["Q1", "Q3", "Q5", "Q7", "Q21", "Q30"].map(|bay| format!("S12E1{bay}")) {
        timeline.jump(BEGIN, format!("{bay}PROT/PTRC1.Tr"), 1.0);
        timeline.jump(BEGIN, format!("{bay}CTRL/XCBR1.Pos"), 0.0);
        timeline.jump(BEGIN + 0.5, format!("{bay}CTRL/XCBR1.Pos"), 1.0);
        timeline.load(BEGIN + 0.3, &format!("={bay}"), 0.0, 0.2);
    }
    for line in ["S12E1Q1", "S12E1Q3", "S12E1Q5", "S12E1Q7"] {
        timeline.dead(BEGIN + 0.5, line, &["PPV.phsAB"]);
    }
    timeline.dead(BEGIN + 0.5, "S12E1Q41", &["PPV.phsAB", "PPV.phsBC", "PPV.phsCA"]);
    // 76 MW less go through T1 and come in by the lines.
    for (bay, megawatts) in [("=S12D1Q21", 6.4), ("=S12D1Q1", -84.0), ("=S12D1Q2", -75.4)] {
        timeline.load(BEGIN + 0.3, bay, megawatts, 0.4);
    }
    timeline.jump(BEGIN + 0.5, "S12T1MEAS/YPTR1.LodPct", 4.0);
    timeline
}

fn overload() -> Timeline {
    let mut timeline = Timeline::default();
    let over = 10.0;
    for (bay, megawatts) in
        [("=S12E1Q2", 122.0), ("=S12E1Q22", -173.6), ("=S12D1Q22", 180.0), ("=S12D1Q2", -215.0)]
    {
        timeline.load(BEGIN, bay, megawatts, over);
    }
    timeline.ramp(BEGIN, "S12T2MEAS/YPTR1.LodPct", 103.0, over);
    // Contacts of the six devices, by pole; the disconnector's middle one is worn.
    for node in 1..=18 {
        let degrees = if node == 2 { 112.0 } else { 48.0 + 0.3 * f64::from(node) };
        timeline.ramp(BEGIN + 4.0, format!("S12E1Q2MON/STMP{node}.Tmp"), degrees, 16.0);
    }
    timeline
}

fn transformer_heating() -> Timeline {
    let mut timeline = Timeline::default();
    for fan in 1..=16 {
        timeline.jump(BEGIN, format!("S12T1MON/CCGR{fan}.Amp"), 0.0);
    }
    for (bay, megawatts) in
        [("=S12D1Q21", 231.0), ("=S12E1Q21", -223.0), ("=S12D1Q1", -196.0), ("=S12D1Q2", -188.0)]
    {
        timeline.load(BEGIN, bay, megawatts, 8.0);
    }
    timeline.ramp(BEGIN, "S12T1MEAS/YPTR1.LodPct", 132.0, 8.0);
    for sensor in [1, 2] {
        timeline.ramp(BEGIN, format!("S12T1MON/SIML{sensor}.Tmp"), 101.0, 26.0);
        timeline.ramp(BEGIN, format!("S12T1MON/YPTR{sensor}.HPTmp"), 133.0, 24.0);
        timeline.ramp(BEGIN, format!("S12T1MON/SIML{sensor}.Lev"), 76.0, 26.0);
    }
    for (gas, ppm) in [("H2", 96.0), ("C2H4", 41.0)] {
        timeline.ramp(BEGIN + 10.0, format!("S12T1MON/SIML1.{gas}"), ppm, 20.0);
    }
    timeline
}

fn sf6_leak() -> Timeline {
    let mut timeline = Timeline::default();
    // From 7.09 bar at 23 °C, which is 7.0 at 20 °C, to 5.9 at 20 °C in 30 s: 6.4 after 16 s,
    // 6.0 after 27 s.
    timeline.ramp(BEGIN, "S12D1Q3MON/SIMG2.Pres", 5.972, 30.0);
    timeline.jump(BEGIN + 16.5, "S12D1Q3PROT/SIMG1.InsAlm", 1.0);
    timeline.jump(BEGIN + 27.5, "S12D1Q3PROT/SIMG1.InsBlk", 1.0);
    timeline
}

/// Travel time of disconnector blades, seconds; `live.rs` configures the overlay alike.
const BLADE_SECONDS: f64 = 8.0;
const EARTHING_SECONDS: f64 = 6.0;

fn isolation() -> Timeline {
    let mut timeline = Timeline::default();
    let bay = "S12D1Q3";
    timeline.jump(BEGIN, format!("{bay}CTRL/XCBR1.Pos"), 0.0);
    timeline.jump(BEGIN + 0.2, format!("{bay}CTRL/XCBR1.Pos"), 1.0);
    timeline.load(BEGIN + 0.2, "=S12D1Q3", 0.0, 0.1);
    // The line's disconnector, then its earthing blade: each leaves one end and comes to the
    // other (IEC 61850-7-3: 0 on its way, 1 off, 2 on).
    let disconnecting = BEGIN + 4.0;
    timeline.jump(disconnecting, format!("{bay}CTRL/XSWI3.Pos"), 0.0);
    timeline.jump(disconnecting + BLADE_SECONDS, format!("{bay}CTRL/XSWI3.Pos"), 1.0);
    timeline.dead(BEGIN + 1.0, bay, &["PPV.phsAB"]);
    let earthing = disconnecting + BLADE_SECONDS + 4.0;
    timeline.jump(earthing, format!("{bay}CTRL/XSWI4.Pos"), 0.0);
    timeline.jump(earthing + EARTHING_SECONDS, format!("{bay}CTRL/XSWI4.Pos"), 2.0);
    timeline
}

fn link_loss() -> Timeline {
    let events = vec![json!({
        "at_seconds": BEGIN, "instance": "yard_110", "link": "link-loss", "for_seconds": 60,
    })];
    Timeline { events }
}
