//! `busbar dga`, and commands of plugins in general.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use busbar_plugin_host::{CommandExit, LoadRules};
use busbar_plugin_process::{CommandError, Isolation, PluginCatalog, PluginOptions};
use e2e::{Output, built, built_folder, busbar, finish};
use serde_json::json;

const HEADER: &str = "H2,CH4,C2H6,C2H4,C2H2";
/// Number of rows of the large file: enough that a copy of it, or of its results, would show.
const MANY: u32 = 600_000;
/// Greatest peak memory of any of the processes, bytes. Programs and libraries with all their
/// checks take some 60 MB by themselves.
const MAX_PEAK_BYTES: u64 = 120 << 20;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder can be made"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("it can be written");
        path
    }

    /// Creates a plugin directory with this one library.
    fn plugins(&self, plugin: &str) -> PathBuf {
        let name = format!("lib{plugin}.{}", std::env::consts::DLL_EXTENSION);
        let folder = self.path("plugins");
        fs::create_dir_all(&folder).expect("it can be made");
        fs::copy(built(built_folder().join(&name)), folder.join(&name)).expect("it can be copied");
        folder
    }
}

/// Returns the command `busbar NAME FILE`, with the plugins of this folder.
fn offered(name: &str, file: &Path, plugins: &Path) -> Command {
    let mut command = busbar();
    command.arg(name).arg(file).arg("--plugin-directory").arg(plugins);
    command
}

fn dga(folder: &Folder, file: &Path) -> Command {
    offered("dga", file, &folder.plugins("gas_analysis"))
}

#[track_caller]
fn refused(command: &mut Command, code: i32, words: &[&str]) -> Output {
    let output = finish(command).expect_code(code);
    for word in words {
        assert!(output.stderr.contains(word), "no '{word}' in:\n{}", output.stderr);
    }
    output
}

#[test]
fn samples_of_a_file_are_analysed_and_bad_rows_told() {
    let folder = Folder::new();
    let text = "\u{feff}time,h2,CH4,C2H6,C2H4,C2H2,equipment\r\n\
                2026-01-01,31,192,130,31,0,\"=S1T1, oil\"\r\n\
                2026-01-02,x,192,130,31,0,=S1T1\r\n\
                2026-01-03,60,10,4,4,4,=S1T2\r\n\
                2026-01-04,-1,10,4,4,4,=S1T2\r\n";
    let (file, out) = (folder.file("samples.csv", text), folder.path("results.csv"));
    let output = finish(dga(&folder, &file).arg("--out").arg(&out)).expect_code(0);
    assert_eq!(output.stdout, "");
    let place = file.display();
    for line in [
        format!("{place}:3: H2: 'x' is no number"),
        format!("{place}:5: H2: -1 ppm is negative"),
        format!("{place}: 2 samples analysed, 2 rows left out"),
    ] {
        assert!(output.stderr.contains(&line), "{line}\n{}", output.stderr);
    }
    let expected = "equipment,time,H2,CH4,C2H6,C2H4,C2H2,iec,rogers,doernenburg,keygas,dlt722,\
                    tri1,tri4,tri5,tri4_applicable,tri5_applicable,pent1,pent2,pent_x,pent_y,\
                    c57_status\n\
                    \"=S1T1, oil\",2026-01-01,31,192,130,31,0,T1,ND,NF,T1,T1,T1,O,S,true,false,\
                    T1,O,-17.301389,-9.095805,NA\n\
                    =S1T2,2026-01-03,60,10,4,4,4,ND,ND,NF,PD,D2,D1,S,C,false,false,";
    let results = fs::read_to_string(&out).expect("it was written");
    assert!(results.starts_with(expected), "{results}");
    assert_eq!(results.lines().count(), 3);
    // The same to stdout.
    let output = finish(&mut dga(&folder, &file)).expect_code(0);
    assert_eq!(output.stdout, results);
}

#[test]
fn settings_add_columns() {
    let folder = Folder::new();
    let text =
        format!("equipment,time,{HEADER}\nA,2026-01-01,1,98,1,1,1\nA,2026-02-01,1,98,1,1,2\n");
    let file = folder.file("samples.csv", text);
    let mut command = dga(&folder, &file);
    let output = finish(command.args(["--set", "history=true", "--set", "uncertainty=0.15"]));
    let output = output.expect_code(0);
    let header = output.stdout.lines().next().expect("there is a header");
    let added = "c57_status,c57_status_history,h2_rate,ch4_rate,c2h6_rate,c2h4_rate,c2h2_rate,\
                 co_rate,co2_rate,iec_p,rogers_p,doernenburg_p,keygas_p,dlt722_p,tri1_p,tri4_p,\
                 tri5_p,pent1_p,pent2_p";
    assert!(header.ends_with(added), "{header}");
    assert!(
        output.stdout.contains("PD=0.") && output.stdout.contains("T1=0."),
        "{}",
        output.stdout
    );
}

