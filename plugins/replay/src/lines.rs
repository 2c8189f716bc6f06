//! Lines of a file, whatever is in it: of bounded length, each with its place.

use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

/// Longest line that is read. A record of 100,000 channels has less.
pub const MAX_LINE_BYTES: usize = 1 << 20;
/// Ends a text file in DOS.
const DOS_END_OF_FILE: u8 = 0x1A;

/// What was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A line, without its end.
    Whole,
    /// A line longer than [`MAX_LINE_BYTES`]: passed over.
    TooLong,
    /// The file has no more.
    End,
}

/// Reads lines that end with LF or CR LF.
#[derive(Debug)]
pub struct Lines<R> {
    reader: BufReader<R>,
    /// Where the next line starts, bytes from the start of the file.
    offset: u64,
    /// Number of the next line, the first being 1.
    number: u64,
}

impl<R: Read + Seek> Lines<R> {
    /// Lines from a place of a file on, which is the start of a line.
    ///
    /// # Errors
    /// Those of the file.
    pub fn from(file: R, offset: u64, number: u64) -> io::Result<Self> {
        let mut lines = Self { reader: BufReader::new(file), offset, number };
        lines.go_to(offset, number)?;
        Ok(lines)
    }

    /// Goes on from the start of another line.
    ///
    /// # Errors
    /// Those of the file.
    pub fn go_to(&mut self, offset: u64, number: u64) -> io::Result<()> {
        self.reader.seek(SeekFrom::Start(offset))?;
        (self.offset, self.number) = (offset, number);
        Ok(())
    }

    /// Where the next line starts, bytes from the start of the file.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Number of the next line, the first being 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Reads the next line into `line`, without its end.
    ///
    /// # Errors
    /// Those of the file.
    pub fn read(&mut self, line: &mut Vec<u8>) -> io::Result<Line> {
        line.clear();
        let mut is_too_long = false;
        let mut is_ended = false;
        let started = self.offset;
        while !is_ended {
            let found = self.reader.fill_buf()?;
            if found.is_empty() {
                break;
            }
            let end = found.iter().position(|&byte| byte == b'\n');
            let text = &found[..end.unwrap_or(found.len())];
            is_too_long |= line.len() + text.len() > MAX_LINE_BYTES;
            if !is_too_long {
                line.extend_from_slice(text);
            }
            is_ended = end.is_some();
            let used = text.len() + usize::from(is_ended);
            self.reader.consume(used);
            self.offset += used as u64;
        }
        if self.offset == started {
            return Ok(Line::End);
        }
        self.number += 1;
        if is_too_long {
            return Ok(Line::TooLong);
        }
        if line.last() == Some(&b'\r') {
            line.pop();
        }
        // Nothing but the mark: there is no such line.
        if !is_ended && line[..] == [DOS_END_OF_FILE] {
            return Ok(Line::End);
        }
        Ok(Line::Whole)
    }
}

#[cfg(test)]
#[path = "lines_tests.rs"]
mod tests;
