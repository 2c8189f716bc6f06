//! `test`: all that CI runs, on a fresh machine too.

use std::env;
use std::io::IsTerminal;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::book;
use crate::checkout_times;
use crate::deny;
use crate::packages::{self, Purpose};
use crate::process;
use crate::python;
use crate::references;
use crate::stage;
use crate::steps::Steps;
use crate::workspace::{Profile, Workspace};

/// One a test program, when nextest is not there.
const MAX_RESULT_LINES: usize = 1024;

/// Command-line options of `test`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Run only the tests whose names contain this, without lints.
    filter: Option<String>,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    env::set_current_dir(&workspace.root).context("cannot go to the repository's root")?;
    let mut steps = Steps::default();
    let mut results = Vec::new();
    let outcome = run_steps(workspace, arguments, &mut steps, &mut results);
    println!("{}", steps.table());
    if let Some(line) = closing_line(&results) {
        println!("{line}");
    }
    outcome
}

fn run_steps(
    workspace: &Workspace,
    arguments: &Arguments,
    steps: &mut Steps,
    results: &mut Vec<String>,
) -> Result<()> {
    let filter = arguments.filter.as_deref();
    steps.run("packages", || packages::ensure(Purpose::Tests))?;
    if env::var("CI").is_ok_and(|value| value == "true") {
        steps.run("checkout", || {
            let count = checkout_times::restore(&workspace.root, &workspace.target)?;
            println!("{count} files are as the last build had them");
            Ok(())
        })?;
    }
    if filter.is_none() {
        steps.run("dependencies", || deny::check_or_skip(workspace))?;
        steps.run("format", || {
            ensure_component("fmt", "rustfmt")?;
            process::run(process::cargo().args(["fmt", "--all", "--check"]))
                .context("`cargo fmt --all` mends this")
        })?;
        steps.run("clippy", || {
            ensure_component("clippy", "clippy")?;
            let mut clippy = process::cargo();
            clippy.args(["clippy", "--workspace", "--all-targets"]);
            process::run(clippy.args(["--", "-D", "warnings"]))
        })?;
        steps.run("documentation", || {
            let mut doc = process::cargo();
            doc.env("RUSTDOCFLAGS", "-D warnings");
            process::run(doc.args(["doc", "--workspace", "--no-deps"]))
        })?;
    }
    // With the tests: cargo unites the features of what it builds at once, and whatever has other
    // ones is built again.
    steps.run("build", || {
        let targets = ["--lib", "--bins", "--tests", "--examples"];
        process::run(process::cargo().args(["build", "--workspace"]).args(targets))
    })?;
    steps.run("stage", || stage::stage(workspace, Profile::Dev))?;
    let python = steps.run("python", || python::ensure_environment(workspace, python::TESTS))?;
    if filter.is_none() {
        steps.run("book", || book::build_or_skip(workspace))?;
        steps.run("doc tests", || {
            let mut doc_tests = process::cargo();
            process::run(doc_tests.args(["test", "--quiet", "--workspace", "--doc"]))
        })?;
    }
    if filter.is_none() {
        steps.run("as on a card", || run_as_on_a_card(workspace))?;
    }
    if filter.is_none() {
        steps.run("references", || references::run_sample(workspace))?;
    }
    // Last, so that its result ends the output.
    steps.run("tests", || run_tests(filter, python.as_deref(), results))
}

fn run_tests(filter: Option<&str>, python: Option<&Path>, results: &mut Vec<String>) -> Result<()> {
    let mut command = process::cargo();
    if has_nextest() {
        command.args(["nextest", "run", "--workspace"]).args(filter);
    } else {
        println!("cargo-nextest is not installed: running the tests with cargo test.");
        command.args(["test", "--workspace", "--all-targets", "--no-fail-fast"]).args(filter);
        // Without nextest's groups, windows and peers would get in each other's way.
        command.args(["--", "--test-threads=1"]);
    }
    set_environment(&mut command, python);
    let (status, lines) = process::run_and_keep(&mut command, MAX_RESULT_LINES, is_result)?;
    results.extend(lines);
    if !status.success() {
        bail!("tests failed ({status}); see above");
    }
    Ok(())
}

