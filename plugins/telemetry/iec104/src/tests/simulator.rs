//! The simulated station, seen by this plugin and by independent controlling stations.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use busbar_plugin_sdk::simulation::{Behavior, FaultPlan, Signal, SignalShape};
use busbar_plugin_sdk::{SimulatedTag, Simulation, Simulator};

use super::peer;
use super::*;

const SEED: u64 = 11;

struct Device {
    plugin: Iec104,
    port: u16,
    tags: Vec<SimulatedTag>,
}

fn simulated(
    ioa: u32,
    kind: ValueKind,
    more: serde_json::Value,
    (shape, base, amplitude, period_seconds): (SignalShape, f64, f64, f64),
) -> SimulatedTag {
    let mut spec = tag(ioa, kind);
    let (Some(address), Some(more)) = (spec.address.as_object_mut(), more.as_object()) else {
        panic!("addresses are objects");
    };
    address.extend(more.clone());
    let period = Duration::from_secs_f64(period_seconds);
    let behaviour = Behavior::new(shape, base, amplitude, period).unwrap();
    let signal = Signal::new(SEED, &spec.id, kind, behaviour).unwrap();
    SimulatedTag { spec, signal }
}

fn start_device(tags: Vec<SimulatedTag>, update: Duration) -> Device {
    // Between the look and the start another may take it: then the next one is tried.
    for _ in 0..20 {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let settings = json!({"host": "127.0.0.1", "port": free});
        let settings: Settings = serde_json::from_value(settings).unwrap();
        let mut plugin = Iec104::create(settings, host()).unwrap();
        let faults = FaultPlan::none();
        let simulation = Simulation { tags: tags.clone(), faults, update, seed: SEED };
        if plugin.start_simulation(simulation).is_ok() {
            return Device { plugin, port: free, tags };
        }
    }
    panic!("no port is free");
}

fn tags() -> Vec<SimulatedTag> {
    let none = json!({});
    vec![
        simulated(1, ValueKind::F64, none.clone(), (SignalShape::Sine, 60.0, 20.0, 8.0)),
        simulated(2, ValueKind::I64, none.clone(), (SignalShape::Walk, 0.0, 500.0, 3.0)),
        simulated(3, ValueKind::Bool, none.clone(), (SignalShape::Steps, 0.0, 0.0, 0.7)),
        simulated(4, ValueKind::DoublePoint, none.clone(), (SignalShape::Steps, 0.0, 0.0, 2.0)),
        simulated(5, ValueKind::I64, json!({"type": "step"}), (SignalShape::Steps, 0.0, 20.0, 0.5)),
        simulated(
            6,
            ValueKind::I64,
            json!({"type": "counter"}),
            (SignalShape::Counter, 0.0, 1e6, 0.5),
        ),
        simulated(7, ValueKind::Bool, json!({"bit": 9}), (SignalShape::Steps, 0.0, 0.0, 0.7)),
        simulated(
            8,
            ValueKind::F64,
            json!({"scale": 0.01}),
            (SignalShape::Constant, 230.5, 0.0, 1.0),
        ),
    ]
}

/// The value that a tag had at a time tag, as exactly as a float can say it.
fn is_value_at(tag: &SimulatedTag, value: &Value, time: SystemTime) -> bool {
    match (tag.signal.at(time), value) {
        (Value::F64(expected), Value::F64(value)) => (expected - value).abs() <= 1e-4,
        (expected, value) => expected == *value,
    }
}

#[test]
fn every_change_has_the_value_of_its_time() {
    let device = start_device(tags(), Duration::from_millis(50));
    let specs = device.tags.iter().map(|tag| tag.spec.clone()).collect();
    let running = start(device.port, json!({"counter_period_seconds": 1}), specs);
    for tag in &device.tags {
        running.wait("a good value", tag.spec.tag, |sample| sample.quality.is_good());
    }
    // All but the constant change within some seconds.
    let timed = |seen: &Recording, tag: u32| {
        seen.samples.iter().filter(|s| s.tag == tag && s.source_time.is_some()).count()
    };
    let all = |seen: &Recording| (1..8).all(|tag| timed(seen, tag) > 2);
    assert!(running.recorder.wait_until(3 * PATIENCE, all));
    let mut looked_at = 0;
    for sample in running.recorder.recording().samples {
        let tag = device.tags.iter().find(|tag| tag.spec.tag == sample.tag).unwrap();
        if let (Some(value), Some(time)) = (&sample.value, sample.source_time) {
            assert!(is_value_at(tag, value, time), "{}: {value:?} at {time:?}", tag.spec.id);
            looked_at += 1;
        }
    }
    assert!(looked_at > 50, "{looked_at}");
    assert_eq!(running.recorder.latest(8).unwrap().value, Some(Value::F64(230.5)));
}

