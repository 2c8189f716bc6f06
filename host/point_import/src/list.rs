//! CSV text to points.

use std::collections::HashMap;

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::column::Column;
use crate::fault::{ListFault, MAX_FAULTS};
use crate::point::{self, Point};

/// The largest list, in bytes.
pub const MAX_LIST_BYTES: usize = 256 * 1024 * 1024;
/// The most points of a list.
pub const MAX_POINTS: usize = 1_000_000;
/// The most columns.
const MAX_COLUMNS: usize = 256;
/// Delimiters that are looked for.
const DELIMITERS: [u8; 3] = [b',', b';', b'\t'];

/// A point list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointList {
    /// Points without fault, in the order of the list.
    pub points: Vec<Point>,
    /// Every fault, in the order of the list; at most [`MAX_FAULTS`] and one more.
    pub faults: Vec<ListFault>,
    /// Whether a fault is of the list as a whole, so that skipping rows mends nothing.
    pub is_unreadable: bool,
    /// Names of columns that are not used.
    pub unused: Vec<String>,
}

/// The first row of a tag.
#[derive(Clone, Copy, Debug)]
struct FirstRow {
    line: u64,
    /// Tells whether it has a fault.
    is_bad: bool,
}

impl PointList {
    /// Reads a list: UTF-8, with or without byte order mark; fields parted by comma,
    /// semicolon or tab; the first line names the columns.
    pub fn parse(bytes: &[u8]) -> Self {
        let mut list = Self::default();
        match text_of(bytes) {
            Ok(text) => list.read(text),
            Err(fault) => list.fail(fault),
        }
        if list.faults.len() > MAX_FAULTS {
            let more = list.faults.len() - MAX_FAULTS;
            list.faults.truncate(MAX_FAULTS);
            let line = list.faults.last().map_or(1, |fault| fault.line);
            let remedy = "mend these first; the columns may be mixed up";
            list.faults.push(ListFault::new(line, "", format!("and {more} more faults"), remedy));
        }
        list
    }

    fn fail(&mut self, fault: ListFault) {
        self.faults.push(fault);
        self.is_unreadable = true;
    }

