//! The report's files.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::document::Block;
use crate::html::html;
use crate::markdown::markdown;
use crate::report::report;
use crate::results::Results;

/// Writes `report.md`, `report.html`, `report.json` and the charts; returns the
/// first three.
///
/// # Errors
/// When a file cannot be written.
pub fn write_report(results: &Results, folder: &Path) -> Result<[PathBuf; 3]> {
    let document = report(results);
    for block in &document.blocks {
        if let Block::Chart(chart) = block {
            write(&folder.join(&chart.file), &chart.svg)?;
        }
    }
    let files = ["report.md", "report.html", "report.json"].map(|name| folder.join(name));
    write(&files[0], &markdown(&document))?;
    write(&files[1], &html(&document))?;
    write(&files[2], &serde_json::to_string_pretty(results)?)?;
    Ok(files)
}

fn write(path: &Path, text: &str) -> Result<()> {
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
