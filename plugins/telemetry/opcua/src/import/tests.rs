//! Against asyncua, with everything that can be browsed (`opcua_space.py`).

use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::{CommandRun, host, run_command};
use busbar_plugin_sdk::{Plugin, abi};
use serde_json::{Value, json};

use crate::tests::peer;
use crate::{OpcUa, Settings};

/// Longest wait for an answer, which suffices also on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(30);

/// Expected point list of the test server's Station.
const LIST: &str = r#"tag,description,type,unit,low,high,address.node,address.index,address.states
Station.Bay 1.Any,,i64,,,,nsu=urn:busbar:test;s=Station.Any,,
Station.Bay 1.Breaker,,double_point,,,,nsu=urn:busbar:test;s=Station.Breaker,,"{""0"":""intermediate"",""1"":""off"",""2"":""on"",""3"":""bad_state""}"
Station.Bay 1.Earthing,,double_point,,,,nsu=urn:busbar:test;s=Station.Earthing,,"{""false"":""on"",""true"":""off""}"
Station.Bay 1.Gas,,f64,,,,nsu=urn:busbar:test;s=Station.Gas,,
Station.Bay 1.Loose[0],,bool,,,,nsu=urn:busbar:test;s=Station.Loose,0,
Station.Bay 1.Loose[1],,bool,,,,nsu=urn:busbar:test;s=Station.Loose,1,
Station.Bay 1.Mode,"1 Manual, 5 Automatic",i64,,,,nsu=urn:busbar:test;s=Station.Mode,,
Station.Bay 1.Phases[0],,f64,,,,nsu=urn:busbar:test;s=Station.Phases,0,
Station.Bay 1.Phases[1],,f64,,,,nsu=urn:busbar:test;s=Station.Phases,1,
Station.Bay 1.Phases[2],,f64,,,,nsu=urn:busbar:test;s=Station.Phases,2,
Station.Bay 1.Pump,"false Stopped, true Running",bool,,,,nsu=urn:busbar:test;s=Station.Pump,,
Station.Bay 1.Twin (nsu=urn:busbar:test;s=Twin A),,f64,,,,nsu=urn:busbar:test;s=Twin A,,
Station.Bay 1.Twin (nsu=urn:busbar:test;s=Twin B),,f64,,,,nsu=urn:busbar:test;s=Twin B,,
Station.Types.Boolean,,bool,,,,nsu=urn:busbar:test;s=Station.Types.Boolean,,
Station.Types.Byte,,i64,,,,nsu=urn:busbar:test;s=Station.Types.Byte,,
Station.Types.Double,,f64,,,,nsu=urn:busbar:test;s=Station.Types.Double,,
Station.Types.Float,,f64,,,,nsu=urn:busbar:test;s=Station.Types.Float,,
Station.Types.Int16,,i64,,,,nsu=urn:busbar:test;s=Station.Types.Int16,,
Station.Types.Int32,,i64,,,,nsu=urn:busbar:test;s=Station.Types.Int32,,
Station.Types.Int64,,i64,,,,nsu=urn:busbar:test;s=Station.Types.Int64,,
Station.Types.LocalizedText,,text,,,,nsu=urn:busbar:test;s=Station.Types.LocalizedText,,
Station.Types.SByte,,i64,,,,nsu=urn:busbar:test;s=Station.Types.SByte,,
Station.Types.StatusCode,,i64,,,,nsu=urn:busbar:test;s=Station.Types.StatusCode,,
Station.Types.String,,text,,,,nsu=urn:busbar:test;s=Station.Types.String,,
Station.Types.UInt16,,i64,,,,nsu=urn:busbar:test;s=Station.Types.UInt16,,
Station.Types.UInt32,,i64,,,,nsu=urn:busbar:test;s=Station.Types.UInt32,,
Station.Types.UInt64,,i64,,,,nsu=urn:busbar:test;s=Station.Types.UInt64,,
Station.Voltage,"Voltage, ""L1-L2""",f64,kV,0,400,nsu=urn:busbar:test;s=Station.Voltage,,
"#;
const REFUSED: [(&str, &str); 5] = [
    ("Bay 1.Closed", "its AccessLevel does not allow this user to read it"),
    ("Bay 1.Matrix", "a matrix: only elements of one-dimensional arrays can be tags"),
    ("Types.ByteString", "a ByteString is no measured value"),
    ("Types.DateTime", "a DateTime is no measured value"),
    ("Types.Guid", "a Guid is no measured value"),
];

/// Runs the command `points` against a server at a port; `settings` are added to the URL.
pub(crate) fn points(port: u16, settings: &Value, arguments: &[&str]) -> CommandRun {
    let mut all = json!({"url": format!("opc.tcp://127.0.0.1:{port}/test")});
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let settings: Settings = serde_json::from_value(all).unwrap();
    let plugin = OpcUa::create(settings, host()).unwrap();
    run_command(&plugin, "points", arguments, b"", (1, usize::MAX)).unwrap()
}

pub(crate) fn list(run: &CommandRun) -> &str {
    std::str::from_utf8(&run.output).unwrap()
}

/// Checks that there is no list, with this exit code and for this reason.
#[track_caller]
pub(crate) fn check_refused(run: &CommandRun, exit_code: u32, words: &str) {
    assert_eq!((run.exit_code, list(run)), (Some(exit_code), ""), "{:?}", run.diagnostics);
    let said = run.diagnostics.iter().any(|(_, message)| message.contains(words));
    assert!(said, "{words}: {:?}", run.diagnostics);
}

