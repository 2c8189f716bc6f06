//! `busbar plugin check`: it passes every plugin that ships, and finds each kind of misbehaviour at
//! each function.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use e2e::{Output, built, built_folder, busbar, finish, workspace_path};
use fault_injector::{CallSite, FAULT_VARIABLE, Fault, Misbehavior};
use serde_json::{Value, json};

/// Longest time of a case with a hang, seconds.
const HANG_SECONDS: &str = "4";
/// Number of checks side by side, which mostly wait.
const CHECKED_AT_ONCE: usize = 8;
/// Sample of faults, one of each kind at different functions, which CI runs instead of all.
const SAMPLE: &[(Misbehavior, CallSite)] = &[
    (Misbehavior::Panic, CallSite::Configure),
    (Misbehavior::MissingVerdict, CallSite::Draw),
    (Misbehavior::VerdictOutOfRange, CallSite::Draw),
    (Misbehavior::UnknownWithoutReason, CallSite::Draw),
    (Misbehavior::SeverityOfNormal, CallSite::Draw),
    (Misbehavior::IndexOutOfBounds, CallSite::Optimize),
    (Misbehavior::PanicInDrop, CallSite::Destroy),
    (Misbehavior::Segfault, CallSite::Publish),
    (Misbehavior::StackOverflow, CallSite::Draw),
    (Misbehavior::Abort, CallSite::Check),
    (Misbehavior::Exit, CallSite::Stop),
    (Misbehavior::AllocationFailure, CallSite::Create),
    (Misbehavior::EndlessLoop, CallSite::Init),
    (Misbehavior::Deadlock, CallSite::GetFactory),
    (Misbehavior::DoubleFree, CallSite::GetCapability),
    (Misbehavior::CloseDescriptors, CallSite::Start),
    (Misbehavior::LeakMemory, CallSite::Create),
    (Misbehavior::LeakDescriptor, CallSite::Deinit),
    (Misbehavior::LeakThread, CallSite::Start),
    (Misbehavior::WrongStructSize, CallSite::Descriptor),
    (Misbehavior::NotUtf8, CallSite::Draw),
    (Misbehavior::NotFinite, CallSite::Publish),
    (Misbehavior::OutOfRange, CallSite::Count),
    (Misbehavior::NullResult, CallSite::Create),
    (Misbehavior::Overrun, CallSite::Optimize),
    (Misbehavior::Flood, CallSite::Publish),
    (Misbehavior::AfterStop, CallSite::Publish),
    (Misbehavior::Segfault, CallSite::Simulate),
    (Misbehavior::LeakMemory, CallSite::StopSimulation),
    (Misbehavior::NotUtf8, CallSite::SimulationStatus),
    (Misbehavior::OutOfRange, CallSite::RunCommand),
    (Misbehavior::LeakDescriptor, CallSite::RunCommand),
    (Misbehavior::Panic, CallSite::DescribeChart),
    (Misbehavior::NotFinite, CallSite::ReadChart),
    (Misbehavior::OutOfRange, CallSite::ReadChart),
    (Misbehavior::Overrun, CallSite::Explain),
    (Misbehavior::NotUtf8, CallSite::DescribeRecords),
    (Misbehavior::OutOfRange, CallSite::ReadRecords),
    (Misbehavior::Overrun, CallSite::ReadRecords),
    (Misbehavior::NotUtf8, CallSite::ReadAlarms),
    (Misbehavior::OutOfRange, CallSite::ReadAlarms),
    (Misbehavior::Flood, CallSite::ReadAlarms),
    (Misbehavior::Overrun, CallSite::ReadAlarms),
    (Misbehavior::NotUtf8, CallSite::Notify),
    (Misbehavior::OutOfRange, CallSite::Notify),
    (Misbehavior::Overrun, CallSite::Notify),
];

fn transformer() -> Value {
    json!({ "transformers": [{ "equipment": "=T1" }] })
}

fn gas() -> Value {
    json!({ "equipment": ["=Q1-QA1"], "filling": 7.0, "alarm": 6.4, "lock_out": 6.0 })
}

fn quantities() -> Value {
    json!({
        "quantities": [{ "name": "Core current", "role": "core", "attention": 100, "alarm": 300 }],
        "equipment": ["=T1-TA1"],
    })
}

/// Returns the settings of a recipient whom nothing reaches.
fn nobody() -> Value {
    json!({ "settings": {
        "recipients": [{ "name": "nobody", "webhooks": ["gone"] }],
        "webhooks": { "gone": { "url": "http://127.0.0.1:1/" } },
    } })
}

