//! A recording in CSV (RFC 4180), a line a row.

mod cells;
mod columns;
mod config;

use std::fs::File;
use std::io::{Read, Seek};
use std::path::PathBuf;

use busbar_plugin_sdk::Reason;

use crate::address::Points;
use crate::instant::SECOND;
use crate::lines::{Line, Lines, MAX_LINE_BYTES};
use crate::recording::{Fault, Recording, Update, open_file};
use crate::remarks::Remarks;
use crate::settings::Config;

use cells::Cells;
#[cfg(test)]
use cells::MAX_COLUMNS;
use columns::{Columns, Row, RowFault};
pub(crate) use config::{Column, CsvConfig, Form, TimeFormat, find_column};

/// Rows that are left out in a row before the player looks whether to go on.
const MAX_LEFT_OUT: usize = 1000;
/// Rows that are searched for the first time.
const MAX_ROWS_TO_FIRST_TIME: usize = 1000;

/// An open recording.
pub(crate) struct Table<R> {
    file: PathBuf,
    lines: Lines<R>,
    line: Vec<u8>,
    cells: Cells,
    columns: Columns,
    /// Time of the first row, in the file's own count.
    first: i64,
    is_absolute: bool,
    /// Time of the last row.
    last: i64,
    /// Start and number of a line.
    mark: (u64, u64),
    /// Whether it was read to its end.
    is_ended: bool,
}

impl Table<File> {
    /// Opens what the settings name.
    pub(crate) fn open(config: &Config, points: &Points) -> Result<Self, Fault> {
        Self::new(config, open_file(&config.file)?, points)
    }
}

impl<R: Read + Seek + Send> Table<R> {
    pub(crate) fn new(config: &Config, bytes: R, points: &Points) -> Result<Self, Fault> {
        let file = config.file.clone();
        let failed = |error: std::io::Error| Fault::new(&config.file, error);
        let mut lines = Lines::from(bytes, 0, 1).map_err(failed)?;
        let (mut line, mut cells) = (Vec::new(), Cells::new(config.csv.delimiter));
        let header = lines.read(&mut line).map_err(failed)?;
        let named = match header {
            Line::Whole => cells.cut(line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&line)),
            Line::TooLong => Err(format!("more than {MAX_LINE_BYTES} bytes")),
            Line::End => Err("the file is empty: its first row names the columns".into()),
        };
        named.map_err(|what| Fault::new(&file, format!("line 1: {what}")))?;
        let columns =
            Columns::find(&config.csv, points, &cells).map_err(|faults| match faults {
                columns::Missing::Of(what) => Fault::new(&file, format!("line 1: {what}")),
                columns::Missing::OfTags(faults) => Fault::of_tags(&file, &faults),
            })?;
        let mark = (lines.offset(), lines.number());
        let is_absolute = config.csv.time_format != TimeFormat::Seconds;
        let mut table = Self {
            file,
            lines,
            line,
            cells,
            columns,
            first: 0,
            is_absolute,
            last: i64::MIN,
            mark,
            is_ended: false,
        };
        table.first = table.find_first_time()?;
        table.rewind()?;
        Ok(table)
    }

    fn find_first_time(&mut self) -> Result<i64, Fault> {
        let mut fault = "there is no row after the first".to_owned();
        for _ in 0..MAX_ROWS_TO_FIRST_TIME {
            match self.next_row()? {
                None => break,
                Some(Ok(row)) => return Ok(row.time),
                Some(Err(unreadable)) => fault = unreadable.what,
            }
        }
        Err(Fault::new(&self.file, fault))
    }

    /// The next row that is not blank, or what is wrong with it.
    fn next_row(&mut self) -> Result<Option<Result<Row, RowFault>>, Fault> {
        loop {
            let number = self.lines.number();
            let read =
                self.lines.read(&mut self.line).map_err(|error| Fault::new(&self.file, error))?;
            let cut = match read {
                Line::End => return Ok(None),
                Line::TooLong => Err(format!("more than {MAX_LINE_BYTES} bytes")),
                Line::Whole if self.line.iter().all(u8::is_ascii_whitespace) => continue,
                Line::Whole => self.cells.cut(&self.line),
            };
            let row = cut
                .map_err(|what| RowFault { what, is_named: false })
                .and_then(|()| self.columns.row(&self.cells, number));
            let at_line = |fault: RowFault| RowFault {
                what: format!("line {number}: {}", fault.what),
                ..fault
            };
            return Ok(Some(row.map_err(at_line)));
        }
    }

    /// A row that cannot be read never leaves the values before it as they were: its tags
    /// are missing from the last time on, until a row that can be read has them.
    fn note_unreadable(
        &mut self,
        fault: &RowFault,
        updates: &mut Vec<Update>,
        remarks: &mut Remarks,
    ) {
        remarks
            .add(format!("{}; the row is left out, its tags are bad until the next", fault.what));
        self.columns.read_unreadable(&self.cells, fault.is_named, self.last.max(0), updates);
    }
}

impl<R: Read + Seek + Send> Recording for Table<R> {
    fn origin(&self) -> Option<i64> {
        self.is_absolute.then_some(self.first)
    }

    fn read(
        &mut self,
        updates: &mut Vec<Update>,
        remarks: &mut Remarks,
    ) -> Result<Option<i64>, Fault> {
        for _ in 0..MAX_LEFT_OUT {
            let row = match self.next_row()? {
                None => {
                    if !std::mem::replace(&mut self.is_ended, true) {
                        self.columns.tell_unseen(remarks);
                    }
                    return Ok(None);
                }
                Some(Ok(row)) => row,
                Some(Err(fault)) => {
                    self.note_unreadable(&fault, updates, remarks);
                    if updates.is_empty() {
                        continue;
                    }
                    return Ok(Some(self.last.max(0)));
                }
            };
            let Some(nanos) = row.time.checked_sub(self.first) else {
                let what = format!("line {}: its time is out of reach of the first", row.line);
                self.note_unreadable(&RowFault { what, is_named: true }, updates, remarks);
                return Ok(Some(self.last.max(0)));
            };
            if nanos < self.last {
                remarks.add(format!(
                    "line {}: it is {:.3} s earlier than the one before; tags that have a later value already are bad: sort the file by time",
                    row.line,
                    self.last.saturating_sub(nanos) as f64 / SECOND as f64
                ));
            }
            self.last = self.last.max(nanos);
            self.columns.read(&self.cells, &row, [nanos, self.last], updates, remarks);
            return Ok(Some(self.last));
        }
        // Nothing new, at the same time as before.
        Ok(Some(self.last.max(0)))
    }

    fn skip_to(&mut self, _nanos: i64) -> Result<(), Fault> {
        // Rows before tell the state at any time.
        Ok(())
    }

    fn rewind(&mut self) -> Result<(), Fault> {
        self.last = i64::MIN;
        self.columns.forget_times();
        let (offset, number) = self.mark;
        self.lines.go_to(offset, number).map_err(|error| Fault::new(&self.file, error))
    }

    fn mark(&mut self) {
        self.mark = (self.lines.offset(), self.lines.number());
    }
}

/// What a missing cell makes of a tag.
pub(crate) const MISSING: Reason = Reason::Sensor;

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
