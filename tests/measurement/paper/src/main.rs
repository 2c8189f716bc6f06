//! `paper OUT_DIR --plugins DIR` measures and writes the report.
#![allow(clippy::print_stdout, reason = "where the report is, is this program's output")]

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Parser;
use paper::{Effort, Progress, measure, write_report};

/// Reproduction of the paper's Table I and Figures 5 to 8.
#[derive(Parser)]
struct Arguments {
    /// Folder to write to; made if it does not exist.
    out_dir: PathBuf,
    /// Folder with the library of weighted_collapse.
    #[arg(long)]
    plugins: PathBuf,
    /// Measure less: fewer frames, moves and points.
    #[arg(long)]
    quick: bool,
}

fn main() -> Result<()> {
    let Arguments { out_dir, plugins, quick } = Arguments::parse();
    fs::create_dir_all(&out_dir).with_context(|| {
        format!("cannot make {}: name a folder that you may write to", out_dir.display())
    })?;
    let effort = if quick { Effort::QUICK } else { Effort::FULL };
    let progress = Progress::new()?;
    let results = measure(&out_dir, &plugins, &effort, &progress);
    progress.finish();
    for file in write_report(&results?, &out_dir)? {
        println!("{}", file.display());
    }
    Ok(())
}