/// Returns the settings of an asset register from a source.
fn lists(source: Value) -> Value {
    json!({ "lists": [{
        "title": "Asset register", "kind": "asset", "source": source, "equipment": "ID",
        "columns": [{ "column": "MAKER", "name": "Maker" }],
    }] })
}

fn contour() -> Value {
    json!({
        "name": "Contacts", "unit": "°C", "role": "contact", "equipment": ["=Q1-QB1"],
        "reach_metres": 6, "high": 70, "step": 10,
    })
}

fn flows() -> Value {
    let flow = json!({ "measured_at": "=Q1-BC1", "from": "=Q1-BC1", "to": "=Q1-BV1" });
    let mut flows = json!({ "flows": [flow] });
    flows["flows"][0]["rating_mva"] = json!(305);
    flows
}

fn switches() -> Value {
    json!({ "switches": [{ "equipment": "=Q1", "mechanism": "blade", "travel_seconds": 6 }] })
}

/// Returns the settings of a network of a source, and a switch between it and another node.
fn network() -> Value {
    json!({
        "levels": [{ "name": "220 kV", "color": "#7a4fb5" }],
        "nodes": [{ "id": "a", "level": "220 kV" }, { "id": "b", "level": "220 kV" }],
        "branches": [{ "equipment": "=Q1", "between": ["a", "b"], "switch": true }],
        "sources": [{ "node": "a" }],
    })
}

fn library(plugin: &str) -> PathBuf {
    built(built_folder().join(format!("lib{plugin}.{}", std::env::consts::DLL_EXTENSION)))
}

fn check(library: &PathBuf, sample: &Value) -> (Command, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("sample.json");
    std::fs::write(&path, sample.to_string()).expect("it can be written");
    let mut command = busbar();
    command.args(["plugin", "check"]).arg(library).arg("--sample").arg(path);
    (command, folder)
}

/// Returns tags of the fault injector without a fault.
fn good_sample() -> Value {
    json!({ "tags": [
        { "kind": "f64", "address": 1 },
        { "kind": "i64", "address": {} },
        { "kind": "bool", "address": "a" },
        { "kind": "double_point", "address": [] },
    ] })
}

