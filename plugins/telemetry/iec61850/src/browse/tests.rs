//! Against libiec61850, which tells the names and types of its own model.

use std::fmt::Write;
use std::net::TcpListener;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::{CommandRun, host, run_command};
use busbar_plugin_sdk::{Plugin, abi};
use iec61850_rs::proto::mms::typespec::{Component, TypeSpec};
use serde_json::{Value, json};

use crate::tests::peer;
use crate::{Iec61850, Settings};

/// More than any answer here takes, also on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(15);

/// The status and measured values of the peer's model.
const VALUES: [(&str, &str, &str); 18] = [
    ("ATCC1.TapChg", "i64", "ST"),
    ("GGIO1.Ind1", "bool", "ST"),
    ("GGIO1.Ind2", "bool", "ST"),
    ("GGIO1.IntIn1", "i64", "ST"),
    ("GGIO1.IntIn2", "i64", "ST"),
    ("GGIO1.IntIn3", "i64", "ST"),
    ("LLN0.Mod", "i64", "ST"),
    ("MMXU1.PhV.net", "f64", "MX"),
    ("MMXU1.PhV.neut", "f64", "MX"),
    ("MMXU1.PhV.phsA", "f64", "MX"),
    ("MMXU1.PhV.phsB", "f64", "MX"),
    ("MMXU1.PhV.phsC", "f64", "MX"),
    ("MMXU1.PhV.res", "f64", "MX"),
    ("MMXU1.TotVAr", "i64", "MX"),
    ("MMXU1.TotW", "f64", "MX"),
    ("PTOC1.Op", "bool", "ST"),
    ("XCBR1.OpCnt", "i64", "ST"),
    ("XCBR1.Pos", "double_point", "ST"),
];

#[test]
fn kinds_are_by_type() {
    let component = |name: &str, type_spec| Component { name: Some(name.into()), type_spec };
    let status = |spec: TypeSpec| TypeSpec::Structure {
        packed: false,
        components: vec![component("stVal", spec), component("t", TypeSpec::UtcTime)],
    };
    for (spec, kind) in [
        (TypeSpec::VisibleString(-255), Some("text")),
        (TypeSpec::MmsString(-255), Some("text")),
        (TypeSpec::OctetString(-64), None),
        (TypeSpec::BitString(-2), Some("double_point")),
        (TypeSpec::Unsigned(32), Some("i64")),
    ] {
        assert_eq!(super::value_kind(&status(spec.clone()), 8), kind, "{spec:?}");
    }
}

fn points(settings: &Value, devices: &[&str]) -> CommandRun {
    let settings: Settings = serde_json::from_value(settings.clone()).unwrap();
    let plugin = Iec61850::create(settings, host()).unwrap();
    run_command(&plugin, "points", devices, b"", (1, usize::MAX)).unwrap()
}

fn list(run: &CommandRun) -> &str {
    std::str::from_utf8(&run.output).unwrap()
}

#[track_caller]
fn check_refused(run: &CommandRun, words: &str) {
    let expected = (Some(abi::BUSBAR_EXIT_CODE_INPUT), "");
    assert_eq!((run.exit_code, list(run)), expected, "{:?}", run.diagnostics);
    let said = run.diagnostics.iter().any(|(_, message)| message.contains(words));
    assert!(said, "{words}: {:?}", run.diagnostics);
}

#[test]
fn the_values_of_a_server_are_listed_by_their_types() {
    let Some(peer) = peer::start(&json!({})) else { return };
    let server = json!({"host": "127.0.0.1", "port": peer.port});
    let run = points(&server, &[]);
    assert_eq!(run.exit_code, Some(0), "{:?}", run.diagnostics);
    let mut expected = String::from("tag,type,unit,address.reference,address.fc\n");
    for (object, kind, constraint) in VALUES {
        let reference = format!("IED1LD0/{object}");
        writeln!(expected, "{reference},{kind},,{reference},{constraint}").unwrap();
    }
    assert_eq!(list(&run), expected);
    assert_eq!(list(&points(&server, &["IED1LD0"])), list(&run));
    check_refused(&points(&server, &["LD7"]), "its logical devices are IED1LD0");
}

#[test]
fn lists_that_come_in_many_answers_are_whole() {
    let Some(peer) = peer::start(&json!({"extra": 300})) else { return };
    let run = points(&json!({"host": "127.0.0.1", "port": peer.port}), &[]);
    assert_eq!(run.exit_code, Some(0), "{:?}", run.diagnostics);
    let of_extra = |line: &&str| line.starts_with("IED1LD0/MMXU2.Val");
    // Three phases, neutral, net and residual each.
    assert_eq!(list(&run).lines().filter(of_extra).count(), 6 * 300);
}

#[test]
fn a_server_that_does_not_answer_is_told_in_time() {
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = silent.local_addr().unwrap().port();
    let server = json!({"host": "127.0.0.1", "port": port, "timeout_seconds": 0.6});
    let begun = Instant::now();
    check_refused(&points(&server, &[]), "no association within 600 ms");
    drop(silent);
    check_refused(&points(&server, &[]), "connection refused");
    assert!(begun.elapsed() < PATIENCE);
    check_refused(&points(&json!({}), &[]), "settings: host");
}
