//! What the program prints: results to stdout, everything else to stderr.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::io::Write;
use std::path::Path;
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
    let name = path.file_name().with_context(|| {
        format!("cannot write '{}': it names no file; name one", path.display())
    })?;
    let mut temporary = name.to_owned();
    temporary.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(temporary);
    let written =
        std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, path));
    written.with_context(|| {
        let _ = std::fs::remove_file(&temporary);
        format!(
            "cannot write '{}'; check that its folder exists and may be written",
            path.display()
        )
    })
}

/// Writes JSON into a file.
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    write_file(path, text.as_bytes())
}

/// A progress bar on a terminal, and nothing elsewhere.
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
