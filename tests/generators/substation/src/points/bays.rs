//! Points of each bay.

use super::loads::{MAIN_TRANSFORMERS, loading};
use super::measured::{add_measured, add_some_measured};
use super::monitoring::{self, MonitoredDevices};
use super::point_list::{Gateway, NormalValue, PointContext, PointKind, PointListBuilder};
use super::states::{BREAKER, add_doubles, add_states, switches};
use crate::layout::{BayKind, YARDS};

/// Number of 35 kV feeders, capacitor banks, station transformers and incomers.
const FEEDER_BAYS: usize = 20;
const HOUSE: &str = "=S12H1-UH1";
const CONTROL_HOUSE: &str = "=S12Z1-UH1";

/// Adds the points of all bays.
pub(super) fn add_all(list: &mut PointListBuilder) {
    for (yard, gateway) in YARDS.iter().zip([Gateway::Yard220, Gateway::Yard110]) {
        let mut seen = [0_u8; 5];
        let mut unit = 0;
        for &kind in yard.bays {
            seen[kind as usize] += 1;
            let bay = format!("{}{}", yard.level, kind.designation(seen[kind as usize]));
            unit += 1;
            list.read_by = (gateway, unit);
            match kind {
                BayKind::Line => add_line(&bay, list),
                BayKind::Coupler => add_coupler(&bay, list),
                BayKind::VoltageOne => add_bus(&bay, "QB1", list),
                BayKind::VoltageTwo => add_bus(&bay, "QB2", list),
                // Counted with the transformer.
                BayKind::Transformer => {}
            }
        }
    }
    for number in 1..=MAIN_TRANSFORMERS {
        list.read_by = (Gateway::Transformers, number as u8);
        add_transformer(number, list);
    }
    for feeder in 1..=FEEDER_BAYS {
        list.read_by = (Gateway::House35, feeder as u8);
        let (bay, equipment) = (format!("=S12H1K{feeder}"), HOUSE.to_owned());
        add_measured(&bay, [&equipment, &equipment], 1, list);
        let place =
            PointContext { bay: &bay, equipment: equipment.clone(), node: 1, role: "status" };
        let box_ = ("STMP.Tmp", "cable box temperature", "°C", -40.0, 150.0, 5000);
        list.add(PointKind::Analog, box_, place, NormalValue::Walk(34.0, 0.5));
        add_doubles(&bay, &[(equipment.clone(), BREAKER, true)], 1, list);
        add_states(&bay, &equipment, 51, 5, list);
        monitoring::add_of_feeder(&bay, &equipment, list);
    }
    list.read_by = (Gateway::Station, 1);
    let (bay, equipment) = ("=S12Z1", CONTROL_HOUSE.to_owned());
    for node in 1..=60 {
        let place = PointContext { bay, equipment: equipment.clone(), node, role: "status" };
        let auxiliary = ("MMXN.Vol", "auxiliary voltage", "V", 0.0, 500.0, 1000);
        list.add(PointKind::Analog, auxiliary, place, NormalValue::Walk(231.0, 0.8));
    }
    add_doubles(bay, &vec![(equipment.clone(), BREAKER, true); 20], 0, list);
    add_states(bay, &equipment, 250, 20, list);
    monitoring::add_of_station(bay, &equipment, list);
}

fn add_line(bay: &str, list: &mut PointListBuilder) {
    let [gear, current, voltage] = ["QA1", "BC1", "BV1"].map(|name| format!("{bay}-{name}"));
    add_measured(bay, [&current, &voltage], 1, list);
    add_doubles(bay, &switches(bay), 4, list);
    add_states(bay, &gear, 90, 12, list);
    MonitoredDevices {
        bay,
        breaker: true,
        arrester: true,
        contacts: &["QB1", "QB2", "QA1", "BC1", "QB9", "BV1"],
        insulators: &["UP1"],
        loading: loading(bay),
    }
    .add(list);
}

fn add_coupler(bay: &str, list: &mut PointListBuilder) {
    let [gear, current] = ["QA1", "BC1"].map(|name| format!("{bay}-{name}"));
    add_some_measured(bay, [&current, &current], 1, &[0, 1, 2, 3, 4, 5, 10, 11], list);
    add_doubles(bay, &switches(bay), 3, list);
    add_states(bay, &gear, 80, 10, list);
    MonitoredDevices {
        bay,
        breaker: true,
        arrester: false,
        contacts: &["QB1", "QB2", "QA1", "BC1", "UP2"],
        insulators: &["UP1", "UP2"],
        loading: loading(bay),
    }
    .add(list);
}

fn add_bus(bay: &str, disconnector: &str, list: &mut PointListBuilder) {
    let voltage = format!("{bay}-BV1");
    add_some_measured(bay, [&voltage, &voltage], 1, &[6, 7, 8, 9, 10, 14, 15, 16, 17], list);
    add_doubles(bay, &switches(bay), 2, list);
    add_states(bay, &voltage, 25, 3, list);
    MonitoredDevices {
        bay,
        breaker: false,
        arrester: true,
        contacts: &[disconnector],
        insulators: &["BV1"],
        loading: 0.0,
    }
    .add(list);
}

fn add_transformer(number: usize, list: &mut PointListBuilder) {
    let own = format!("=S12T{number}");
    let tank = format!("{own}-TA1");
    for level in ["D1", "E1"] {
        let bay = format!("=S12{level}Q{}", 20 + number);
        let [current, gear] = ["BC1", "QA1"].map(|name| format!("{bay}-{name}"));
        add_measured(&bay, [&current, &current], 1, list);
        add_doubles(&bay, &switches(&bay), 2, list);
        add_states(&bay, &gear, 45, 6, list);
        MonitoredDevices {
            bay: &bay,
            breaker: true,
            arrester: true,
            contacts: &["QB1", "QB2", "QA1"],
            insulators: &[],
            loading: loading(&bay),
        }
        .add(list);
    }
    let low = format!("{own}-WB1");
    add_measured(&own, [&low, &low], 1, list);
    for (quantity, role, usual) in [
        (("YPTR.LodPct", "load", "%", 0.0, 200.0, 1000), "load", NormalValue::Walk(45.0, 0.5)),
        (("YLTC.TapPos", "tap position", "1", 0.0, 20.0, 1000), "tap", NormalValue::Constant(9.0)),
        (
            ("YPTR.WinTmp", "winding", "°C", -40.0, 200.0, 1000),
            "winding",
            NormalValue::Walk(49.0, 0.3),
        ),
    ] {
        let place = PointContext { bay: &own, equipment: tank.clone(), node: 1, role };
        let point = list.add(PointKind::Analog, quantity, place, usual);
        point.limits[1] = (role == "load").then_some(100.0);
    }
    add_doubles(&own, &[(low.clone(), BREAKER, true)], 3, list);
    add_states(&own, &tank, 60, 8, list);
    monitoring::add_of_transformer(&own, list);
}
