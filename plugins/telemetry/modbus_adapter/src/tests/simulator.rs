//! The simulated device, read by this adapter and by independent clients.

use std::process::Command;
use std::time::SystemTime;

use busbar_plugin_sdk::simulation::{Behavior, FaultKind, FaultPlan, Signal, SignalShape};
use busbar_plugin_sdk::{SimulatedTag, Simulation, Simulator, Text};

use super::*;

const SEED: u64 = 11;

/// A device at a free port. The adapter that is one needs settings of its own.
struct Device {
    adapter: ModbusAdapter,
    port: u16,
    tags: Vec<SimulatedTag>,
}

fn simulated(
    tag: u32,
    kind: ValueKind,
    address: serde_json::Value,
    behaviour: (SignalShape, f64, f64, f64),
) -> SimulatedTag {
    let (shape, base, amplitude, period_seconds) = behaviour;
    let period = Duration::from_secs_f64(period_seconds);
    let spec = tag_spec(tag, &format!("tag{tag}"), kind, address);
    let behaviour = Behavior::new(shape, base, amplitude, period).unwrap();
    let signal = Signal::new(SEED, &spec.id, kind, behaviour).unwrap();
    SimulatedTag { spec, signal }
}

fn start_device(tags: Vec<SimulatedTag>, faults: FaultPlan, timeout_millis: u64) -> Device {
    // Between the look and the start another may take it: then the next one is tried.
    for _ in 0..20 {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let settings = json!({"host": "127.0.0.1", "port": free, "timeout_seconds": timeout_millis as f64 / 1_000.0});
        let settings: Settings = serde_json::from_value(settings).unwrap();
        let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
        let update = Duration::from_secs(1);
        let simulation =
            Simulation { tags: tags.clone(), faults: faults.clone(), update, seed: SEED };
        if adapter.start_simulation(simulation).is_ok() {
            return Device { adapter, port: free, tags };
        }
    }
    panic!("no port is free");
}

/// Creates one tag for each way in which values lie in cells.
fn tags() -> Vec<SimulatedTag> {
    let holding = |register: u16, format: &str| json!({"table": "holding", "register": register, "type": format});
    let sine = (SignalShape::Sine, 60.0, 20.0, 8.0);
    vec![
        simulated(0, ValueKind::F64, holding(0, "f32"), sine),
        simulated(
            1,
            ValueKind::F64,
            json!({"table": "input", "register": 100, "type": "i16", "scale": 0.1}),
            (SignalShape::Walk, -20.0, 30.0, 3.0),
        ),
        simulated(
            2,
            ValueKind::I64,
            holding(6, "u32"),
            (SignalShape::Counter, 70_000.0, 5000.0, 0.5),
        ),
        simulated(
            3,
            ValueKind::Bool,
            json!({"table": "coil", "register": 3}),
            (SignalShape::Steps, 0.0, 0.0, 2.0),
        ),
        simulated(
            4,
            ValueKind::DoublePoint,
            json!({"table": "discrete", "register": 10}),
            (SignalShape::Steps, 0.0, 0.0, 4.0),
        ),
        simulated(
            5,
            ValueKind::Bool,
            json!({"table": "holding", "register": 8, "bit": 3}),
            (SignalShape::Constant, 1.0, 0.0, 1.0),
        ),
        simulated(
            6,
            ValueKind::F64,
            json!({"table": "holding", "register": 9, "type": "f64", "word_order": "little", "unit": 7}),
            (SignalShape::Walk, 1e6, 1e5, 5.0),
        ),
        simulated(
            7,
            ValueKind::Text,
            json!({"table": "holding", "register": 14, "length": 12}),
            (SignalShape::Counter, 0.0, 50.0, 0.5),
        ),
    ]
}

/// Reports whether the signal has this value at some instant between `from` and `to`, within the
/// resolution of the tag's cells.
fn has_at_some_time(tag: &SimulatedTag, value: &Value, from: SystemTime, to: SystemTime) -> bool {
    let step = Duration::from_millis(1);
    let near = |expected: Value| match (expected, value) {
        (Value::F64(expected), Value::F64(value)) => {
            // Half a step of the cells, and what a millisecond changes.
            let slope = tag.signal.max_slope().unwrap_or_default();
            (expected - value).abs() <= 0.051 + 0.001 * slope
        }
        (expected, value) => expected == *value,
    };
    let mut time = from;
    while time <= to {
        if near(tag.signal.at(time)) {
            return true;
        }
        time += step;
    }
    near(tag.signal.at(to))
}