#[test]
fn c104_gets_everything() {
    let Some(python) = peer::C104.python() else { return };
    // Without changes meanwhile: c104 leaves out what comes by another type than before.
    let device = start_device(tags(), Duration::from_secs(3600));
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../tests/end_to_end/peers/iec104_c104_client.py"
    );
    let begun = SystemTime::now();
    let output =
        Command::new(python).args([script, &device.port.to_string(), "1", "0.5"]).output().unwrap();
    let ended = SystemTime::now();
    let said = String::from_utf8_lossy(&output.stdout);
    let told: serde_json::Value = serde_json::from_str(said.trim()).unwrap_or_else(|error| {
        panic!("{error}: {said}{}", String::from_utf8_lossy(&output.stderr))
    });
    for request in ["interrogation", "counters", "clock", "test"] {
        assert_eq!(told[request], true, "{request}: {told}");
    }
    let points = &told["points"];
    assert_eq!(points.as_object().map(serde_json::Map::len), Some(8), "{points}");
    for (ioa, kind) in [
        ("1", "M_ME_"),
        ("2", "M_ME_"),
        ("3", "M_SP_"),
        ("4", "M_DP_"),
        ("5", "M_ST_"),
        ("6", "M_IT_"),
        ("7", "M_BO_"),
        ("8", "M_ME_NC_1"),
    ] {
        let point = &points[ioa];
        assert!(point["type"].as_str().unwrap().starts_with(kind), "{ioa}: {point}");
        assert_eq!(point["is_good"], true, "{ioa}: {point}");
    }
    assert_eq!(points["8"]["value"], 23_050.0);
    // The sine, as it was at some millisecond meanwhile.
    let Some(value) = points["1"]["value"].as_f64() else { panic!("{points}") };
    let millis = ended.duration_since(begun).unwrap().as_millis() as u64;
    let mut times = (0..=millis).map(|millis| begun + Duration::from_millis(millis));
    let given = |time| match device.tags[0].signal.at(time) {
        Value::F64(given) => given,
        other => panic!("{other:?}"),
    };
    assert!(times.any(|time| (given(time) - value).abs() < 0.02), "{points}");
}

/// A controlling station by hat-drivers.
struct Hat {
    child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Hat {
    fn connect(port: u16) -> Option<Self> {
        let script = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../../tests/end_to_end/peers/iec104_hat_client.py"
        );
        let mut command = Command::new(peer::HAT.python()?);
        command.args(["-W", "ignore", script, &port.to_string()]);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Some(Self { child, lines })
    }

    fn ask(&mut self, command: serde_json::Value) -> Vec<serde_json::Value> {
        writeln!(self.child.stdin.as_mut().unwrap(), "{command}").unwrap();
        let line = self.lines.next().unwrap().unwrap();
        serde_json::from_str(&line).unwrap()
    }
}

