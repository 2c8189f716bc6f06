//! The rows of a file as records.

use std::borrow::Cow;

use encoding_rs::Encoding;
use record_source::{Deadline, Gathered, Layout, ListSettings, Source, Version, version_of};

use crate::rows::{MAX_CELLS, MAX_ROW_BYTES, Next, Rows};
use crate::{CsvFile, file};

/// Rows between two looks at the time.
const ROWS_A_LOOK: u64 = 64;

/// A file with what is wanted of it.
pub(crate) struct Table {
    pub(crate) list: ListSettings<CsvFile>,
    pub(crate) encoding: &'static Encoding,
}

impl Source for Table {
    fn version(&self) -> Result<Version, String> {
        version_of(&self.list.source.file)
    }

    fn read(&self, rows: &mut Gathered, deadline: &Deadline) -> Result<(), String> {
        let bytes = file::read(&self.list.source.file, deadline)?;
        self.parse(&bytes, rows, deadline)
    }
}

impl Table {
    /// The rows of a file's bytes.
    pub(crate) fn parse(
        &self,
        bytes: &[u8],
        into: &mut Gathered,
        deadline: &Deadline,
    ) -> Result<(), String> {
        let (bytes, encoding) = file::text(bytes, self.encoding);
        let mut rows = Rows::of(&bytes, self.list.source.delimiter.byte());
        let layout = match rows.next() {
            Next::End => return Err("it is empty".into()),
            Next::TooLong => return Err(format!("its first line {}", too_long())),
            Next::Row => {
                let names: Result<Vec<_>, _> =
                    (0..rows.len()).map(|at| decoded(rows.cell(at), encoding)).collect();
                let names = names.map_err(|fault| format!("its first line {fault}"))?;
                Layout::of(&self.list, &names)?
            }
        };
        let columns = rows.len();
        for number in 1.. {
            let next = rows.next();
            if number % ROWS_A_LOOK == 0 {
                deadline.check()?;
            }
            let line = rows.line();
            let row = match next {
                Next::End => break,
                Next::TooLong => Err(format!("it {}", too_long())),
                Next::Row if rows.is_blank() => continue,
                Next::Row if rows.len() != columns => {
                    let count = rows.len();
                    let hint = if rows.back() { "; is a quote not closed?" } else { "" };
                    Err(format!("it has {count} cells, where the first line has {columns}{hint}"))
                }
                Next::Row => self.record(&rows, &layout, encoding),
            };
            into.take(line, row)?;
        }
        Ok(())
    }

    fn record(
        &self,
        rows: &Rows<'_>,
        layout: &Layout,
        encoding: &'static Encoding,
    ) -> Result<busbar_plugin_sdk::Record, String> {
        let cells: Result<Vec<Cow<'_, str>>, String> =
            (0..rows.len()).map(|at| decoded(rows.cell(at), encoding)).collect();
        let cells = cells.map_err(|fault| format!("it {fault}"))?;
        layout.record(&self.list, |at| Ok(cells.get(at).map_or("", |cell| cell.as_ref())))
    }
}

fn decoded<'c>(cell: &'c [u8], encoding: &'static Encoding) -> Result<Cow<'c, str>, String> {
    let text = encoding.decode_without_bom_handling_and_without_replacement(cell);
    let text = text.filter(|text| !text.contains(['\0', '\u{fffd}']));
    text.ok_or_else(|| format!("is not {}: set `encoding`, or mend the row", encoding.name()))
}

fn too_long() -> String {
    format!("has more than {MAX_ROW_BYTES} bytes or {MAX_CELLS} cells; is a quote not closed?")
}
