//! Output of the program: results to stdout, everything else to stderr.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::fs::File;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

/// Prints one line to stderr.
pub(crate) fn line(text: &str) {
    eprintln!("{text}");
}

/// Prints an error with its causes, once.
pub(crate) fn error(error: &anyhow::Error) {
    let text = format!("{error:#}");
    // Diagnostics say `error:` themselves, with their place before it.
    if text.contains(": error: ") { eprintln!("{text}") } else { eprintln!("error: {text}") }
}

/// Prints a line of a result to stdout; a closed pipe is no failure.
pub(crate) fn result(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}").and_then(|()| std::io::stdout().flush());
}

/// Prints JSON to stdout.
pub(crate) fn json(value: &Value) -> anyhow::Result<ExitCode> {
    result(&serde_json::to_string_pretty(value)?);
    Ok(ExitCode::SUCCESS)
}

/// Writes a file whole or not at all.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let temporary = beside(path)?;
    let written = std::fs::write(&temporary, bytes).and_then(|()| {
        // A file that is replaced stays as secret, or as public, as it was.
        if let Ok(former) = std::fs::metadata(path) {
            std::fs::set_permissions(&temporary, former.permissions())?;
        }
        std::fs::rename(&temporary, path)
    });
    written.with_context(|| {
        let _ = std::fs::remove_file(&temporary);
        not_written(path)
    })
}

/// Returns the temporary path at which a file is written before it is renamed.
fn beside(path: &Path) -> anyhow::Result<PathBuf> {
    let name = path.file_name().with_context(|| {
        format!("cannot write '{}': it names no file; name one", path.display())
    })?;
    let mut temporary = name.to_owned();
    temporary.push(format!(".{}.tmp", std::process::id()));
    Ok(path.with_file_name(temporary))
}

fn not_written(path: &Path) -> String {
    format!("cannot write '{}'; check that its folder exists and may be written", path.display())
}

/// Sink for a result of any length, written piece by piece.
pub(crate) enum Sink {
    /// Standard output; on a terminal without control characters, which a plugin may have put
    /// there.
    Stdout { is_terminal: bool },
    /// File that is written whole or not at all.
    File { path: PathBuf, temporary: PathBuf, file: Option<BufWriter<File>> },
}

impl Sink {
    /// Opens a sink into this file, or to stdout.
    pub(crate) fn open(path: Option<&Path>) -> anyhow::Result<Self> {
        let Some(path) = path else {
            return Ok(Self::Stdout { is_terminal: io::stdout().is_terminal() });
        };
        let temporary = beside(path)?;
        let file = File::create(&temporary).with_context(|| not_written(path))?;
        Ok(Self::File { path: path.to_owned(), temporary, file: Some(BufWriter::new(file)) })
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Stdout { is_terminal: false } => io::stdout().write_all(bytes),
            Self::Stdout { is_terminal: true } => {
                let is_shown = |byte: u8| byte >= b' ' && byte != 0x7f || b"\n\t".contains(&byte);
                let shown: Vec<_> =
                    bytes.iter().map(|&byte| if is_shown(byte) { byte } else { b'?' }).collect();
                io::stdout().write_all(&shown)
            }
            Self::File { file: Some(file), .. } => file.write_all(bytes),
            Self::File { file: None, .. } => Err(io::Error::other("the file is closed")),
        }
    }

    /// Completes the output: a file is renamed to its path.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        match &mut self {
            // A closed pipe is no failure.
            Self::Stdout { .. } => drop(io::stdout().flush()),
            Self::File { path, temporary, file } => {
                let flushed = file.take().map_or(Ok(()), |mut file| file.flush());
                flushed
                    .and_then(|()| std::fs::rename(&temporary, &path))
                    .with_context(|| not_written(path))?;
            }
        }
        Ok(())
    }
}

impl Drop for Sink {
    fn drop(&mut self) {
        // What was not finished goes; what was has another name.
        if let Self::File { temporary, .. } = self {
            let _ = std::fs::remove_file(temporary);
        }
    }
}

/// Writes JSON into a file.
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    write_file(path, text.as_bytes())
}

/// Creates a progress bar on a terminal, and nothing elsewhere.
pub(crate) fn progress_bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:28} {wide_bar} {pos}/{len}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1).with_style(style)
}

/// Shows a stage on a progress bar.
pub(crate) fn show_progress(bar: &ProgressBar, stage: &str, done: usize, total: usize) {
    bar.set_message(stage.to_owned());
    bar.set_length(total as u64);
    bar.set_position(done as u64);
}
