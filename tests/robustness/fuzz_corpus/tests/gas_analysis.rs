//! Fuzzing of gas analyses: any bytes are a table of samples or diagnostics with their lines.
//! Results are CSV with a row for each sample, whose cells are names of zones and finite numbers.

use busbar_plugin_sdk::Plugin;
use busbar_plugin_sdk::testing::{host, run_command};
use gas_analysis::{GasAnalysis, Settings};

/// Columns of the results that are numbers, from the end.
const NUMBERS: std::ops::Range<usize> = 1..3;
/// Number of columns of the results.
const RESULTS: usize = 15;

/// Runs one input; reports whether the table is accepted.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let plugin = GasAnalysis::create(Settings::default(), host()).expect("it is made");
    // The length of the input chooses how it comes.
    let pieces = (1 + bytes.len() % 97, usize::MAX);
    let run = run_command(&plugin, "dga", &[], bytes, pieces).expect("it does not fail");
    let lines = bytes.iter().filter(|&&byte| byte == b'\n').count() as u64 + 1;
    for (line, text) in &run.diagnostics {
        assert!(*line <= lines && !text.is_empty(), "{line}: {text}");
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(&run.output[..]);
    let mut rows = 0;
    for row in reader.records() {
        // All rows are as long as the header, or this is an error.
        let row = row.expect("results are CSV");
        rows += 1;
        if rows == 1 {
            continue;
        }
        let cells: Vec<_> = row.iter().collect();
        let results = &cells[cells.len() - RESULTS..];
        assert!(results.iter().all(|cell| !cell.is_empty()), "{results:?}");
        for number in NUMBERS.map(|back| results[RESULTS - 1 - back]) {
            let is_finite = number.parse().is_ok_and(|value: f64| value.is_finite());
            assert!(number == "NA" || is_finite, "{number}");
        }
    }
    assert_eq!(run.exit_code == Some(0), rows > 1, "{run:?}");
    rows > 1
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("gas_analysis", fuzz_one);
}
