//! Writer of the report's files.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::report::report;
use crate::results::Results;

/// Writes `report.md`, `report.html`, `report.json` and the charts; returns the
/// first three.
///
/// # Errors
/// When a file cannot be written.
pub fn write_report(results: &Results, folder: &Path) -> Result<[PathBuf; 3]> {
    let [markdown, html] = report_writer::write(&report(results), folder)?;
    let json = folder.join("report.json");
    fs::write(&json, serde_json::to_string_pretty(results)?)
        .with_context(|| format!("cannot write {}", json.display()))?;
    Ok([markdown, html, json])
}
