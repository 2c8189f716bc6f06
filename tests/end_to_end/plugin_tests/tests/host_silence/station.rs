//! Station of the walk: a piece of equipment and its tags for every overlay plugin.

use std::collections::BTreeMap;

use e2e::Scene;
use serde_json::{Value, json};

/// Time after which a value that is not sent again is stale, seconds.
pub(crate) const FRESHNESS_SECONDS: f64 = 1.5;
/// Plugins whose instances have their names.
pub(crate) const OVERLAYS: [&str; 9] = [
    "condition",
    "contour",
    "energisation",
    "load_flow",
    "power_overlay",
    "sf6_density",
    "switch_position",
    "thermography",
    "transformer_thermal",
];

/// Kind of a tag's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Number,
    Bool,
    /// Switch position, by the numbers of IEC 60870-5-101: 1 off, 2 on, 3 both.
    DoublePoint,
}

/// Tag of the station with the values that it may have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TagCase {
    pub(crate) id: &'static str,
    pub(crate) kind: Kind,
    pub(crate) unit: &'static str,
    pub(crate) node: &'static str,
    pub(crate) role: &'static str,
    /// Values that it has, and that a missing one may have.
    pub(crate) grid: &'static [f64],
    /// Value that a plugin must not believe; none where any value is possible.
    pub(crate) implausible: Option<f64>,
}

const fn number(
    [id, unit, node, role]: [&'static str; 4],
    grid: &'static [f64],
    implausible: Option<f64>,
) -> TagCase {
    TagCase { id, kind: Kind::Number, unit, node, role, grid, implausible }
}

const fn position([id, node]: [&'static str; 2], grid: &'static [f64]) -> TagCase {
    let (kind, implausible) = (Kind::DoublePoint, None);
    TagCase { id, kind, unit: "", node, role: "position", grid, implausible }
}

/// All tags. Roles are of one overlay each, but for positions.
pub(crate) const TAGS: [TagCase; 20] = [
    number(["C1.oil", "°C", "=C1", "oil"], &[40.0, 79.0, 84.0, 95.0], None),
    number(["C1.gas", "ppm", "=C1", "gas"], &[20.0, 99.0, 120.0, 400.0], None),
    number(["K1.level", "mm", "=K1", "level"], &[-10.0, 20.0, 60.0, 90.0], None),
    number(["W1.power", "MW", "=W1", "value"], &[5.0, 50.0, 97.0, 120.0], None),
    TagCase {
        id: "W1.trip",
        kind: Kind::Bool,
        unit: "",
        node: "=W1",
        role: "alarm",
        grid: &[0.0, 1.0],
        implausible: None,
    },
    number(["F1.p", "MW", "=F1", "active_power"], &[10.0, 99.0, 112.0, -130.0], None),
    number(["F1.q", "Mvar", "=F1", "reactive_power"], &[0.0, 5.0, 140.0], None),
    number(["G1.pressure", "bar", "=G1", "sf6_pressure"], &[3.0, 7.0, 8.2], Some(-2.0)),
    number(["G1.temperature", "°C", "=G1", "sf6_temperature"], &[20.0, 60.0], Some(400.0)),
    position(["S1.position", "=S1"], &[1.0, 2.0, 3.0]),
    position(["E1.position", "=E1"], &[1.0, 2.0]),
    position(["E2.position", "=E2"], &[1.0, 2.0]),
    number(["T1.l1", "°C", "=T1-L1", "contact_temperature"], &[24.0, 26.0, 140.0], Some(900.0)),
    number(["T1.l2", "°C", "=T1-L2", "contact_temperature"], &[24.0, 26.0, 140.0], Some(900.0)),
    number(["T1.l3", "°C", "=T1-L3", "contact_temperature"], &[24.0, 26.0, 140.0], Some(900.0)),
    number(["A1.air", "°C", "=A1", "ambient"], &[20.0], Some(200.0)),
    number(["H1.load", "%", "=H1", "load"], &[50.0, 250.0], Some(4_000.0)),
    number(["H1.oil", "°C", "=H1", "top_oil"], &[50.0, 150.0], None),
    number(["H1.winding", "°C", "=H1", "hot_spot"], &[60.0, 190.0], None),
    number(["X1.other", "", "=X1", "other"], &[1.0, 2.0], None),
];

/// Settings of a site that a reload may change, by index of the variant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Variant {
    /// Thresholds of the overlays: the second ones tolerate more.
    pub(crate) is_tolerant: bool,
    /// True if there is a further tag and further equipment, before all others.
    pub(crate) has_more: bool,
    /// Index of the overlay in this process, if any.
    pub(crate) in_process: Option<usize>,
    /// Something that concerns no overlay.
    pub(crate) size: u32,
}

/// Thresholds that a variant has.
pub(crate) struct Thresholds {
    pub(crate) oil: f64,
    pub(crate) level: f64,
    pub(crate) power: f64,
    pub(crate) rating: f64,
}

impl Variant {
    pub(crate) fn thresholds(self) -> Thresholds {
        match self.is_tolerant {
            false => Thresholds { oil: 80.0, level: 50.0, power: 95.0, rating: 100.0 },
            true => Thresholds { oil: 90.0, level: 70.0, power: 110.0, rating: 115.0 },
        }
    }
}

/// Returns the settings of an overlay.
fn settings(overlay: &str, Thresholds { oil, level, rating, .. }: &Thresholds) -> Value {
    match overlay {
        "condition" => json!({ "equipment": ["=C1"], "quantities": [
            { "name": "Oil", "role": "oil", "unit": "°C", "attention": oil, "alarm": 93.0 },
            { "name": "Gas", "role": "gas", "unit": "ppm", "attention": 100.0, "alarm": 300.0 },
        ]}),
        "contour" => json!({
            "name": "Level", "unit": "mm", "role": "level", "equipment": ["=K1"],
            "reach_metres": 5.0, "low": 0.0, "high": level, "step": 10.0,
        }),
        "energisation" => json!({
            "levels": [{ "name": "110 kV", "color": "#aa2200" }],
            "nodes": [
                { "id": "line", "level": "110 kV" },
                { "id": "bus", "level": "110 kV", "equipment": ["=EB"] },
            ],
            "branches": [{ "equipment": "=E1", "between": ["line", "bus"], "kind": "breaker" }],
            "earths": [{ "equipment": "=E2", "node": "bus" }],
            "sources": [{ "node": "line" }],
        }),
        "load_flow" => json!({ "flows": [
            { "measured_at": "=F1", "from": "=F1", "to": "=F2", "rating_mva": rating },
        ]}),
        "sf6_density" => json!({
            "equipment": ["=G1"], "filling": 7.0, "alarm": 6.4, "lock_out": 6.0, "unit": "bar",
        }),
        "switch_position" => json!({ "switches": [{ "equipment": "=S1", "travel_seconds": 5.0 }] }),
        "thermography" => json!({ "equipment": ["=T1-L1", "=T1-L2", "=T1-L3"] }),
        "transformer_thermal" => json!({ "transformers": [{
            "equipment": "=H1", "cooling": "ONAN", "size": "medium", "rated_power": 40.0,
        }]}),
        _ => json!({}),
    }
}

/// Returns the roles of an overlay's bindings.
fn roles(overlay: &str) -> &'static [&'static str] {
    match overlay {
        "condition" => &["oil", "gas"],
        "contour" => &["level"],
        "energisation" | "switch_position" => &["position"],
        "load_flow" => &["active_power", "reactive_power"],
        "power_overlay" => &["value", "alarm"],
        "sf6_density" => &["sf6_pressure", "sf6_temperature"],
        "thermography" => &["contact_temperature", "ambient"],
        _ => &["load", "top_oil", "hot_spot"],
    }
}

