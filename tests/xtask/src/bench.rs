//! `bench`: the benches and comparisons.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::workspace::{Profile, Workspace};

const PACKAGE: &str = "bench";

/// Options of `bench`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// File to write the figures to, as JSON.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Rounds; medians, minima and maxima are over these.
    #[arg(long)]
    rounds: Option<usize>,
    /// Run only these sections.
    #[arg(long)]
    only: Vec<String>,
    /// Cores to stay on, as `taskset --cpu-list` takes them: 1, or 0-3.
    #[arg(long)]
    cores: Option<String>,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::Tests)?;
    let mut build = process::cargo();
    build.args(["build", "--profile", Profile::Release.name(), "--package", PACKAGE]);
    process::run(build.current_dir(&workspace.root))?;
    process::run(&mut command(workspace, arguments))
}

fn command(workspace: &Workspace, arguments: &Arguments) -> Command {
    let program = workspace.program(Profile::Release, PACKAGE);
    let mut command = match &arguments.cores {
        None => Command::new(program),
        Some(cores) => {
            let mut pinned = Command::new("taskset");
            pinned.args(["--cpu-list", cores]).arg(program);
            pinned
        }
    };
    if let Some(out) = &arguments.out {
        command.arg("--out").arg(out);
    }
    if let Some(rounds) = arguments.rounds {
        command.args(["--rounds", &rounds.to_string()]);
    }
    for section in &arguments.only {
        command.args(["--only", section]);
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_handed_on() {
        let workspace = Workspace::find().unwrap();
        let plain = Arguments { out: None, rounds: None, only: Vec::new(), cores: None };
        let plain = command(&workspace, &plain);
        assert_eq!(plain.get_args().len(), 0);
        let program = plain.get_program().to_string_lossy().into_owned();
        let arguments = Arguments {
            out: Some("f.json".into()),
            rounds: Some(7),
            only: vec!["optimizer".to_owned()],
            cores: Some("1".to_owned()),
        };
        let pinned = command(&workspace, &arguments);
        assert_eq!(pinned.get_program(), "taskset");
        let given: Vec<_> = pinned.get_args().map(|a| a.to_string_lossy().into_owned()).collect();
        let expected = [
            "--cpu-list",
            "1",
            &program,
            "--out",
            "f.json",
            "--rounds",
            "7",
            "--only",
            "optimizer",
        ];
        assert_eq!(given, expected);
    }
}