    fn read(&mut self, text: &str) {
        let mut reader = ReaderBuilder::new()
            .delimiter(delimiter_of(text))
            .flexible(true)
            .trim(Trim::All)
            .from_reader(text.as_bytes());
        let headers = reader.headers().cloned().unwrap_or_default();
        let Some(columns) = self.columns(&headers) else { return };
        let mut rows: HashMap<String, FirstRow> = HashMap::new();
        let mut record = StringRecord::new();
        loop {
            match reader.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    let line = error.position().map_or(1, csv::Position::line);
                    let remedy = "save the list as CSV in UTF-8";
                    return self.fail(ListFault::new(line, "", error.to_string(), remedy));
                }
            }
            let line = record.position().map_or(1, |position| line_at(text, position));
            if record.iter().all(str::is_empty) {
                continue;
            }
            if self.points.len() >= MAX_POINTS {
                let cause = format!("the list has more than {MAX_POINTS} points");
                return self.fail(ListFault::new(line, "", cause, "split it"));
            }
            self.read_row(line, &record, &columns, &headers, &mut rows);
        }
        if self.points.is_empty() && self.faults.is_empty() {
            self.fail(ListFault::new(1, "", "the list has no points", "add a row for each tag"));
        }
    }

    /// Reads a row. A tag is that of its first row, good or bad: where that has a fault no
    /// later row takes its place, for nobody knows which of them is meant.
    fn read_row(
        &mut self,
        line: u64,
        record: &StringRecord,
        columns: &[Option<Column>],
        headers: &StringRecord,
        rows: &mut HashMap<String, FirstRow>,
    ) {
        let before = self.faults.len();
        let point = self.read_point(line, record, columns, headers);
        let column = columns.iter().position(|column| *column == Some(Column::Tag));
        let tag = column.and_then(|column| record.get(column)).unwrap_or_default();
        let is_bad = self.faults.len() > before;
        if let Some(first) = rows.get(tag) {
            // A row with faults of its own is told by those.
            if is_bad {
                return;
            }
            let cause = format!("the tag '{tag}' is in line {} already", first.line);
            let (cause, remedy) = if first.is_bad {
                (
                    cause + ", which has a fault: neither is read",
                    "correct that line, and remove one",
                )
            } else {
                (cause, "give one of them another id, or remove it")
            };
            self.faults.push(ListFault::new(line, "", cause, remedy));
            return;
        }
        if !tag.is_empty() {
            rows.insert(tag.to_owned(), FirstRow { line, is_bad });
        }
        self.points.extend(point);
    }

    /// Reads the point of a row, with every fault of it.
    fn read_point(
        &mut self,
        line: u64,
        record: &StringRecord,
        columns: &[Option<Column>],
        headers: &StringRecord,
    ) -> Option<Point> {
        if record.len() > headers.len() {
            let cause = format!("it has {} fields, the header {}", record.len(), headers.len());
            let remedy = "put fields that have the delimiter in them into quotes";
            self.faults.push(ListFault::new(line, "", cause, remedy));
            return None;
        }
        let cells: Vec<_> = columns
            .iter()
            .zip(headers)
            .zip(record)
            .filter(|(_, text)| !text.is_empty())
            .filter_map(|((column, name), text)| Some((column.as_ref()?, name, text)))
            .collect();
        point::read(line, &cells, &mut self.faults)
    }

    /// What each column holds; `None` with a fault where that cannot be.
    fn columns(&mut self, headers: &StringRecord) -> Option<Vec<Option<Column>>> {
        if headers.len() > MAX_COLUMNS {
            let cause = format!("the list has {} columns, {MAX_COLUMNS} at most", headers.len());
            self.fail(ListFault::new(1, "", cause, "remove those that are not needed"));
            return None;
        }
        let mut columns: Vec<Option<Column>> = Vec::new();
        for header in headers {
            let column = Column::named(header);
            match &column {
                None if !header.is_empty() => self.unused.push(header.to_owned()),
                Some(known) if columns.iter().flatten().any(|other| other == known) => {
                    // "id" and "name": the first one is the tag.
                    if *known != Column::Tag {
                        let remedy = "rename or remove one of them";
                        self.fail(ListFault::new(1, header, "two columns hold the same", remedy));
                    } else {
                        self.unused.push(header.to_owned());
                        columns.push(None);
                        continue;
                    }
                }
                _ => {}
            }
            columns.push(column);
        }
        if !columns.iter().flatten().any(|column| *column == Column::Tag) {
            let cause = "no column holds the tags' ids";
            let remedy = "name it 'tag' in the first line (or id, name, point)";
            self.fail(ListFault::new(1, "", cause, remedy));
        }
        (!self.is_unreadable).then_some(columns)
    }
}

fn text_of(bytes: &[u8]) -> Result<&str, ListFault> {
    if bytes.len() > MAX_LIST_BYTES {
        let cause = format!("the list has {} bytes, {MAX_LIST_BYTES} at most", bytes.len());
        return Err(ListFault::new(1, "", cause, "split it"));
    }
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let before = &bytes[..error.valid_up_to()];
        let line = before.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
        ListFault::new(line, "", "it is not UTF-8 text", "save the list as CSV in UTF-8")
    })
}

/// The line that a record begins in. The reader counts what is left of the line before
/// (the second byte of CR LF, empty lines) to the record.
fn line_at(text: &str, position: &csv::Position) -> u64 {
    let rest = text.as_bytes().get(position.byte() as usize..).unwrap_or_default();
    let ends = rest.iter().take_while(|byte| b"\r\n".contains(byte));
    position.line() + ends.filter(|byte| **byte == b'\n').count() as u64
}

/// The delimiter that the first line has most of, outside of quotes.
fn delimiter_of(text: &str) -> u8 {
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

#[cfg(test)]
#[path = "list_tests.rs"]
mod tests;
