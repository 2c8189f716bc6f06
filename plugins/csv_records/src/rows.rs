//! Rows of a text, one after another, of bounded size.
//!
//! A cell in quotes may have lines of its own. Where a quote is not closed, what follows
//! would all be one cell: such a row ends with its first line ([`Rows::back`]).

use csv_core::{ReadRecordResult, Reader, ReaderBuilder};

/// Bytes of a row.
pub(crate) const MAX_ROW_BYTES: usize = 64 << 10;
/// Cells of a row.
pub(crate) const MAX_CELLS: usize = 256;

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Next {
    /// A row.
    Row,
    /// A row with more bytes or cells than one may have.
    TooLong,
    /// Nothing.
    End,
}

/// Rows of a text; the memory is used again for every row.
pub(crate) struct Rows<'b> {
    bytes: &'b [u8],
    at: usize,
    /// Of what comes next.
    line: u64,
    /// Where the row begins, and its line.
    start: (usize, u64),
    reader: Reader,
    text: Vec<u8>,
    ends: [usize; MAX_CELLS],
    count: usize,
}

impl<'b> Rows<'b> {
    pub(crate) fn of(bytes: &'b [u8], delimiter: u8) -> Self {
        Self {
            bytes,
            at: 0,
            line: 1,
            start: (0, 1),
            reader: ReaderBuilder::new().delimiter(delimiter).build(),
            text: vec![0; MAX_ROW_BYTES],
            ends: [0; MAX_CELLS],
            count: 0,
        }
    }

    /// Goes to the next row that is not empty.
    pub(crate) fn next(&mut self) -> Next {
        while let Some(b'\r' | b'\n') = self.bytes.get(self.at) {
            self.line += u64::from(self.bytes[self.at] == b'\n');
            self.at += 1;
        }
        self.start = (self.at, self.line);
        if self.at >= self.bytes.len() {
            return Next::End;
        }
        let rest = &self.bytes[self.at..];
        let window = &rest[..rest.len().min(2 * MAX_ROW_BYTES)];
        self.reader.reset();
        let (mut used, mut written, mut cells) = (0, 0, 0);
        let next = loop {
            let (result, read, wrote, ended) = self.reader.read_record(
                &window[used..],
                &mut self.text[written..],
                &mut self.ends[cells..],
            );
            used += read;
            written += wrote;
            cells += ended;
            match result {
                // The next call has no input left, which ends the row.
                ReadRecordResult::InputEmpty if window.len() == rest.len() => {}
                ReadRecordResult::Record | ReadRecordResult::End => break Next::Row,
                _ => break Next::TooLong,
            }
        };
        self.count = if next == Next::Row { cells } else { 0 };
        self.line += window[..used].iter().filter(|byte| **byte == b'\n').count() as u64;
        self.at += used;
        if next == Next::TooLong {
            self.back();
        }
        next
    }

    /// Ends the row with its first line; whether it had more.
    pub(crate) fn back(&mut self) -> bool {
        let (start, line) = self.start;
        let rest = &self.bytes[start..];
        let len = rest.iter().position(|byte| *byte == b'\n').map_or(rest.len(), |end| end + 1);
        let had_more = start + len < self.at;
        (self.at, self.line) = (start + len, line + 1);
        had_more
    }

    /// Line of the row; the first is 1.
    pub(crate) fn line(&self) -> u64 {
        self.start.1
    }

    /// Cells of the row.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// A cell of it; empty where there is none.
    pub(crate) fn cell(&self, index: usize) -> &[u8] {
        let before = index.checked_sub(1).map_or(0, |before| self.ends[before.min(MAX_CELLS - 1)]);
        let end = self.ends.get(index).filter(|_| index < self.count);
        end.and_then(|end| self.text.get(before..*end)).unwrap_or_default()
    }

    /// Whether all its cells are blank.
    pub(crate) fn is_blank(&self) -> bool {
        (0..self.count).all(|index| self.cell(index).trim_ascii().is_empty())
    }
}