/// Fills in the configuration of a scene.
pub(crate) fn configure(scene: &mut Scene, variant: Variant) {
    let thresholds = variant.thresholds();
    let breaker = json!({ "file": "models/breaker.glb" });
    let mut nodes: Vec<Value> = Vec::new();
    if variant.has_more {
        nodes.push(json!({ "id": "=A0" }));
    }
    let mut ids: Vec<&str> = TAGS.iter().map(|tag| tag.node).chain(["=EB", "=F2"]).collect();
    ids.dedup();
    nodes.extend(
        ids.iter().zip(0..).map(
            |(id, place)| json!({ "id": id, "transform": { "translation": [3 * place, 0, 0] } }),
        ),
    );
    if let Some(last) = nodes.last_mut() {
        last["model"] = json!("breaker");
    }
    let mut tags = BTreeMap::new();
    for TagCase { id, kind, unit, .. } in TAGS {
        let kind = match kind {
            Kind::Number => "f64",
            Kind::Bool => "bool",
            Kind::DoublePoint => "double_point",
        };
        let mut tag = json!({
            "type": kind, "unit": unit, "set_by_host": true,
            "freshness_seconds": FRESHNESS_SECONDS,
        });
        if id == "W1.power" {
            tag["limits"] = json!({ "low": 10.0, "high": thresholds.power });
        }
        tags.insert(id, tag);
    }
    if variant.has_more {
        tags.insert("A0.first", json!({ "type": "f64", "set_by_host": true }));
    }
    let bindings = TAGS.iter();
    let bindings: Value =
        bindings.map(|tag| json!({ "tag": tag.id, "node": tag.node, "role": tag.role })).collect();
    let plugins: BTreeMap<&str, Value> = OVERLAYS
        .iter()
        .enumerate()
        .map(|(index, overlay)| {
            let isolation = if variant.in_process == Some(index) { "none" } else { "process" };
            let plugin = json!({
                "plugin": overlay, "isolation": isolation, "roles": roles(overlay),
                "settings": settings(overlay, &thresholds),
            });
            (*overlay, plugin)
        })
        .collect();
    let alarms: BTreeMap<String, Value> = OVERLAYS
        .iter()
        .map(|overlay| {
            let alarm = json!({ "verdict": { "instance": overlay }, "message": "abnormal" });
            (alarm_of(overlay), alarm)
        })
        .collect();
    let directories = scene.config["plugin_directories"].clone();
    scene.config = json!({
        "version": 1,
        "plugin_directories": directories,
        "plugins": plugins,
        "models": { "breaker": breaker },
        "scene": nodes,
        "tags": tags,
        "bindings": bindings,
        "overlays": OVERLAYS,
        "alarms": alarms,
        "supervision": {
            "restart_seconds": 0.05, "max_restart_seconds": 0.1, "max_deaths": 60,
            "window_seconds": 10,
        },
        "graphics": { "samples": 1, "quality": "low" },
        "window": { "size": [64 + variant.size, 48] },
    });
}

/// Returns the id of the alarm on the verdicts of an overlay.
pub(crate) fn alarm_of(overlay: &str) -> String {
    format!("judged by {overlay}")
}
