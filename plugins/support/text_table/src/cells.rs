//! Cells of one row (RFC 4180), in memory that is used again for every row.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

use crate::Delimiter;

/// Most cells of one row.
pub const MAX_COLUMNS: usize = 65_536;

/// Cells of one row.
#[derive(Debug)]
pub struct Cells {
    reader: Reader,
    max: usize,
    text: Vec<u8>,
    written: usize,
    /// Ends of cells in `text`.
    ends: Vec<usize>,
    count: usize,
}

impl Cells {
    /// Makes an empty row of at most `max` cells.
    pub fn new(delimiter: Delimiter, max: usize) -> Self {
        let mut reader = ReaderBuilder::new();
        let reader = reader.delimiter(delimiter.byte()).terminator(Terminator::Any(b'\n')).build();
        let max = max.min(MAX_COLUMNS);
        Self { reader, max, text: Vec::new(), written: 0, ends: Vec::new(), count: 0 }
    }

    /// Begins a row with a line, without its end; returns whether the row ends there, and not
    /// within quotes.
    ///
    /// # Errors
    /// More cells than a row may have.
    pub(crate) fn begin(&mut self, line: &str) -> Result<bool, String> {
        self.reader.reset();
        (self.written, self.count) = (0, 0);
        Ok(self.feed(line.as_bytes())? || self.feed(b"\n")?)
    }

    /// Goes on with the next line of a row.
    ///
    /// # Errors
    /// More cells than a row may have.
    pub(crate) fn go_on(&mut self, line: &str) -> Result<bool, String> {
        Ok(self.feed(line.as_bytes())? || self.feed(b"\n")?)
    }

    /// Cuts a line at its delimiters, whether its quotes are closed or not.
    ///
    /// # Errors
    /// More cells than a row may have.
    pub fn cut(&mut self, line: &str) -> Result<(), String> {
        self.reader.reset();
        (self.written, self.count) = (0, 0);
        if !self.feed(line.as_bytes())? {
            self.feed(b"")?;
        }
        Ok(())
    }

    /// Reads bytes of a row; no bytes are its end.
    fn feed(&mut self, bytes: &[u8]) -> Result<bool, String> {
        let mut used = 0;
        // No cell is longer unquoted than quoted, and none has less than a delimiter.
        self.text.resize(self.written + bytes.len() + 1, 0);
        self.ends.resize((self.count + bytes.len() + 1).min(self.max), 0);
        loop {
            let (result, read, wrote, ended) = self.reader.read_record(
                bytes.get(used..).unwrap_or_default(),
                self.text.get_mut(self.written..).unwrap_or_default(),
                self.ends.get_mut(self.count..).unwrap_or_default(),
            );
            used += read;
            self.written += wrote;
            self.count += ended;
            match result {
                ReadRecordResult::InputEmpty if used >= bytes.len() => return Ok(false),
                ReadRecordResult::InputEmpty => {}
                ReadRecordResult::Record | ReadRecordResult::End => return Ok(true),
                ReadRecordResult::OutputFull | ReadRecordResult::OutputEndsFull => {
                    self.count = 0;
                    return Err(format!("more than {} cells", self.max));
                }
            }
        }
    }

    /// Number of cells in the row.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Reports a row without cells.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// A cell without blanks around it; empty where there is none.
    pub fn get(&self, index: usize) -> &str {
        let before = index.checked_sub(1).and_then(|before| self.ends.get(before)).copied();
        let end = self.ends.get(index).filter(|_| index < self.count);
        let bytes = end.and_then(|&end| self.text.get(before.unwrap_or(0)..end));
        std::str::from_utf8(bytes.unwrap_or_default()).unwrap_or("\u{fffd}").trim()
    }

    /// All cells in order.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        (0..self.count).map(|index| self.get(index))
    }
}
