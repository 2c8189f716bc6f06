//! Line reader for untrusted files: lines of bounded length, each with its place.

use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};

use crate::TextEncoding;

/// Bytes of the longest line that is read. A record of 100,000 channels has fewer.
pub const MAX_LINE_BYTES: usize = 1 << 20;
/// Ends a text file in DOS.
const DOS_END_OF_FILE: u8 = 0x1A;

/// Outcome of reading a line.
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
    /// Bytes of a line's end, in the text's encoding.
    line_feed: &'static [u8],
    carriage_return: &'static [u8],
    /// Offset of the next line, bytes from the start of the file.
    offset: u64,
    /// Number of the next line, the first being 1.
    number: u64,
}

impl<R: Read + Seek> Lines<R> {
    /// Reads lines from a place of a file on, which is the start of a line.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn from(file: R, offset: u64, number: u64) -> io::Result<Self> {
        Self::of_encoding(file, TextEncoding::default(), offset, number)
    }

    /// Reads lines of a text in an encoding, whose line feed may have two bytes.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn of_encoding(
        file: R,
        encoding: TextEncoding,
        offset: u64,
        number: u64,
    ) -> io::Result<Self> {
        let mut lines = Self::from_stream(file, encoding);
        lines.go_to(offset, number)?;
        Ok(lines)
    }

    /// Goes on from the start of another line.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn go_to(&mut self, offset: u64, number: u64) -> io::Result<()> {
        self.reader.seek(SeekFrom::Start(offset))?;
        (self.offset, self.number) = (offset, number);
        Ok(())
    }
}

impl<R: Read> Lines<R> {
    /// Creates a reader of the lines of a stream, whose byte order mark is read already.
    pub fn from_stream(stream: R, encoding: TextEncoding) -> Self {
        Self {
            reader: BufReader::new(stream),
            line_feed: encoding.line_feed(),
            carriage_return: encoding.carriage_return(),
            offset: 0,
            number: 1,
        }
    }

    /// Looks at the first bytes for what ends a line: a carriage return alone, as once on the
    /// Macintosh, where there is no line feed.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub(crate) fn find_line_end(&mut self) -> io::Result<()> {
        let start = self.reader.fill_buf()?;
        let has = |end: &[u8]| start.chunks(end.len()).any(|unit| unit == end);
        if !has(self.line_feed) && has(self.carriage_return) {
            self.line_feed = self.carriage_return;
        }
        Ok(())
    }

    /// Offset of the next line, bytes from the start of the file.
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
    /// I/O errors of the file.
    pub fn read(&mut self, line: &mut Vec<u8>) -> io::Result<Line> {
        line.clear();
        if self.line_feed.len() > 1 {
            return self.read_wide(line);
        }
        let mut is_too_long = false;
        let mut is_ended = false;
        let started = self.offset;
        while !is_ended {
            let found = self.reader.fill_buf()?;
            if found.is_empty() {
                break;
            }
            let end = found.iter().position(|byte| self.line_feed == [*byte]);
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

    /// Reads a line of UTF-16, whose code units have two bytes.
    fn read_wide(&mut self, line: &mut Vec<u8>) -> io::Result<Line> {
        let (started, mut is_too_long) = (self.offset, false);
        loop {
            let mut unit = [0; 2];
            let mut read = 0;
            while let Some(rest) = unit.get_mut(read..).filter(|rest| !rest.is_empty()) {
                match self.reader.read(rest)? {
                    0 => break,
                    more => read += more,
                }
            }
            self.offset += read as u64;
            if read < unit.len() || unit == self.line_feed {
                line.extend_from_slice(unit.get(..read % unit.len()).unwrap_or_default());
                break;
            }
            is_too_long |= line.len() + read > MAX_LINE_BYTES;
            if !is_too_long {
                line.extend_from_slice(&unit);
            }
        }
        if self.offset == started {
            return Ok(Line::End);
        }
        self.number += 1;
        Ok(if is_too_long { Line::TooLong } else { Line::Whole })
    }
}

#[cfg(test)]
#[path = "lines_tests.rs"]
mod tests;
