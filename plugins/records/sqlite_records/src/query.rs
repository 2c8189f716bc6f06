//! Execution of a query, and conversion of its rows to records.
//!
//! Each time the file is opened anew: a connection may take a file that was moved into the
//! place of another for the one that it knows (SQLite file format, 1.3.7).

use std::borrow::Cow;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use record_source::{
    CellFormats, ColumnLayout, ListSettings, ReadDeadline, RowBatch, Source, SourceVersion,
    file_version,
};
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, ErrorCode, OpenFlags, Row};

use crate::SqliteQuery;

/// Longest text or row, bytes.
const MAX_VALUE_BYTES: i32 = 1 << 20;
/// Columns of a result, at most.
const MAX_COLUMNS: i32 = 256;
/// Greatest memory of the library in this process, bytes.
const MAX_HEAP_BYTES: i64 = 64 << 20;
/// Steps of SQLite's virtual machine between two checks of the deadline.
const STEPS_BETWEEN_LOOKS: i32 = 1000;
/// Longest wait for a lock: shorter than stopping may take.
const MAX_LOCK_WAIT: Duration = Duration::from_millis(500);

/// Source of one list: its query and formats.
pub(crate) struct Query {
    pub(crate) list: ListSettings<SqliteQuery>,
    pub(crate) formats: CellFormats,
}

impl Source for Query {
    /// Returns the version of the file and of its write-ahead log, which has newer data.
    fn version(&self) -> Result<SourceVersion, String> {
        let file = file_version(&self.list.source.file)?;
        let Ok(log) = file_version(&log_of(&self.list.source.file)) else { return Ok(file) };
        // An empty log is made whenever somebody looks.
        let modified = if log.len > 0 { file.modified.max(log.modified) } else { file.modified };
        Ok(SourceVersion { modified, len: file.len + log.len })
    }

    fn read(&self, rows: &mut RowBatch, deadline: &ReadDeadline) -> Result<(), String> {
        let connection = open(&self.list.source.file).map_err(|error| words(&error, deadline))?;
        let mut fault = None;
        let asked = self.ask(connection, rows, deadline, &mut fault);
        asked.map_err(|error| words(&error, deadline))?;
        fault.map_or(Ok(()), Err)
    }
}

impl Query {
    /// Runs the query; faults of the query or its result go into `fault`.
    fn ask(
        &self,
        mut connection: Connection,
        into: &mut RowBatch,
        deadline: &ReadDeadline,
        fault: &mut Option<String>,
    ) -> rusqlite::Result<()> {
        let ends = deadline.clone();
        connection.progress_handler(STEPS_BETWEEN_LOOKS, Some(move || ends.has_passed()))?;
        let mut statement = connection.prepare(&self.list.source.query)?;
        if !statement.readonly() || statement.column_count() == 0 {
            *fault = Some("the query does not only read: write one SELECT".into());
            return Ok(());
        }
        if statement.parameter_count() > 0 {
            *fault = Some("the query has parameters, which nobody gives it".into());
            return Ok(());
        }
        let names: Vec<String> = statement.column_names().map(str::to_owned).collect();
        let layout = match ColumnLayout::find(&self.list, &names) {
            Ok(layout) => layout,
            Err(wrong) => {
                *fault = Some(format!("the query: {wrong}"));
                return Ok(());
            }
        };
        let mut rows = statement.raw_query();
        for number in 1.. {
            let Some(row) = rows.next()? else { break };
            let cells: Vec<_> = (0..names.len()).map(|at| text(row, at)).collect();
            let cell = |at: usize| match cells.get(at) {
                Some(Ok(text)) => Ok(text.as_ref()),
                Some(Err(wrong)) => Err(format!("column '{}': {wrong}", names[at])),
                None => Ok(""),
            };
            if let Err(full) = into.take(number, layout.record(&self.list, &self.formats, cell)) {
                *fault = Some(full);
                return Ok(());
            }
        }
        Ok(())
    }
}

fn text<'r>(row: &'r Row<'_>, at: usize) -> Result<Cow<'r, str>, &'static str> {
    match row.get_ref(at).map_err(|_| "it cannot be read")? {
        ValueRef::Null => Ok("".into()),
        ValueRef::Integer(number) => Ok(number.to_string().into()),
        ValueRef::Real(number) => Ok(number.to_string().into()),
        ValueRef::Text(bytes) => {
            std::str::from_utf8(bytes).map(Cow::from).map_err(|_| "it is not UTF-8; mend the row")
        }
        ValueRef::Blob(_) => Err("it is binary; cast it in the query"),
    }
}

fn log_of(file: &Path) -> PathBuf {
    let mut name = OsString::from(file);
    name.push("-wal");
    name.into()
}

/// Opens a file read-only, so that nothing else can be opened through it.
fn open(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(MAX_LOCK_WAIT)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES)?;
    connection.set_limit(Limit::SQLITE_LIMIT_COLUMN, MAX_COLUMNS)?;
    connection.set_limit(Limit::SQLITE_LIMIT_ATTACHED, 0)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    connection.execute_batch(&format!(
        "PRAGMA query_only = ON; PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0; \
         PRAGMA hard_heap_limit = {MAX_HEAP_BYTES};"
    ))?;
    Ok(connection)
}

/// Describes an error for operators.
fn words(error: &rusqlite::Error, deadline: &ReadDeadline) -> String {
    match error.sqlite_error_code() {
        Some(ErrorCode::OperationInterrupted) => {
            deadline.check().err().unwrap_or_else(|| "the query was stopped".into())
        }
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            format!("{error}: another program writes, or holds it")
        }
        Some(ErrorCode::OutOfMemory) => {
            format!("the query needs more than {} MB of memory: narrow it", MAX_HEAP_BYTES >> 20)
        }
        Some(ErrorCode::TooBig) => {
            format!("a value has more than {MAX_VALUE_BYTES} bytes: select less text")
        }
        _ => error.to_string(),
    }
}