/// Draws as on a graphics card, where more than drawing is left to the device.
fn run_as_on_a_card(workspace: &Workspace) -> Result<()> {
    const PACKAGES: [&str; 2] = ["busbar_gpu", "busbar_renderer"];
    let mut command = process::cargo();
    if has_nextest() {
        let filter = PACKAGES.map(|package| format!("package({package})")).join(" | ");
        command.args(["nextest", "run", "--workspace", "--filterset", &filter]);
    } else {
        command.arg("test").args(PACKAGES.iter().flat_map(|package| ["--package", package]));
    }
    let folder = tempfile::tempdir().context("no folder for the layer can be made")?;
    let library = workspace.library(Profile::Dev, "vulkan_faults");
    vulkan_faults::install(&mut command, &library, folder.path())?;
    set_environment(&mut command, None);
    process::run(command.env(vulkan_faults::AS_CARD_VARIABLE, "1"))
}

fn has_nextest() -> bool {
    process::succeeds(process::cargo().args(["nextest", "--version"]))
}

fn set_environment(command: &mut Command, python: Option<&Path>) {
    command.env("RUST_BACKTRACE", "1");
    // A peer that cannot be started is a failure, not a skipped test.
    command.env("BUSBAR_REQUIRE_PEERS", "1");
    if let Some(python) = python {
        command.env("BUSBAR_PYTHON", python);
    }
    if std::io::stdout().is_terminal() {
        command.env("CARGO_TERM_COLOR", "always");
    }
}

/// Installs a part of the Rust toolchain that `cargo NAME` needs.
fn ensure_component(name: &str, component: &str) -> Result<()> {
    if process::succeeds(process::cargo().args([name, "--version"])) {
        return Ok(());
    }
    process::run(Command::new("rustup").args(["component", "add", component]))
        .with_context(|| format!("`cargo {name}` is missing: install {component}"))
}

/// True for nextest's closing line and those of single test programs.
fn is_result(line: &str) -> bool {
    line.starts_with("test result: ") || (line.contains("Summary") && line.contains(" run:"))
}

/// Nextest's own line, or the sum of cargo test's.
fn closing_line(results: &[String]) -> Option<String> {
    let last = results.last()?;
    if !last.starts_with("test result: ") {
        return Some(last.trim().to_owned());
    }
    let sum = |what: &str| results.iter().map(|line| count(line, what)).sum::<u64>();
    let failed = sum("failed");
    Some(format!(
        "test result: {}. {} passed; {failed} failed; {} ignored",
        if failed == 0 { "ok" } else { "FAILED" },
        sum("passed"),
        sum("ignored"),
    ))
}

/// The number before `what`, as in `3 passed;`.
fn count(line: &str, what: &str) -> u64 {
    let words: Vec<_> = line.split([' ', ';']).filter(|word| !word.is_empty()).collect();
    let pair = words.windows(2).find(|pair| pair[1] == what);
    pair.and_then(|pair| pair[0].parse().ok()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(output: &[&str], expected: Option<&str>) {
        let lines = output.iter().filter(|line| is_result(line));
        let results: Vec<_> = lines.map(ToString::to_string).collect();
        assert_eq!(closing_line(&results).as_deref(), expected);
    }

    #[test]
    fn the_closing_line_is_that_of_nextest() {
        let summary = "     Summary [   1.204s] 21 tests run: 21 passed, 0 skipped";
        check(&["        PASS [   0.011s] xtask steps", summary], Some(summary.trim()));
    }

    #[test]
    fn cargo_test_is_summed_up() {
        check(
            &[
                "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out",
                "Doc-tests geometry",
                "test result: FAILED. 20 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out",
            ],
            Some("test result: FAILED. 23 passed; 2 failed; 1 ignored"),
        );
    }

    #[test]
    fn no_tests_have_no_closing_line() {
        check(&["error: could not compile `gpu`"], None);
    }
}