#[test]
fn what_cannot_be_analysed_is_refused_and_nothing_written() {
    let folder = Folder::new();
    let out = folder.path("results.csv");
    for (name, text, words) in [
        ("empty.csv", String::new(), &["empty.csv: the file is empty"][..]),
        ("some.csv", "H2,CH4\n1,2\n".into(), &["some.csv:1: the header lacks C2H6, C2H4, C2H2"]),
        ("german.csv", HEADER.replace(',', ";"), &["german.csv:1: columns are separated by semi"]),
        ("bad.csv", format!("{HEADER}\na,b,c,d,e\n"), &["bad.csv:2: H2: 'a'", "none of 1 rows"]),
    ] {
        let file = folder.file(name, text);
        refused(dga(&folder, &file).arg("--out").arg(&out), 1, words);
    }
    let good = folder.file("good.csv", format!("{HEADER}\n1,2,3,4,5\n"));
    refused(&mut dga(&folder, &folder.path("absent.csv")), 1, &["absent.csv", "No such file"]);
    refused(&mut dga(&folder, folder.0.path()), 1, &["it is no file"]);
    refused(
        dga(&folder, &good).args(["--set", "age=7"]),
        2,
        &["'gas_analysis'", "is not one of \"unknown\"", "remedy"],
    );
    refused(dga(&folder, &good).args(["--", "more"]), 2, &["unknown argument 'more'"]);
    refused(dga(&folder, &good).arg("--no-such-option"), 2, &["--no-such-option", "Usage"]);
    let nowhere = folder.path("no/such/folder.csv");
    refused(dga(&folder, &good).arg("--out").arg(nowhere), 1, &["check that its folder exists"]);
    let mut left: Vec<_> = fs::read_dir(folder.0.path())
        .expect("it can be read")
        .map(|entry| entry.expect("it can be read").file_name().into_string().expect("text"))
        .collect();
    left.sort();
    assert_eq!(left, ["bad.csv", "empty.csv", "german.csv", "good.csv", "plugins", "some.csv"]);
}

#[test]
fn commands_are_found_by_their_plugins() {
    let folder = Folder::new();
    let file = folder.file("good.csv", format!("{HEADER}\n1,2,3,4,5\n"));
    let plugins = folder.plugins("gas_analysis");
    refused(
        &mut offered("dgga", &file, &plugins),
        2,
        &["no command 'dgga'", "they offer dga", "remedy"],
    );
    fs::copy(built(built_folder().join("libpower_overlay.so")), plugins.join("liboverlay.so"))
        .expect("it can be copied");
    finish(&mut offered("dga", &file, &plugins)).expect_code(0);
    let none = folder.path("none");
    fs::create_dir(&none).expect("it can be made");
    refused(&mut offered("dga", &file, &none), 2, &["none of them offers a command"]);
    let help = finish(busbar().args(["dga", "--help"])).expect_code(0);
    assert!(help.stdout.contains("Usage: busbar dga") && help.stdout.contains("--out"));
}

#[test]
fn whoever_has_enough_of_the_output_may_leave() {
    let folder = Folder::new();
    let file = folder.file("good.csv", HEADER.to_owned() + &"\n1,2,3,4,5".repeat(50_000));
    let mut shell = Command::new("bash");
    shell.args([
        "-c",
        "\"$0\" dga \"$1\" --plugin-directory \"$2\" | head -n 1; exit ${PIPESTATUS[0]}",
    ]);
    shell.arg(built(built_folder().join("busbar"))).arg(&file).arg(folder.plugins("gas_analysis"));
    let output = finish(&mut shell).expect_code(0);
    assert!(output.stdout.starts_with("H2,CH4") && output.stderr.is_empty(), "{output:?}");
}

