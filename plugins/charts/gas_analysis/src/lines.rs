//! Line reader for untrusted streams: lines of bounded length, each with its number, in UTF-8,
//! or in UTF-16 by the byte order mark.

use std::io::{self, Chain, Cursor, Read};

pub(crate) use text_table::lines::Line;
use text_table::{MAX_MARK_BYTES, TextEncoding, lines};

/// Longest row that is read, bytes. A sample takes some hundred.
pub(crate) const MAX_LINE_BYTES: usize = 1 << 16;

/// Reads lines that end with LF or CR LF.
pub(crate) struct Lines<R> {
    lines: lines::Lines<Chain<Cursor<Vec<u8>>, R>>,
    encoding: TextEncoding,
    raw: Vec<u8>,
    /// Number of the line read last; the first is 1.
    pub(crate) number: u64,
    /// Bytes of that line, in UTF-8 unless the text is in another encoding without a mark.
    pub(crate) text: Vec<u8>,
}

impl<R: Read> Lines<R> {
    /// Reads the byte order mark of a stream.
    ///
    /// # Errors
    /// I/O errors of the stream.
    pub(crate) fn open(mut reader: R) -> io::Result<Self> {
        let mut start = Vec::new();
        (&mut reader).take(MAX_MARK_BYTES as u64).read_to_end(&mut start)?;
        let (encoding, mark) = TextEncoding::from_mark(&start).unwrap_or_default();
        start.drain(..mark);
        let lines = lines::Lines::from_stream(Cursor::new(start).chain(reader), encoding);
        Ok(Self { lines, encoding, raw: Vec::new(), number: 0, text: Vec::new() })
    }

    /// Reads the next line into `text`.
    ///
    /// # Errors
    /// I/O errors of the stream.
    pub(crate) fn read(&mut self) -> io::Result<Line> {
        self.text.clear();
        let read = self.lines.read(&mut self.raw)?;
        if read == Line::End {
            return Ok(read);
        }
        self.number += 1;
        if read == Line::TooLong || self.raw.len() > MAX_LINE_BYTES {
            return Ok(Line::TooLong);
        }
        if self.encoding == TextEncoding::default() {
            std::mem::swap(&mut self.raw, &mut self.text);
        } else {
            let text = self.encoding.decode(&self.raw);
            self.text.extend_from_slice(text.trim_end_matches('\r').as_bytes());
        }
        Ok(Line::Whole)
    }
}
