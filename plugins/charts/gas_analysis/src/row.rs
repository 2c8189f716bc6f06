//! One row: a line cut into cells, and a sample of them.

use dga::{Concentration, Gas, Sample};
use text_table::Delimiter;

/// Cells of a row.
pub(crate) const MAX_COLUMNS: usize = 256;

/// Cells of one row, in memory that is used again for every row.
pub(crate) struct Cells(text_table::Cells);

impl Cells {
    pub(crate) fn new() -> Self {
        Self(text_table::Cells::new(Delimiter::default(), MAX_COLUMNS))
    }

    /// Cuts a line into cells.
    ///
    /// # Errors
    /// Why it is no row, in words.
    pub(crate) fn cut(&mut self, line: &[u8]) -> Result<(), String> {
        let text = std::str::from_utf8(line).map_err(|error| {
            let at = error.valid_up_to() + 1;
            format!("byte {at} of the row is not UTF-8; save the file as UTF-8")
        })?;
        if line.contains(&0) {
            return Err("the row has a byte 0: this is no text".into());
        }
        if !has_closed_quotes(line) {
            return Err("a quote is not closed; a row is one line".into());
        }
        self.0.cut(text)
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns a cell without blanks around it; empty where there is none.
    pub(crate) fn get(&self, index: usize) -> &str {
        self.0.get(index)
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
