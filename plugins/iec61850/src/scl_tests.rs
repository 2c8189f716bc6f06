use busbar_plugin_sdk::testing::{CommandRun, host, run_command};
use busbar_plugin_sdk::{Plugin, Telemetry};

use crate::Iec61850;

const FILE: &str = include_str!("../../../tests/peers/iec61850_ied.cid");

fn run(text: &str, arguments: &[&str]) -> CommandRun {
    let settings = serde_json::from_value(serde_json::json!({})).unwrap();
    let plugin = Iec61850::create(settings, host()).unwrap();
    run_command(&plugin, "scl", arguments, text.as_bytes(), (1000, usize::MAX)).unwrap()
}

fn output(run: &CommandRun) -> &str {
    std::str::from_utf8(&run.output).unwrap()
}

fn says(run: &CommandRun, words: &str) -> bool {
    run.diagnostics.iter().any(|(_, message)| message.contains(words))
}

#[test]
fn what_reports_have_is_listed() {
    let run = run(FILE, &["IED1"]);
    assert_eq!(
        output(&run),
        "tag,type,unit,address.reference,address.fc\n\
         IED1LD0/GGIO1.Ind1,bool,,IED1LD0/GGIO1.Ind1,ST\n\
         IED1LD0/MMXU1.PhV.phsA,f64,,IED1LD0/MMXU1.PhV.phsA,MX\n\
         IED1LD0/MMXU1.PhV.phsB,f64,,IED1LD0/MMXU1.PhV.phsB,MX\n\
         IED1LD0/MMXU1.PhV.phsC,f64,,IED1LD0/MMXU1.PhV.phsC,MX\n\
         IED1LD0/MMXU1.TotW,f64,MW,IED1LD0/MMXU1.TotW,MX\n\
         IED1LD0/XCBR1.Pos,double_point,,IED1LD0/XCBR1.Pos,ST\n"
    );
    let block = "report control block IED1LD0/LLN0.BR.brcbA01: data set dsWhole";
    assert!(says(&run, block), "{:?}", run.diagnostics);
}

#[test]
fn all_is_listed_where_it_is_asked_for() {
    let run = run(FILE, &["all"]);
    for row in ["IED1LD0/GGIO1.IntIn1,i64,,", "IED1LD0/XCBR1.OpCnt,i64,,", "IED1LD0/LLN0.Mod,i64"] {
        assert!(output(&run).contains(row), "{row}: {}", output(&run));
    }
}

#[test]
fn faults_are_named() {
    for (text, arguments, words) in [
        ("<SCL", &[][..], "it is no SCL file"),
        ("", &[], "it is no SCL file"),
        (FILE, &["IED9"], "it has no IED 'IED9', but IED1"),
        (FILE, &["IED1", "IED2"], "busbar scl FILE"),
        ("<SCL xmlns=\"http://www.iec.ch/61850/2003/SCL\"/>", &[], ""),
    ] {
        let run = run(text, arguments);
        assert_ne!(run.exit_code, Some(0), "{words}");
        assert!(run.output.is_empty() && says(&run, words), "{words}: {:?}", run.diagnostics);
    }
}

/// A type that has itself is an engineering fault, and none that a list never ends of.
#[test]
fn types_within_themselves_end() {
    let looped =
        FILE.replace("<SDO name=\"phsC\" type=\"CMV_1\"/>", "<SDO name=\"phsC\" type=\"WYE_1\"/>");
    let run = run(&looped, &["all"]);
    assert!(output(&run).lines().count() < 1000, "{}", output(&run).len());
}

#[test]
fn a_plugin_without_a_server_serves_no_tags() {
    let settings = serde_json::from_value(serde_json::json!({})).unwrap();
    let plugin = Iec61850::create(settings, host()).unwrap();
    let fault = plugin.check(&[]).unwrap_err();
    assert!(fault.message().contains("host: give a name"), "{}", fault.message());
}