impl Drop for Hat {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn hat_sees_types_causes_and_times() {
    let device = start_device(tags(), Duration::from_millis(100));
    let Some(mut hat) = Hat::connect(device.port) else { return };
    let data = |messages: &[serde_json::Value], cause: &str| -> Vec<serde_json::Value> {
        let is = |m: &&serde_json::Value| m["kind"] == "DataMsg" && m["cause"] == cause;
        messages.iter().filter(is).cloned().collect()
    };
    let all = hat.ask(json!({"interrogate": 1}));
    assert!(all.iter().any(|m| m["kind"] == "InitializationMsg"), "{all:?}");
    let interrogated = data(&all, "INTERROGATED_STATION");
    assert_eq!(interrogated.len(), 7, "all but the counter: {all:?}");
    assert!(interrogated.iter().all(|message| message["time_millis"].is_null()));
    let groups: usize = (21..=36)
        .map(|group| {
            let cause = format!("INTERROGATED_GROUP{:02}", group - 20);
            data(&hat.ask(json!({"interrogate": 1, "group": group})), &cause).len()
        })
        .sum();
    assert_eq!(groups, 7);
    let counters = hat.ask(json!({"counters": 1}));
    assert_eq!(data(&counters, "INTERROGATED_COUNTER").len(), 1, "{counters:?}");
    let frozen = hat.ask(json!({"counters": 1, "freeze": "FREEZE"}));
    assert!(frozen.iter().any(|m| m["is_negative"] == true), "{frozen:?}");
    let clock = hat.ask(json!({"clock": 1}));
    assert!(clock.iter().any(|m| m["kind"] == "ClockSyncMsg" && m["is_negative"] == false));
    let unknown = hat.ask(json!({"interrogate": 77}));
    assert!(unknown.iter().any(|m| m["is_negative"] == true), "{unknown:?}");
    let changes = data(&hat.ask(json!({"listen": 3})), "SPONTANEOUS");
    let sine: Vec<_> = changes.iter().filter(|message| message["ioa"] == 1).collect();
    assert!(sine.len() > 5, "{changes:?}");
    for message in sine {
        let value = Value::F64(message["value"].as_f64().unwrap());
        let time = UNIX_EPOCH + Duration::from_millis(message["time_millis"].as_u64().unwrap());
        assert!(is_value_at(&device.tags[0], &value, time), "{message}");
    }
}

/// Loads the simulator: five thousand points, each changing at every scan.
#[test]
fn thousands_of_points_are_served_at_once() {
    const POINTS: u32 = 5000;
    let walk = (SignalShape::Walk, 0.0, 1000.0, 5.0);
    let tags = (1..=POINTS).map(|ioa| simulated(ioa, ValueKind::F64, json!({}), walk)).collect();
    let device = start_device(tags, Duration::from_millis(100));
    let begun = Instant::now();
    let specs = device.tags.iter().map(|tag| tag.spec.clone()).collect();
    let running = start(device.port, json!({}), specs);
    let has_all = |seen: &Recording| {
        let good = seen.samples.iter().filter(|s| s.quality.is_good() && s.source_time.is_none());
        good.count() >= POINTS as usize
    };
    assert!(running.recorder.wait_until(3 * PATIENCE, has_all));
    let interrogated = begun.elapsed();
    running.recorder.clear();
    let begun = Instant::now();
    let changes = |seen: &Recording| seen.samples.len() >= 50_000;
    assert!(running.recorder.wait_until(6 * PATIENCE, changes));
    let rate = 50_000.0 / begun.elapsed().as_secs_f64();
    eprintln!("{POINTS} points within {interrogated:?}, then {rate:.0} changes a second");
    let recording = running.recorder.recording();
    for sample in recording.samples.iter().step_by(97) {
        let tag = &device.tags[sample.tag as usize - 1];
        let (Some(value), Some(time)) = (&sample.value, sample.source_time) else { continue };
        assert!(is_value_at(tag, value, time), "{}: {value:?}", tag.spec.id);
    }
    assert!(device.plugin.simulation_status().messages > 1000);
}

#[test]
fn a_station_with_certificates_is_not_simulated() {
    let settings = json!({"host": "127.0.0.1", "port": 1, "tls": {"ca": "/ca.pem"}});
    let settings: Settings = serde_json::from_value(settings).unwrap();
    let mut plugin = Iec104::create(settings, host()).unwrap();
    let update = Duration::from_secs(1);
    let simulation = Simulation { tags: tags(), faults: FaultPlan::none(), update, seed: 1 };
    let refused = plugin.start_simulation(simulation).unwrap_err();
    assert!(refused.message().contains("leave \"tls\" away"), "{refused}");
}

#[test]
fn a_text_is_neither_read_nor_simulated() {
    let mut tags = tags();
    let spec = tag_spec(50, "Q1.Mode", ValueKind::Text, json!({"ioa": 50}));
    let behavior = Behavior::new(SignalShape::Constant, 1.0, 0.0, Duration::from_secs(1)).unwrap();
    let signal = Signal::new(1, &spec.id, ValueKind::Text, behavior).unwrap();
    tags.push(SimulatedTag { spec, signal });
    let specs: Vec<_> = tags.iter().map(|tag| tag.spec.clone()).collect();
    let settings: Settings =
        serde_json::from_value(json!({"host": "127.0.0.1", "port": 1})).unwrap();
    let mut plugin = Iec104::create(settings, host()).unwrap();
    let update = Duration::from_secs(1);
    let simulation = Simulation { tags, faults: FaultPlan::none(), update, seed: 1 };
    let refusals = [
        plugin.check(&specs).unwrap_err(),
        plugin.start(specs, Recorder::new().sink()).unwrap_err(),
        plugin.start_simulation(simulation).unwrap_err(),
    ];
    for refused in refusals {
        let message = refused.message();
        assert!(message.contains("1 of 9 tags"), "{message}");
        assert!(message.contains("tag 'Q1.Mode': IEC 60870-5-104 carries no text"), "{message}");
    }
}
