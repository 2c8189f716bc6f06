use busbar_plugin_sdk::testing::{CommandRun, host, run_command};
use proptest::prelude::*;

use super::*;
use crate::lines::MAX_LINE_BYTES;
use crate::report::RESULTS;
use crate::settings::{Age, Equipment};

const HEADER: &str = "H2,CH4,C2H6,C2H4,C2H2";

fn plugin() -> GasAnalysis {
    GasAnalysis::create(Settings::default(), host()).unwrap()
}

fn run_pieces(input: &[u8], piece: usize) -> CommandRun {
    run_command(&plugin(), "dga", &[], input, (piece, usize::MAX)).unwrap()
}

fn run(input: impl AsRef<[u8]>) -> CommandRun {
    run_pieces(input.as_ref(), 1000)
}

/// Rows of results as cells, the header first.
fn rows(run: &CommandRun) -> Vec<Vec<String>> {
    let text = std::str::from_utf8(&run.output).unwrap();
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
    reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect()
}

/// The only diagnostic, and that nothing was done.
#[track_caller]
fn refused(input: impl AsRef<[u8]>, expected: &str) {
    let run = run(input);
    assert_eq!(run.exit_code, Some(1), "{run:?}");
    let last = run.diagnostics.last().unwrap();
    assert!(last.1.contains(expected), "{last:?}");
}

/// Checks the diagnostic of a row between two good ones, which are analysed.
#[track_caller]
fn bad_row(row: impl AsRef<[u8]>, expected: &str) {
    let mut input = format!("{HEADER}\n1,2,3,4,5\n").into_bytes();
    input.extend_from_slice(row.as_ref());
    input.extend_from_slice(b"\n5,4,3,2,1\n");
    let run = run(input);
    assert_eq!((run.exit_code, rows(&run).len()), (Some(0), 3), "{run:?}");
    let [fault, sums] = run.diagnostics.as_slice() else { panic!("{:?}", run.diagnostics) };
    assert!(fault.0 == 3 && fault.1.contains(expected), "{fault:?}");
    assert_eq!(*sums, (0, "2 samples analysed, 1 rows left out".to_owned()));
}

#[test]
fn the_published_example_of_the_pentagon() {
    let run = run(format!("{HEADER}\n31,192,130,31,0\n"));
    assert_eq!((run.exit_code, run.diagnostics.len()), (Some(0), 0));
    let rows = rows(&run);
    assert_eq!(rows[0][..5], ["H2", "CH4", "C2H6", "C2H4", "C2H2"]);
    assert_eq!(rows[0][5..], RESULTS);
    let expected = [
        "31",
        "192",
        "130",
        "31",
        "0",
        "T1",
        "ND",
        "NF",
        "T1",
        "T1",
        "T1",
        "O",
        "S",
        "true",
        "false",
        "T1",
        "O",
        "-17.301389",
        "-9.095805",
        "NA",
    ];
    assert_eq!(rows[1], expected);
}

#[test]
fn columns_come_in_any_order_and_case() {
    let run = run("Time,c2h2,o2,CH4,h2,C2H4,co,c2h6,N2,EQUIPMENT\n\
                   2026-01-01,5,900,40,30,20,100,10,5000,\"=S1T1, \"\"A\"\"\"\n");
    assert_eq!((run.exit_code, run.diagnostics.len()), (Some(0), 0), "{:?}", run.diagnostics);
    let rows = rows(&run);
    let gases = ["H2", "CH4", "C2H6", "C2H4", "C2H2", "CO", "O2", "N2"];
    assert_eq!(rows[0][..2], ["equipment", "time"]);
    assert_eq!(rows[0][2..10], gases);
    assert_eq!(rows[1][..2], ["=S1T1, \"A\"", "2026-01-01"]);
    assert_eq!(rows[1][2..10], ["30", "40", "10", "20", "5", "100", "900", "5000"]);
    assert_eq!(rows[1].last().unwrap(), "3");
}

#[test]
fn marks_ends_and_blanks_of_files_are_borne() {
    let plain = run(format!("{HEADER}\n1,2,3,4,5\n6,7,8,9,10\n"));
    for input in [
        format!("\u{feff}{HEADER}\r\n1,2,3,4,5\r\n\r\n6,7,8,9,10\r\n"),
        format!("\n  \n{HEADER}\n\"1\", 2 ,3,4,5\n\n6,7,8,9,10"),
    ] {
        for piece in [1, 3, 7, 100_000] {
            assert_eq!(run_pieces(input.as_bytes(), piece), plain);
        }
    }
}

#[test]
fn absent_gases_and_limits_of_detection() {
    let run = run(format!("{HEADER}\n100,,5,5,5\n100,10,5,<0.5,< 1\n,,,,0\n"));
    assert_eq!(run.exit_code, Some(0));
    assert!(run.diagnostics.is_empty(), "{:?}", run.diagnostics);
    let rows = rows(&run);
    // CH4 is absent, and triangle 1 needs it.
    assert_eq!(rows[1][5..9], ["NA", "NA", "NA", "NA"]);
    assert_eq!(rows[1][10], "NA");
    // Below the limits there is nothing: CH4 alone is left in triangle 1.
    assert_eq!((rows[2][3].as_str(), rows[2][10].as_str()), ("<0.5", "PD"));
    assert_eq!(rows[3][15..], ["NA", "NA", "NA", "NA", "NA"]);
}

