//! Overlays of condition monitoring for the station's points.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::points::{Point, SF6_ALARM, SF6_FILLING, SF6_LOCK_OUT};

/// Overlay: name, plugin, settings, roles that it needs.
type Overlay = (&'static str, &'static str, Value, Vec<&'static str>);

/// Quantities with their roles and limits: attention, alarm.
const QUANTITIES: [(&str, &str, f64, f64); 5] = [
    ("Arrester resistive current", "arrester_resistive_current", 0.3, 0.6),
    ("Insulator leakage", "leakage_current", 2.0, 5.0),
    ("Core earth current", "core_current", 100.0, 300.0),
    ("Partial discharge", "partial_discharge", 300.0, 1000.0),
    ("Bushing loss factor", "loss_factor", 0.6, 1.0),
];

/// Returns the overlays of gas, contacts, and all other monitoring.
pub(super) fn overlays(points: &[Point]) -> [Overlay; 3] {
    let quantities = QUANTITIES.map(|(name, role, attention, alarm)| {
        json!({ "name": name, "role": role, "attention": attention, "alarm": alarm })
    });
    let roles = QUANTITIES.map(|(_, role, ..)| role);
    [
        (
            "gas",
            "sf6_density",
            json!({
                "equipment": equipment(points, &["sf6_pressure"]),
                "filling": SF6_FILLING,
                "alarm": SF6_ALARM,
                "lock_out": SF6_LOCK_OUT,
                "trend_days": 0.02 / 24.0,
                "state_file": "${folder}/gas_trends.json",
            }),
            vec!["sf6_pressure", "sf6_temperature"],
        ),
        (
            "contacts",
            "thermography",
            json!({ "equipment": equipment(points, &["contact_temperature"]) }),
            vec!["contact_temperature", "ambient"],
        ),
        (
            "monitored",
            "condition",
            json!({ "quantities": quantities, "equipment": equipment(points, &roles) }),
            roles.to_vec(),
        ),
    ]
}

/// Returns the equipment that has points in these roles.
pub(super) fn equipment<'p>(points: &'p [Point], roles: &[&str]) -> BTreeSet<&'p str> {
    let in_role = points.iter().filter(|point| roles.contains(&point.role));
    in_role.map(|point| point.equipment.as_str()).collect()
}
