//! `soak`: the long tests.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::packages::{self, Purpose};
use crate::process;
use crate::stage;
use crate::workspace::{Profile, Workspace};

/// Tests in which calls to Vulkan fail, and what lets every one of them fail.
const FAULT_TESTS: [&str; 2] = ["failing_calls", "failing_window"];
const ALL_FAULTS: &str = "BUSBAR_VULKAN_FAULTS";
/// The test that kills a process which writes the alarm log, and how often.
const KILL_TEST: &str = "kills";
const KILLS_VARIABLE: &str = "BUSBAR_ALARM_KILLS";
const KILLS: &str = "200";
/// The seeded damages and power cuts of the audit log, and how many.
const LOG_PACKAGE: &str = "busbar_audit_log";
const LOG_VARIABLES: [(&str, &str); 2] =
    [("BUSBAR_LOG_DAMAGES", "1000"), ("BUSBAR_LOG_POWER_CUTS", "100")];
/// The matrix of source and host clocks, and how many steps it takes.
const CLOCK_TEST: &str = "clock_matrix";
const CLOCK_VARIABLE: &str = "BUSBAR_CLOCK_STEPS";
const CLOCK_STEPS: &str = "100000000";
/// The matrices of faulty messages: the package of each adapter and a name that its tests
/// have, and how many steps each takes.
const MESSAGE_MATRICES: [(&str, &str); 8] = [
    ("iec104", "no_message_makes_a_wrong_value_good"),
    ("iec61850", "no_wrong_or_old_value_is_good_whatever_messages_do"),
    ("modbus_adapter", "no_answer_over_tcp_leaves_an_old_value_good"),
    ("mqtt", "no_metric_is_good_that_is_wrong_or_old"),
    ("mqtt", "no_plain_value_is_good_that_is_wrong_or_old"),
    ("opcua", "no_wrong_or_old_value_is_good_whatever_messages_do"),
    ("replay", "rows_that_cannot_be_read_leave_no_value_good"),
    ("sql_adapter", "rows_and_notifications_with_faults_leave_no_old_value_good"),
];
const MATRIX_VARIABLE: &str = "BUSBAR_MATRIX_STEPS";
const MATRIX_STEPS: u64 = 1_000_000;
/// The test that reads pictures for what is stale and looks live, and how many sequences
/// of values it reads.
const STALE_TEST: &str = "stale_picture";
const STALE_VARIABLE: &str = "BUSBAR_STALE_SEQUENCES";
const STALE_SEQUENCES: &str = "100000";
/// The tests in which viewers die, hang, are slow and lose their device, by package: embedded
/// ones, those in a window and behind a web page; how often each, and how many seconds the machine
/// is busy.
const VIEW_TESTS: [(&str, &[&str]); 2] = [
    ("busbar_embed", &["faults", "device", "live", "slow"]),
    ("operation_tests", &["web_delay", "window_watch"]),
];
const VIEW_VARIABLES: [(&str, &str); 2] =
    [("BUSBAR_EMBED_FAULTS", "200"), ("BUSBAR_LIVE_SECONDS", "600")];
/// The test that writes configurations, good and bad, for a view to load, and how many.
const RELOAD_TEST: &str = "reload_soak";
const RELOADS_VARIABLE: &str = "BUSBAR_RELOADS";
const RELOADS: &str = "10000";
/// The silence tests of plugins, cases of each, and the walk of a whole site with its steps.
const SILENCE_TEST: &str = "silence";
const SILENCE_CASES: (&str, &str) = ("BUSBAR_SILENCE_CASES", "100000");
const HOST_SILENCE_TEST: &str = "host_silence";
const HOST_SILENCE_STEPS: (&str, &str) = ("BUSBAR_HOST_SILENCE_STEPS", "10000");
const FUZZ_FOLDER: &str = "tests/robustness/fuzz";
/// Inputs that are kept, a folder a target.
const KEPT_INPUTS: &str = "tests/robustness/fuzz_corpus/corpus";
/// Package and version of cargo-fuzz that are installed where it is missing.
const FUZZER: &str = "cargo-fuzz@^0.13";
const MAX_MINUTES: u64 = 7 * 24 * 60;
/// Time limit of one fuzz input, seconds, beyond which it is a finding.
const MAX_INPUT_SECONDS: u64 = 10;
const MAX_ALLOCATION_MEGABYTES: u64 = 256;

