//! Entry point for fuzzing: reads bytes without a file.

use std::time::Duration;

use busbar_plugin_sdk::{Record, RecordRowFault};
use record_source::{ListSettings, ReadDeadline, RowBatch};

use crate::CsvFile;
use crate::table::Table;

/// Longest time for a fuzzer's bytes; none takes as long.
const MAX_TIME: Duration = Duration::from_secs(10);

/// Rows and faults of a file's bytes.
#[derive(Debug, Default)]
pub struct Read {
    /// Rows that are good.
    pub rows: Vec<Record>,
    /// Faults of rows left out.
    pub faults: Vec<RecordRowFault>,
}

/// Reads bytes as a list of a file has it, in the encoding of this name.
///
/// # Errors
/// Why they are no table.
pub fn read(list: ListSettings<CsvFile>, label: &str, bytes: &[u8]) -> Result<Read, String> {
    let table = Table::new(list, Some(label))?;
    let mut rows = RowBatch::with_lists(1);
    table.parse(bytes, &mut rows, &ReadDeadline::within(MAX_TIME))?;
    Ok(Read { rows: rows.rows().to_vec(), faults: rows.faults().to_vec() })
}
