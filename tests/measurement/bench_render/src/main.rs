//! `bench_render` measures frames of Busbar beside other viewers, all on one core of the
//! same rasteriser, and reports. Run by `cargo xtask bench-render`.
#![allow(clippy::print_stdout, reason = "what is done, and how it went, is its output")]

mod busbar_renderer;
mod camera;
mod frames;
mod many_stations;
mod render_protocol;
mod renderer_process;
mod report;
mod scenes;
mod screen_error;
mod startup;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};

use crate::report::Results;
use crate::scenes::Scenes;

/// Sections of the measurement, in order.
const SECTIONS: [&str; 4] = ["frames", "screen_error", "start", "many"];

/// Comparison of Busbar's frames with those of other viewers.
#[derive(Parser)]
#[command(args_conflicts_with_subcommands = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// Folder for the report and pictures; made if it does not exist.
    #[arg(long, default_value = "target/bench_render")]
    out: PathBuf,
    /// Folder of the optimisers' libraries.
    #[arg(long, default_value = "config/plugins")]
    plugins: PathBuf,
    /// Python with the peers' packages; without it nothing is compared.
    #[arg(long)]
    python: Option<PathBuf>,
    /// Folder of the peers' scripts.
    #[arg(long, default_value = "tests/end_to_end/peers")]
    scripts: PathBuf,
    /// Core that every renderer runs on.
    #[arg(long, default_value = "1")]
    core: String,
    /// Path of the program that users run.
    #[arg(long, default_value = "target/release/busbar")]
    busbar: PathBuf,
    /// Run only these sections.
    #[arg(long, value_parser = SECTIONS)]
    only: Vec<String>,
    /// Rounds; medians are over the frames of these.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
}

#[derive(Subcommand)]
enum Command {
    /// Draw what the input asks for.
    #[command(hide = true)]
    Worker,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    match arguments.command {
        Some(Command::Worker) => busbar_renderer::serve(),
        None => bench(&arguments),
    }
}

fn bench(arguments: &Arguments) -> Result<()> {
    let Arguments { out, plugins, python, scripts, core, rounds, busbar, only, .. } = arguments;
    fs::create_dir_all(out).with_context(|| {
        format!("cannot make {}: name a folder that you may write to", out.display())
    })?;
    let out = &out.canonicalize()?;
    let folder = tempfile::tempdir()?;
    let folder = folder.path();
    symlink(plugins.canonicalize()?, folder.join("plugins"))?;
    let scenes = Scenes::make(folder, &plugins.canonicalize()?)?;
    let renderers = renderer_process::renderers(python.as_deref(), scripts)?;
    let pace = (core.as_str(), *rounds);
    let wants = |section: &str| only.is_empty() || only.iter().any(|wanted| wanted == section);
    let mut results = Results::default();
    if wants("frames") {
        results.frames = frames::measure(&scenes, &renderers, pace, out)?;
    }
    if wants("screen_error") {
        results.followed = screen_error::measure(&scenes, &renderers, pace, folder, out)?;
    }
    if wants("start") {
        let camera = camera::orbit(scenes.bounds, 1, 1.0)[0];
        let glb = &scenes.levels.first().context("no scene")?.glb;
        results.starts = startup::measure(glb, camera, pace, busbar, out)?;
    }
    if wants("many") {
        let busbar_renderer = renderers.first().context("nobody draws")?;
        results.many = many_stations::measure(&scenes, busbar_renderer, pace, folder, out)?;
    }
    for file in report::write(&results, out)? {
        println!("{}", file.display());
    }
    for bar in report::bars(&results) {
        println!("{:<7} {} ({})", bar.verdict.word(), bar.claim, bar.figure);
    }
    Ok(())
}
