//! `bench`: the benches and comparisons.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Result;

use crate::packages::{self, Purpose};
use crate::process;
use crate::python;
use crate::scan;
use crate::stage;
use crate::workspace::{Profile, Workspace};

const PACKAGE: &str = "bench";
/// Plugins whose boundary is measured.
const PLUGINS: [&str; 2] = ["weighted_collapse", "quadric_collapse"];
/// Section with methods from outside this project.
const LEVELS: &str = "levels";
/// Output folder of the report.
const FOLDER: &str = "target/bench";
/// Folder of the peers' scripts.
const SCRIPTS: &str = "tests/end_to_end/peers";

/// Command-line options of `bench`.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder for the report; `target/bench` if none is given.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Rounds; medians, minima and maxima are over these.
    #[arg(long)]
    rounds: Option<usize>,
    /// Run only these sections: optimizer, orders, collapse_stacks, levels.
    #[arg(long)]
    only: Vec<String>,
    /// Leave large meshes and the scan out of the levels.
    #[arg(long)]
    quick: bool,
    /// A further mesh for the levels, glTF or PLY.
    #[arg(long)]
    mesh: Vec<PathBuf>,
    /// Cores to stay on, as `taskset --cpu-list` takes them: 1, or 0-3.
    #[arg(long)]
    cores: Option<String>,
}

/// Optional prerequisites of the comparison, as far as they are installed.
#[derive(Default)]
struct OptionalPeers {
    python: Option<PathBuf>,
    scan: Option<PathBuf>,
}

pub(crate) fn run(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    packages::ensure(Purpose::Bench)?;
    let packages = PLUGINS.into_iter().chain([PACKAGE]);
    stage::build_packages(workspace, Profile::Release, packages)?;
    let libraries = PLUGINS.map(|plugin| workspace.library(Profile::Release, plugin));
    stage::replace_libraries(&workspace.path(FOLDER).join("plugins"), &libraries)?;
    let others = match arguments.includes(LEVELS) {
        true => OptionalPeers::find(workspace, arguments.quick),
        false => OptionalPeers::default(),
    };
    process::run(&mut command(workspace, arguments, &others))
}

impl Arguments {
    fn includes(&self, section: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|wanted| wanted == section)
    }
}

impl OptionalPeers {
    /// Prepares the optional prerequisites; the bench runs without those that fail.
    fn find(workspace: &Workspace, quick: bool) -> Self {
        let python = python::ensure_environment(workspace, python::BENCH).unwrap_or_else(|error| {
            println!("No Python peers: {error:#}");
            None
        });
        let scan = (!quick).then(|| scan::ensure_scan(workspace));
        let scan = scan.and_then(|scan| {
            scan.inspect_err(|error| println!("No scan from elsewhere: {error:#}")).ok()
        });
        Self { python, scan }
    }
}

fn command(workspace: &Workspace, arguments: &Arguments, others: &OptionalPeers) -> Command {
    let program = workspace.program(Profile::Release, PACKAGE);
    let mut command = match &arguments.cores {
        None => Command::new(program),
        Some(cores) => {
            let mut pinned = Command::new("taskset");
            pinned.args(["--cpu-list", cores]).arg(program);
            pinned
        }
    };
    let folder = workspace.path(FOLDER);
    command.arg("--out").arg(arguments.out.as_ref().unwrap_or(&folder));
    command.arg("--plugins").arg(folder.join("plugins"));
    if let Some(rounds) = arguments.rounds {
        command.args(["--rounds", &rounds.to_string()]);
    }
    for section in &arguments.only {
        command.args(["--only", section]);
    }
    if arguments.quick {
        command.arg("--quick");
    }
    for mesh in &arguments.mesh {
        command.arg("--mesh").arg(mesh);
    }
    if let Some(python) = &others.python {
        command.arg("--python").arg(python).arg("--scripts").arg(workspace.path(SCRIPTS));
    }
    if let Some(scan) = &others.scan {
        command.arg("--scan").arg(scan);
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(command: &Command) -> Vec<String> {
        command.get_args().map(|argument| argument.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn options_are_handed_on() {
        let workspace = Workspace::find().unwrap();
        let plain = Arguments {
            out: None,
            rounds: None,
            only: Vec::new(),
            quick: false,
            mesh: Vec::new(),
            cores: None,
        };
        assert!(plain.includes(LEVELS));
        let plain = command(&workspace, &plain, &OptionalPeers::default());
        let target = workspace.path(FOLDER).to_string_lossy().into_owned();
        let plugins = workspace.path("target/bench/plugins").to_string_lossy().into_owned();
        assert_eq!(given(&plain), ["--out", &target, "--plugins", &plugins]);
        let program = plain.get_program().to_string_lossy().into_owned();
        let arguments = Arguments {
            out: Some("folder".into()),
            rounds: Some(7),
            only: vec!["optimizer".to_owned()],
            quick: true,
            mesh: vec!["a.glb".into()],
            cores: Some("1".to_owned()),
        };
        assert!(!arguments.includes(LEVELS));
        let others = OptionalPeers { python: Some("python".into()), scan: Some("scan.ply".into()) };
        let pinned = command(&workspace, &arguments, &others);
        assert_eq!(pinned.get_program(), "taskset");
        let scripts = workspace.path(SCRIPTS).to_string_lossy().into_owned();
        let expected = [
            "--cpu-list",
            "1",
            &program,
            "--out",
            "folder",
            "--plugins",
            &plugins,
            "--rounds",
            "7",
            "--only",
            "optimizer",
            "--quick",
            "--mesh",
            "a.glb",
            "--python",
            "python",
            "--scripts",
            &scripts,
            "--scan",
            "scan.ply",
        ];
        assert_eq!(given(&pinned), expected);
    }
}
