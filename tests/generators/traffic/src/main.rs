//! `traffic --library LIB... --models DIR --out DIR` measures the way of values, from
//! an isolated plugin to the picture, and with `--python` and `--peers` what adapters do a
//! second beside the peers' own clients; and writes what it found. `busbar` must be beside
//! it.
#![allow(clippy::print_stdout, reason = "what is done, and how it went, is its output")]

mod avalanche;
mod drain;
mod pixel;
mod report;
mod requests;
mod scene;
mod sustained;

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Parser;
use serde::Serialize;

use crate::requests::Peers;
use crate::scene::GeneratedScene;

/// Measurement of values on their way from a plugin to the picture.
#[derive(Parser)]
struct Arguments {
    /// Libraries of the plugins: sample_generator, an overlay, and the adapters.
    #[arg(long, required = true)]
    library: Vec<PathBuf>,
    /// Folder of the demo's models.
    #[arg(long)]
    models: PathBuf,
    /// Python with the peers' packages; without it nothing is compared.
    #[arg(long, requires = "peers")]
    python: Option<PathBuf>,
    /// Folder of the peers' scripts.
    #[arg(long)]
    peers: Option<PathBuf>,
    /// Folder for the report; made if it does not exist.
    #[arg(long)]
    out: PathBuf,
    /// Run a tenth of everything, without bars.
    #[arg(long)]
    quick: bool,
}

/// Results of all measurements.
#[derive(Debug, Serialize)]
struct Results {
    drain: drain::DrainTimes,
    sustained: sustained::Sustained,
    requests: Option<requests::Requests>,
    pixel: pixel::Latency,
    avalanche: avalanche::Avalanche,
}

fn main() -> Result<()> {
    let Arguments { library, models, python, peers, out, quick } = Arguments::parse();
    fs::create_dir_all(&out).with_context(|| {
        format!("cannot make {}: name a folder that you may write to", out.display())
    })?;
    let site = GeneratedScene::new(&library, &models, if quick { 10 } else { 1 })?;
    let peers = python.zip(peers).map(|(python, scripts)| Peers { python, scripts });
    let requests = peers.as_ref().map(|peers| requests::measure(&site, peers)).transpose();
    let results = Results {
        requests: requests.context("requests a second")?,
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
        if bar.verdict == report_writer::Verdict::Missed {
            missed.push(bar.claim);
        }
    }
    if missed.is_empty() || quick { Ok(()) } else { bail!("missed: {}", missed.join("; ")) }
}
