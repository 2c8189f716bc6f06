use busbar_plugin_sdk::testing::{CommandRun, host, run_command};
use busbar_plugin_sdk::{Plugin, Telemetry};

use crate::Iec61850;

const FILE: &str = include_str!("../../../../tests/end_to_end/peers/iec61850_ied.cid");

fn run(text: &str, arguments: &[&str]) -> CommandRun {
    run_bytes(text.as_bytes(), arguments)
}

fn run_bytes(bytes: &[u8], arguments: &[&str]) -> CommandRun {
    let settings = serde_json::from_value(serde_json::json!({})).unwrap();
    let plugin = Iec61850::create(settings, host()).unwrap();
    run_command(&plugin, "scl", arguments, bytes, (1000, usize::MAX)).unwrap()
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
fn texts_are_listed() {
    for text in ["VisString255", "VisString129", "Unicode255"] {
        let status = "name=\"stVal\" fc=\"ST\" bType=\"INT32\"";
        assert!(FILE.contains(status));
        let file = FILE.replace(status, &format!("name=\"stVal\" fc=\"ST\" bType=\"{text}\""));
        let run = run(&file, &["all"]);
        assert!(output(&run).contains("IED1LD0/GGIO1.IntIn1,text,,"), "{text}: {}", output(&run));
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

/// The same file in every encoding gives the same list; its own words are UTF-8 there.
#[test]
fn files_of_any_encoding_give_the_same_list() {
    let words = [
        ("windows-1251", encoding_rs::WINDOWS_1251, "\u{412}\u{442}"),
        ("windows-1252", encoding_rs::WINDOWS_1252, "\u{b0}C"),
        ("GB18030", encoding_rs::GB18030, "\u{74e6}"),
        ("UTF-8", encoding_rs::UTF_8, "\u{2103}"),
    ];
    for (label, encoding, unit) in words {
        let text = FILE
            .replace("encoding=\"UTF-8\"", &format!("encoding=\"{label}\""))
            .replace("<Val>W</Val>", &format!("<Val>{unit}</Val>"))
            .replace("manufacturer=\"libiec61850\"", &format!("desc=\"{unit}\""));
        let run = run_bytes(&encoding.encode(&text).0, &["IED1"]);
        let row = format!("IED1LD0/MMXU1.TotW,f64,M{unit},IED1LD0/MMXU1.TotW,MX\n");
        assert!(output(&run).contains(&row), "{label}: {} {:?}", output(&run), run.diagnostics);
        assert_eq!(output(&run).lines().count(), 7, "{label}");
        // By its mark, whatever it declares.
        let wide: Vec<u8> = std::iter::once(0xFEFF)
            .chain(text.encode_utf16())
            .flat_map(|unit: u16| unit.to_le_bytes())
            .collect();
        assert_eq!(output(&run_bytes(&wide, &["IED1"])), output(&run), "UTF-16 for {label}");
    }
}

#[test]
fn characters_that_cannot_be_read_are_told_and_shown_in_no_address() {
    let text = FILE.replace("manufacturer=\"libiec61850\"", "desc=\"\u{d6}l\"");
    let bytes = encoding_rs::WINDOWS_1252.encode(&text.replace("UTF-8", "utf-8")).0.into_owned();
    let told = "line 5: it has bytes that are no UTF-8";
    // What nobody sees keeps nobody from the list.
    let of_bytes = run_bytes(&bytes, &["IED1"]);
    assert!(says(&of_bytes, told) && output(&of_bytes).lines().count() == 7);
    // A name that nobody can read is no address.
    let text = text
        .replace("inst=\"LD0\"", "inst=\"L\u{e9}\"")
        .replace("ldInst=\"LD0\"", "ldInst=\"L\u{e9}\"");
    let of_names = run_bytes(&encoding_rs::WINDOWS_1252.encode(&text).0, &["IED1", "all"]);
    assert!(
        says(&of_names, told) && says(&of_names, "unreadable names"),
        "{:?}",
        of_names.diagnostics
    );
    assert!(of_names.output.is_empty() && of_names.exit_code != Some(0));
    let unknown = FILE.replace("encoding=\"UTF-8\"", "encoding=\"x-martian\"");
    assert!(says(&run(&unknown, &[]), "declares the encoding 'x-martian', which is not known"));
}
