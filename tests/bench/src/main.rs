//! `bench` measures Busbar on the paper's substation, flattened into one mesh,
//! beside what it is compared with. Run by `cargo xtask bench`.
//!
//! What is compared is measured in one process, in alternating rounds, so that
//! ratios hold on a machine that has other things to do.
#![allow(clippy::print_stdout, reason = "the tables are this program's output")]

mod optimizer;
mod orders;
mod report;
mod scene;
mod series;
mod stacks;

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};

use crate::report::{Report, Section};
use crate::scene::Scene;

/// Fewer rounds have no median worth telling.
const MIN_ROUNDS: usize = 7;
const MAX_ROUNDS: usize = 1000;

/// A section's name, and what measures it.
type Bench = (&'static str, fn(&Scene, usize, &ProgressBar) -> Result<Section>);

/// What is measured, in order: one file each.
const BENCHES: [Bench; 3] =
    [("optimizer", optimizer::run), ("orders", orders::run), ("collapse_stacks", stacks::run)];

/// Measures Busbar beside what it is compared with.
#[derive(Parser)]
struct Arguments {
    /// File to write the figures to, as JSON.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Rounds; medians, minima and maxima are over these.
    #[arg(long, default_value_t = 9, value_parser = parse_rounds)]
    rounds: usize,
    /// Run only these sections.
    #[arg(long, value_parser = BENCHES.map(|bench| bench.0))]
    only: Vec<String>,
}

fn parse_rounds(text: &str) -> Result<usize> {
    let rounds = text.parse()?;
    if !(MIN_ROUNDS..=MAX_ROUNDS).contains(&rounds) {
        bail!("give from {MIN_ROUNDS} to {MAX_ROUNDS} rounds");
    }
    Ok(rounds)
}

fn main() -> Result<()> {
    let Arguments { out, rounds, only } = Arguments::parse();
    // Hidden by itself where the output is not a terminal.
    let progress = ProgressBar::new(rounds as u64);
    progress.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}")?);
    progress.set_message("making the substation");
    let scene = Scene::paper()?;
    let mut report = Report::new(&scene, rounds);
    for (name, bench) in BENCHES {
        if only.is_empty() || only.iter().any(|wanted| wanted == name) {
            progress.set_message(name);
            progress.reset();
            let section =
                bench(&scene, rounds, &progress).with_context(|| format!("section {name}"))?;
            progress.suspend(|| println!("{}", section.table(name)));
            report.add(name, &section);
        }
    }
    progress.finish_and_clear();
    if let Some(path) = out {
        fs::write(&path, report.json()?).with_context(|| {
            format!("cannot write {}: name a file you may write", path.display())
        })?;
    }
    Ok(())
}
