//! IEC 60870-5-104 in a scene, with a station of c104: its values are in the statistics, and those
//! that it no longer confirms are bad.

use std::process::Command;
use std::thread;
use std::time::Duration;

use e2e::peer::python;
use e2e::relay::Relay;
use e2e::{Process, Scene, finish, workspace_path};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Number of messages after which all values have come: the confirmation of the start, and of the
/// interrogation, its values, its end.
const ANSWERS_TO_ALL: usize = 2;
/// Time for reading answers that passed the relay, loaded machines included.
const READING: Duration = Duration::from_millis(500);

struct Station {
    process: Process,
    port: u16,
}

impl Station {
    fn start() -> Option<Self> {
        let points: Vec<_> = points().into_iter().map(|(point, ..)| point).collect();
        let mut command = Command::new(python("c104")?);
        command.arg(workspace_path("tests/end_to_end/peers/iec104_c104.py"));
        let process = Process::start(command.arg(json!({ "points": points }).to_string()));
        let port = process.wait_for_line(|line| line.strip_prefix("READY ")?.parse().ok());
        Some(Self { process, port })
    }
}

/// Lists points with their tags' kinds and the expected statistics: value, quality, reason.
fn points() -> [(Value, &'static str, Value, &'static str, Option<&'static str>); 6] {
    let point = |ioa: u32, kind: &str, value: Value, quality: u8| json!({"common_address": 1, "ioa": ioa, "type": kind, "value": value, "quality": quality});
    [
        (point(1, "M_SP_NA_1", json!(true), 0), "bool", json!(true), "good", None),
        (point(2, "M_DP_NA_1", json!(2), 0), "double_point", json!("closed"), "good", None),
        (point(3, "M_ME_NC_1", json!(230.5), 0), "f64", json!(230.5), "good", None),
        (point(4, "M_ST_NA_1", json!(-3), 0), "i64", json!(-3), "good", None),
        (point(5, "M_ME_NB_1", json!(7), 0x80), "f64", json!(7.0), "bad", Some("sensor")),
        (
            point(6, "M_ME_NB_1", json!(8), 0x01),
            "f64",
            json!(8.0),
            "uncertain",
            Some("out of range"),
        ),
    ]
}

fn id(point: &Value) -> String {
    format!("P{}", point["ioa"])
}

/// Returns a scene whose tags are the points.
fn scene(port: u16) -> Scene {
    let mut scene = Scene::without_tags();
    scene.add_plugin("iec104");
    scene.config["plugins"]["station"] = json!({
        "plugin": "iec104",
        "settings": {
            "host": "127.0.0.1", "port": port,
            "t1_seconds": 0.6, "t2_seconds": 0.3, "t3_seconds": 0.4,
        }
    });
    for (point, kind, ..) in points() {
        scene.config["tags"][id(&point)] = json!({
            "type": kind, "freshness_seconds": 60,
            "source": {"instance": "station", "address": {"ioa": point["ioa"]}}
        });
    }
    scene
}

#[test]
fn values_are_those_of_the_station() {
    let Some(station) = Station::start() else { return };
    for isolation in ["process", "none"] {
        let mut scene = scene(station.port);
        scene.config["isolation"] = json!(isolation);
        scene.config["tags"]["Lost"] = json!({
            "type": "f64",
            "source": {"instance": "station", "address": {"ioa": 1, "common_address": 9}}
        });
        let output = finish(&mut scene.rendering(2.0)).expect_code(0);
        let said = output.stdout + &output.stderr;
        assert!(said.contains("the station does not know common address 9"), "{said}");
        let stats = scene.stats();
        for (point, _, value, quality, reason) in points() {
            let tag = stats.tag(&id(&point));
            assert_eq!((&tag.value, tag.quality.as_str()), (&value, quality), "{point}");
            assert_eq!(tag.reason.as_deref(), reason, "{point}");
        }
        let lost = stats.tag("Lost");
        assert_eq!((lost.quality.as_str(), lost.reason.as_deref()), ("bad", Some("configuration")));
    }
}

#[test]
fn a_station_that_is_killed_or_hangs_leaves_nothing_good() {
    for signal in [Signal::KILL, Signal::STOP] {
        let Some(station) = Station::start() else { return };
        let relay = Relay::start(station.port);
        let scene = scene(relay.port);
        let running = Process::start(&mut scene.rendering(3.0));
        relay.wait_for_answers(ANSWERS_TO_ALL);
        // A connection that is reset loses what was not read.
        thread::sleep(READING);
        station.process.signal(signal);
        running.finish().expect_code(0);
        for (id, tag) in scene.stats().tags() {
            let found = (tag.quality.as_str(), tag.reason.as_deref());
            assert_eq!(found, ("bad", Some("communication")), "{id} after {signal:?}");
        }
        let kept = scene.stats().tag("P3").value;
        assert_eq!(kept, json!(230.5), "the last value stays");
    }
}
