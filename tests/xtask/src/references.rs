//! `references`: the calculations of the plugins beside independent ones. Each comparison
//! prints the worst deviation of its quantities, and fails beyond a stated limit.

use std::env;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Error, Result, bail};

use crate::process;
use crate::python;
use crate::steps::Steps;
use crate::workspace::{Profile, Workspace};

/// Variable that makes missing peers a failure, as for tests, where it is 1.
const REQUIRE_VARIABLE: &str = "BUSBAR_REQUIRE_PEERS";
/// Folder of real COMTRADE recordings that are compared too, where it is set.
const RECORDINGS_VARIABLE: &str = "BUSBAR_COMTRADE_FOLDER";

/// Options of the command `references`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Compare a sample, as CI does.
    #[arg(long)]
    pub(crate) quick: bool,
}

/// Sizes of the comparisons.
struct Sample {
    /// One point of the gas law in so many.
    gas_step: &'static str,
    /// Load profiles of transformers.
    profiles: &'static str,
    /// Number of random networks.
    networks: &'static str,
}

const QUICK: Sample = Sample { gas_step: "10", profiles: "10", networks: "2000" };
const WHOLE: Sample = Sample { gas_step: "1", profiles: "100", networks: "100000" };

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let mut steps = Steps::default();
    let outcome = compare(workspace, arguments, &mut steps);
    println!("{}", steps.table());
    outcome
}

/// Runs the sample as a step of CI. Where the packages cannot be installed it is skipped with
/// a message, unless peers are required.
///
/// # Errors
/// A deviation beyond its limit, or missing packages that are required.
pub(crate) fn run_sample(workspace: &Workspace) -> Result<()> {
    match python::ensure_environment(workspace, python::REFERENCES) {
        Ok(_) => run(workspace, &Arguments { quick: true }),
        Err(error) => {
            let is_required = env::var_os(REQUIRE_VARIABLE).is_some_and(|value| value == "1");
            println!("{}", skip(error, is_required)?);
            Ok(())
        }
    }
}

/// Returns the message of a sample that is skipped for want of its packages.
fn skip(error: Error, is_required: bool) -> Result<String> {
    if is_required {
        return Err(error);
    }
    Ok(format!("references: SKIPPED ({error:#}); with {REQUIRE_VARIABLE}=1 this is a failure"))
}

fn compare(workspace: &Workspace, arguments: &Arguments, steps: &mut Steps) -> Result<()> {
    let sample = if arguments.quick { QUICK } else { WHOLE };
    let python = steps
        .run("python", || python::ensure_environment(workspace, python::REFERENCES))?
        .context("the references' requirements are missing from tests/end_to_end/peers")?;
    steps.run("SF6", || {
        build_example("sf6_density", "print_values")?;
        let mut comparison = script(workspace, &python, "sf6_density");
        comparison.arg(example(workspace, "print_values")).arg(sample.gas_step);
        process::run(&mut comparison)
    })?;
    steps.run("temperatures", || {
        build_example("transformer_thermal", "series")?;
        // Annex C's printed values, then two other implementations.
        test(&["-p", "transformer_thermal", "--lib", "standards_example"], None)?;
        let folder = tempfile::tempdir().context("no folder for the series can be made")?;
        let file = folder.path().join("series.csv");
        let written = File::create(&file).context("the series cannot be written")?;
        // Children have no input, so the series go by a file.
        let status = Command::new(example(workspace, "series"))
            .args([sample.profiles, "1"])
            .stdin(Stdio::null())
            .stdout(written)
            .status()
            .context("the series of temperatures cannot be made")?;
        if !status.success() {
            bail!("the series of temperatures ended with {status}");
        }
        process::run(script(workspace, &python, "transformer_thermal").arg(&file))
    })?;
    steps.run("topology", || {
        let cases = ("BUSBAR_TOPOLOGY_CASES", sample.networks);
        test(&["-p", "energisation", "_completions"], Some(cases))?;
        let folder = tempfile::tempdir().context("no folder for the networks can be made")?;
        let file = folder.path().join("networks.jsonl");
        let mut command = process::cargo();
        command.args(["test", "-p", "energisation", "--lib", "networks_for_another"]);
        command.args(["--", "--ignored"]).envs([cases]).env("BUSBAR_TOPOLOGY_FILE", &file);
        process::run(&mut command)?;
        process::run(script(workspace, &python, "energisation").arg(&file))
    })?;
    if env::var_os(RECORDINGS_VARIABLE).is_some() {
        steps.run("recordings", || {
            let mut command = process::cargo();
            command.args(["test", "-p", "replay", "recordings_of_a_folder"]);
            command.args(["--", "--ignored", "--nocapture"]).env("BUSBAR_PYTHON", &python);
            process::run(&mut command)
        })?;
    }
    Ok(())
}

fn build_example(package: &str, name: &str) -> Result<()> {
    process::run(process::cargo().args(["build", "-p", package, "--example", name]))
}

fn example(workspace: &Workspace, name: &str) -> std::path::PathBuf {
    let program = workspace.program(Profile::Dev, name);
    let folder = program.parent().map(Path::to_owned).unwrap_or_default();
    folder.join("examples").join(name)
}

fn script(workspace: &Workspace, python: &Path, plugin: &str) -> Command {
    let mut command = Command::new(python);
    command.arg(workspace.path(format!("plugins/overlays/{plugin}/references/compare.py")));
    command
}

fn test(arguments: &[&str], variable: Option<(&str, &str)>) -> Result<()> {
    let mut command = process::cargo();
    command.arg("test").args(arguments).args(["--", "--nocapture"]);
    command.envs(variable);
    process::run(&mut command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_packages_skip_the_sample_unless_peers_are_required() {
        let error = || anyhow::anyhow!("no index").context("cannot make the environment");
        let message = skip(error(), false).unwrap();
        assert!(message.contains("SKIPPED (cannot make the environment: no index)"), "{message}");
        assert_eq!(skip(error(), true).unwrap_err().to_string(), "cannot make the environment");
    }
}
