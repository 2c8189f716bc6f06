//! Polling of record sources for changes, on a thread of their own.

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{Error, Host, LogLevel, RecordList, RecordSet, StopToken, Worker};

use crate::row_batch::MAX_READ;
use crate::{MAX_MESSAGE, ReadDeadline, RowBatch, one_line};

/// Period at which sources are checked for changes.
const POLL_PERIOD: Duration = Duration::from_secs(1);
/// Delay before a source that could not be read is tried again.
const RETRY_PERIOD: Duration = Duration::from_secs(5);
/// Consecutive polls that may find that a source changed while it was read.
const MAX_CHANGES: u32 = 5;
/// Longest wait of the first call for sources to be read once.
const FIRST_PATIENCE: Duration = Duration::from_secs(2);
/// Slack beyond [`MAX_READ`] before reading counts as late.
const LATE_SLACK: Duration = Duration::from_secs(2);
/// Rows left out that are logged each time.
const MAX_LOGGED: usize = 10;

/// Version of a source, by which changes are detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourceVersion {
    /// Time of the last change.
    pub modified: SystemTime,
    /// Size of the source, bytes.
    pub len: u64,
}

/// Returns the version of a file.
///
/// # Errors
/// Why there is none, in words.
pub fn file_version(file: &Path) -> Result<SourceVersion, String> {
    let metadata = std::fs::metadata(file).map_err(|error| error.to_string())?;
    if !metadata.is_file() {
        return Err("it is no regular file".into());
    }
    let modified = metadata.modified().map_err(|error| error.to_string())?;
    Ok(SourceVersion { modified, len: metadata.len() })
}

/// Source of a list's rows.
pub trait Source: Send + 'static {
    /// Returns the version of the source now.
    ///
    /// # Errors
    /// Why it is not there, in words.
    fn version(&self) -> Result<SourceVersion, String>;

    /// Reads all rows of the source.
    ///
    /// # Errors
    /// Why it cannot be read, in words.
    fn read(&self, rows: &mut RowBatch, deadline: &ReadDeadline) -> Result<(), String>;
}

/// Update of a list that nobody has taken yet.
#[derive(Default)]
struct PendingUpdate {
    read: Option<(RowBatch, SystemTime)>,
    /// Result of the last read: a fault or none; `None` before the first.
    fault: Option<Option<String>>,
}

#[derive(Default)]
struct State {
    updates: Vec<PendingUpdate>,
    /// Index of the list that is being read, and since when.
    reading: Option<(usize, Instant)>,
    has_tried_all: bool,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lists of records whose sources are polled.
pub struct PolledRecords {
    shared: Arc<Shared>,
    lists: Vec<RecordList>,
    revision: u64,
    _worker: Worker,
}

impl PolledRecords {
    /// Starts to poll the source of each list.
    ///
    /// # Errors
    /// No thread can be started.
    pub fn start(host: &Host, lists: Vec<(RecordList, Box<dyn Source>)>) -> Result<Self, Error> {
        let (lists, sources): (Vec<_>, Vec<_>) = lists.into_iter().unzip();
        let updates = sources.iter().map(|_| PendingUpdate::default()).collect();
        let state = State { updates, ..State::default() };
        let shared = Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() });
        let (theirs, log) = (shared.clone(), host.clone());
        let names: Vec<String> = lists.iter().map(|list| list.source.clone()).collect();
        let worker = Worker::start(host, "records", move |running| {
            let poller = |(source, name)| SourcePoller::new(source, name);
            let mut pollers: Vec<SourcePoller> =
                sources.into_iter().zip(names).map(poller).collect();
            loop {
                for (index, poller) in pollers.iter_mut().enumerate() {
                    poller.poll(index, &theirs, &log, running);
                }
                theirs.state().has_tried_all = true;
                theirs.changed.notify_all();
                if !running.wait(POLL_PERIOD) {
                    return;
                }
            }
        })?;
        // Greater than whatever it was in a process before this one.
        let revision = unix_nanos(SystemTime::now()).max(1) as u64;
        Ok(Self { shared, lists, revision, _worker: worker })
    }

    /// Returns the lists as they were last read; the first call waits a little for that.
    pub fn records(&mut self) -> RecordSet<'_> {
        let state = self.shared.state();
        let is_new = |state: &mut State| !state.has_tried_all;
        let waited = self.shared.changed.wait_timeout_while(state, FIRST_PATIENCE, is_new);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        // Who waited once waits no more.
        state.has_tried_all = true;
        let late = state.reading.filter(|(_, since)| since.elapsed() > MAX_READ + LATE_SLACK);
        let update: Vec<PendingUpdate> = state.updates.iter_mut().map(std::mem::take).collect();
        drop(state);
        for (list, update) in self.lists.iter_mut().zip(update) {
            let is_other = update.fault.as_ref().is_some_and(|fault| *fault != list.fault);
            self.revision += u64::from(update.read.is_some() || is_other);
            if let Some((batch, modified)) = update.read {
                (list.rows, list.left_out) = (batch.rows, batch.left_out);
                list.faults = batch.faults;
                list.as_of_unix_nanos = Some(unix_nanos(modified));
            }
            if let Some(fault) = update.fault {
                list.fault = fault;
            }
        }
        if let Some((index, _)) = late {
            let list = &mut self.lists[index];
            let fault = Some("it does not answer".to_owned());
            self.revision += u64::from(list.fault != fault);
            list.fault = fault;
        }
        RecordSet { revision: self.revision, lists: &self.lists }
    }
}