#[test]
fn shipped_plugins_pass() {
    // Free, so that simulators can listen there.
    let free = std::net::TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr());
    let port = free.expect("a port is free").port();
    let modbus = json!({
        "settings": { "host": "127.0.0.1", "port": port, "poll_seconds": 0.1 },
        "tags": [
            { "kind": "f64", "address": { "table": "input", "register": 100, "type": "i16" } },
            { "kind": "bool", "address": { "table": "discrete", "register": 4 } },
            { "kind": "double_point", "address": { "table": "discrete", "register": 0 } },
        ],
    });
    let line = json!({
        "settings": { "serial": { "device": "/dev/there-is-none" } },
        "tags": [{ "kind": "bool", "address": { "table": "coil", "register": 0, "unit": 7 } }],
    });
    let station = json!({
        "settings": { "host": "127.0.0.1", "port": port },
        "tags": [
            { "kind": "f64", "address": { "ioa": 1 } },
            { "kind": "bool", "address": { "ioa": 2 } },
        ],
    });
    let ied = json!({
        "settings": { "host": "127.0.0.1", "port": port },
        "tags": [
            { "kind": "f64", "address": { "reference": "LD0/MMXU1.TotW", "fc": "MX" } },
            { "kind": "double_point", "address": { "reference": "LD0/XCBR1.Pos", "fc": "ST" } },
        ],
    });
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let recording = folder.path().join("recording.csv");
    std::fs::write(&recording, "time,oil,closed\n0,55.5,1\n1,56,0\n").expect("it can be written");
    let replay = json!({
        "settings": { "file": recording, "loop": true, "csv": { "time_format": "seconds" } },
        "tags": [
            { "kind": "f64", "address": { "column": "oil" } },
            { "kind": "bool", "address": { "column": "closed" } },
        ],
    });
    let register = folder.path().join("register.csv");
    std::fs::write(&register, "ID,MAKER\n=Q1,Alpha\n,nobody's\n=Q2,Beta\n").expect("written");
    let nowhere = json!({ "file": "/no/such/assets.db", "query": "SELECT * FROM assets" });
    let database = json!({
        "settings": {
            "postgres": {
                "host": "127.0.0.1", "port": 1, "database": "d", "user": "u",
                "sslmode": "disable",
            },
            "queries": [
                { "name": "rows", "sql": "SELECT key, value FROM latest", "poll_seconds": 0.1 },
                { "name": "row", "sql": "SELECT oil FROM t1", "poll_seconds": 0.1 },
            ],
            "listen": [{ "channel": "values", "query": "rows" }],
        },
        "tags": [
            { "kind": "f64", "address": { "query": "row", "column": "oil" } },
            { "kind": "bool", "address": { "query": "rows", "key": "fan" } },
        ],
    });
    let topics = json!({
        "settings": { "host": "127.0.0.1", "port": 1 },
        "tags": [
            { "kind": "f64", "address": { "topic": "site7/p", "pointer": "/value" } },
            {
                "kind": "bool",
                "address": { "group": "north", "edge_node": "station7", "metric": "fan" },
            },
        ],
    });
    let file = json!({
        "settings": {
            "sqlite": { "path": "/no/such/values.db" },
            "queries": [{ "name": "row", "sql": "SELECT oil FROM t1", "poll_seconds": 0.1 }],
        },
        "tags": [{ "kind": "f64", "address": { "query": "row", "column": "oil" } }],
    });
    let server = json!({
        "settings": { "url": "opc.tcp://127.0.0.1:1", "alarms": true },
        "tags": [
            { "kind": "f64", "address": { "node": "ns=2;s=P" } },
            { "kind": "double_point", "address": { "node": "i=7", "states": { "OPEN": "off" } } },
        ],
    });
    for (plugin, sample, most_skipped) in [
        ("modbus_adapter", modbus, 0),
        // A line is read, not simulated.
        ("modbus_adapter", line, 2),
        ("iec104", station, 0),
        ("iec61850", ied, 0),
        // It reads, and simulates no server.
        ("opcua", server, 2),
        ("mqtt", topics, 0),
        ("replay", replay, 0),
        ("sql_adapter", database, 0),
        ("sql_adapter", file, 0),
        ("power_overlay", json!({}), 0),
        ("energisation", json!({ "settings": network() }), 0),
        ("transformer_thermal", json!({ "settings": transformer() }), 0),
        ("sf6_density", json!({ "settings": gas() }), 0),
        ("thermography", json!({ "settings": { "equipment": ["=Q1-QB1-L1"] } }), 0),
        ("condition", json!({ "settings": quantities() }), 0),
        ("contour", json!({ "settings": contour() }), 0),
        ("load_flow", json!({ "settings": flows() }), 0),
        ("switch_position", json!({ "settings": switches() }), 0),
        ("quadric_collapse", json!({}), 0),
        ("weighted_collapse", json!({}), 0),
        ("gas_analysis", json!({}), 0),
        ("csv_records", json!({ "settings": lists(json!({ "file": register })) }), 0),
        ("sqlite_records", json!({ "settings": lists(nowhere) }), 0),
        ("notifier", nobody(), 0),
        ("fault_injector", good_sample(), 0),
    ] {
        let (mut command, folder) = check(&library(plugin), &sample);
        let report = folder.path().join("report.json");
        let output = finish(command.arg("--json").arg(&report)).expect_code(0);
        let text = std::fs::read(&report).expect("the report is written");
        let report: Value = serde_json::from_slice(&text).expect("it is JSON");
        assert_eq!(report["passed"], true, "{}", output.stdout);
        let cases = report["cases"].as_array().expect("it lists cases");
        let skipped = cases.iter().filter(|case| case["verdict"] == "skip").count();
        assert!(skipped <= most_skipped && cases.len() >= 17, "{}", output.stdout);
    }
}

/// The binary built when the entry froze loads for ever.
#[test]
#[cfg(all(target_arch = "x86_64", target_os = "linux"))]
fn the_frozen_plugin_passes() {
    let frozen = workspace_path("plugins/sdk/abi/tests/frozen/plugin_1_0.so");
    let output = finish(busbar().args(["plugin", "check"]).arg(&frozen)).expect_code(0);
    for line in ["pass  create  ", "pass  create-arguments", "pass  instances", "14 passed"] {
        assert!(output.stdout.contains(line), "{line}:\n{}", output.stdout);
    }
    // And in the host, as a configuration would have it.
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    std::fs::copy(&frozen, folder.path().join("plugin_1_0.so")).expect("it can be copied");
    let catalog = busbar_plugin_host::Catalog::discover(&[folder.path().to_owned()]);
    assert_eq!(catalog.refused(), []);
    let made = catalog.create("frozen", "com.example.frozen", &json!({}));
    assert!(made.is_ok_and(|instance| instance.info().version == "1.0.0"));
}

