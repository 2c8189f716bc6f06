//! The Busbar program: arguments, window, composition.

mod arguments;
mod check;
mod command;
mod embedded;
mod import;
mod optimize;
mod output;
mod plugin;
mod render;
mod serve;
mod simulate;
mod view;

use std::process::ExitCode;

use clap::Parser;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::debug_fn;

use arguments::{Arguments, Command, PluginCommand};

/// Input or environment at fault.
const EXIT_INPUT: u8 = 1;
/// Busbar at fault.
const EXIT_INTERNAL: u8 = 3;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let filter = EnvFilter::try_from_env("BUSBAR_LOG").unwrap_or_else(|_| "info".into());
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    match arguments.command {
        // The viewer reads these lines: level and message, the rest it adds.
        Command::PluginHost => {
            log.with_ansi(false)
                .without_time()
                .with_target(false)
                .fmt_fields(message_only())
                .init();
        }
        _ => log.compact().init(),
    }
    match std::panic::catch_unwind(|| run(arguments)) {
        Ok(Ok(code)) => code,
        Ok(Err(error)) => {
            output::error(&error);
            ExitCode::from(EXIT_INPUT)
        }
        // The panic hook has printed what and where.
        Err(_) => {
            output::line("error: this is a fault of Busbar itself; please report it");
            ExitCode::from(EXIT_INTERNAL)
        }
    }
}

/// Writes the message of a log line and none of its fields.
fn message_only() -> impl for<'w> FormatFields<'w> + 'static {
    debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        _ => Ok(()),
    })
}

fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    match arguments.command {
        Command::View(options) => view::run(&options),
        Command::Render(options) => render::run(&options),
        Command::Check { config } => check::run(&config),
        Command::Optimize(options) => optimize::run(&options),
        Command::Simulate(options) => simulate::run(&options),
        Command::Import(options) => import::run(&options),
        Command::Serve(options) => serve::run(&options),
        Command::Schema => output::json(&busbar_viewer::schema()),
        Command::Plugin { command } => match command {
            PluginCommand::List { config, schema } => plugin::list(config.as_deref(), schema),
            PluginCommand::Check(options) => plugin::check::run(&options),
            PluginCommand::New(options) => plugin::new::run(&options),
            PluginCommand::Sign { library, key } => plugin::sign(&library, &key),
            PluginCommand::RunCase { request } => Ok(plugin::check::case(&request)),
        },
        Command::PluginHost => plugin::host(),
        Command::Embedded => embedded::run(),
        Command::Offered(words) => command::run(words),
    }
}
