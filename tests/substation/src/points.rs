//! The point list: what the station's devices report, as a control centre
//! would list it.

use std::fmt::Write;

use crate::layout::{BayKind, YARDS};

/// 35 kV feeders, capacitor banks, station transformers and incomers.
const FEEDER_BAYS: usize = 20;
const HOUSE: &str = "=S12H1-UH1";
const CONTROL_HOUSE: &str = "=S12Z1-UH1";

/// What a point carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointKind {
    /// A measured value.
    Analog,
    /// A switch position in two bits.
    Double,
    /// A status or alarm.
    Single,
    /// A command; Busbar shows it and never sends it.
    Control,
    /// A value of condition monitoring.
    Monitoring,
}

impl PointKind {
    fn word(self) -> &'static str {
        match self {
            Self::Analog => "analog",
            Self::Double => "double_point",
            Self::Single => "single_point",
            Self::Control => "control",
            Self::Monitoring => "monitoring",
        }
    }
}

/// One point.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Reference in the style of IEC 61850, unique.
    pub id: String,
    /// The equipment (IEC 81346) that it belongs to.
    pub equipment: String,
    /// What people call it.
    pub name: String,
    /// What it carries.
    pub kind: PointKind,
    /// Unit; empty for states.
    pub unit: &'static str,
    /// Least plausible value.
    pub low: f64,
    /// Greatest plausible value.
    pub high: f64,
    /// Milliseconds between two values at most.
    pub scan_millis: u32,
}

