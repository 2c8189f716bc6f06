//! Live station: every point a tag of a simulated gateway, with its overlays and alarms.

mod alarms;
mod monitoring;

use std::collections::{BTreeMap, HashMap};

use serde_json::{Map, Value, json};

use crate::models::{BLADE, EARTHING_BLADE};
use crate::points::{
    EARTHED, Gateway, Load, MAIN_TRANSFORMERS, NormalValue, Point, PointKind, bay_loads, points,
};
use crate::{Network, NetworkSwitch, Station, network};

/// Port of the first simulated gateway; the others follow.
const FIRST_PORT: u16 = 15_021;
/// Number of missing scans after which a value is stale.
const MISSED_SCANS: u32 = 3;
/// Scan period of fast points, milliseconds; slower ones have a poll group of their own.
const FAST_MILLIS: u32 = 1000;
const SLOW_GROUP: &str = "monitoring";
/// First register of that group: far from the others, so that no read covers the gap.
const SLOW_REGISTER: u16 = 2000;
/// Period of a random walk between two targets, seconds.
const WALK_SECONDS: f64 = 30.0;
const AMBIENT: &str = "S12Z1MON/MMET1.EnvTmp";

impl Station {
    /// Returns the configuration with all points from simulated gateways, and with overlays and
    /// alarms. `closed` may set switches to other positions than those of normal operation.
    pub fn live_configuration(&self, closed: impl Fn(&NetworkSwitch) -> bool) -> Value {
        let Network { settings, switches } = network();
        let stands: HashMap<&str, bool> =
            switches.iter().map(|switch| (switch.equipment.as_str(), closed(switch))).collect();
        let points = points();
        let mut configuration = self.configuration();
        let plugins = &mut configuration["plugins"];
        for (gateway, port) in Gateway::ALL.into_iter().zip(FIRST_PORT..) {
            plugins[gateway.name()] = json!({
                "plugin": "modbus_adapter",
                "settings": {
                    "host": "127.0.0.1",
                    "port": port,
                    "poll_seconds": FAST_MILLIS as f64 / 2_000.0,
                    "poll_groups": { SLOW_GROUP: { "poll_seconds": FAST_MILLIS as f64 / 1_000.0 } },
                },
            });
        }
        plugins["energised"] = json!({ "plugin": "energisation", "settings": settings });
        plugins["flow"] = json!({ "plugin": "load_flow", "settings": flows() });
        plugins["contact_contour"] =
            json!({ "plugin": "contour", "settings": contact_contour(&points) });
        plugins["positions"] =
            json!({ "plugin": "switch_position", "settings": switch_positions(&switches) });
        plugins["thermal"] = json!({ "plugin": "transformer_thermal", "settings": thermal() });
        for (name, plugin, settings, roles) in monitoring::overlays(&points) {
            plugins[name] = json!({ "plugin": plugin, "settings": settings, "roles": roles });
        }
        for (overlay, roles) in ROLES {
            plugins[overlay]["roles"] = json!(roles);
        }
        let mut registers = Registers::default();
        let mut tags = Map::new();
        for point in &points {
            let stands = stands.get(point.equipment.as_str()).filter(|_| point.role == "position");
            let address = registers.address(point);
            tags.insert(point.id.clone(), tag(point, address, stands.copied()));
        }
        configuration["tags"] = Value::Object(tags);
        configuration["bindings"] = Value::Array(bindings(&points));
        configuration["alarms"] = Value::Object(alarms::alarms(&points));
        configuration["overlays"] = json!([
            // What comes later lies over what comes before.
            "energised",
            "contacts",
            "monitored",
            "gas",
            "thermal",
            "positions",
            "flow",
            "contact_contour",
            "values"
        ]);
        for (name, eye, target) in CAMERAS {
            configuration["cameras"][name] =
                json!({ "eye": eye, "target": target, "fov_degrees": 50 });
        }
        configuration
    }
}

/// Overlays that are not of condition monitoring, with the roles of the points that they need.
const ROLES: [(&str, &[&str]); 6] = [
    ("contact_contour", &["contact_temperature"]),
    ("energised", &["position"]),
    ("flow", &["active_power", "reactive_power"]),
    ("positions", &["position", "earth_switch"]),
    ("thermal", &["load", "ambient"]),
    ("values", &["load", "top_oil", "hot_spot"]),
];

