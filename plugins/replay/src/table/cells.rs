//! A line cut into cells.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

/// Cells of one row.
pub(crate) const MAX_COLUMNS: usize = 65_536;

/// The cells of one row; the memory is used again for every row.
#[derive(Debug)]
pub(crate) struct Cells {
    reader: Reader,
    text: Vec<u8>,
    /// Where cells end in `text`.
    ends: Vec<usize>,
    count: usize,
}

impl Cells {
    /// No cells yet.
    pub(crate) fn new(delimiter: u8) -> Self {
        // Lines are cut already: within one there is no end of a row.
        let reader =
            ReaderBuilder::new().delimiter(delimiter).terminator(Terminator::Any(b'\n')).build();
        Self { reader, text: Vec::new(), ends: Vec::new(), count: 0 }
    }

    /// Cuts a line.
    ///
    /// # Errors
    /// More cells than [`MAX_COLUMNS`].
    pub(crate) fn cut(&mut self, line: &[u8]) -> Result<(), String> {
        self.reader.reset();
        self.count = 0;
        // No cell is longer unquoted than quoted, and none has less than a delimiter.
        self.text.resize(line.len() + 1, 0);
        self.ends.resize((line.len() + 1).min(MAX_COLUMNS), 0);
        let (mut used, mut written, mut cells) = (0, 0, 0);
        loop {
            let (result, read, wrote, ended) = self.reader.read_record(
                &line[used..],
                &mut self.text[written..],
                &mut self.ends[cells..],
            );
            used += read;
            written += wrote;
            cells += ended;
            match result {
                // The next call has no input left, which ends the row.
                ReadRecordResult::InputEmpty => {}
                ReadRecordResult::Record | ReadRecordResult::End => break,
                ReadRecordResult::OutputFull | ReadRecordResult::OutputEndsFull => {
                    return Err(format!("more than {MAX_COLUMNS} cells"));
                }
            }
        }
        self.count = cells;
        Ok(())
    }

    /// Cells of the row.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// A cell without blanks around it; empty where there is none.
    pub(crate) fn get(&self, index: usize) -> &str {
        let start =
            index.checked_sub(1).map_or(0, |before| self.ends.get(before).copied().unwrap_or(0));
        let end = self.ends.get(index).filter(|_| index < self.count);
        let bytes = end.and_then(|&end| self.text.get(start..end)).unwrap_or_default();
        // What is no text fits nothing.
        std::str::from_utf8(bytes).unwrap_or("\u{fffd}").trim()
    }
}