#[test]
fn a_large_file_takes_little_memory() {
    let folder = Folder::new();
    let (file, out) = (folder.path("large.csv"), folder.path("results.csv"));
    let mut writer = BufWriter::new(File::create(&file).expect("it can be made"));
    writeln!(writer, "equipment,{HEADER},CO,CO2,O2,N2").expect("it can be written");
    for i in 0..MANY {
        // Every hundredth row is bad.
        let ethane = if i % 100 == 7 { -1 } else { i64::from(i % 89) };
        writeln!(
            writer,
            "=S{i}T1,{},{},{ethane},{},{},300,4000,900,50000",
            i % 997,
            i % 499,
            i % 211,
            i % 7
        )
        .expect("it can be written");
    }
    writer.flush().expect("it can be written");
    let output = finish(dga(&folder, &file).arg("--out").arg(&out)).expect_code(0);
    assert!(output.peak_bytes < MAX_PEAK_BYTES, "{} bytes", output.peak_bytes);
    let results = fs::read_to_string(&out).expect("it was written");
    assert_eq!(results.lines().count() as u32, MANY - MANY / 100 + 1);
    let told = output.stderr.lines().filter(|line| line.contains("-1 ppm is negative")).count();
    assert!((900..=1000).contains(&told), "{told} told");
    let sums = format!("{} samples analysed, {} rows left out", MANY - MANY / 100, MANY / 100);
    assert!(output.stderr.contains(&sums), "{}", output.stderr.lines().last().unwrap_or_default());
    assert!(output.stderr.contains("more such lines are not shown"));
}

#[test]
fn a_command_that_dies_or_fails_is_told() {
    let folder = Folder::new();
    let plugins = folder.plugins("fault_injector");
    let file = folder.file("input", "anything");
    let with = |kind: &str| {
        let mut command = offered("inject-faults", &file, &plugins);
        command.args(["--set", &format!("kind={kind}"), "--set", "at=run_command"]);
        command
    };
    refused(&mut with("segfault"), 1, &["fault_injector", "SIGSEGV"]);
    refused(&mut with("exit"), 1, &["fault_injector", "exit"]);
    refused(&mut with("panic"), 1, &["told to panic at RunCommand"]);
    refused(&mut with("out_of_range"), 1, &["unknown exit code"]);
    let out = folder.path("out");
    refused(with("abort").arg("--out").arg(&out), 1, &["SIGABRT"]);
    assert!(!out.exists());
    let output = finish(&mut offered("inject-faults", &file, &plugins)).expect_code(0);
    assert_eq!(output.stdout, "anything");
}

#[test]
fn bytes_pass_unchanged_in_a_process_and_without_one() {
    let folder = Folder::new();
    let bytes: Vec<_> =
        (0..3_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 23) as u8).collect();
    let file = folder.file("input", &bytes);
    let directories = [folder.plugins("fault_injector")];
    for isolation in [Isolation::Process, Isolation::None] {
        let catalog = PluginCatalog::discover(&directories, &LoadRules::default(), isolation);
        let options = PluginOptions { isolation, ..PluginOptions::default() };
        let plugin = catalog.create("copy", "fault_injector", &json!({}), &options).expect("made");
        let commands = plugin.commands().expect("it has some");
        assert_eq!(commands.len(), 1);
        let mut copied = Vec::new();
        let mut shares = Vec::new();
        let report = plugin.run_command(
            &commands[0].name,
            &[],
            File::open(&file).expect("it opens"),
            &mut |piece| {
                copied.extend_from_slice(piece);
                Ok(())
            },
            &mut |share| shares.push(share),
        );
        let report = report.expect("it copies");
        assert_eq!((report.exit, report.diagnostics.len()), (CommandExit::Done, 0));
        assert!(copied == bytes, "{isolation:?}: {} bytes", copied.len());
        assert!(shares.is_sorted() && shares.iter().all(|share| (0.0..=1.0).contains(share)));
        // An output that fails stops it, and it runs again afterwards.
        let failed = plugin.run_command(
            &commands[0].name,
            &[],
            File::open(&file).expect("it opens"),
            &mut |_| Err(std::io::Error::other("the disk is full")),
            &mut |_| {},
        );
        let Err(CommandError::Output(error)) = failed else { panic!("{failed:?}") };
        assert!(error.to_string().contains("the disk is full"), "{error}");
        let unknown = plugin.run_command(
            "no-such",
            &[],
            File::open(&file).expect("it opens"),
            &mut |_| Ok(()),
            &mut |_| {},
        );
        let Err(CommandError::Plugin(error)) = unknown else { panic!("{unknown:?}") };
        assert!(error.to_string().contains("no command 'no-such'"), "{error}");
    }
}

#[test]
fn plugin_list_names_commands() {
    let folder = Folder::new();
    folder.plugins("gas_analysis");
    let mut config = json!({ "version": 1, "plugin_directories": ["plugins"] });
    config["scene"] = json!([{ "id": "=N1" }]);
    let config = folder.file("scene.json", config.to_string());
    let output = finish(busbar().args(["plugin", "list"]).arg(config)).expect_code(0);
    assert!(output.stdout.contains("    busbar dga: analyse gases"), "{}", output.stdout);
}
