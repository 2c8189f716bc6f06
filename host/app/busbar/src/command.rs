//! Subcommands of plugins: `busbar NAME FILE`.

use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, anyhow, bail};
use busbar_commands::plugin_with_command;
use busbar_plugin_host::{CommandExit, CommandReport, DiagnosticLevel, LoadRules};
use busbar_plugin_process::{CommandError, Isolation, PluginCatalog};
use clap::Parser;

use crate::arguments::OfferedOptions;
use crate::exit_codes::{EXIT_INPUT, EXIT_USAGE};
use crate::{output, plugin};

/// Steps of a progress bar.
const PARTS: usize = 1000;

/// Runs the command of this name with the arguments after it.
pub(crate) fn run(mut words: Vec<OsString>) -> anyhow::Result<ExitCode> {
    let name = words.remove(0).to_string_lossy().into_owned();
    let program = [OsString::from(format!("busbar {name}"))];
    let options = match OfferedOptions::try_parse_from(program.into_iter().chain(words)) {
        Ok(options) => options,
        Err(error) => error.exit(),
    };
    let directories = match options.plugin_directory.as_slice() {
        [] => plugin::default_directories()?,
        asked => asked.iter().map(std::path::absolute).collect::<Result<_, _>>()?,
    };
    let catalog = PluginCatalog::discover(&directories, &LoadRules::default(), Isolation::Process);
    let settings = options.set.iter().cloned().collect::<serde_json::Map<_, _>>().into();
    let plugin = match plugin_with_command(&catalog, &name, &settings) {
        Ok(plugin) => plugin,
        Err(reason) => {
            output::error(&anyhow!(reason));
            return Ok(ExitCode::from(EXIT_USAGE));
        }
    };
    let input = open(&options.file)?;
    let mut sink = output::Sink::open(options.out.as_deref())?;
    let bar = output::progress_bar();
    let ran = plugin.run_command(
        &name,
        &options.arguments,
        input,
        &mut |bytes| sink.write(bytes),
        &mut |share| {
            output::show_progress(&bar, &name, (share * PARTS as f32) as usize, PARTS);
        },
    );
    bar.finish_and_clear();
    let file = options.file.display().to_string();
    match ran {
        Ok(report) => {
            tell(&file, &report);
            if report.exit == CommandExit::Done {
                sink.finish()?;
            }
            Ok(exit_code(&report))
        }
        // Whoever reads the output has enough.
        Err(CommandError::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
            Ok(ExitCode::SUCCESS)
        }
        Err(CommandError::Output(error)) => {
            Err(error).with_context(|| format!("the output of `{name}` cannot be written"))
        }
        Err(CommandError::Plugin(error)) => {
            bail!("{file}: {error}\n  remedy: {}", error.remedy())
        }
    }
}

/// Opens an input file, and nothing that could block the program.
fn open(path: &Path) -> anyhow::Result<File> {
    let place = || format!("cannot read '{}'", path.display());
    let metadata = path.metadata().with_context(place)?;
    if !metadata.is_file() {
        bail!("{}: it is no file\n  remedy: name a file", place());
    }
    File::open(path).with_context(place)
}

/// Returns the program's exit code for the outcome of a command.
pub(crate) fn exit_code(report: &CommandReport) -> ExitCode {
    ExitCode::from(match report.exit {
        CommandExit::Done => 0,
        CommandExit::InputAtFault => EXIT_INPUT,
        CommandExit::WrongUse => EXIT_USAGE,
    })
}

/// Prints the diagnostics of a command on its input.
pub(crate) fn tell(file: &str, report: &CommandReport) {
    for diagnostic in &report.diagnostics {
        let place = diagnostic.line.map_or(file.to_owned(), |line| format!("{file}:{line}"));
        let kind = match diagnostic.level {
            DiagnosticLevel::Warning => "warning: ",
            DiagnosticLevel::Error | DiagnosticLevel::Info => "",
        };
        output::line(&format!("{place}: {kind}{}", diagnostic.message));
    }
    if report.omitted > 0 {
        output::line(&format!("{file}: {} more such lines are not shown", report.omitted));
    }
}
