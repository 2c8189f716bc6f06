//! Conversion of a file's rows to records.

use std::io::Cursor;

use record_source::{
    CellFormats, ColumnLayout, ListSettings, ReadDeadline, RowBatch, Source, SourceVersion,
    file_version,
};
use text_table::{Dialect, NextRow, RowLimits, Rows};

use crate::{CsvFile, file};

/// Greatest bytes and cells of a row.
const LIMITS: RowLimits = RowLimits { bytes: 64 << 10, cells: 256 };
/// Rows between two checks of the deadline.
const ROWS_A_LOOK: u64 = 64;

/// Source of one list: its file and formats.
pub(crate) struct Table {
    pub(crate) list: ListSettings<CsvFile>,
    dialect: Dialect,
    formats: CellFormats,
}

impl Source for Table {
    fn version(&self) -> Result<SourceVersion, String> {
        file_version(&self.list.source.file)
    }

    fn read(&self, rows: &mut RowBatch, deadline: &ReadDeadline) -> Result<(), String> {
        let bytes = file::read(&self.list.source.file, deadline)?;
        self.parse(&bytes, rows, deadline)
    }
}

impl Table {
    /// Checks the settings of a list; `encoding` replaces the one in the settings.
    ///
    /// # Errors
    /// Each setting at fault, with what is allowed.
    pub(crate) fn new(list: ListSettings<CsvFile>, encoding: Option<&str>) -> Result<Self, String> {
        let encoding = encoding.or(list.source.encoding.as_deref());
        let (dialect, separators) = list.source.dialect(encoding)?;
        let formats = CellFormats::with_separators(&list, separators)?;
        Ok(Self { list, dialect, formats })
    }

    /// Reads the rows of a file's bytes.
    ///
    /// # Errors
    /// Why they are no table.
    pub(crate) fn parse(
        &self,
        bytes: &[u8],
        into: &mut RowBatch,
        deadline: &ReadDeadline,
    ) -> Result<(), String> {
        let failed = |error: std::io::Error| error.to_string();
        // What contradicts the settings is read by them or by the file's mark.
        let (mut rows, _) =
            Rows::open(Cursor::new(bytes), &self.dialect, LIMITS).map_err(failed)?;
        let layout = match rows.read().map_err(failed)? {
            NextRow::End => return Err("it is empty".into()),
            NextRow::TooLong(what) => {
                return Err(format!("its first row has {what}; is a quote not closed?"));
            }
            NextRow::Row if rows.is_malformed() => {
                return Err(format!("its first row {}", malformed(&rows)));
            }
            NextRow::Row => {
                let names: Vec<&str> = rows.cells().iter().collect();
                let hint = if rows.has_open_quote() { "; is a quote not closed?" } else { "" };
                ColumnLayout::find(&self.list, &names).map_err(|fault| format!("{fault}{hint}"))?
            }
        };
        let columns = rows.cells().len();
        for number in 1.. {
            let next = rows.read().map_err(failed)?;
            if number % ROWS_A_LOOK == 0 {
                deadline.check()?;
            }
            let line = rows.line();
            let row = match next {
                NextRow::End => break,
                NextRow::TooLong(what) => Err(format!("it has {what}; is a quote not closed?")),
                NextRow::Row if rows.cells().iter().all(str::is_empty) => continue,
                NextRow::Row if rows.cells().len() != columns => {
                    let count = rows.cells().len();
                    rows.end_with_first_line().map_err(failed)?;
                    let hint = if rows.has_open_quote() { "; is a quote not closed?" } else { "" };
                    Err(format!("it has {count} cells, where the first row has {columns}{hint}"))
                }
                NextRow::Row if rows.is_malformed() => Err(format!("it {}", malformed(&rows))),
                NextRow::Row => {
                    let cells = rows.cells();
                    layout.record(&self.list, &self.formats, |at| Ok(cells.get(at)))
                }
            };
            into.take(line, row)?;
        }
        Ok(())
    }
}

fn malformed<R: std::io::Read + std::io::Seek>(rows: &Rows<R>) -> String {
    format!("is not {}: set `encoding`, or mend the row", rows.encoding().name())
}
