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

/// A file that claims four thousand million instances takes no memory for them.
#[test]
fn instances_are_not_counted_out() {
    let many = FILE.replace("max=\"1\"", "max=\"4294967295\"");
    let run = run(&many, &[]);
    assert_eq!(run.exit_code, Some(0));
    let block = "IED1LD0/LLN0.BR.brcbA01, the first of 4294967295: data set dsWhole";
    assert!(says(&run, block), "{:?}", run.diagnostics);
}

/// Short files that would become more than memory holds.
#[test]
fn types_that_multiply_are_refused() {
    let phases = "<SDO name=\"phsC\" type=\"CMV_1\"/>";
    let within = FILE.replace(phases, "<SDO name=\"phsC\" type=\"WYE_1\"/>");
    assert!(says(&run(&within, &[]), "DOType 'WYE_1' is within itself"));
    let types: String = (0..20)
        .map(|n| {
            let below: String =
                (0..10).map(|i| format!("<SDO name=\"s{i}\" type=\"T{}\"/>", n + 1)).collect();
            format!("<DOType id=\"T{n}\" cdc=\"WYE\">{below}</DOType>")
        })
        .collect();
    let many = FILE
        .replace(phases, "<SDO name=\"phsC\" type=\"T0\"/>")
        .replace("<DataTypeTemplates>", &format!("<DataTypeTemplates>{types}"));
    assert!(says(&run(&many, &[]), "at most 2000000 are read"));
    let deep: String = (0..100)
        .map(|n| {
            format!(
                "<DAType id=\"D{n}\"><BDA name=\"f\" bType=\"Struct\" type=\"D{}\"/></DAType>",
                n + 1
            )
        })
        .collect();
    let deep = FILE
        .replace("type=\"AnalogueValue\"", "type=\"D0\"")
        .replace("<DataTypeTemplates>", &format!("<DataTypeTemplates>{deep}"));
    assert!(says(&run(&deep, &[]), "types are more than 24 levels deep"));
}

#[test]
fn a_plugin_without_a_server_serves_no_tags() {
    let settings = serde_json::from_value(serde_json::json!({})).unwrap();
    let plugin = Iec61850::create(settings, host()).unwrap();
    let fault = plugin.check(&[]).unwrap_err();
    assert!(fault.message().contains("host: give a name"), "{}", fault.message());
}
