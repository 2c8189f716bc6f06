//! SQLite: a file, opened to be read alone, on a thread of its own.
//!
//! Each query opens it anew. A connection keeps pages as long as a counter in the file
//! stays the same (SQLite file format, 1.3.7), which it does when a file is copied over
//! another or moved into its place: what was read before would then be shown for ever.

use std::borrow::Cow;
use std::path::Path;
use std::time::{Duration, Instant};

use busbar_link::Backoff;
use busbar_plugin_sdk::StopToken;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use thiserror::Error;

use crate::answer::{Answer, QueryFault, Samples};
use crate::cell::{Cell, Row};
use crate::point_states::{PointStates, shown};
use crate::schedule::Schedule;
use crate::settings::{Config, QueryConfig};

/// The longest text or row, bytes.
const MAX_VALUE_BYTES: i32 = 1 << 20;
/// Columns of a result.
const MAX_COLUMNS: i32 = 2000;
/// The most memory of the library in this process, bytes.
const MAX_HEAP_BYTES: i64 = 64 << 20;
/// Steps of the library's machine between two looks at the clock.
const STEPS_BETWEEN_LOOKS: i32 = 1000;
/// The longest that one query waits for a lock: shorter than stopping may take.
const MAX_LOCK_WAIT: Duration = Duration::from_millis(500);
/// A file that could be read so long deserves a quick second try.
const STABLE_AFTER: Duration = Duration::from_secs(10);

/// Fault of the file, for which no query can run.
#[derive(Debug, Error)]
enum FileFault {
    #[error("it cannot be opened: {0}")]
    Open(String),
    #[error("it is no file")]
    NoFile,
    #[error("it cannot be read: {0}")]
    Read(String),
}

/// Serves until the worker is dropped.
pub(crate) fn serve(
    path: &Path,
    config: &Config,
    mut point_states: PointStates,
    running: &StopToken,
) {
    let mut backoff = Backoff::new(config.reconnect);
    let session = Session { path, queries: &config.queries, timeout: config.timeout, running };
    point_states.open();
    while running.is_running() {
        let started = Instant::now();
        let Err(fault) = session.run(&mut point_states) else { return };
        if started.elapsed() >= STABLE_AFTER {
            backoff.reset();
        }
        let delay = backoff.next_delay();
        point_states.note_lost(&fault.to_string(), delay);
        running.wait(delay);
    }
}

/// A file that can be read.
struct Session<'a> {
    path: &'a Path,
    queries: &'a [QueryConfig],
    timeout: Duration,
    running: &'a StopToken,
}

