//! CSV text to points.

use std::collections::HashMap;

use csv::{Reader, ReaderBuilder, StringRecord, Trim};

use crate::column::Column;
use crate::fault::{ListFault, MAX_FAULTS};
use crate::list_layout::{Layout, cell_text, explains_columns, is_no_value, is_remark, layout_of};
use crate::list_text::{ListEncoding, ListText, decode};
use crate::number_style::NumberStyle;
use crate::point::Point;
use crate::row;

/// The largest list, in bytes.
pub const MAX_LIST_BYTES: usize = 256 * 1024 * 1024;
/// The most points of a list.
pub const MAX_POINTS: usize = 1_000_000;
/// Limit of the columns.
const MAX_COLUMNS: usize = 256;

/// Point list with its rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointList {
    /// Points without fault, in the order of the list.
    pub points: Vec<Point>,
    /// Every fault, in the order of the list; at most [`MAX_FAULTS`] and one more.
    pub faults: Vec<ListFault>,
    /// True for a fault of the list as a whole, which skipping rows does not mend.
    pub is_unreadable: bool,
    /// Names of columns that are not used.
    pub unused: Vec<String>,
    /// Assumptions about the list that its user should know: a guessed encoding, lines that
    /// were skipped.
    pub remarks: Vec<String>,
}

/// The first row of a tag.
#[derive(Clone, Copy, Debug)]
struct FirstRow {
    line: u64,
    /// Tells whether it has a fault.
    is_bad: bool,
}

/// Columns of a list, and how its numbers are written.
struct Table {
    columns: Vec<Option<Column>>,
    headers: StringRecord,
    style: NumberStyle,
}

impl PointList {
    /// Reads a list: UTF-8, UTF-16, or the encoding of the system that wrote it; fields
    /// parted by comma, semicolon, tab or bar. The first line that names a tag column and
    /// another is the header; titles may stand before it.
    pub fn parse(bytes: &[u8]) -> Self {
        Self::parse_in(bytes, None)
    }

