//! `traffic --library LIB... --models DIR --out DIR` measures the way of values, from
//! an isolated plugin to the picture, and writes what it found. `busbar` must be
//! beside it.
#![allow(clippy::print_stdout, reason = "what is done, and how it went, is its output")]

mod avalanche;
mod drain;
mod pixel;
mod report;
mod site;
mod sustained;

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Parser;
use serde::Serialize;

use crate::site::Site;

/// Measures the way of values, from a plugin to the picture.
#[derive(Parser)]
struct Arguments {
    /// Libraries of the plugins: sample_generator and an overlay.
    #[arg(long, required = true)]
    library: Vec<PathBuf>,
    /// Folder of the demo's models.
    #[arg(long)]
    models: PathBuf,
    /// Folder for the report; made if it does not exist.
    #[arg(long)]
    out: PathBuf,
    /// A tenth of everything, and no bar.
    #[arg(long)]
    quick: bool,
}

/// All that was measured.
#[derive(Debug, Serialize)]
struct Results {
    drain: drain::Drain,
    sustained: sustained::Sustained,
    pixel: pixel::Latency,
    avalanche: avalanche::Avalanche,
}

fn main() -> Result<()> {
    let Arguments { library, models, out, quick } = Arguments::parse();
    fs::create_dir_all(&out).with_context(|| {
        format!("cannot make {}: name a folder that you may write to", out.display())
    })?;
    let site = Site::new(&library, &models, if quick { 10 } else { 1 })?;
    let results = Results {
        drain: drain::measure(&site).context("draining")?,
        avalanche: avalanche::measure(&site).context("in the avalanche")?,
        pixel: pixel::measure(&site).context("from change to picture")?,
        sustained: sustained::measure(&site).context("beside sustained updates")?,
    };
    for file in report::write(&results, &out)? {
        println!("{}", file.display());
    }
    let mut missed = Vec::new();
    for bar in report::bars(&results) {
        println!("{:<7} {} ({})", bar.verdict.word(), bar.claim, bar.figure);
        if bar.verdict == document::Verdict::Missed {
            missed.push(bar.claim);
        }
    }
    if missed.is_empty() || quick { Ok(()) } else { bail!("missed: {}", missed.join("; ")) }
}