/// A quantity: reference, name, unit, low, high, milliseconds.
type Quantity = (&'static str, &'static str, &'static str, f64, f64, u32);

/// Measured values of a feeder; 15, the last one for transformers and 35 kV.
const MEASURED: [Quantity; 15] = [
    ("MMXU1.TotW", "active power", "MW", -400.0, 400.0, 2000),
    ("MMXU1.TotVAr", "reactive power", "Mvar", -200.0, 200.0, 2000),
    ("MMXU1.A.phsA", "current L1", "A", 0.0, 3150.0, 1000),
    ("MMXU1.A.phsB", "current L2", "A", 0.0, 3150.0, 1000),
    ("MMXU1.A.phsC", "current L3", "A", 0.0, 3150.0, 1000),
    ("MSQI1.SeqA.c3", "residual current", "A", 0.0, 3150.0, 1000),
    ("MMXU1.PhV.phsA", "voltage L1", "kV", 0.0, 160.0, 1000),
    ("MMXU1.PhV.phsB", "voltage L2", "kV", 0.0, 160.0, 1000),
    ("MMXU1.PhV.phsC", "voltage L3", "kV", 0.0, 160.0, 1000),
    ("MMXU1.PPV.phsAB", "voltage L1-L2", "kV", 0.0, 270.0, 1000),
    ("MMXU1.Hz", "frequency", "Hz", 45.0, 55.0, 1000),
    ("MMXU1.TotPF", "power factor", "1", -1.0, 1.0, 3000),
    ("MMTR1.SupWh", "energy out", "MWh", 0.0, 1.0e7, 60_000),
    ("MMTR1.DmdWh", "energy in", "MWh", 0.0, 1.0e7, 60_000),
    ("STMP1.Tmp", "cable box temperature", "°C", -40.0, 150.0, 60_000),
];

/// Condition monitoring of a bay; the list repeats with the next sensor.
const MONITORED: [Quantity; 9] = [
    ("SIMG.Pres", "SF6 pressure", "bar", 0.0, 12.0, 60_000),
    ("SIMG.Tmp", "SF6 temperature", "°C", -40.0, 100.0, 60_000),
    ("SARC.TotA", "arrester leakage current", "mA", 0.0, 20.0, 300_000),
    ("SARC.RisA", "arrester resistive current", "mA", 0.0, 10.0, 300_000),
    ("SARC.OpCnt", "arrester operations", "1", 0.0, 9999.0, 300_000),
    ("STMP.TmpA", "contact temperature L1", "°C", -40.0, 200.0, 300_000),
    ("STMP.TmpB", "contact temperature L2", "°C", -40.0, 200.0, 300_000),
    ("STMP.TmpC", "contact temperature L3", "°C", -40.0, 200.0, 300_000),
    ("SINS.LeakA", "insulator leakage current", "mA", 0.0, 50.0, 300_000),
];

/// Condition monitoring of a transformer.
const TRANSFORMER_MONITORED: [Quantity; 16] = [
    ("SIML.H2", "hydrogen", "ppm", 0.0, 5000.0, 7_200_000),
    ("SIML.CH4", "methane", "ppm", 0.0, 5000.0, 7_200_000),
    ("SIML.C2H2", "acetylene", "ppm", 0.0, 1000.0, 7_200_000),
    ("SIML.C2H4", "ethylene", "ppm", 0.0, 5000.0, 7_200_000),
    ("SIML.C2H6", "ethane", "ppm", 0.0, 5000.0, 7_200_000),
    ("SIML.CO", "carbon monoxide", "ppm", 0.0, 10_000.0, 7_200_000),
    ("SIML.CO2", "carbon dioxide", "ppm", 0.0, 50_000.0, 7_200_000),
    ("SIML.H2O", "moisture in oil", "ppm", 0.0, 100.0, 7_200_000),
    ("SIML.Tmp", "top-oil temperature", "°C", -40.0, 150.0, 60_000),
    ("YPTR.HPTmp", "winding hot-spot", "°C", -40.0, 200.0, 60_000),
    ("SIML.Lev", "oil level", "%", 0.0, 100.0, 60_000),
    ("SCUR.Core", "core earth current", "mA", 0.0, 1000.0, 300_000),
    ("SIMB.TanD", "bushing loss factor", "%", 0.0, 5.0, 1_800_000),
    ("SPDC.Lev", "partial discharge", "pC", 0.0, 10_000.0, 300_000),
    ("CCGR.Amp", "fan current", "A", 0.0, 10.0, 60_000),
    ("SVBR.Lev", "tank vibration", "m/s2", 0.0, 50.0, 300_000),
];

/// Condition monitoring of the station.
const STATION_MONITORED: [Quantity; 4] = [
    ("MMET.Tmp", "ambient temperature", "°C", -50.0, 60.0, 60_000),
    ("ZBAT.Vol", "battery voltage", "V", 0.0, 300.0, 60_000),
    ("SFIR.Lev", "smoke density", "%", 0.0, 100.0, 10_000),
    ("SCAM.Rate", "video stream rate", "Mbit/s", 0.0, 100.0, 10_000),
];

/// States; the list repeats with the next logical node.
const STATES: [(&str, &str); 15] = [
    ("PTRC.Tr", "trip"),
    ("PTRC.Str", "protection picked up"),
    ("PDIF.Op", "differential protection operated"),
    ("PDIS.Op", "distance protection operated"),
    ("PTOC.Op", "overcurrent protection operated"),
    ("RREC.Op", "reclosing"),
    ("RBRF.OpEx", "breaker failure"),
    ("RVTF.Alm", "voltage transformer fault"),
    ("LPHD.PhyHealth", "device fault"),
    ("LGOS.St", "GOOSE link"),
    ("SIMG.InsAlm", "SF6 low"),
    ("SOPM.MotOv", "spring motor overrun"),
    ("GAPC.DcAlm", "control supply lost"),
    ("CILO.EnaCls", "interlock released"),
    ("LLN0.Loc", "local control"),
];

const POSITIONS: [(&str, &str); 3] =
    [("XCBR.Pos", "breaker"), ("XSWI.Pos", "disconnector"), ("CSWI.Pos", "switch")];
const COMMANDS: [(&str, &str); 3] =
    [("CSWI.Pos.Oper", "operate"), ("GGIO.SPCSO.Oper", "reset"), ("RREC.Auto.Oper", "reclosing")];

/// How many points a bay has: analog, double, single, control, monitoring.
type Numbers = [usize; 5];

const LINE: Numbers = [14, 8, 90, 12, 36];
const TRANSFORMER: Numbers = [45, 14, 150, 20, 99];
const COUPLER: Numbers = [8, 6, 80, 10, 27];
const BUS: Numbers = [9, 3, 25, 3, 15];
const FEEDER: Numbers = [15, 2, 51, 5, 6];
const STATION: Numbers = [60, 20, 250, 20, 102];

/// The point list.
pub fn points() -> Vec<Point> {
    let mut points = Vec::new();
    for yard in &YARDS {
        let mut seen = [0_u8; 5];
        for &kind in yard.bays {
            seen[kind as usize] += 1;
            let designation = kind.designation(seen[kind as usize]);
            let bay = format!("{}{designation}", yard.level);
            match kind {
                BayKind::Line => add(&bay, "-QA1", LINE, &MONITORED, &mut points),
                BayKind::Coupler => add(&bay, "-QA1", COUPLER, &MONITORED, &mut points),
                BayKind::VoltageOne | BayKind::VoltageTwo => {
                    add(&bay, "-BV1", BUS, &MONITORED, &mut points);
                }
                // Counted with the transformer.
                BayKind::Transformer => {}
            }
        }
    }
    for number in 1..=2 {
        let bay = format!("=S12T{number}");
        add(&bay, "-TA1", TRANSFORMER, &TRANSFORMER_MONITORED, &mut points);
    }
    for feeder in 1..=FEEDER_BAYS {
        let first = points.len();
        add(&format!("=S12H1K{feeder}"), "", FEEDER, &MONITORED, &mut points);
        points[first..].iter_mut().for_each(|point| HOUSE.clone_into(&mut point.equipment));
    }
    let first = points.len();
    add("=S12Z1", "", STATION, &STATION_MONITORED, &mut points);
    points[first..].iter_mut().for_each(|point| CONTROL_HOUSE.clone_into(&mut point.equipment));
    points
}

fn add(bay: &str, device: &str, numbers: Numbers, monitored: &[Quantity], into: &mut Vec<Point>) {
    let kinds = [
        PointKind::Analog,
        PointKind::Double,
        PointKind::Single,
        PointKind::Control,
        PointKind::Monitoring,
    ];
    for (kind, number) in kinds.into_iter().zip(numbers) {
        for i in 0..number {
            let (reference, name, unit, low, high, scan_millis) = match kind {
                PointKind::Analog => MEASURED[i % MEASURED.len()],
                PointKind::Monitoring => monitored[i % monitored.len()],
                PointKind::Double => state(&POSITIONS, i, 3.0),
                PointKind::Single => state(&STATES, i, 1.0),
                PointKind::Control => state(&COMMANDS, i, 1.0),
            };
            let length = match kind {
                PointKind::Analog => MEASURED.len(),
                PointKind::Monitoring => monitored.len(),
                PointKind::Double => POSITIONS.len(),
                PointKind::Single => STATES.len(),
                PointKind::Control => COMMANDS.len(),
            };
            let set = i / length + 1;
            into.push(Point {
                id: reference_of(bay, kind, reference, set),
                equipment: format!("{bay}{device}"),
                name: if set > 1 { format!("{name} {set}") } else { name.to_owned() },
                kind,
                unit,
                low,
                high,
                scan_millis,
            });
        }
    }
}

/// States are sent when they change and polled each second.
fn state(list: &[(&'static str, &'static str)], i: usize, high: f64) -> Quantity {
    let (reference, name) = list[i % list.len()];
    (reference, name, "", 0.0, high, 1000)
}

/// The bay, the logical node with its number, the data object.
fn reference_of(bay: &str, kind: PointKind, reference: &str, set: usize) -> String {
    let (node, data) = reference.split_once('.').unwrap_or((reference, ""));
    let device = match kind {
        PointKind::Analog => "MEAS",
        PointKind::Monitoring => "MON",
        PointKind::Double | PointKind::Control => "CTRL",
        PointKind::Single => "PROT",
    };
    let node = node.trim_end_matches(|c: char| c.is_ascii_digit() && node.starts_with('M'));
    format!("{}{device}/{node}{set}.{data}", bay.trim_start_matches('='))
}

/// The list as CSV.
pub fn csv(points: &[Point]) -> String {
    let mut csv = "id,equipment,name,type,unit,low,high,scan_millis\n".to_owned();
    for p in points {
        // Writing to a string does not fail.
        let _ = writeln!(
            csv,
            "{},{},{},{},{},{},{},{}",
            p.id,
            p.equipment,
            p.name,
            p.kind.word(),
            p.unit,
            p.low,
            p.high,
            p.scan_millis
        );
    }
    csv
}