#[test]
fn what_cannot_be_checked_is_told_in_words() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let text = folder.path().join("libtext.so");
    std::fs::write(&text, "no library").expect("it can be written");
    let sample = folder.path().join("sample.json");
    std::fs::write(&sample, "{\"tag\": []}").expect("it can be written");
    let plugin = library("power_overlay");
    let sample_arguments = ["--sample".as_ref(), sample.as_os_str()];
    let only = ["--only".as_ref(), "no-such-case".as_ref()];
    let refused = |library: &Path, more: &[&OsStr], words: &[&str]| {
        let output = finish(busbar().args(["plugin", "check"]).arg(library).args(more));
        let output = output.expect_code(1);
        let said = output.stdout + &output.stderr;
        assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
    };
    refused(&folder.path().join("absent.so"), &[], &["absent.so", "give the path"]);
    refused(&text, &[], &["FAIL  load", "cannot be loaded", "-> build it", "needs `load`"]);
    refused(&plugin, &sample_arguments, &["sample.json", "unknown field `tag`", "write {"]);
    refused(&plugin, &only, &["no-such-case", "report lists"]);
    // A case by its name, and those that it needs, and no others.
    let mut command = busbar();
    command.args(["plugin", "check"]).arg(&plugin).args(["--only", "overlay-draw"]);
    let output = finish(&mut command).expect_code(0);
    assert!(output.stdout.contains("pass  overlay-draw"), "{}", output.stdout);
    assert!(output.stdout.contains("6 passed, 0 failed, 0 skipped"), "{}", output.stdout);
}

/// Compiles an optimiser in C whose flags say that it reads no wedges, with another line of work.
fn optimizer_without_wedges(folder: &Path, work: &str) -> PathBuf {
    let templates = workspace_path("plugins/sdk/sdk/templates");
    let mut text = std::fs::read_to_string(templates.join("optimizer_c/plugin.c"))
        .expect("the template is there");
    let count = "size_t count = 3 * (size_t)mesh->triangle_count;";
    let flags = ".flags = BUSBAR_OPTIMIZER_NO_WEDGES, .optimize = optimize};";
    for (old, new) in
        [(count, &format!("{count} {work}")), (".optimize = optimize};", &flags.to_owned())]
    {
        assert_eq!(text.matches(old).count(), 1, "{old}");
        text = text.replace(old, new);
    }
    let (source, library) = (folder.join("plugin.c"), folder.join("liboptimizer.so"));
    std::fs::write(&source, text).expect("it can be written");
    let mut gcc = Command::new("gcc");
    gcc.args(["-shared", "-fPIC", "-O2", "-Wall", "-Wextra", "-Werror"]).arg("-I");
    gcc.arg(workspace_path("plugins/sdk/abi/include")).arg("-I").arg(templates.join("c"));
    finish(gcc.arg(&source).arg("-o").arg(&library).arg("-lm")).expect_code(0);
    library
}

#[test]
fn who_reads_wedges_and_denies_it_is_found() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let check = |work: &str| {
        let library = optimizer_without_wedges(folder.path(), work);
        finish(busbar().args(["plugin", "check"]).arg(library))
    };
    check("").expect_code(0);
    let output = check("if (mesh->wedge_count == 0) count = 0;").expect_code(1);
    let found = ["FAIL  optimizer-sequence", "leave BUSBAR_OPTIMIZER_NO_WEDGES out"];
    assert!(found.iter().all(|line| output.stdout.contains(line)), "{}", output.stdout);
}

#[test]
fn a_fault_of_each_kind_is_found() {
    let missing: Vec<_> =
        Misbehavior::ALL.iter().filter(|kind| SAMPLE.iter().all(|(k, _)| k != *kind)).collect();
    assert!(missing.is_empty(), "the sample lacks {missing:?}");
    let everywhere: BTreeSet<_> = SAMPLE.iter().map(|&(_, at)| at as usize).collect();
    assert_eq!(everywhere.len(), CallSite::ALL.len(), "the sample strikes everywhere");
    find_all(SAMPLE.iter().copied());
}

