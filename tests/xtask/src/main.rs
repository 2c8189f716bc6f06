//! The project's commands, run as `cargo xtask NAME`.
//!
//! Invariant: no child process outlives a command.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "what is done, and how it went, is this program's output"
)]

mod bench;
mod bench_render;
mod book;
mod checkout_times;
mod demo;
mod deny;
mod faults;
mod install;
mod motion;
mod packages;
mod paper;
mod pictures;
mod process;
mod python;
mod references;
mod rest;
mod scan;
mod simulator;
mod sites;
mod soak;
mod stage;
mod station;
mod steps;
mod summary;
mod test;
mod traffic;
mod viewer;
mod workspace;
mod x_server;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::workspace::Workspace;

/// Project commands of Busbar.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install what is missing, build, and show the live station.
    Demo(demo::Arguments),
    /// Build the plugins and models and put them where the demo scene looks.
    Stage(stage::Arguments),
    /// Put program, library, header and plugins below a prefix, for programs that embed a view.
    Install(install::Arguments),
    /// Install what is missing and run all that CI runs.
    Test(test::Arguments),
    /// Run the long tests: fuzzing, failing calls to Vulkan, kills beside the alarm log.
    Soak(soak::Arguments),
    /// Let every fault of a plugin strike beside a live view, 10,000 times.
    Faults(faults::Arguments),
    /// Measure the way of values, from a plugin to the picture.
    Traffic(traffic::Arguments),
    /// Measure one viewer on a broker that carries a hundred stations.
    Sites(sites::Arguments),
    /// Run the benches and comparisons.
    Bench(bench::Arguments),
    /// Measure frames beside other viewers.
    BenchRender(bench_render::Arguments),
    /// Measure the processor time of a viewer with nothing to do.
    Rest(rest::Arguments),
    /// Measure how a viewer's window answers: dragging, rest after it, keys.
    Motion(motion::Arguments),
    /// Measure what the paper measured and judge what it says.
    Paper(paper::Arguments),
    /// Compare the calculations of plugins with independent ones.
    References(references::Arguments),
    /// Make the pictures of the README and the book.
    Pictures,
    /// Generate, build and link-check the book.
    Book(book::Arguments),
    /// Check licences, sources and duplicates of dependencies.
    Deny,
}

fn main() -> ExitCode {
    match run(Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(1)
        }
    }
}

fn run(command: Command) -> Result<()> {
    process::catch_signals()?;
    let workspace = Workspace::find()?;
    match command {
        Command::Book(arguments) => book::run(&workspace, &arguments),
        Command::BenchRender(arguments) => bench_render::run(&workspace, &arguments),
        Command::Deny => deny::run(&workspace),
        Command::Demo(arguments) => demo::run(&workspace, &arguments),
        Command::Stage(arguments) => stage::run(&workspace, &arguments),
        Command::Install(arguments) => install::run(&workspace, &arguments),
        Command::Test(arguments) => test::run(&workspace, &arguments),
        Command::Soak(arguments) => soak::run(&workspace, &arguments),
        Command::Traffic(arguments) => traffic::run(&workspace, &arguments),
        Command::Sites(arguments) => sites::run(&workspace, &arguments),
        Command::Faults(arguments) => faults::run(&workspace, &arguments),
        Command::Bench(arguments) => bench::run(&workspace, &arguments),
        Command::Motion(arguments) => motion::run(&workspace, &arguments),
        Command::Paper(arguments) => paper::run(&workspace, &arguments),
        Command::References(arguments) => references::run(&workspace, &arguments),
        Command::Rest(arguments) => rest::run(&workspace, &arguments),
        Command::Pictures => pictures::run(&workspace),
    }
}
