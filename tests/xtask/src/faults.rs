//! `faults`: every fault of a plugin beside a live view, thousands of times.

use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::stage;
use crate::workspace::{Profile, Workspace};

const PACKAGE: &str = "faults";
/// Plugin that injects the faults.
const PLUGIN: &str = "fault_injector";
/// Program whose processes run plugins.
const HOST: &str = "busbar";
/// Output folder of the report.
const FOLDER: &str = "target/faults";
const INJECTIONS: u64 = 10_000;
/// Options of the quick run: each fault once, and fewer kills.
const QUICK: [&str; 4] = ["--injections", "250", "--kills", "100"];
const MAX_INJECTIONS: u64 = 10_000_000;

/// Command-line options of `faults`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Let each fault strike once.
    #[arg(long, conflicts_with = "injections")]
    quick: bool,
    /// Least number of injections.
    #[arg(long, default_value_t = INJECTIONS)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_INJECTIONS))]
    injections: u64,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::Picture)?;
    stage::build_packages(workspace, Profile::Release, [PACKAGE, PLUGIN, HOST])?;
    process::run(&mut command(workspace, arguments))
}

fn command(workspace: &Workspace, arguments: &Arguments) -> Command {
    let mut command = Command::new(workspace.program(Profile::Release, PACKAGE));
    command.arg("--library").arg(workspace.library(Profile::Release, PLUGIN));
    command.arg("--out").arg(workspace.path(FOLDER));
    if arguments.quick {
        command.args(QUICK);
    } else {
        command.args(["--injections", &arguments.injections.to_string()]);
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_handed_on() {
        let workspace = Workspace::find().unwrap();
        let check = |quick, injections, expected: &[&str]| {
            let command = command(&workspace, &Arguments { quick, injections });
            let given: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
            assert!(given[1].contains(PLUGIN), "{given:?}");
            assert_eq!(given[4..], *expected);
        };
        check(true, INJECTIONS, &QUICK);
        check(false, 500, &["--injections", "500"]);
    }
}
