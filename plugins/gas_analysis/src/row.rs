//! One row: a line cut into cells, and a sample of them.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};
use dga::{Concentration, Gas, Sample};

use crate::lines::MAX_LINE_BYTES;

/// Cells of a row.
pub(crate) const MAX_COLUMNS: usize = 256;

/// The cells of one row; the memory is used again for every row.
pub(crate) struct Cells {
    reader: Reader,
    text: Vec<u8>,
    /// Where cells end in `text`.
    ends: [usize; MAX_COLUMNS],
    count: usize,
}

impl Cells {
    pub(crate) fn new() -> Self {
        // Lines are cut already: within one there is no end of a row.
        let reader = ReaderBuilder::new().terminator(Terminator::Any(b'\n')).build();
        Self { reader, text: vec![0; MAX_LINE_BYTES + 1], ends: [0; MAX_COLUMNS], count: 0 }
    }

    /// Cuts a line.
    ///
    /// # Errors
    /// Why it is no row, in words.
    pub(crate) fn cut(&mut self, line: &[u8]) -> Result<(), String> {
        self.count = 0;
        if let Err(error) = std::str::from_utf8(line) {
            let at = error.valid_up_to() + 1;
            return Err(format!("byte {at} of the row is not UTF-8; save the file as UTF-8"));
        }
        if line.contains(&0) {
            return Err("the row has a byte 0: this is no text".into());
        }
        if !has_closed_quotes(line) {
            return Err("a quote is not closed; a row is one line".into());
        }
        self.reader.reset();
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

    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// A cell without blanks around it; empty where there is none.
    pub(crate) fn get(&self, index: usize) -> &str {
        let start = index.checked_sub(1).and_then(|before| self.ends.get(before));
        let end = self.ends.get(index).filter(|_| index < self.count);
        let cell = end.and_then(|&end| self.text.get(start.copied().unwrap_or(0)..end));
        // The line is text, and so are its cells.
        std::str::from_utf8(cell.unwrap_or_default()).unwrap_or_default().trim()
    }
}

/// Within quotes a quote is written twice, so that their number is even.
fn has_closed_quotes(line: &[u8]) -> bool {
    line.iter().filter(|&&byte| byte == b'"').count() % 2 == 0
}

/// Adds one gas to a sample: a number in ppm, `<` and a detection limit, or nothing for a
/// gas that was not measured.
///
/// # Errors
/// What is wrong with it, in words, without its column.
pub(crate) fn add(sample: Sample, gas: Gas, cell: &str) -> Result<Sample, String> {
    if cell.is_empty() {
        return Ok(sample);
    }
    let (text, is_below) = match cell.strip_prefix('<') {
        Some(limit) => (limit.trim_start(), true),
        None => (cell, false),
    };
    let ppm: f64 = text.parse().map_err(|_| no_number(cell))?;
    let made = if is_below { Concentration::below(ppm) } else { Concentration::measured(ppm) };
    made.map(|concentration| sample.with(gas, concentration)).map_err(|error| error.to_string())
}

fn no_number(cell: &str) -> String {
    const SHOWN: usize = 40;
    let shown = &cell[..cell.floor_char_boundary(SHOWN)];
    let is_decimal_comma = cell.contains(',') && cell.replace(',', ".").parse::<f64>().is_ok();
    if is_decimal_comma {
        return format!("'{shown}' has a decimal comma; write {}", cell.replace(',', "."));
    }
    format!("'{shown}' is no number; write ppm, <LIMIT below a detection limit, or nothing")
}
