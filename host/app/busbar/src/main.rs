//! The Busbar program: arguments, window, composition.

mod arguments;
mod benchmark;
mod check;
mod command;
mod config_upgrade;
mod doctor;
mod embedded;
mod exit_codes;
mod import;
mod kiosk;
mod log;
mod log_command;
mod metrics;
mod optimize;
mod output;
mod plugin;
mod render;
mod serve;
mod simulate;
mod systemd;
mod view;
mod window_watch;
mod x11_window_events;

use std::panic::AssertUnwindSafe;
use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Command, ConfigCommand, LogCommand, PluginCommand};
use exit_codes::{EXIT_INPUT, EXIT_INTERNAL};
use log::Log;

/// Allocator with huge pages: models are many megabytes.
#[global_allocator]
static HEAP: busbar_process_heap::HugePageAllocator = busbar_process_heap::HugePageAllocator;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    // After a panic nothing of this is looked at again.
    match std::panic::catch_unwind(AssertUnwindSafe(|| run(arguments))) {
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

fn run(arguments: Arguments) -> anyhow::Result<ExitCode> {
    if matches!(
        arguments.command,
        Command::View(_) | Command::Render(_) | Command::Embedded | Command::Benchmark(_)
    ) {
        busbar_process_heap::configure_allocator();
        busbar_viewer::set_memory_release(busbar_process_heap::release_freed_memory);
    }
    let log = match arguments.command {
        Command::PluginHost => {
            log::start_of_plugin();
            None
        }
        // It has nobody to tell, and the viewer's log is the viewer's.
        Command::WatchWindow { .. } => None,
        _ => Some(Log::start(&arguments.log)),
    };
    match arguments.command {
        Command::View(options) => view::run(&options, log),
        Command::Render(options) => render::run(&options),
        Command::Benchmark(options) => benchmark::run(&options),
        Command::Check { config } => check::run(&config),
        Command::Doctor(options) => doctor::run(&options),
        Command::Optimize(options) => optimize::run(&options),
        Command::Simulate(options) => simulate::run(&options),
        Command::Import(options) => import::run(&options),
        Command::Serve(options) => serve::run(&options),
        Command::Log { command: LogCommand::Verify { folder, key, anchor } } => {
            log_command::verify(&folder, key.as_deref(), anchor.as_deref())
        }
        Command::Config { command: ConfigCommand::Upgrade { file, dry_run } } => {
            config_upgrade::run(&file, dry_run)
        }
        Command::Schema => output::json(&busbar_config::schema()),
        Command::Plugin { command } => match command {
            PluginCommand::List { config, schema } => plugin::list(config.as_deref(), schema),
            PluginCommand::Check(options) => plugin::check::run(&options),
            PluginCommand::New(options) => plugin::new::run(&options),
            PluginCommand::Run(options) => plugin::run::run(&options),
            PluginCommand::Sign { library, key } => plugin::sign(&library, &key),
            PluginCommand::RunCase { request } => Ok(plugin::check::case(&request)),
        },
        Command::PluginHost => plugin::host(),
        Command::Embedded => embedded::run(),
        Command::WatchWindow { window } => window_watch::run(window),
        Command::Offered(words) => command::run(words),
    }
}
