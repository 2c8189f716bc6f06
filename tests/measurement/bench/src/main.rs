//! `bench` measures Busbar beside what it is compared with, and reports. Run by
//! `cargo xtask bench`.
//!
//! Sections on the paper's substation, flattened into one mesh, measure in one
//! process, in alternating rounds, so that ratios hold on a machine that has
//! other things to do. The section `levels` starts a process a method.
#![allow(clippy::print_stdout, reason = "the tables are this program's output")]

mod affinity;
mod levels;
mod memory;
mod optimizer;
mod optimizers;
mod orders;
mod report;
mod scene;
mod series;
mod stacks;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use report_writer::{Claim, Document};
use serde_json::{Map, Value, json};

use crate::levels::Plan;
use crate::report::Section;
use crate::scene::Scene;

/// Least number of rounds for a median.
const MIN_ROUNDS: usize = 7;
const MAX_ROUNDS: usize = 1000;
/// Sections of the measurement, in order.
const SECTIONS: [&str; 4] = ["optimizer", "orders", "collapse_stacks", "levels"];

/// Comparison of Busbar with its peers.
#[derive(Parser)]
#[command(args_conflicts_with_subcommands = true)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// Folder for report.md, report.html, report.json and pictures.
    #[arg(long, default_value = "target/bench")]
    out: PathBuf,
    /// Rounds; medians, minima and maxima are over these.
    #[arg(long, default_value_t = 9, value_parser = parse_rounds)]
    rounds: usize,
    /// Run only these sections.
    #[arg(long, value_parser = SECTIONS)]
    only: Vec<String>,
    /// Leave large meshes out of the levels.
    #[arg(long)]
    quick: bool,
    /// A further mesh for the levels, glTF or PLY.
    #[arg(long)]
    mesh: Vec<PathBuf>,
    /// A scan for the levels that the bars are about, glTF or PLY.
    #[arg(long)]
    scan: Option<PathBuf>,
    /// Python with the peers' packages.
    #[arg(long, requires = "scripts")]
    python: Option<PathBuf>,
    /// Folder of the peers' scripts.
    #[arg(long)]
    scripts: Option<PathBuf>,
    /// Folder of built plugins, to measure what their boundary costs.
    #[arg(long)]
    plugins: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    /// Worker: one method on one mesh, started by the bench.
    #[command(hide = true)]
    Worker(levels::worker::Task),
}

fn parse_rounds(text: &str) -> Result<usize> {
    let rounds = text.parse()?;
    if !(MIN_ROUNDS..=MAX_ROUNDS).contains(&rounds) {
        bail!("give from {MIN_ROUNDS} to {MAX_ROUNDS} rounds");
    }
    Ok(rounds)
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    if let Some(Command::Worker(task)) = &arguments.command {
        println!("{}", serde_json::to_string(&levels::worker::run(task)?)?);
        return Ok(());
    }
    let out = &arguments.out;
    fs::create_dir_all(out).with_context(|| {
        format!("cannot make the folder {}: name one that you may write to", out.display())
    })?;
    // Hidden by itself where the output is not a terminal.
    let progress = ProgressBar::new(arguments.rounds as u64);
    progress.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}")?);
    progress.set_message("making the substation");
    let scene = Scene::paper()?;
    let found = measure_all(&scene, &arguments, &progress)?;
    progress.finish_and_clear();
    let [markdown, html] = report_writer::write(&found.document(&scene), out)?;
    let json = out.join("report.json");
    fs::write(&json, serde_json::to_string_pretty(&found.json(&scene))?)
        .with_context(|| format!("cannot write {}", json.display()))?;
    for claim in found.bars() {
        println!("{:<7} {} ({})", claim.verdict.word(), claim.claim, claim.figure);
    }
    println!("{}\n{}\n{}", markdown.display(), html.display(), json.display());
    Ok(())
}

/// Results of all sections.
struct BenchResults {
    rounds: usize,
    sections: Vec<(&'static str, Section)>,
    levels: Option<levels::Levels>,
}

fn measure_all(
    scene: &Scene,
    arguments: &Arguments,
    progress: &ProgressBar,
) -> Result<BenchResults> {
    let mut found = BenchResults { rounds: arguments.rounds, sections: Vec::new(), levels: None };
    let only = &arguments.only;
    for name in SECTIONS {
        if !only.is_empty() && !only.iter().any(|wanted| wanted == name) {
            continue;
        }
        progress.set_length(arguments.rounds as u64);
        progress.set_message(name);
        progress.reset();
        let (rounds, context) = (arguments.rounds, || format!("section {name}"));
        let plugins = arguments.plugins.as_deref();
        let section = match name {
            "optimizer" => optimizer::run(scene, rounds, plugins, progress),
            "orders" => orders::run(scene, rounds, progress),
            "collapse_stacks" => stacks::run(scene, rounds, progress),
            _ => {
                let levels = levels::run(scene, &plan(arguments), progress);
                found.levels = Some(levels.with_context(context)?);
                continue;
            }
        };
        let section = section.with_context(context)?;
        progress.suspend(|| println!("{}", section.table(name)));
        found.sections.push((name, section));
    }
    Ok(found)
}

fn plan(arguments: &Arguments) -> Plan {
    let scripts = arguments.scripts.as_deref().unwrap_or(Path::new("."));
    Plan {
        peers: levels::peers(arguments.python.as_deref(), scripts),
        files: arguments.mesh.clone(),
        scan: arguments.scan.clone(),
        quick: arguments.quick,
        out: arguments.out.clone(),
    }
}

impl BenchResults {
    fn bars(&self) -> Vec<Claim> {
        let sections = self.sections.iter().flat_map(|(name, section)| section.bars(name));
        sections.chain(self.levels.iter().flat_map(levels::bars)).collect()
    }

    fn document(&self, scene: &Scene) -> Document {
        let mut document =
            Document { title: "Busbar beside the field".to_owned(), blocks: Vec::new() };
        if let Some(levels) = &self.levels {
            levels::write_worse(&mut document, levels);
        }
        report::claims(&mut document, "Bars", self.bars());
        if !self.sections.is_empty() {
            document.heading("The paper's scene");
            let topology = &scene.topology;
            document.text(format!(
                "{} vertices, {} triangles; {} rounds on {} cores.",
                report_writer::number_format::grouped(topology.positions.len() as u64),
                report_writer::number_format::grouped(topology.triangles.len() as u64),
                self.rounds,
                cores()
            ));
        }
        for (name, section) in &self.sections {
            section.write(&mut document, name);
        }
        if let Some(levels) = &self.levels {
            levels::write(&mut document, levels);
        }
        document
    }

    fn json(&self, scene: &Scene) -> Value {
        let sections = self.sections.iter().map(|(name, s)| ((*name).to_owned(), s.json()));
        json!({
            "cores": cores(),
            "rounds": self.rounds,
            "vertices": scene.topology.positions.len(),
            "triangles": scene.topology.triangles.len(),
            "sections": Value::Object(sections.collect::<Map<_, _>>()),
            "levels": self.levels,
        })
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
