//! Subcommand `busbar import CONFIG --from INSTANCE`: the points of a device, as a point list or as
//! tags.

use std::process::ExitCode;

use anyhow::bail;
use busbar_commands::{DevicePointSource, DevicePoints};
use busbar_plugin_host::CommandExit;
use busbar_plugin_process::CommandError;

use super::check_free;
use crate::arguments::ImportOptions;
use crate::command::{exit_code, tell};
use crate::output;

/// Runs the plugin's listing; writes nothing unless it succeeds.
pub(super) fn run(options: &ImportOptions, instance: &str) -> anyhow::Result<ExitCode> {
    let out = options.out.as_deref();
    if let Some(out) = out.filter(|_| !options.force) {
        check_free(&[out])?;
    }
    let source = DevicePointSource::open(&options.source, instance)?;
    let DevicePoints { list, report } = match source.list_points(&options.arguments) {
        Ok(points) => points,
        Err(CommandError::Output(error)) => bail!("the list of '{instance}': {error}"),
        Err(CommandError::Plugin(error)) => {
            bail!("{instance}: {error}\n  remedy: {}", error.remedy())
        }
    };
    tell(instance, &report);
    if report.exit != CommandExit::Done {
        if let Some(remedy) = source.network_remedy() {
            output::line(&format!("  remedy: {remedy}"));
        }
        return Ok(exit_code(&report));
    }
    // Also where the text is written as it is: what is no good is not handed on.
    let tags = source.tags(&list).or_else(|faults| {
        let faults: Vec<_> = faults.iter().map(|fault| fault.render(instance)).collect();
        bail!("the plugin's list has faults\n{}", faults.join("\n"))
    })?;
    let is_json = |path: &std::path::Path| path.extension().is_some_and(|end| end == "json");
    match out {
        Some(out) if is_json(out) => output::write_json(out, &tags)?,
        out => {
            let mut sink = output::Sink::open(out)?;
            sink.write(&list)?;
            sink.finish()?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
