//! Writer of a report's files.

use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::{Block, Document, html, markdown};

/// Writes `report.md`, `report.html` and the charts; returns the first two.
///
/// # Errors
/// When a file cannot be written; the error names it.
pub fn write(document: &Document, folder: &Path) -> io::Result<[PathBuf; 2]> {
    for block in &document.blocks {
        if let Block::Chart(chart) = block {
            write_file(&folder.join(&chart.file), &chart.svg)?;
        }
    }
    let files = ["report.md", "report.html"].map(|name| folder.join(name));
    write_file(&files[0], &markdown(document))?;
    write_file(&files[1], &html(document))?;
    Ok(files)
}

fn write_file(path: &Path, text: &str) -> io::Result<()> {
    fs::write(path, text).map_err(|error| {
        io::Error::new(error.kind(), format!("cannot write {}: {error}", path.display()))
    })
}