/// Command-line options of `soak`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Minutes for each fuzz target.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=MAX_MINUTES))]
    minutes: u64,
    /// Fuzz target to run, once for each; without it all of them.
    #[arg(long = "target")]
    targets: Vec<String>,
    /// Let every call to Vulkan fail in turn, and fuzz nothing; without it that
    /// comes after the fuzz targets, unless some are named.
    #[arg(long, conflicts_with = "targets")]
    vulkan_faults: bool,
    /// Kill a process that writes the audit log 200 times, damage 1,000 logs and cut the
    /// power of 100, and nothing else; without it that comes last, unless fuzz targets are
    /// named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults"])]
    alarm_kills: bool,
    /// Read pictures of 100,000 sequences of values for what is stale and looks live, and
    /// nothing else (some 25 minutes); without it that comes last, unless fuzz targets are
    /// named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults", "alarm_kills"])]
    stale_pictures: bool,
    /// Kill, abort and stop the viewer of a program that embeds it, and take its graphics
    /// device, 200 times each, keep the machine busy for 10 minutes a surface, and nothing
    /// else (some two hours); without it that comes last, unless fuzz targets are named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults", "alarm_kills", "stale_pictures"])]
    view_faults: bool,
    /// Write 10,000 configurations, good and bad, for a view with live plugins to load, and
    /// nothing else (some 30 minutes); without it that comes last, unless fuzz targets are
    /// named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults", "alarm_kills", "stale_pictures", "view_faults"])]
    reload: bool,
    /// Take 100,000,000 steps of the matrix of source and host clocks, and nothing else (some
    /// 3 minutes); without it that comes last, unless fuzz targets are named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults", "alarm_kills", "stale_pictures", "view_faults", "reload"])]
    clock_matrix: bool,
    /// Take steps of the matrix of faulty messages of each adapter, and nothing else (some 30
    /// minutes for 1,000,000 steps); without it that comes last, unless fuzz targets are named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults", "alarm_kills", "stale_pictures", "view_faults", "reload", "clock_matrix"])]
    message_matrix: bool,
    /// Judge 100,000 faulty inputs by each overlay, and let a site with all overlays take 10,000
    /// steps of faults, reloads and kills, and nothing else (some 2 hours); without it that comes
    /// last, unless fuzz targets are named.
    #[arg(long, conflicts_with_all = ["targets", "vulkan_faults", "alarm_kills", "stale_pictures", "view_faults", "reload", "clock_matrix", "message_matrix"])]
    silence: bool,
    /// Steps of each matrix of faulty messages.
    #[arg(long, default_value_t = MATRIX_STEPS, value_parser = clap::value_parser!(u64).range(1..))]
    matrix_steps: u64,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    if arguments.alarm_kills {
        return kill_all(workspace);
    }
    if arguments.stale_pictures {
        return read_pictures(workspace);
    }
    if arguments.view_faults {
        return end_viewers(workspace);
    }
    if arguments.reload {
        return reload_all(workspace);
    }
    if arguments.clock_matrix {
        return step_clocks(workspace);
    }
    if arguments.message_matrix {
        return disturb_messages(workspace, arguments.matrix_steps);
    }
    if arguments.silence {
        return judge_faulty_inputs(workspace);
    }
    if !arguments.vulkan_faults {
        fuzz_all(workspace, arguments)?;
    }
    if !arguments.targets.is_empty() {
        return Ok(());
    }
    fail_all_calls(workspace)?;
    if arguments.vulkan_faults {
        return Ok(());
    }
    kill_all(workspace)?;
    read_pictures(workspace)?;
    end_viewers(workspace)?;
    reload_all(workspace)?;
    step_clocks(workspace)?;
    disturb_messages(workspace, arguments.matrix_steps)?;
    judge_faulty_inputs(workspace)
}

/// Lets overlays judge inputs with faults, alone and in a site.
fn judge_faulty_inputs(workspace: &Workspace) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    process::run(process::cargo().current_dir(&workspace.root).args(["build", "--workspace"]))?;
    stage::stage(workspace, Profile::Dev)?;
    let (variable, cases) = SILENCE_CASES;
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(variable, cases);
    process::run(command.args(["test", "--workspace", SILENCE_TEST]))?;
    let (variable, steps) = HOST_SILENCE_STEPS;
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(variable, steps);
    command.args(["test", "--workspace", "--test", HOST_SILENCE_TEST]);
    process::run(command.args(["--", "--nocapture", "--test-threads=1"]))
}

/// Lets a view load very many configurations.
fn reload_all(workspace: &Workspace) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    process::run(process::cargo().current_dir(&workspace.root).args(["build", "--workspace"]))?;
    stage::stage(workspace, Profile::Dev)?;
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(RELOADS_VARIABLE, RELOADS);
    command.args(["test", "--workspace", "--test", RELOAD_TEST]);
    process::run(command.args(["--", "--nocapture"]))
}