impl Session<'_> {
    /// Runs queries until the worker is dropped.
    fn run(&self, point_states: &mut PointStates) -> Result<(), FileFault> {
        open(self.path, self.timeout)?;
        point_states.note_connected();
        let periods = self.queries.iter().map(|query| query.period);
        let mut schedule =
            Schedule::new(periods, |query| point_states.is_used(query), Instant::now());
        while let Some((query, due)) = schedule.next() {
            if !self.running.wait(due.saturating_duration_since(Instant::now())) {
                return Ok(());
            }
            schedule.note_run(query, Instant::now());
            let connection = open(self.path, self.timeout)?;
            match self.ask(connection, query, point_states) {
                Ok(outcome) => point_states.note_answer(query, outcome),
                Err(error) if !self.running.is_running() => {
                    // It was stopped for that.
                    drop(error);
                    return Ok(());
                }
                Err(error) => point_states.note_answer(query, Err(self.judge(&error)?)),
            }
        }
        Ok(())
    }

    fn ask(
        &self,
        mut connection: Connection,
        query: usize,
        point_states: &PointStates,
    ) -> rusqlite::Result<Result<Samples, QueryFault>> {
        let deadline = Instant::now() + self.timeout;
        let running = self.running.clone();
        let is_over = move || !running.is_running() || Instant::now() > deadline;
        connection.progress_handler(STEPS_BETWEEN_LOOKS, Some(is_over))?;
        let mut statement = connection.prepare(&self.queries[query].sql)?;
        let refused = |what: &str| Ok(Err(QueryFault::Refused(what.to_owned())));
        if !statement.readonly() {
            return refused("it does not only read: write a SELECT");
        }
        if statement.column_count() == 0 {
            return refused("it gives no columns: write a SELECT");
        }
        if statement.parameter_count() > 0 {
            return refused("it has parameters, which nobody gives it: write the values");
        }
        let points = point_states.points(query);
        let names: Vec<_> = statement.column_names().map(str::to_owned).collect();
        let names: Vec<_> = names.iter().map(String::as_str).collect();
        let mut answer = match Answer::begin(&points, &names, &point_states.time_rules()) {
            Ok(answer) => answer,
            Err(fault) => return Ok(Err(fault)),
        };
        let mut rows = statement.raw_query();
        while let Some(row) = rows.next()? {
            if let Err(fault) = answer.take(row) {
                return Ok(Err(fault));
            }
        }
        Ok(answer.finish())
    }

    /// Classifies an error as a fault of its query, or of the file.
    fn judge(&self, error: &rusqlite::Error) -> Result<QueryFault, FileFault> {
        let text = shown(&error.to_string());
        let code = match error {
            rusqlite::Error::SqliteFailure(failure, _) => failure.code,
            rusqlite::Error::SqlInputError { error, .. } => error.code,
            _ => return Ok(QueryFault::Refused(text)),
        };
        let millis = self.timeout.as_millis();
        match code {
            ErrorCode::OperationInterrupted => Ok(QueryFault::Unavailable(format!(
                "it took longer than {millis} ms (timeout_seconds) and was stopped"
            ))),
            ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked => {
                Ok(QueryFault::Unavailable(format!("{text}: another program writes, or holds it")))
            }
            ErrorCode::OutOfMemory => Ok(QueryFault::Refused(format!(
                "it needs more than {} MB of memory: narrow it",
                MAX_HEAP_BYTES >> 20
            ))),
            ErrorCode::TooBig => Ok(QueryFault::Refused(format!(
                "a value has more than {MAX_VALUE_BYTES} bytes: select less text"
            ))),
            ErrorCode::DatabaseCorrupt
            | ErrorCode::NotADatabase
            | ErrorCode::SystemIoFailure
            | ErrorCode::CannotOpen
            | ErrorCode::FileLockingProtocolFailed
            | ErrorCode::PermissionDenied => Err(FileFault::Read(text)),
            _ => Ok(QueryFault::Refused(text)),
        }
    }
}

/// Opens a file so that nothing can be written and nothing else be opened through it.
fn open(path: &Path, timeout: Duration) -> Result<Connection, FileFault> {
    let metadata = std::fs::metadata(path).map_err(|error| FileFault::Open(error.to_string()))?;
    if !metadata.is_file() {
        return Err(FileFault::NoFile);
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connect = || {
        let connection = Connection::open_with_flags(path, flags)?;
        connection.busy_timeout(timeout.min(MAX_LOCK_WAIT))?;
        connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES)?;
        connection.set_limit(Limit::SQLITE_LIMIT_COLUMN, MAX_COLUMNS)?;
        connection.set_limit(Limit::SQLITE_LIMIT_ATTACHED, 0)?;
        connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
        connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
        let pragmas = format!(
            "PRAGMA query_only = ON; PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0; \
             PRAGMA hard_heap_limit = {MAX_HEAP_BYTES};"
        );
        connection.execute_batch(&pragmas)?;
        Ok(connection)
    };
    connect().map_err(|error: rusqlite::Error| FileFault::Open(shown(&error.to_string())))
}

impl Row for rusqlite::Row<'_> {
    fn cell(&self, column: usize) -> Cell<'_> {
        match self.get_ref(column) {
            Ok(ValueRef::Null) => Cell::Null,
            Ok(ValueRef::Integer(value)) => Cell::Int(value),
            Ok(ValueRef::Real(value)) => Cell::Float(value),
            Ok(ValueRef::Text(bytes)) => match std::str::from_utf8(bytes) {
                Ok(text) => Cell::Text(Cow::from(text)),
                Err(_) => Cell::NotUtf8(bytes),
            },
            Ok(ValueRef::Blob(_)) => {
                Cell::Unusable("a blob, which no tag takes: cast it in the query".into())
            }
            Err(_) => Cell::Unusable("a value that cannot be read".into()),
        }
    }
}
