//! Recording in CSV (RFC 4180) and what programs make of it.

mod cell_values;
mod columns;
mod config;
mod header;
mod settings;

use std::fs::File;
use std::io::{Read, Seek};
use std::path::PathBuf;

use busbar_plugin_sdk::Reason;

use text_table::lines::MAX_LINE_BYTES;
use text_table::{MAX_COLUMNS, NextRow, RowLimits, Rows};

use crate::address::Points;
use crate::instant::SECOND;
use crate::recording::{Fault, Recording, Update, open_file};
use crate::remarks::Remarks;
use crate::settings::Config;

use columns::{Columns, Row, RowFault};
pub(crate) use config::{Column, CsvConfig, Form, find_column};
use header::{FirstRow, judge_first_row};
pub(crate) use settings::RawCsv;

/// Limits of a row.
const LIMITS: RowLimits = RowLimits { bytes: MAX_LINE_BYTES, cells: MAX_COLUMNS };

/// Rows that are left out in a row before the player looks whether to go on.
const MAX_LEFT_OUT: usize = 1000;
/// Rows that are searched for the first time.
const MAX_ROWS_TO_FIRST_TIME: usize = 1000;

/// Open table recording with its reader.
pub(crate) struct Table<R> {
    file: PathBuf,
    rows: Rows<R>,
    columns: Columns,
    /// Cells of the header, where there is one.
    header: Vec<String>,
    /// Time of the first row, in the file's own count.
    first: i64,
    is_absolute: bool,
    /// Time of the last row, from the first.
    last: i64,
    /// Time of the last row that could be read, in the file's own count.
    last_time: Option<i64>,
    /// Place of a row.
    mark: (u64, u64),
    /// Set once it was read to its end.
    is_ended: bool,
}

impl Table<File> {
    /// Opens what the settings name.
    pub(crate) fn open(
        config: &Config,
        points: &Points,
        remarks: &mut Remarks,
    ) -> Result<Self, Fault> {
        Self::new(config, open_file(&config.file)?, points, remarks)
    }
}

impl<R: Read + Seek + Send> Table<R> {
    pub(crate) fn new(
        config: &Config,
        bytes: R,
        points: &Points,
        remarks: &mut Remarks,
    ) -> Result<Self, Fault> {
        let file = config.file.clone();
        let failed = |error: std::io::Error| Fault::new(&config.file, error);
        let (mut rows, told) = Rows::open(bytes, &config.csv.dialect, LIMITS).map_err(failed)?;
        told.into_iter().for_each(|remark| remarks.add(remark));
        let start = rows.position();
        match rows.read().map_err(failed)? {
            NextRow::Row => {}
            NextRow::TooLong(what) => {
                return Err(Fault::new(&file, format!("line {}: {what}", rows.line())));
            }
            NextRow::End => {
                let what = "the file is empty: its first row names the columns";
                return Err(Fault::new(&file, format!("line {}: {what}", rows.line())));
            }
        }
        let line = rows.line();
        let at_line = |what: String| Fault::new(&config.file, format!("line {line}: {what}"));
        let (first_row, remark) =
            judge_first_row(&config.csv, points, rows.cells(), line).map_err(at_line)?;
        let names: Vec<&str> = rows.cells().iter().collect();
        let hint = hint_of(&rows, remark.as_deref());
        let columns =
            Columns::find(&config.csv, points, &names).map_err(|faults| match faults {
                columns::Missing::Of(what) => at_line(format!("{what}{hint}")),
                columns::Missing::OfTags(mut faults) => {
                    faults.iter_mut().for_each(|fault| fault.push_str(&hint));
                    Fault::of_tags(&file, &faults)
                }
            })?;
        remark.into_iter().for_each(|remark| remarks.add(remark));
        if rows.is_malformed() {
            let encoding = rows.encoding().name();
            remarks.add(format!("line {line} is no text in {encoding}: set csv.encoding"));
        }
        let header = match first_row {
            FirstRow::Header => names.into_iter().map(str::to_owned).collect(),
            FirstRow::Data => {
                rows.go_to(start).map_err(failed)?;
                Vec::new()
            }
        };
        let mark = rows.position();
        let mut table = Self {
            file,
            rows,
            columns,
            header,
            first: 0,
            is_absolute: !config.csv.times.format.is_relative(),
            last: i64::MIN,
            last_time: None,
            mark,
            is_ended: false,
        };
        table.take_units(config, points, remarks)?;
        table.first = table.find_first_time()?;
        table.rewind()?;
        Ok(table)
    }