#[test]
fn everything_that_can_be_a_tag_is_listed_and_the_rest_is_named() {
    let Some(peer) = peer::start(&json!({"space": {}})) else { return };
    let run = points(peer.port, &json!({}), &[]);
    assert_eq!((run.exit_code, list(&run)), (Some(0), LIST), "{:?}", run.diagnostics);
    let mut said = run.diagnostics.iter().map(|(_, message)| message.as_str());
    assert_eq!(said.next(), Some("tags: 28; variables that cannot be tags: 5"));
    for ((path, reason), said) in REFUSED.iter().zip(said.by_ref()) {
        let wanted = format!("no tag: Station.{path}: {reason}");
        assert!(said.starts_with(&wanted), "{wanted}: {said}");
    }
    assert_eq!(said.next(), None);
}

#[test]
fn a_server_with_narrow_limits_gives_the_same_list() {
    let limits = [
        json!({"nodes": 3, "references": 2, "points": 1, "reads": 2}),
        json!({"references": 1, "points": 1}),
        json!({"nodes": 1, "references": 5, "reads": 3}),
    ];
    for limits in limits {
        let Some(peer) = peer::start(&json!({"space": limits})) else { return };
        let run = points(peer.port, &json!({}), &[]);
        assert_eq!((run.exit_code, list(&run)), (Some(0), LIST), "{limits}: {:?}", run.diagnostics);
    }
}

#[test]
fn browsing_begins_at_the_nodes_that_are_named() {
    let Some(peer) = peer::start(&json!({"space": {}})) else { return };
    let at = |nodes: &[&str]| points(peer.port, &json!({}), nodes);
    let run = at(&["nsu=urn:busbar:test;s=Types"]);
    assert_eq!(list(&run).lines().count(), 15, "{}", list(&run));
    assert_eq!(list(&run).lines().nth(1).unwrap().split(',').next(), Some("Boolean"));
    // By index too, and several together.
    let run = at(&["ns=2;s=Types", "ns=2;s=Bay"]);
    assert!(
        list(&run).contains("\nVoltage,") && list(&run).contains("\nBoolean,"),
        "{}",
        list(&run)
    );
    // Of the standard's nodes, where they are asked for.
    let run = at(&["i=2253"]);
    assert!(list(&run).contains("ServerStatus.State,"), "{}", list(&run));
    check_refused(&at(&["Station"]), abi::BUSBAR_EXIT_CODE_USAGE, "'Station' is no node id");
    check_refused(&at(&["ns=2;s=None"]), abi::BUSBAR_EXIT_CODE_INPUT, "browsing: BadNodeIdInvalid");
    let nowhere = at(&["nsu=urn:other;s=Station"]);
    check_refused(&nowhere, abi::BUSBAR_EXIT_CODE_INPUT, "no namespace of nsu=urn:other;s=Station");
    let guid = at(&["ns=2;s=Station.Types.Guid"]);
    check_refused(&guid, abi::BUSBAR_EXIT_CODE_INPUT, "no variable was found that can be a tag");
}

#[test]
fn what_is_too_deep_is_left_out_and_told() {
    let Some(peer) = peer::start(&json!({"depth": 40})) else { return };
    let run = points(peer.port, &json!({}), &[]);
    let deepest = list(&run)
        .lines()
        .map(|line| line.matches(".V,").count() * line.matches('.').count())
        .max();
    assert_eq!((run.exit_code, deepest), (Some(0), Some(31)), "{:?}", run.diagnostics);
    let told = "what is deeper than 32 levels is left out: name nodes further down to begin at";
    assert!(run.diagnostics.iter().any(|(_, said)| said == told), "{:?}", run.diagnostics);
}

#[test]
fn a_server_that_freezes_is_given_up_in_time() {
    for freeze_after in [0, 2] {
        let Some(peer) = peer::start(&json!({"space": {"freeze_after": freeze_after}})) else {
            return;
        };
        let begun = Instant::now();
        let run = points(peer.port, &json!({"silence_seconds": 0.7}), &[]);
        check_refused(&run, abi::BUSBAR_EXIT_CODE_INPUT, "the server was silent for 700 ms");
        assert!(begun.elapsed() < PATIENCE, "{:?}", begun.elapsed());
    }
}

#[test]
fn each_server_that_cannot_be_asked_is_named_and_the_next_one_is() {
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let run = points(port, &json!({}), &[]);
    check_refused(&run, abi::BUSBAR_EXIT_CODE_INPUT, "connection refused");
    let Some(peer) = peer::start(&json!({"space": {}})) else { return };
    let other = format!("opc.tcp://127.0.0.1:{}/test", peer.port);
    let run = points(port, &json!({"redundancy": [other]}), &[]);
    assert_eq!((run.exit_code, list(&run)), (Some(0), LIST));
}

#[test]
fn a_host_that_asks_to_stop_is_obeyed_and_the_session_closed() {
    let Some(mut peer) = peer::start(&json!({"space": {}})) else { return };
    let url = format!("opc.tcp://127.0.0.1:{}/test", peer.port);
    let settings: Settings = serde_json::from_value(json!({"url": url})).unwrap();
    let plugin = OpcUa::create(settings, host()).unwrap();
    let stopped = run_command(&plugin, "points", &[], b"", (1, 0)).unwrap_err();
    assert_eq!(stopped.message(), "cancelled");
    let begun = Instant::now();
    while peer.ask(&json!({"sessions": true})) != "0" {
        assert!(begun.elapsed() < PATIENCE, "the session stays");
    }
}