/// Ends viewers again and again, and lets them work on a busy machine.
fn end_viewers(workspace: &Workspace) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    process::run(process::cargo().current_dir(&workspace.root).args(["build", "--workspace"]))?;
    stage::stage(workspace, Profile::Dev)?;
    for (package, tests) in VIEW_TESTS {
        let mut command = process::cargo();
        command.current_dir(&workspace.root).envs(VIEW_VARIABLES);
        command.args(["test", "--package", package]);
        command.args(tests.iter().flat_map(|test| ["--test", test]));
        process::run(command.args(["--", "--nocapture", "--test-threads=1"]))?;
    }
    Ok(())
}

/// Reads the pictures of very many sequences of values.
fn read_pictures(workspace: &Workspace) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    process::run(process::cargo().current_dir(&workspace.root).args(["build", "--workspace"]))?;
    stage::stage(workspace, Profile::Dev)?;
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(STALE_VARIABLE, STALE_SEQUENCES);
    command.args(["test", "--workspace", "--test", STALE_TEST]);
    process::run(command.args(["--", "--nocapture"]))
}

/// Kills the process that writes the alarm log again and again.
fn kill_all(workspace: &Workspace) -> Result<()> {
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(KILLS_VARIABLE, KILLS);
    command.args(["test", "--workspace", "--test", KILL_TEST]);
    process::run(command.args(["--", "--nocapture"]))?;
    let mut command = process::cargo();
    command.current_dir(&workspace.root).envs(LOG_VARIABLES);
    command.args(["test", "--package", LOG_PACKAGE, "--lib"]);
    process::run(command.args(["--", "--nocapture"]))
}

/// Sets the clocks of sources and host in very many ways.
fn step_clocks(workspace: &Workspace) -> Result<()> {
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(CLOCK_VARIABLE, CLOCK_STEPS);
    process::run(command.args(["test", "--workspace", "--test", CLOCK_TEST]))
}

/// Lets messages of each adapter be lost, cut, oversized, unknown and misassigned.
fn disturb_messages(workspace: &Workspace, steps: u64) -> Result<()> {
    for (package, test) in MESSAGE_MATRICES {
        let mut command = process::cargo();
        command.current_dir(&workspace.root).env(MATRIX_VARIABLE, steps.to_string());
        command.args(["test", "--package", package, "--lib", test, "--", "--nocapture"]);
        process::run(&mut command)?;
    }
    Ok(())
}

/// Lets each call to Vulkan fail with each code that it may give.
fn fail_all_calls(workspace: &Workspace) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    process::run(process::cargo().current_dir(&workspace.root).args(["build", "--workspace"]))?;
    let mut command = process::cargo();
    command.current_dir(&workspace.root).env(ALL_FAULTS, "all").args(["test", "--workspace"]);
    for test in FAULT_TESTS {
        command.args(["--test", test]);
    }
    process::run(command.args(["--", "--nocapture", "--test-threads=1"]))
}

fn fuzz_all(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let folder = workspace.path(FUZZ_FOLDER);
    let known = fuzz_targets(&folder)
        .with_context(|| format!("cannot list the fuzz targets of {}", folder.display()))?;
    let targets = chosen(known, &arguments.targets)?;
    packages::ensure(Purpose::Tests)?;
    ensure_fuzzer()?;
    // What is fuzzed is what is shipped, in the same versions.
    fs::copy(workspace.path("Cargo.lock"), folder.join("Cargo.lock"))
        .context("cannot copy Cargo.lock")?;
    let mut findings = Vec::new();
    for target in &targets {
        findings.extend(fuzz(workspace, target, arguments.minutes)?);
    }
    if findings.is_empty() {
        println!("{} fuzz targets, no finding", targets.len());
        return Ok(());
    }
    let list: Vec<_> = findings.iter().map(|p| p.display().to_string()).collect();
    bail!("fuzzing found: {}", list.join(", "))
}

/// The names of the programs in `fuzz_targets`, at least one.
fn fuzz_targets(fuzz_folder: &Path) -> Result<Vec<String>> {
    let files = files_in(&fuzz_folder.join("fuzz_targets"))?;
    let sources = files.iter().filter(|f| f.extension().is_some_and(|e| e == "rs"));
    let targets: Vec<_> =
        sources.filter_map(|f| Some(f.file_stem()?.to_string_lossy().into_owned())).collect();
    if targets.is_empty() {
        bail!("there is none");
    }
    Ok(targets)
}

/// Selects the fuzz targets that are wanted; all of them where none is named.
fn chosen(known: Vec<String>, wanted: &[String]) -> Result<Vec<String>> {
    if let Some(unknown) = wanted.iter().find(|name| !known.contains(name)) {
        bail!("there is no fuzz target '{unknown}'; there are {}", known.join(", "));
    }
    Ok(known.into_iter().filter(|name| wanted.is_empty() || wanted.contains(name)).collect())
}