#[test]
fn bad_rows_are_told_and_left_out() {
    bad_row("1,2,x,4,5", "C2H6: 'x' is no number");
    bad_row("1,2,3,4", "4 cells, where the header has 5");
    bad_row("1,2,3,4,5,6", "6 cells");
    bad_row("1,-2,3,4,5", "CH4: -2 ppm is negative");
    bad_row("1,2,3,1e300,5", "C2H4: 1");
    bad_row("1,2,3,1e300,5", "more than oil can hold");
    bad_row("1,2,3,4,1e999", "C2H2: a concentration is a finite number");
    bad_row("NaN,2,3,4,5", "H2: a concentration is a finite number");
    bad_row("1,\"2,5\",3,4,5", "CH4: '2,5' has a decimal comma; write 2.5");
    bad_row(",,,,", "none of H2, CH4, C2H6, C2H4 and C2H2 is given");
    bad_row("1,2,3,4,\"5", "a quote is not closed");
    bad_row("1,2,3,4,<", "C2H2: '<' is no number");
    bad_row("1,2,3,4,<-1", "C2H2: -1 ppm is negative");
    bad_row(b"1,2,3,4,\xE9", "byte 9 of the row is not UTF-8");
    bad_row(b"1,2,3,4,\x00", "a byte 0");
    bad_row("1,2,3,4,".to_owned() + &"5".repeat(MAX_LINE_BYTES), "more than 65536 bytes");
    bad_row(",".repeat(300), "more than 256 cells");
}

#[test]
fn tables_in_utf_16_are_read_by_their_mark() {
    let table = format!("{HEADER},equipment\r\n1,2,3,4,5,Ä\r\n\r\n5,4,3,2,1,\"a,b\"\r\n");
    let expected = run(&table);
    assert_eq!(rows(&expected).len(), 3);
    let little = table.encode_utf16().flat_map(u16::to_le_bytes);
    let big = table.encode_utf16().flat_map(u16::to_be_bytes);
    let encoded = [
        b"\xFF\xFE".iter().copied().chain(little).collect::<Vec<u8>>(),
        b"\xFE\xFF".iter().copied().chain(big).collect(),
        b"\xEF\xBB\xBF".iter().copied().chain(table.bytes()).collect(),
    ];
    for encoded in encoded {
        for piece in [1, 1000] {
            assert_eq!(run_pieces(&encoded, piece).output, expected.output);
        }
    }
}

#[test]
fn files_that_are_no_tables_are_refused() {
    refused("", "the file is empty");
    refused("\n\n", "the file is empty");
    refused(HEADER, "there is no row below the header");
    refused(format!("{HEADER}\nx,1,2,3,4\n"), "none of 1 rows is a sample");
    refused("H2,CH4\n1,2\n", "the header lacks C2H6, C2H4, C2H2");
    refused("H2;CH4;C2H6;C2H4;C2H2\n1;2;3;4;5\n", "separated by semicolons");
    refused("H2\tCH4\tC2H6\tC2H4\tC2H2\n", "separated by tabs");
    refused("H2,CH4,C2H6,C2H4,C2H2,h2\n", "column H2 is there twice");
    refused("H2,CH4,C2H6,C2H4,C2H2,Time,TIME\n", "column time is there twice");
    refused(b"\xFF\xFEH\x002\x00\n\x00", "the header lacks CH4");
    refused(b"\x89PNG\r\n\x1a\n\x00\x00", "not UTF-8");
    refused("x".repeat(10 * MAX_LINE_BYTES), "more than 65536 bytes");
}

#[test]
fn columns_without_use_are_named() {
    let run = run(format!("{HEADER},lab,\n1,2,3,4,5,X,\n"));
    assert_eq!(run.diagnostics, [(1, "columns not used: 'lab', ''".to_owned())]);
    assert_eq!(rows(&run).len(), 2);
}

#[test]
fn settings_choose_limits() {
    let settings = Settings {
        age: Age::UpTo9,
        equipment: Equipment::InstrumentTransformer,
        ..Settings::default()
    };
    let plugin = GasAnalysis::create(settings, host()).unwrap();
    // CH4/H2 0.15; CH4 above the limit of young transformers alone.
    let input = format!("{HEADER},O2,N2\n400,60,100,1,0,100,5000\n");
    let run = run_command(&plugin, "dga", &[], input.as_bytes(), (1000, usize::MAX)).unwrap();
    assert_eq!(rows(&run)[1][7], "PD");
    let young = format!("{HEADER},O2,N2\n10,60,5,1,0,100,5000\n");
    let status = |plugin| {
        let run = run_command(plugin, "dga", &[], young.as_bytes(), (1000, usize::MAX)).unwrap();
        rows(&run)[1].last().unwrap().clone()
    };
    assert_eq!((status(&plugin).as_str(), status(&self::plugin()).as_str()), ("2", "1"));
}

