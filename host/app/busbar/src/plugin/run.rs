//! Subcommand `busbar plugin run CONFIG INSTANCE COMMAND`: a command with an instance's settings.

use std::process::ExitCode;

use anyhow::bail;
use busbar_commands::InstanceCommand;
use busbar_plugin_process::CommandError;

use crate::arguments::PluginRunOptions;
use crate::command::{exit_code, tell};
use crate::output;

/// Runs the command; its output goes to the standard output.
pub(crate) fn run(options: &PluginRunOptions) -> anyhow::Result<ExitCode> {
    let PluginRunOptions { config, instance, command, arguments } = options;
    let opened = InstanceCommand::open(config, instance, command)?;
    let mut sink = output::Sink::open(None)?;
    match opened.run(arguments, &mut |bytes| sink.write(bytes)) {
        Ok(report) => {
            sink.finish()?;
            tell(instance, &report);
            Ok(exit_code(&report))
        }
        Err(CommandError::Output(error)) => bail!("the output of '{command}': {error}"),
        Err(CommandError::Plugin(error)) => {
            bail!("{instance}: {error}\n  remedy: {}", error.remedy())
        }
    }
}
