//! Subcommand `busbar plugin check`: conformance of a plugin library.

use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::Context;
use busbar_plugin_check::{Options, Sample, check, run_case};

use crate::arguments::PluginCheckOptions;
use crate::exit_codes::EXIT_INPUT;
use crate::output;

/// Subcommand of this program that runs one case in its own process.
const RUN_CASE: [&str; 2] = ["plugin", "run-case"];

pub(crate) fn run(options: &PluginCheckOptions) -> anyhow::Result<ExitCode> {
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    let case_command = |request: &Path| {
        let mut command = Command::new(&program);
        command.args(RUN_CASE).arg(request);
        command
    };
    let sample = options.sample.as_deref().map(Sample::read).transpose()?.unwrap_or_default();
    let checked = Options { case_limit: options.limit, sample, only: options.only.clone() };
    let mut plugin = None;
    let report = check(&options.library, &checked, &case_command, &mut |case| {
        if case.plugin != plugin {
            plugin.clone_from(&case.plugin);
            output::result(&format!("plugin {}", plugin.as_deref().unwrap_or_default()));
        }
        output::result(&case.to_string());
    })?;
    let [passed, failed, skipped] = report.counts();
    output::result(&format!("{passed} passed, {failed} failed, {skipped} skipped"));
    if let Some(path) = &options.json {
        output::write_json(path, &report)?;
    }
    Ok(if report.passed { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INPUT) })
}

/// Runs one case in this process, which ends with it.
pub(crate) fn case(request: &Path) -> ExitCode {
    ExitCode::from(run_case(request) as u8)
}