/// Camera of a scenario: name, eye and target, metres.
type Camera = (&'static str, [f64; 3], [f64; 3]);

const CAMERAS: [Camera; 5] = [
    ("isolation", [-4.5, 9.5, -76.5], [-14.5, 5.0, -63.5]),
    ("yard_110", [0.0, 40.0, 80.0], [0.0, 0.0, 29.0]),
    ("overload", [-44.0, 9.0, 62.0], [-44.0, 4.5, 40.0]),
    ("sf6", [-8.0, 8.0, -74.0], [-14.0, 4.5, -57.0]),
    ("transformer_1", [-33.6, 10.2, -14.0], [-27.6, 4.2, 0.0]),
];

/// Register allocator: next free address of each unit and table.
#[derive(Default)]
struct Registers {
    next: BTreeMap<(Gateway, u8, &'static str), u16>,
}

impl Registers {
    fn address(&mut self, point: &Point) -> Value {
        let (gateway, unit) = point.read_by;
        let is_slow = point.scan_millis > FAST_MILLIS;
        let (table, space, cells) = match point.kind {
            PointKind::Analog | PointKind::Monitoring if is_slow => ("holding", SLOW_GROUP, 2),
            PointKind::Analog | PointKind::Monitoring => ("holding", "holding", 2),
            PointKind::Double => ("discrete", "discrete", 2),
            PointKind::Single => ("discrete", "discrete", 1),
            PointKind::Control => ("coil", "coil", 1),
        };
        let first = if space == SLOW_GROUP { SLOW_REGISTER } else { 0 };
        let next = self.next.entry((gateway, unit, space)).or_insert(first);
        let mut address = json!({ "unit": unit, "table": table, "register": *next });
        *next += cells;
        if table == "holding" {
            address["type"] = json!("f32");
        }
        if space == SLOW_GROUP {
            address["poll_group"] = json!(SLOW_GROUP);
        }
        json!({ "instance": gateway.name(), "address": address })
    }
}

fn tag(point: &Point, source: Value, closed: Option<bool>) -> Value {
    let usual = match closed {
        // Double-points as IEC 61850-7-3 counts them: 1 is off, 2 is on.
        Some(closed) => NormalValue::Constant(if closed { 2.0 } else { 1.0 }),
        None => point.usual,
    };
    let simulate = match usual {
        NormalValue::Constant(base) => json!({ "shape": "constant", "base": base }),
        NormalValue::Walk(base, amplitude) => json!({
            "shape": "walk", "base": base, "amplitude": amplitude, "period_seconds": WALK_SECONDS,
        }),
        NormalValue::Counter(base, seconds) => json!({
            "shape": "counter", "base": base, "amplitude": 1.0e6, "period_seconds": seconds,
        }),
    };
    let mut tag = json!({
        "name": capitalised(&point.name),
        "freshness_seconds": (MISSED_SCANS * point.scan_millis) as f64 / 1_000.0,
        "source": source,
        "simulate": simulate,
    });
    match point.kind {
        PointKind::Double => tag["type"] = json!("double_point"),
        PointKind::Single | PointKind::Control => tag["type"] = json!("bool"),
        PointKind::Analog | PointKind::Monitoring => {
            tag["type"] = json!("f64");
            tag["unit"] = json!(if point.unit == "1" { "" } else { point.unit });
            tag["range"] = json!({ "low": point.low, "high": point.high });
            let [low, high] = point.limits;
            if low.is_some() || high.is_some() {
                tag["limits"] = json!({ "low": low, "high": high });
            }
        }
    }
    tag
}

fn capitalised(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// Returns the bindings of every point to its equipment; the ambient temperature is also bound to
/// the transformers.
fn bindings(points: &[Point]) -> Vec<Value> {
    let binding =
        |tag: &str, node: &str, role: &str| json!({ "tag": tag, "node": node, "role": role });
    let own = points.iter().map(|point| binding(&point.id, &point.equipment, point.role));
    let ambient = (1..=MAIN_TRANSFORMERS)
        .map(|number| binding(AMBIENT, &format!("=S12T{number}-TA1"), "ambient"));
    own.chain(ambient).collect()
}

/// Returns the settings for the positions of all switches and the earthing blades of lines.
fn switch_positions(switches: &[NetworkSwitch]) -> Value {
    let main = |switch: &NetworkSwitch| {
        let equipment = &switch.equipment;
        match equipment.ends_with("-QA1") {
            // Too quick to be seen.
            true => json!({ "equipment": equipment, "mechanism": "breaker" }),
            false => json!({ "equipment": equipment, "mechanism": BLADE, "travel_seconds": 8 }),
        }
    };
    let earthing = |switch: &NetworkSwitch| {
        switch.equipment.ends_with(EARTHED).then(|| {
            json!({
                "equipment": switch.equipment,
                "mechanism": EARTHING_BLADE,
                "role": "earth_switch",
                "travel_seconds": 6,
            })
        })
    };
    let all = switches.iter().map(main).chain(switches.iter().filter_map(earthing));
    json!({ "switches": all.collect::<Vec<_>>() })
}

/// Returns the settings of power at the current transformers of all bays: out of the busbar is
/// positive.
fn flows() -> Value {
    let flow = |load: Load| {
        let at = |device: &str| format!("{}-{device}", load.bay);
        let to = match load.bay.rsplit_once('Q').map(|(_, number)| number) {
            Some("30") => "UP2",
            _ => "FA1",
        };
        json!({
            "measured_at": at("BC1"),
            "from": at("BC1"),
            "to": at(to),
            "rating_mva": (3_f64.sqrt() * load.kilovolts * load.rated_amperes / 1000.0).round(),
        })
    };
    let in_yards = bay_loads().into_iter().filter(|load| load.bay.contains('Q'));
    json!({ "flows": in_yards.map(flow).collect::<Vec<_>>() })
}

/// Returns the settings of the temperatures of all contacts. The limit is that of copper contacts
/// in air (IEC 62271-1, table 14: a rise of 65 K for tin-plated ones, at 20 °C).
fn contact_contour(points: &[Point]) -> Value {
    json!({
        "name": "Contact temperature, °C",
        "unit": "°C",
        "role": "contact_temperature",
        "equipment": monitoring::equipment(points, &["contact_temperature"]),
        "reach_metres": 6,
        "high": 85,
        "step": 5,
    })
}

/// Returns the settings of forced-air cooling, as transformers of this size have.
fn thermal() -> Value {
    let transformer = |number: usize| {
        json!({
            "equipment": format!("=S12T{number}-TA1"),
            "cooling": "ONAF",
            "top_oil_rise": 45.0,
            "gradient": 14.5,
            "loss_ratio": 6.0,
        })
    };
    json!({
        "transformers": (1..=MAIN_TRANSFORMERS).map(transformer).collect::<Vec<_>>(),
        "state_file": "${folder}/transformer_states.json",
    })
}
