//! `faults --library LIB --out DIR [--injections N]` injects faults into plugins
//! beside a live view and writes what became of it. `busbar` must be beside it.
#![allow(clippy::print_stdout, reason = "what is done, and how it went, is its output")]

mod injection;
mod process;
mod process_boundary;
mod report;
mod results;
mod round;
mod scene;
mod subject;

use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Parser;

use crate::process::{descriptors, resident_bytes, threads};
use crate::results::{Results, Usage};
use crate::scene::FaultScene;

/// Greatest accepted number of injections.
const MAX_INJECTIONS: u64 = 10_000_000;

/// Injects faults into plugins beside a live view.
#[derive(Parser)]
struct Arguments {
    /// Path of the fault injector's library.
    #[arg(long)]
    library: PathBuf,
    /// Folder for the report; made if it does not exist.
    #[arg(long)]
    out: PathBuf,
    /// Least number of injections; a round has every fault once.
    #[arg(long, default_value_t = 10_000)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_INJECTIONS))]
    injections: u64,
    /// Number of kills in the measurement without other load.
    #[arg(long, default_value_t = 500)]
    #[arg(value_parser = clap::value_parser!(u64).range(1..=MAX_INJECTIONS))]
    kills: u64,
    /// Leave out what is to be measured without other load, and judge no times.
    #[arg(long)]
    storm_only: bool,
}

fn main() -> Result<()> {
    let Arguments { library, out, injections, kills, storm_only } = Arguments::parse();
    fs::create_dir_all(&out).with_context(|| {
        format!("cannot make {}: name a folder that you may write to", out.display())
    })?;
    let started = Instant::now();
    let mut border = None;
    if !storm_only {
        border = Some(process_boundary::measure(kills as usize).context("measuring the border")?);
        println!("measured the border in {:.0} s", started.elapsed().as_secs_f64());
    }

    let site = FaultScene::new(&library)?;
    let mut results = Results::new(border, site.plugins.len() + 1);
    while (results.records.len() as u64) < injections {
        let number = results.rounds;
        let round = round::run(&site, number).with_context(|| format!("in round {number}"))?;
        results.add(round);
        let usage = Usage {
            resident_bytes: resident_bytes(),
            descriptors: descriptors(),
            threads: threads(),
        };
        results.note_usage(usage);
        println!(
            "round {number}: {} injections, {:.0} s, {} MB, {} descriptors",
            results.records.len(),
            started.elapsed().as_secs_f64(),
            usage.resident_bytes / 1_000_000,
            usage.descriptors
        );
    }
    results.seconds = started.elapsed().as_secs_f64();
    for file in report::write(&results, &out)? {
        println!("{}", file.display());
    }
    let missed = results.missed_bars();
    if missed.is_empty() {
        return Ok(());
    }
    bail!("missed: {}", missed.join("; "))
}