#[test]
fn the_adapter_reads_what_the_device_has_at_the_time() {
    let device = start_device(tags(), FaultPlan::none(), 1000);
    let specs = device.tags.iter().map(|tag| tag.spec.clone()).collect();
    let running = start(device.port, json!({}), specs);
    for tag in &device.tags {
        let begun = SystemTime::now();
        let count = |seen: &busbar_plugin_sdk::testing::Recording| {
            let good = seen.samples.iter().filter(|s| s.tag == tag.spec.tag && s.quality.is_good());
            good.count()
        };
        running.recorder.clear();
        assert!(running.recorder.wait_until(PATIENCE, |seen| count(seen) > 20));
        let ended = SystemTime::now();
        let from = begun - Duration::from_millis(200);
        for sample in running.recorder.recording().samples {
            if sample.tag == tag.spec.tag && sample.quality.is_good() {
                let value = sample.value.unwrap();
                let fits = has_at_some_time(tag, &value, from, ended);
                assert!(fits, "{}: {value:?}", tag.spec.id);
            }
        }
    }
    let status = device.adapter.simulation_status();
    assert_eq!((status.clients, status.connections), (1, 1));
    assert!(status.messages > 20 && status.endpoint.contains(&device.port.to_string()));
}

#[test]
fn pymodbus_reads_the_same() {
    let Some(python) = super::peer::python() else { return };
    let device = start_device(tags(), FaultPlan::none(), 1000);
    let script =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../../tests/end_to_end/peers/pymodbus_client.py");
    let reads = json!([
        ["input", 1, 100, 1],
        ["holding", 1, 6, 3],
        ["coil", 1, 3, 1],
        ["discrete", 1, 10, 2],
        ["holding", 7, 9, 4],
        ["holding", 1, 2, 1],
        ["holding", 1, 0, 30],
        ["holding", 9, 0, 1],
        ["holding", 1, 14, 6],
    ]);
    let begun = SystemTime::now();
    let output = Command::new(python)
        .args([script, &device.port.to_string(), &reads.to_string()])
        .output()
        .unwrap();
    let ended = SystemTime::now();
    let said = String::from_utf8_lossy(&output.stdout);
    let cells: serde_json::Value = serde_json::from_str(&said).unwrap_or_else(|error| {
        panic!("{error}: {said}{}", String::from_utf8_lossy(&output.stderr))
    });
    let cell = |read: usize, index: usize| cells[read][index].as_u64().unwrap();
    let check = |tag: usize, value: Value| {
        let fits = has_at_some_time(&device.tags[tag], &value, begun, ended);
        assert!(fits, "{}: {value:?} in {cells}", device.tags[tag].spec.id);
    };
    check(1, Value::F64(f64::from(cell(0, 0) as u16 as i16) * 0.1));
    check(2, Value::I64((cell(1, 0) << 16 | cell(1, 1)) as i64));
    assert_eq!(cell(1, 2), 1 << 3, "a bit of a register");
    check(3, Value::Bool(cell(2, 0) == 1));
    let position = cell(3, 0) | cell(3, 1) << 1;
    check(4, Value::DoublePoint(busbar_plugin_sdk::DoublePoint::from_bits(position)));
    let bits = (0..4).fold(0, |bits, index| bits | cell(4, index) << (16 * index));
    check(6, Value::F64(f64::from_bits(bits)));
    let bytes: Vec<_> = (0..6).flat_map(|index| (cell(8, index) as u16).to_be_bytes()).collect();
    let written = str::from_utf8(&bytes).unwrap().trim_end_matches('\0');
    assert!(written.starts_with("Text "), "{written}");
    check(7, Value::Text(Text::cut(written)));
    assert_eq!(cells[5], json!([0]), "between tags");
    assert_eq!((&cells[6], &cells[7]), (&json!(2), &json!(11)), "exceptions");
}

#[test]
fn mbpoll_reads_the_same() {
    let there = Command::new("mbpoll").arg("-V").output().is_ok();
    let required = |name| std::env::var_os(name).is_some();
    if !there {
        assert!(!required("CI") && !required("BUSBAR_REQUIRE_PEERS"), "mbpoll is missing");
        eprintln!("SKIPPED: no mbpoll: install it, or run `cargo xtask test`");
        return;
    }
    let device = start_device(tags(), FaultPlan::none(), 1000);
    let begun = SystemTime::now();
    let output = Command::new("mbpoll")
        // One float of holding registers, addresses from 0, the high word first.
        .args(["-0", "-1", "-B", "-t", "4:float", "-r", "0", "-p", &device.port.to_string()])
        .arg("127.0.0.1")
        .output()
        .unwrap();
    let ended = SystemTime::now();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let value = said.lines().find_map(|line| line.strip_prefix("[0]:")?.trim().parse().ok());
    let value =
        value.unwrap_or_else(|| panic!("{said}{}", String::from_utf8_lossy(&output.stderr)));
    assert!(has_at_some_time(&device.tags[0], &Value::F64(value), begun, ended), "{value}");
}