    /// Takes a row of units after the header, where there is one.
    fn take_units(
        &mut self,
        config: &Config,
        points: &Points,
        remarks: &mut Remarks,
    ) -> Result<(), Fault> {
        let failed = |error| Fault::new(&config.file, error);
        if self.header.is_empty() || self.rows.read().map_err(failed)? != NextRow::Row {
            return Ok(());
        }
        if header::is_units_row(&config.csv, self.rows.cells(), self.columns.time_columns()) {
            let taken = self.columns.take_units(self.rows.cells(), points, remarks);
            taken.map_err(|faults| Fault::of_tags(&config.file, &faults))?;
            self.mark = self.rows.position();
            if config.csv.units_row.is_none() {
                let line = self.rows.line();
                remarks.add(format!(
                    "line {line} is taken as a row of units; csv.units_row says otherwise"
                ));
            }
        }
        Ok(())
    }

    fn find_first_time(&mut self) -> Result<i64, Fault> {
        self.rows.go_to(self.mark).map_err(|error| Fault::new(&self.file, error))?;
        let mut fault = None;
        for _ in 0..MAX_ROWS_TO_FIRST_TIME {
            match self.next_row()? {
                None => break,
                Some(Ok(row)) => return Ok(row.time),
                Some(Err(unreadable)) => {
                    fault.get_or_insert(unreadable.what);
                }
            }
        }
        let fault = fault.unwrap_or_else(|| "there is no row of data".to_owned());
        Err(Fault::new(&self.file, fault))
    }

    /// The next row that is not blank, or what is wrong with it.
    fn next_row(&mut self) -> Result<Option<Result<Row, RowFault>>, Fault> {
        let file = &self.file;
        let failed = |error| Fault::new(file, error);
        loop {
            let next = self.rows.read().map_err(failed)?;
            let number = self.rows.line();
            let row = match next {
                NextRow::End => return Ok(None),
                NextRow::TooLong(what) => Err(RowFault { what, is_named: false }),
                NextRow::Row => {
                    if self.columns.is_other_width(self.rows.cells()) {
                        self.rows.end_with_first_line().map_err(failed)?;
                    }
                    let cells = self.rows.cells();
                    let time = self.header.get(self.columns.time_column());
                    let is_header = time
                        .is_some_and(|time| !time.is_empty() && cells.iter().any(|c| c == time));
                    if is_header && cells.iter().eq(self.header.iter().map(String::as_str)) {
                        continue;
                    }
                    if is_header && !self.header.is_empty() {
                        let what = format!(
                            "line {number}: another header with other columns: split the file there"
                        );
                        return Err(Fault::new(file, what));
                    }
                    self.columns.row(cells, number, self.last_time)
                }
            };
            if let Ok(row) = &row {
                self.last_time = Some(row.time);
            }
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
        self.columns.read_unreadable(self.rows.cells(), fault.is_named, self.last.max(0), updates);
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
            self.columns.read(self.rows.cells(), &row, [nanos, self.last], updates, remarks);
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
        (self.last, self.last_time) = (i64::MIN, None);
        self.columns.forget_times();
        self.rows.go_to(self.mark).map_err(|error| Fault::new(&self.file, error))
    }

    fn mark(&mut self) {
        self.mark = self.rows.position();
    }
}

/// Remedy for columns that are not found, by what the first row looks like.
fn hint_of<R: Read + Seek>(rows: &Rows<R>, remark: Option<&str>) -> String {
    let line = rows.first_line();
    if let Some(remark) = remark {
        return format!("; {remark}: without a header columns have numbers alone, from 1 on");
    }
    if rows.is_malformed() {
        return format!("; it is no text in {}: set csv.encoding", rows.encoding().name());
    }
    let other = [';', '\t', '|', ','].into_iter().find(|other| {
        *other != char::from(rows.delimiter().byte())
            && rows.cells().len() == 1
            && line.contains(*other)
    });
    match other {
        Some(other) => {
            format!("; its cells look separated by {other:?}: set csv.delimiter, csv.skip_lines")
        }
        None => String::new(),
    }
}

/// Reason of a tag whose cell is missing.
pub(crate) const MISSING: Reason = Reason::Sensor;

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
