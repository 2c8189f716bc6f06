//! Lines of a stream, whatever is in it: of bounded length, each with its number.

use std::io::{self, BufRead, BufReader, Read};

/// Longest row that is read, bytes. A sample takes some hundred.
pub(crate) const MAX_LINE_BYTES: usize = 1 << 16;
/// Bytes that are read at once.
const READ_BYTES: usize = 1 << 16;
/// Mark of UTF-8 at the start of a file.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// What was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// A line, without its end.
    Whole,
    /// A line longer than [`MAX_LINE_BYTES`], of which the start is kept.
    TooLong,
    /// There is no more.
    End,
}

/// Reads lines that end with LF or CR LF, from a stream that may begin with the mark of UTF-8.
pub(crate) struct Lines<R> {
    reader: BufReader<R>,
    /// Number of the line read last; the first is 1.
    pub(crate) number: u64,
    pub(crate) text: Vec<u8>,
}

impl<R: Read> Lines<R> {
    pub(crate) fn of(reader: R) -> Self {
        let reader = BufReader::with_capacity(READ_BYTES, reader);
        Self { reader, number: 0, text: Vec::new() }
    }

    /// Reads the next line into `text`.
    ///
    /// # Errors
    /// Those of the stream.
    pub(crate) fn read(&mut self) -> io::Result<Line> {
        self.text.clear();
        let (mut is_too_long, mut is_ended, mut has_any) = (false, false, false);
        while !is_ended {
            let found = self.reader.fill_buf()?;
            if found.is_empty() {
                break;
            }
            has_any = true;
            let end = found.iter().position(|&byte| byte == b'\n');
            let text = &found[..end.unwrap_or(found.len())];
            let room = MAX_LINE_BYTES - self.text.len();
            is_too_long |= text.len() > room;
            self.text.extend_from_slice(&text[..text.len().min(room)]);
            is_ended = end.is_some();
            let used = text.len() + usize::from(is_ended);
            self.reader.consume(used);
        }
        if !has_any {
            return Ok(Line::End);
        }
        self.number += 1;
        if self.number == 1 && self.text.starts_with(BYTE_ORDER_MARK) {
            self.text.drain(..BYTE_ORDER_MARK.len());
        }
        if self.text.last() == Some(&b'\r') {
            self.text.pop();
        }
        Ok(if is_too_long { Line::TooLong } else { Line::Whole })
    }
}