    /// Reads a list as [`PointList::parse`] does, in a named encoding where one is given.
    pub fn parse_in(bytes: &[u8], encoding: Option<ListEncoding>) -> Self {
        let mut list = Self::default();
        match text_of(bytes, encoding) {
            Ok(ListText { text, remark }) => {
                list.remarks.extend(remark);
                list.read(&text);
            }
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
        let layout = layout_of(text);
        let Layout { delimiter, start, lines_before } = layout;
        let text = text.get(start..).unwrap_or_default();
        let mut reader = reader_of(text, delimiter);
        let headers = reader.headers().cloned().unwrap_or_default();
        let Some(columns) = self.columns(&headers, lines_before + 1) else { return };
        if lines_before > 0 {
            let line = lines_before + 1;
            self.remarks.push(format!("line {line} is its header; the lines before are left out"));
        }
        let table = Table { style: style_of(text, delimiter, &columns), columns, headers };
        let mut rows: HashMap<String, FirstRow> = HashMap::new();
        let mut record = StringRecord::new();
        let mut is_first = true;
        loop {
            match reader.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    let line = lines_before + error.position().map_or(1, csv::Position::line);
                    let remedy = "save the list as CSV in UTF-8";
                    return self.fail(ListFault::new(line, "", error.to_string(), remedy));
                }
            }
            let line = lines_before + record.position().map_or(1, |place| line_at(text, place));
            if record.iter().all(str::is_empty) || is_remark(&record) {
                continue;
            }
            if std::mem::take(&mut is_first) && explains_columns(&record, &table.columns) {
                let text = format!("line {line} explains the columns, and is left out");
                self.remarks.push(text);
                continue;
            }
            if self.points.len() >= MAX_POINTS {
                let cause = format!("the list has more than {MAX_POINTS} points");
                return self.fail(ListFault::new(line, "", cause, "split it"));
            }
            self.read_row(line, &record, &table, &mut rows);
        }
        if self.points.is_empty() && self.faults.is_empty() {
            let line = lines_before + 1;
            self.fail(ListFault::new(line, "", "the list has no points", "add a row for each tag"));
        }
    }

    /// Reads a row. A tag is that of its first row, good or bad: where that has a fault no
    /// later row takes its place, for nobody knows which of them is meant.
    fn read_row(
        &mut self,
        line: u64,
        record: &StringRecord,
        table: &Table,
        rows: &mut HashMap<String, FirstRow>,
    ) {
        let before = self.faults.len();
        let point = self.read_point(line, record, table);
        let column = table.columns.iter().position(|column| *column == Some(Column::Tag));
        let tag = column.and_then(|column| record.get(column)).map(cell_text).unwrap_or_default();
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
    fn read_point(&mut self, line: u64, record: &StringRecord, table: &Table) -> Option<Point> {
        let Table { columns, headers, style } = table;
        // Spreadsheets leave empty cells behind.
        let filled = record.iter().enumerate().filter(|(_, cell)| !cell.is_empty());
        let used = filled.last().map_or(0, |(last, _)| last + 1);
        if used > headers.len() {
            let cause = format!("it has {used} fields, the header {}", headers.len());
            let remedy = "put fields that have the delimiter in them into quotes";
            self.faults.push(ListFault::new(line, "", cause, remedy));
            return None;
        }
        let cells: Vec<_> = columns
            .iter()
            .zip(headers)
            .zip(record)
            .filter_map(|((column, name), cell)| Some((column.as_ref()?, name, cell_text(cell))))
            .filter(|(column, _, text)| match column {
                Column::Tag | Column::Description => !text.is_empty(),
                _ => !is_no_value(text),
            })
            .collect();
        row::read(line, &cells, *style, &mut self.faults)
    }

    /// The columns that a header names; `None` with a fault where they make no list.
    fn columns(&mut self, headers: &StringRecord, line: u64) -> Option<Vec<Option<Column>>> {
        if headers.len() > MAX_COLUMNS {
            let cause = format!("the list has {} columns, {MAX_COLUMNS} at most", headers.len());
            self.fail(ListFault::new(line, "", cause, "remove those that are not needed"));
            return None;
        }
        let named: Vec<_> = headers.iter().map(Column::named).collect();
        let has_usual =
            |column: &Column| named.iter().flatten().any(|(c, usual)| *usual && c == column);
        let mut columns: Vec<Option<Column>> = Vec::new();
        for (header, named) in headers.iter().zip(&named) {
            let counts = |(column, is_usual): &&(Column, bool)| *is_usual || !has_usual(column);
            let mut column = named.as_ref().filter(counts).map(|(column, _)| column.clone());
            let same = |(other, name): &(&Option<Column>, &str)| {
                **other == column && column.is_some() && Column::is_same_name(name, header)
            };
            let known = columns.iter().flatten().any(|other| Some(other) == column.as_ref());
            if column.is_none() || known {
                // "id" and "name", "description" and "comment": the first one counts.
                let is_twice = columns.iter().zip(headers).any(|pair| same(&pair));
                if is_twice && column != Some(Column::Tag) {
                    let remedy = "rename or remove one of them";
                    self.fail(ListFault::new(line, header, "two columns hold the same", remedy));
                } else if !header.is_empty() {
                    self.unused.push(header.to_owned());
                }
                column = None;
            }
            columns.push(column);
        }
        if !columns.iter().flatten().any(|column| *column == Column::Tag) {
            let cause = "no column holds the tags' ids";
            let remedy = "name it 'tag' in the first line (or id, name, point)";
            self.fail(ListFault::new(line, "", cause, remedy));
        }
        (!self.is_unreadable).then_some(columns)
    }
}

fn text_of(bytes: &[u8], encoding: Option<ListEncoding>) -> Result<ListText<'_>, ListFault> {
    if bytes.len() > MAX_LIST_BYTES {
        let cause = format!("the list has {} bytes, {MAX_LIST_BYTES} at most", bytes.len());
        return Err(ListFault::new(1, "", cause, "split it"));
    }
    decode(bytes, encoding)
}

fn reader_of(text: &str, delimiter: u8) -> Reader<&[u8]> {
    ReaderBuilder::new()
        .delimiter(delimiter)
        .flexible(true)
        .trim(Trim::All)
        .from_reader(text.as_bytes())
}

/// The decimal mark that the numbers of a list show.
fn style_of(text: &str, delimiter: u8, columns: &[Option<Column>]) -> NumberStyle {
    let mut style =
        if delimiter == b',' { NumberStyle::of_commas() } else { NumberStyle::default() };
    let is_number = |column: &Option<Column>| column.as_ref().is_some_and(Column::is_number);
    let numbers: Vec<usize> =
        (0..columns.len()).filter(|index| is_number(&columns[*index])).collect();
    let mut record = StringRecord::new();
    let mut reader = reader_of(text, delimiter);
    while !numbers.is_empty() && reader.read_record(&mut record).unwrap_or(false) {
        let cells = numbers.iter().filter_map(|index| record.get(*index));
        cells.for_each(|cell| style.observe(cell_text(cell)));
    }
    style
}

/// The line that a record begins in. The reader counts what is left of the line before
/// (the second byte of CR LF, empty lines) to the record.
fn line_at(text: &str, position: &csv::Position) -> u64 {
    let rest = text.as_bytes().get(position.byte() as usize..).unwrap_or_default();
    let ends = rest.iter().take_while(|byte| b"\r\n".contains(byte));
    position.line() + ends.filter(|byte| **byte == b'\n').count() as u64
}

#[cfg(test)]
#[path = "list_tests.rs"]
mod tests;
