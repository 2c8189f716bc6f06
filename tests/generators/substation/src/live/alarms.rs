//! Alarm definitions of the station's points.

use serde_json::{Map, Value, json};

use crate::points::{Gateway, Point};

/// Share of the rated current at which an overload is urgent.
const HEAVY_OVERLOAD: f64 = 1.15;

/// Returns the alarms by id: that of the point, with a suffix for the condition.
pub(super) fn alarms(points: &[Point]) -> Map<String, Value> {
    let mut alarms = Map::new();
    for point in points {
        for (what, alarm) in alarms_of_point(point) {
            alarms.insert(format!("{}.{what}", point.id), alarm);
        }
    }
    for gateway in Gateway::ALL {
        // One tag stands for the link: all behind it go bad together.
        let watched = points.iter().find(|point| point.read_by.0 == gateway);
        if let Some(point) = watched {
            let alarm = json!({
                "tag": point.id,
                "condition": { "bad_quality": true },
                "on_delay_seconds": 2,
                "priority": "high",
                "message": format!("Link of gateway '{}' lost", gateway.name()),
                "consequence": "Nothing behind it is known; protection still works",
                "response": "Call telecontrol; man the yard before switching",
                "equipment": point.equipment,
            });
            alarms.insert(format!("{}.Link", gateway.name()), alarm);
        }
    }
    alarms
}

/// Suffix of the id, with the alarm's settings.
type Alarm = (&'static str, Value);

fn alarms_of_point(point: &Point) -> Vec<Alarm> {
    let (_, reference) = point.id.split_once('/').unwrap_or_default();
    let alarm = |priority: &str, condition: Value, message: &str, response: &str| {
        json!({
            "tag": point.id,
            "condition": condition,
            "priority": priority,
            "message": message,
            "response": response,
            "equipment": point.equipment,
        })
    };
    let raised = || json!({ "equals": true });
    let state = |what, priority, message, response| {
        vec![(what, alarm(priority, raised(), message, response))]
    };
    match (reference, point.role) {
        ("PTRC1.Tr", _) => {
            let mut trip =
                alarm("critical", raised(), "Trip", "Do not switch on before the cause is known");
            trip["latched"] = json!(true);
            vec![("Trip", trip)]
        }
        ("PDIF1.Op", _) => state(
            "Differential",
            "critical",
            "Differential protection operated",
            "Inspect what lies between the current transformers",
        ),
        ("RBRF1.OpEx", _) => {
            state("Failure", "critical", "Breaker failure", "See which neighbours have tripped")
        }
        ("SIMG1.InsAlm", _) => state("Low", "high", "SF6 low", "Refill; find the leak"),
        ("SIMG1.InsBlk", _) => state(
            "LockOut",
            "critical",
            "SF6 lock-out: the breaker is blocked",
            "Relieve the breaker by its neighbours before opening its disconnectors",
        ),
        ("GAPC1.DcAlm", _) => {
            state("Supply", "high", "Control supply lost", "Look for a tripped fuse")
        }
        ("LPHD1.PhyHealth", _) => state("Health", "low", "Device fault", "Read its log"),
        (_, "current") if reference.ends_with("phsA") => overload(point, &alarm),
        ("MMXU1.PPV.phsAB", "voltage") if point.equipment.contains("Q4") => {
            let low = point.limits[0].unwrap_or_default();
            let dead = json!({ "low_low": 0.5 * low, "deadband": 1 });
            vec![(
                "Dead",
                alarm("critical", dead, "Busbar without voltage", "See which protection operated"),
            )]
        }
        (_, "top_oil" | "hot_spot" | "load") => hot(point, &alarm),
        _ => Vec::new(),
    }
}

fn overload(point: &Point, alarm: &dyn Fn(&str, Value, &str, &str) -> Value) -> Vec<Alarm> {
    let Some(rated) = point.limits[1] else { return Vec::new() };
    let high = json!({ "high": rated, "deadband": 0.02 * rated });
    let high_high = json!({ "high_high": HEAVY_OVERLOAD * rated, "deadband": 0.02 * rated });
    let mut slight = alarm("medium", high, "Overload", "Shift load to other lines");
    slight["on_delay_seconds"] = json!(2);
    let heavy = alarm("high", high_high, "Heavy overload", "Shed load at once");
    vec![("High", slight), ("HighHigh", heavy)]
}

fn hot(point: &Point, alarm: &dyn Fn(&str, Value, &str, &str) -> Value) -> Vec<Alarm> {
    let Some(limit) = point.limits[1] else { return Vec::new() };
    let (message, priority) = match point.role {
        "top_oil" => ("Top oil hot", "medium"),
        "hot_spot" => ("Winding hot", "high"),
        _ => ("Transformer overloaded", "medium"),
    };
    let high = json!({ "high": limit, "deadband": 2 });
    let mut alarm = alarm(priority, high, message, "Check the coolers; reduce the load");
    alarm["on_delay_seconds"] = json!(1);
    vec![("High", alarm)]
}