/// Minutes: `cargo nextest run -p plugin_tests --run-ignored only every_fault`.
#[test]
#[ignore = "takes minutes: every kind of fault at every function"]
fn every_fault_is_found_everywhere() {
    let all =
        Misbehavior::ALL.iter().flat_map(|&kind| CallSite::ALL.iter().map(move |&at| (kind, at)));
    find_all(all.filter(|(kind, at)| kind.reaches(*at)));
}

fn find_all(faults: impl Iterator<Item = (Misbehavior, CallSite)>) {
    let faults: Vec<_> = faults.collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut missed = Vec::new();
        while let Some(&(kind, at)) = faults.get(next.fetch_add(1, Ordering::Relaxed)) {
            let output = check_with(Fault { kind, at, after_calls: 0 });
            let mut lines = output.stdout.lines().filter(|line| line.starts_with("        "));
            if output.code != Some(1) || !lines.any(|line| explains(kind, at, line)) {
                let code = output.code;
                missed.push(format!("{kind:?} at {at:?}: {code:?}\n{}", output.stdout));
            }
        }
        missed
    };
    let missed: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..CHECKED_AT_ONCE).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("it runs")).collect()
    });
    let (count, all) = (missed.len(), faults.len());
    assert!(missed.is_empty(), "{count} of {all} not found:\n{}", missed.join("\n\n"));
}

/// Checks the injector with a fault, configured by settings as far as they reach.
fn check_with(fault: Fault) -> Output {
    let mut sample = good_sample();
    if fault.at.knows_settings() {
        sample["settings"] = json!(fault);
    }
    let (mut command, _folder) = check(&library("fault_injector"), &sample);
    if !fault.at.knows_settings() {
        command.env(FAULT_VARIABLE, json!(fault).to_string());
    }
    let hangs = matches!(fault.kind, Misbehavior::EndlessLoop | Misbehavior::Deadlock);
    if hangs {
        command.args(["--limit", HANG_SECONDS]);
    }
    finish(&mut command)
}

/// Reports whether a line of a report names the fault, and its place for kinds that kill the
/// process.
fn explains(kind: Misbehavior, at: CallSite, line: &str) -> bool {
    let name = json!(at).as_str().expect("it has a name").to_owned();
    let named = line.contains(&format!("in {name}")) || at == CallSite::Publish;
    let says = |words: &[&str]| words.iter().any(|word| line.contains(word));
    match kind {
        // Caught in the SDK, but for functions that are not Rust's to catch in.
        Misbehavior::Panic | Misbehavior::IndexOutOfBounds | Misbehavior::PanicInDrop => {
            says(&["panicked"])
        }
        Misbehavior::Segfault => named && says(&["SIGSEGV"]),
        Misbehavior::StackOverflow => named && says(&["SIGSEGV", "SIGABRT"]),
        Misbehavior::Abort | Misbehavior::AllocationFailure | Misbehavior::DoubleFree => {
            named && says(&["SIGABRT"])
        }
        Misbehavior::Exit => named && says(&["exit code 0"]),
        Misbehavior::EndlessLoop | Misbehavior::Deadlock if at == CallSite::Publish => {
            says(&["left", "did not end"])
        }
        Misbehavior::EndlessLoop | Misbehavior::Deadlock => named && says(&["did not end within"]),
        Misbehavior::CloseDescriptors => says(&["descriptors that it had not opened"]),
        Misbehavior::LeakMemory => says(&["bytes of heap"]),
        Misbehavior::LeakDescriptor => says(&["descriptors"]),
        Misbehavior::LeakThread => says(&["left_behind"]),
        Misbehavior::WrongStructSize => says(&["says that it has 8 bytes"]),
        Misbehavior::NotUtf8 => says(&["not UTF-8"]),
        Misbehavior::NotFinite => says(&["NaN", "not finite", "is infinite"]),
        Misbehavior::OutOfRange => says(&[
            "1000",
            "which `start` did not give",
            "which is not there",
            "names position",
            "unknown exit code",
            "not described",
            "not those of the header",
            "never handed over",
        ]),
        Misbehavior::NullResult => says(&["null", "failed where it must not"]),
        Misbehavior::Overrun => says(&["beyond the end"]),
        Misbehavior::Flood => says(&["flood", "more than 5,000"]),
        Misbehavior::AfterStop => says(&["while it was idle"]),
        Misbehavior::MissingVerdict => says(&["have no verdict"]),
        Misbehavior::VerdictOutOfRange => says(&["not described"]),
        Misbehavior::UnknownWithoutReason => says(&["has no reason"]),
        Misbehavior::SeverityOfNormal => says(&["has the severity of an abnormal verdict"]),
    }
}
