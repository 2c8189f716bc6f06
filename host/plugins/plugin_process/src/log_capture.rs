//! Log capture: lines that a plugin's process writes to its standard output and error.

use std::io::{PipeReader, Read};
use std::time::{Duration, Instant};

use busbar_plugin_host::shown;

/// Bytes of one line; the rest of it is cut.
const MAX_LINE_BYTES: usize = 2048;
/// Lines a second that reach the log.
const MAX_LINES_PER_SECOND: u32 = 100;
/// Bytes read at once, so that a flood of lines holds nothing up.
const MAX_READ_BYTES: usize = 1 << 16;

/// Cuts output into lines and writes them to the log.
pub(crate) struct OutputLog {
    pipe: PipeReader,
    rest: Vec<u8>,
    second: Instant,
    lines: u32,
    dropped: u64,
}

impl OutputLog {
    /// Reads from a pipe that does not block.
    pub(crate) fn new(pipe: PipeReader) -> Self {
        Self { pipe, rest: Vec::new(), second: Instant::now(), lines: 0, dropped: 0 }
    }

    pub(crate) fn pipe(&self) -> &PipeReader {
        &self.pipe
    }

    /// Reads the available output; false at the end of the pipe.
    pub(crate) fn read(&mut self, plugin: &str) -> bool {
        let mut buffer = vec![0; MAX_READ_BYTES];
        match self.pipe.read(&mut buffer) {
            Ok(0) => false,
            Ok(count) => {
                self.append(&buffer[..count], plugin);
                true
            }
            Err(error) => matches!(
                error.kind(),
                std::io::ErrorKind::WouldBlock | std::io::ErrorKind::Interrupted
            ),
        }
    }

    /// Logs the rest of an unfinished line.
    pub(crate) fn finish(&mut self, plugin: &str) {
        if !self.rest.is_empty() {
            self.append(b"\n", plugin);
        }
    }

    fn append(&mut self, bytes: &[u8], plugin: &str) {
        for piece in bytes.split_inclusive(|&byte| byte == b'\n') {
            let (text, whole) = match piece.split_last() {
                Some((b'\n', text)) => (text, true),
                _ => (piece, false),
            };
            let room = MAX_LINE_BYTES.saturating_sub(self.rest.len());
            self.rest.extend_from_slice(&text[..text.len().min(room)]);
            if whole {
                let line = std::mem::take(&mut self.rest);
                self.line(&line, plugin);
            }
        }
    }

    fn line(&mut self, line: &[u8], plugin: &str) {
        if self.second.elapsed() >= Duration::from_secs(1) {
            (self.second, self.lines) = (Instant::now(), 0);
            let dropped = std::mem::take(&mut self.dropped);
            if dropped > 0 {
                tracing::warn!(%plugin, "{dropped} log lines dropped: too many a second");
            }
        }
        if self.lines >= MAX_LINES_PER_SECOND {
            self.dropped += 1;
            return;
        }
        self.lines += 1;
        let text = shown(&String::from_utf8_lossy(line), MAX_LINE_BYTES);
        let (level, text) = level_of(text.trim());
        match level {
            "ERROR" => tracing::error!(%plugin, "{text}"),
            "WARN" => tracing::warn!(%plugin, "{text}"),
            "DEBUG" | "TRACE" => tracing::debug!(%plugin, "{text}"),
            _ => tracing::info!(%plugin, "{text}"),
        }
    }
}

/// The level before a line of the process's own log; what else a plugin writes
/// has none.
fn level_of(line: &str) -> (&str, &str) {
    match line.split_once(' ') {
        Some((level @ ("ERROR" | "WARN" | "INFO" | "DEBUG" | "TRACE"), text)) => {
            (level, text.trim_start())
        }
        _ => ("", line),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Write, pipe};

    use super::*;

    #[test]
    fn levels_are_taken_off_lines_of_the_log_alone() {
        assert_eq!(level_of("WARN it is hot"), ("WARN", "it is hot"));
        assert_eq!(level_of("WARNING it is hot"), ("", "WARNING it is hot"));
        assert_eq!(level_of(""), ("", ""));
    }

    #[test]
    fn an_endless_line_is_cut_and_a_flood_is_counted() {
        let (reader, mut writer) = pipe().unwrap();
        let mut output = OutputLog::new(reader);
        writer.write_all(&vec![b'x'; 3 * MAX_LINE_BYTES]).unwrap();
        assert!(output.read("p"));
        assert_eq!(output.rest.len(), MAX_LINE_BYTES);
        writer.write_all(&b"\n".repeat(MAX_LINES_PER_SECOND as usize + 5)).unwrap();
        assert!(output.read("p"));
        assert!(output.rest.is_empty());
        assert_eq!((output.lines, output.dropped), (MAX_LINES_PER_SECOND, 5));
        drop(writer);
        assert!(!output.read("p"), "the end");
    }
}