#[test]
fn probabilities_are_told_where_they_are_asked_for() {
    let of =
        |uncertainty| GasAnalysis::create(Settings { uncertainty, ..Settings::default() }, host());
    for wrong in [-0.1, 1.0, f64::NAN] {
        assert!(of(Some(wrong)).is_err());
    }
    // Methane 98 %: half of what it may be is below. The second is certain.
    let input = format!("{HEADER}\n1,98,1,1,1\n1,10,1,1,50\n");
    let run = run_command(&of(Some(0.15)).unwrap(), "dga", &[], input.as_bytes(), (99, 99));
    let rows = rows(&run.unwrap());
    let at = rows[0].iter().position(|name| name == "tri1_p").unwrap();
    assert_eq!(rows[0].len(), 5 + RESULTS.len() + odds::COLUMNS.len());
    let (zones, odds): (Vec<_>, Vec<f64>) = rows[1][at]
        .split(';')
        .map(|part| part.split_once('=').unwrap())
        .map(|(zone, odds)| (zone, odds.parse::<f64>().unwrap()))
        .unzip();
    assert!(zones.contains(&"PD") && zones.contains(&"T1"), "{zones:?}");
    assert!((odds.iter().sum::<f64>() - 1.0).abs() < 1e-3 && odds.is_sorted_by(|a, b| a >= b));
    assert!((odds[0] - 0.5).abs() < 0.05, "{odds:?}");
    assert_eq!(rows[2][at], "D1=1.0000");
}

#[test]
fn histories_are_told_where_they_are_asked_for() {
    let plugin = GasAnalysis::create(Settings { history: true, ..Settings::default() }, host());
    let plugin = plugin.unwrap();
    let run =
        |input: &str| run_command(&plugin, "dga", &[], input.as_bytes(), (99, usize::MAX)).unwrap();
    let input = "equipment,time,H2,CH4,C2H6,C2H4,C2H2,O2,N2\n\
                 A,2025-01-01,10,1,1,1,0,100,50000\n\
                 B,2025-01-01,10,1,1,1,0,100,50000\n\
                 A,2025-04-01,25,1,1,1,0,100,50000\n\
                 A,2025-03-01,30,1,1,1,0,100,50000\n\
                 B,2025-04-01,51,1,1,1,0,100,50000\n\
                 A,2025-07-02,40,1,1,1,0,100,50000\n";
    let run_of_input = run(input);
    let rows = rows(&run_of_input);
    let at = rows[0].iter().position(|name| name == "c57_status_history").unwrap();
    assert_eq!(rows[0].len(), at + history::COLUMNS.len());
    let status: Vec<_> = rows[1..].iter().map(|row| row[at].as_str()).collect();
    // B has jumped by more than 40 ppm; A grows by more than 50 ppm a year.
    assert_eq!(status, ["1", "1", "1", "2", "3"]);
    assert!(rows[5][at + 1].starts_with("60.") && rows[5][at + 2] == "0.000", "{:?}", rows[5]);
    assert_eq!((rows[4][at + 1].as_str(), rows[5][at - 1].as_str()), ("NA", "1"));
    let fault = &run_of_input.diagnostics[0];
    assert!(fault.0 == 5 && fault.1.contains("is not after the sample before of 'A'"), "{fault:?}");
    let without = run(&format!("{HEADER}\n1,2,3,4,5\n"));
    assert_eq!(without.exit_code, Some(1));
    assert!(without.diagnostics[0].1.contains("needs columns equipment and time"));
}

#[test]
fn it_stops_where_the_host_wants_it() {
    let input = HEADER.to_owned() + "\n" + &"1,2,3,4,5\n".repeat(100_000);
    let stopped = run_command(&plugin(), "dga", &[], input.as_bytes(), (1 << 16, 2));
    assert!(stopped.unwrap_err().message().contains("cancelled"));
    let unknown = run_command(&plugin(), "other", &[], b"", (1, 1)).unwrap_err();
    assert!(unknown.message().contains("there is no command 'other'"), "{unknown}");
    let argument = run_command(&plugin(), "dga", &["-x"], b"", (1, 1)).unwrap();
    assert_eq!(argument.exit_code, Some(2));
}

proptest! {
    #[test]
    fn whatever_comes_is_answered(
        bytes in prop::collection::vec(
            prop_oneof![5 => any::<u8>(), 5 => prop::sample::select(&b",\"\n<.;-0129eE"[..])], 0..400),
        with_header in any::<bool>(),
        piece in 1..50_usize,
    ) {
        let mut input = if with_header { format!("{HEADER}\n").into_bytes() } else { Vec::new() };
        input.extend(bytes);
        let run = run_pieces(&input, piece);
        prop_assert!(matches!(run.exit_code, Some(0 | 1)));
        prop_assert_eq!(run.exit_code == Some(0), rows(&run).len() > 1);
        let width = rows(&run).first().map_or(0, Vec::len);
        prop_assert!(rows(&run).iter().all(|row| row.len() == width));
        prop_assert!(run.diagnostics.iter().all(|(_, text)| !text.is_empty()));
    }
}