#[test]
fn what_cannot_be_simulated_is_refused_in_words() {
    let device = start_device(tags(), FaultPlan::none(), 1000);
    let settings = |host: &str, port: u16| {
        let settings = json!({"host": host, "port": port});
        serde_json::from_value::<Settings>(settings).unwrap()
    };
    let start = |settings, tags: Vec<SimulatedTag>| {
        let mut adapter = ModbusAdapter::create(settings, host()).unwrap();
        let update = Duration::from_secs(1);
        let faults = FaultPlan::none();
        adapter.start_simulation(Simulation { tags, faults, update, seed: 1 }).unwrap_err()
    };
    let taken = start(settings("127.0.0.1", device.port), tags());
    assert!(taken.message().contains("127.0.0.1") && taken.message().contains("nobody else has"));
    // An address for documentation (RFC 5737), which is never this machine's.
    let elsewhere = start(settings("192.0.2.1", 15_020), tags());
    assert!(elsewhere.message().contains("name this machine"), "{elsewhere}");
    let small = json!({"table": "holding", "register": 0, "type": "i16", "scale": 0.001});
    let tag = simulated(0, ValueKind::F64, small, (SignalShape::Sine, 60.0, 1.0, 1.0));
    let misfit = start(settings("127.0.0.1", 1), vec![tag]);
    assert!(misfit.message().contains("'tag0'") && misfit.message().contains("scale"), "{misfit}");
    // Neither "Text -100" nor its number finds room.
    let short = json!({"table": "holding", "register": 0, "length": 3});
    let tag = simulated(0, ValueKind::Text, short, (SignalShape::Sine, 0.0, 100.0, 1.0));
    let misfit = start(settings("127.0.0.1", 1), vec![tag]);
    assert!(misfit.message().contains("'tag0'") && misfit.message().contains("length"), "{misfit}");
}

/// With each fault tags turn bad where values are lost, and come back; and what is good
/// is never wrong.
#[test]
fn faults_make_tags_bad_and_never_wrong() {
    let faults = [
        (FaultKind::LinkLoss, true),
        (FaultKind::Slow, false),
        (FaultKind::HalfOpen, true),
        (FaultKind::Reset, true),
        (FaultKind::Garbage, true),
        (FaultKind::Late, true),
    ];
    std::thread::scope(|scope| {
        for (kind, is_lost) in faults {
            scope.spawn(move || survive(kind, is_lost));
        }
    });
}

fn survive(kind: FaultKind, is_lost: bool) {
    let plan = FaultPlan::new(5, &[kind], FAULT_PERIOD, Duration::from_secs(8)).unwrap();
    let device = start_device(tags(), plan, TIMEOUT_MILLIS);
    let specs: Vec<_> = device.tags.iter().map(|tag| tag.spec.clone()).collect();
    let running =
        start(device.port, json!({ "timeout_seconds": TIMEOUT_MILLIS as f64 / 1_000.0 }), specs);
    let mut watch =
        Watch { device: &device, running: &running, seen: 0, looked: SystemTime::now() };
    let fault = || device.adapter.simulation_status().fault;
    watch.until("all tags are good", |watch| watch.all_good());
    watch.until("the fault begins", |_| fault() == Some(kind));
    if is_lost {
        let lost = Some(Quality::Bad(Reason::Communication));
        let latest = || running.recorder.latest(0).map(|sample| sample.quality);
        watch.until("tags are bad", |_| latest() == lost);
    }
    watch.until("the fault is over", |_| fault().is_none());
    watch.until("all tags are good again", |watch| watch.all_good());
    assert!(watch.seen > 100, "{kind:?}: only {} samples were looked at", watch.seen);
}

const TIMEOUT_MILLIS: u64 = 400;
const FAULT_PERIOD: Duration = Duration::from_secs(12);

/// Looks at every sample soon after it came.
struct Watch<'a> {
    device: &'a Device,
    running: &'a Running,
    seen: usize,
    looked: SystemTime,
}

impl Watch<'_> {
    fn until(&mut self, what: &str, is: impl Fn(&Self) -> bool) {
        let begun = std::time::Instant::now();
        while !is(self) {
            self.look();
            assert!(begun.elapsed() < 4 * FAULT_PERIOD, "not within time: {what}");
            std::thread::sleep(Duration::from_millis(20));
        }
        self.look();
    }

    /// Checks that each new good sample was true after its request, which is one deadline ago at
    /// most.
    fn look(&mut self) {
        let from = self.looked - Duration::from_millis(TIMEOUT_MILLIS + 100);
        self.looked = SystemTime::now();
        let recording = self.running.recorder.recording();
        for sample in recording.samples.iter().skip(self.seen).filter(|s| s.quality.is_good()) {
            let tag = self.device.tags.iter().find(|tag| tag.spec.tag == sample.tag).unwrap();
            let fits =
                has_at_some_time(tag, sample.value.as_ref().unwrap(), from, SystemTime::now());
            assert!(fits, "{}: {:?}", tag.spec.id, sample.value);
        }
        self.seen = recording.samples.len();
    }

    fn all_good(&self) -> bool {
        let latest = |tag: &SimulatedTag| self.running.recorder.latest(tag.spec.tag);
        let mut tags = self.device.tags.iter().map(latest);
        tags.all(|sample| sample.is_some_and(|sample| sample.quality.is_good()))
    }
}
