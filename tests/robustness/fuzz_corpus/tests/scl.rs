//! Fuzzing of SCL files (IEC 61850-6): any text is a list of points or a named fault without a
//! panic. Each row has five cells and a kind that tags have.

use busbar_plugin_sdk::Plugin;
use busbar_plugin_sdk::testing::{host, run_command};
use iec61850::Iec61850;
use serde_json::json;

const KINDS: [&str; 4] = ["bool", "double_point", "f64", "i64"];
/// Size of the pieces that the command reads and writes, bytes.
const PIECE: usize = 4096;
const CONSTRAINTS: [&str; 2] = ["ST", "MX"];

/// Runs one input, the text of a file.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let settings = serde_json::from_value(json!({})).expect("no setting is needed");
    let plugin = Iec61850::create(settings, host()).expect("no server is needed");
    let run = run_command(&plugin, "scl", &["all"], bytes, (PIECE, usize::MAX));
    let run = run.expect("whatever is wrong with the text is a diagnostic");
    if run.exit_code != Some(0) {
        assert!(run.output.is_empty() && !run.diagnostics.is_empty());
        return false;
    }
    let mut reader = csv::Reader::from_reader(run.output.as_slice());
    for row in reader.records() {
        let row = row.expect("the list is CSV in UTF-8");
        assert_eq!((row.len(), &row[0]), (5, &row[3]));
        assert!(KINDS.contains(&&row[1]) && CONSTRAINTS.contains(&&row[4]), "{row:?}");
    }
    true
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("scl", fuzz_one);
}
