//! Layout of a list: delimiter, lines before the header, and rows that are no points.

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::column::Column;

/// Delimiters that are looked for.
const DELIMITERS: [u8; 4] = [b',', b';', b'\t', b'|'];
/// Lines in which the header is looked for.
const MAX_PREAMBLE_LINES: usize = 50;
/// Bytes of a header, at most.
const MAX_HEADER_BYTES: usize = 64 * 1024;
/// Words of cells without a value.
const NO_VALUE: [&str; 8] = ["-", "--", "---", "—", "–", "n/a", "#n/a", "n.a."];

/// Place of the header, and the delimiter of it and all below.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) delimiter: u8,
    /// First byte of the header.
    pub(crate) start: usize,
    /// Number of lines before it.
    pub(crate) lines_before: u64,
}

/// Finds the header: the first line that names a tag column and another one. Titles, blank lines
/// and `sep=;` may precede it. Without one it is the first line.
pub(crate) fn layout_of(text: &str) -> Layout {
    let declared = declared_delimiter(text);
    let first = Layout {
        delimiter: declared.unwrap_or_else(|| most_frequent_delimiter(text)),
        start: 0,
        lines_before: 0,
    };
    let mut start = 0;
    for (index, line) in text.split_inclusive('\n').take(MAX_PREAMBLE_LINES).enumerate() {
        // Old spreadsheets end lines in CR alone: there, the text is one line here.
        let candidates = declared.map_or(DELIMITERS.to_vec(), |delimiter| vec![delimiter]);
        for delimiter in candidates {
            if is_header(&text[start..], delimiter) && !line.trim().is_empty() {
                return Layout { delimiter, start, lines_before: index as u64 };
            }
        }
        start += line.len();
    }
    match declared {
        // What stands below is the header, good or bad.
        Some(delimiter) => {
            let line = text.find('\n').map(|end| end + 1);
            let lines_before = u64::from(line.is_some());
            Layout { delimiter, start: line.unwrap_or(text.len()), lines_before }
        }
        None => first,
    }
}

/// The delimiter of a line `sep=;`, as Excel writes and reads it.
fn declared_delimiter(text: &str) -> Option<u8> {
    let line = text.lines().next()?.trim_end_matches('\r').trim_matches('"');
    let start = line.get(..4).filter(|start| start.eq_ignore_ascii_case("sep="))?;
    match line.as_bytes().get(start.len()..)? {
        // A delimiter that is a blank at the end of a line is cut off by some editors.
        [] => Some(b'\t'),
        [delimiter, ..] if delimiter.is_ascii() && !delimiter.is_ascii_alphanumeric() => {
            Some(*delimiter)
        }
        _ => None,
    }
}

/// Reports whether a record names a tag column and another one.
fn is_header(text: &str, delimiter: u8) -> bool {
    let mut end = text.len().min(MAX_HEADER_BYTES);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut reader = ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .from_reader(&text.as_bytes()[..end]);
    let mut record = StringRecord::new();
    if !reader.read_record(&mut record).unwrap_or(false) {
        return false;
    }
    let named = record.iter().filter_map(Column::named);
    let columns: Vec<_> = named.map(|(column, _)| column).collect();
    let has_tag = columns.contains(&Column::Tag);
    has_tag && columns.iter().any(|column| *column != Column::Tag)
}

/// The delimiter that the first line has most of, outside of quotes.
fn most_frequent_delimiter(text: &str) -> u8 {
    let mut counts = [0; DELIMITERS.len()];
    let mut is_quoted = false;
    for byte in text.bytes().take_while(|byte| !b"\r\n".contains(byte)) {
        is_quoted ^= byte == b'"';
        if let Some(index) = DELIMITERS.iter().position(|d| *d == byte).filter(|_| !is_quoted) {
            counts[index] += 1;
        }
    }
    let most = counts.iter().max().copied().unwrap_or(0);
    let index = counts.iter().position(|count| *count == most).unwrap_or(0);
    DELIMITERS[index]
}

/// The text of a cell: what Excel keeps as text, `="007"`, without its marks.
pub(crate) fn cell_text(cell: &str) -> &str {
    cell.strip_prefix("=\"").and_then(|rest| rest.strip_suffix('"')).unwrap_or(cell).trim()
}

/// Reports whether a cell has a word for no value.
pub(crate) fn is_no_value(cell: &str) -> bool {
    cell.is_empty() || NO_VALUE.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// Reports whether a row is a remark: its only cell begins with `#` or `//`.
pub(crate) fn is_remark(record: &StringRecord) -> bool {
    let mut cells = record.iter().filter(|cell| !cell.is_empty());
    let is_mark = |cell: &str| cell.starts_with("# ") || cell == "#" || cell.starts_with("//");
    cells.next().is_some_and(is_mark) && cells.next().is_none()
}

/// Reports whether the row below the header explains the columns: no id, no address, such as the
/// units of numbers.
pub(crate) fn explains_columns(record: &StringRecord, columns: &[Option<Column>]) -> bool {
    let is_bracketed = |cell: &str| {
        let inside = |open, close| cell.starts_with(open) && cell.ends_with(close);
        inside('[', ']') || inside('(', ')') || inside('<', '>')
    };
    let is_open = |column: &Column, cell: &str| {
        let is_place = matches!(column, Column::Tag | Column::Address | Column::AddressField(_));
        !is_place || is_no_value(cell) || is_bracketed(cell)
    };
    columns
        .iter()
        .zip(record)
        .filter_map(|(column, cell)| Some((column.as_ref()?, cell)))
        .all(|(column, cell)| is_open(column, cell))
}

#[cfg(test)]
#[path = "list_layout_tests.rs"]
mod tests;