fn ensure_fuzzer() -> Result<()> {
    if process::succeeds(process::cargo().args(["fuzz", "--version"])) {
        return Ok(());
    }
    process::run(process::cargo().args(["install", "--locked", FUZZER]))
}

/// Runs one target; the inputs that made it fail, if any.
fn fuzz(workspace: &Workspace, target: &str, minutes: u64) -> Result<Vec<PathBuf>> {
    let artifacts = workspace.path(FUZZ_FOLDER).join("artifacts").join(target);
    let corpus = workspace.path(FUZZ_FOLDER).join("corpus").join(target);
    fs::create_dir_all(&corpus).with_context(|| format!("cannot make {}", corpus.display()))?;
    let known = files_or_none(&artifacts)?;
    let mut command = process::cargo();
    command.current_dir(&workspace.root);
    // The sanitizers are an unstable option of the stable compiler.
    command.env("RUSTC_BOOTSTRAP", "1");
    command.args(["fuzz", "run", "--fuzz-dir", FUZZ_FOLDER, target]);
    // What is new goes into the first one.
    command.args([corpus, workspace.path(KEPT_INPUTS).join(target)]);
    command.arg("--");
    command.arg(format!("-max_total_time={}", minutes * 60));
    command.arg(format!("-timeout={MAX_INPUT_SECONDS}"));
    command.arg(format!("-malloc_limit_mb={MAX_ALLOCATION_MEGABYTES}"));
    command.arg("-print_final_stats=1");
    let outcome = process::run(&mut command);
    let found: Vec<_> = files_or_none(&artifacts)?.difference(&known).cloned().collect();
    // Without a finding the target did not build or run.
    if found.is_empty() {
        outcome.with_context(|| format!("fuzz target {target}"))?;
    }
    Ok(found)
}

fn files_or_none(folder: &Path) -> Result<BTreeSet<PathBuf>> {
    match files_in(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(BTreeSet::new()),
        files => files.with_context(|| format!("cannot list {}", folder.display())),
    }
}

fn files_in(folder: &Path) -> io::Result<BTreeSet<PathBuf>> {
    fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_the_sources_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let targets = folder.path().join("fuzz_targets");
        assert!(fuzz_targets(folder.path()).is_err());
        fs::create_dir(&targets).unwrap();
        assert!(fuzz_targets(folder.path()).is_err());
        for name in ["scene_json.rs", "gltf.rs", "notes.md"] {
            fs::write(targets.join(name), "").unwrap();
        }
        assert_eq!(fuzz_targets(folder.path()).unwrap(), ["gltf", "scene_json"]);
    }

    #[test]
    fn targets_are_chosen_by_name() {
        let known = || ["gltf", "scene_json"].map(String::from).to_vec();
        assert_eq!(chosen(known(), &[]).unwrap(), known());
        assert_eq!(chosen(known(), &["scene_json".into()]).unwrap(), ["scene_json"]);
        let unknown = chosen(known(), &["scene".into()]).unwrap_err().to_string();
        assert_eq!(unknown, "there is no fuzz target 'scene'; there are gltf, scene_json");
    }

    #[test]
    fn every_target_has_kept_inputs() {
        let workspace = Workspace::find().unwrap();
        for target in fuzz_targets(&workspace.path(FUZZ_FOLDER)).unwrap() {
            let kept = files_in(&workspace.path(KEPT_INPUTS).join(&target)).unwrap();
            assert!(!kept.is_empty(), "{target}");
        }
    }

    /// Cargo passes over a name that no test has.
    #[test]
    fn every_message_matrix_is_a_test() {
        let workspace = Workspace::find().unwrap();
        for (package, test) in MESSAGE_MATRICES {
            let folder = workspace.path("plugins/telemetry").join(package).join("src");
            let head = format!("fn {test}()");
            assert!(has_text(&folder, &head), "{package} has no {test}");
        }
        let folders = ["host/remote/embed/tests", "tests/end_to_end/operation_tests/tests"];
        for ((package, tests), folder) in VIEW_TESTS.iter().zip(folders) {
            for test in *tests {
                let file = workspace.path(folder).join(format!("{test}.rs"));
                assert!(file.is_file(), "{package} has no {test}");
            }
        }
    }

    fn has_text(folder: &Path, text: &str) -> bool {
        fs::read_dir(folder).unwrap().any(|entry| {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => has_text(&path, text),
                false => fs::read_to_string(path).is_ok_and(|content| content.contains(text)),
            }
        })
    }

    #[test]
    fn no_folder_means_no_artifacts() {
        let folder = tempfile::tempdir().unwrap();
        let absent = folder.path().join("absent");
        assert!(files_or_none(&absent).unwrap().is_empty());
        fs::write(folder.path().join("crash-1"), "").unwrap();
        assert_eq!(files_or_none(folder.path()).unwrap().len(), 1);
    }
}