fn unix_nanos(time: SystemTime) -> i64 {
    let nanos = |duration: Duration| i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX);
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => nanos(since),
        Err(before) => -nanos(before.duration()),
    }
}

/// Poller of one source, with the version that was read last.
struct SourcePoller {
    source: Box<dyn Source>,
    name: String,
    known: Option<SourceVersion>,
    fault: Option<String>,
    tried: Option<Instant>,
    changes: u32,
}

impl SourcePoller {
    fn new(source: Box<dyn Source>, name: String) -> Self {
        Self { source, name, known: None, fault: None, tried: None, changes: 0 }
    }

    /// Reads the source if it changed, or could not be read for a while.
    fn poll(&mut self, index: usize, shared: &Shared, host: &Host, running: &StopToken) {
        let mut state = shared.state();
        state.reading = Some((index, Instant::now()));
        let lists = state.updates.len();
        // Whoever asks meanwhile is not held up.
        drop(state);
        let read = self.read(lists, running);
        let mut state = shared.state();
        state.reading = None;
        let (batch, fault) = match read {
            Ok(None) => return,
            Ok(Some((batch, modified))) => (Some((batch, modified)), None),
            Err(fault) => (None, Some(one_line(&fault, MAX_MESSAGE))),
        };
        let update = &mut state.updates[index];
        update.fault = Some(fault.clone());
        let told = batch.as_ref().map_or_else(Vec::new, |(batch, _)| describe_faults(batch));
        update.read = batch.or(update.read.take());
        drop(state);
        if let Some(fault) = fault.as_ref().filter(|_| fault != self.fault) {
            host.log(LogLevel::Error, &format!("{}: {fault}", self.name));
        }
        told.iter().for_each(|what| host.log(LogLevel::Warning, &format!("{}: {what}", self.name)));
        self.fault = fault;
    }

    /// Reads the rows and the time of their version; none where the source is unchanged.
    fn read(
        &mut self,
        lists: usize,
        running: &StopToken,
    ) -> Result<Option<(RowBatch, SystemTime)>, String> {
        let version = self.source.version()?;
        let is_same = self.known == Some(version);
        let waits = self.tried.is_some_and(|tried| tried.elapsed() < RETRY_PERIOD);
        if is_same && (self.fault.is_none() || waits) {
            return self.fault.clone().map_or(Ok(None), Err);
        }
        (self.known, self.tried) = (Some(version), Some(Instant::now()));
        let mut batch = RowBatch::with_lists(lists);
        self.source.read(&mut batch, &ReadDeadline::from_stop_token(running))?;
        if self.source.version()? == version {
            self.changes = 0;
            return Ok(Some((batch, version.modified)));
        }
        // Somebody writes: half of it would pass for all.
        self.known = None;
        self.changes += 1;
        match self.changes > MAX_CHANGES {
            true => Err("it changes each time while it is read".into()),
            false => Ok(None),
        }
    }
}

/// Describes the rows that are left out, for the log.
fn describe_faults(batch: &RowBatch) -> Vec<String> {
    let faults = batch.faults.iter().take(MAX_LOGGED);
    let mut words: Vec<String> =
        faults.map(|f| format!("row {} is left out: {}", f.row, f.reason)).collect();
    let more = batch.left_out.saturating_sub(words.len() as u64);
    words.extend((more > 0).then(|| format!("{more} more rows are left out")));
    words
}
