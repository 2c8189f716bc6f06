//! Sources that are read again when they changed, on a thread of their own.

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{Error, Host, LogLevel, RecordList, RecordSet, StopToken, Worker};

use crate::row_batch::MAX_READ;
use crate::{MAX_MESSAGE, ReadDeadline, RowBatch, one_line};

/// How often it is looked whether a source changed.
const POLL_PERIOD: Duration = Duration::from_secs(1);
/// How long it takes until one that could not be read is tried again.
const RETRY_PERIOD: Duration = Duration::from_secs(5);
/// Polls in a row that may find that a source changed while it was read.
const MAX_CHANGES: u32 = 5;
/// How long the first question waits for sources to be read once.
const FIRST_PATIENCE: Duration = Duration::from_secs(2);
/// How much longer than it may take reading is not told as late.
const LATE_SLACK: Duration = Duration::from_secs(2);
/// Rows left out that are logged each time.
const MAX_LOGGED: usize = 10;

/// Tells states of a source apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SourceVersion {
    /// When it was changed last.
    pub modified: SystemTime,
    /// Bytes.
    pub len: u64,
}

/// The version of a file.
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

/// Where rows come from.
pub trait Source: Send + 'static {
    /// What tells whether it changed.
    ///
    /// # Errors
    /// Why it is not there, in words.
    fn version(&self) -> Result<SourceVersion, String>;

    /// Reads all rows.
    ///
    /// # Errors
    /// Why it cannot be read, in words.
    fn read(&self, rows: &mut RowBatch, deadline: &ReadDeadline) -> Result<(), String>;
}

/// What was read of a list and nobody has taken yet.
#[derive(Default)]
struct PendingUpdate {
    read: Option<(RowBatch, SystemTime)>,
    /// Whether it could be read, the last time that it was tried.
    fault: Option<Option<String>>,
}

#[derive(Default)]
struct State {
    updates: Vec<PendingUpdate>,
    /// Since when which list is read.
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

/// Lists with their sources.
pub struct PolledRecords {
    shared: Arc<Shared>,
    lists: Vec<RecordList>,
    revision: u64,
    _worker: Worker,
}

impl PolledRecords {
    /// Begins to read; of each list its source.
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

    /// The lists as they were last read; the first call waits a little for that.
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

/// A source, and what it was when it was read.
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

    /// Reads it if it changed, or could not be read for a while.
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

    /// Its rows and of when they are; none where it is as it was.
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

/// What is said in the log of rows that are left out.
fn describe_faults(batch: &RowBatch) -> Vec<String> {
    let faults = batch.faults.iter().take(MAX_LOGGED);
    let mut words: Vec<String> =
        faults.map(|f| format!("row {} is left out: {}", f.row, f.reason)).collect();
    let more = batch.left_out.saturating_sub(words.len() as u64);
    words.extend((more > 0).then(|| format!("{more} more rows are left out")));
    words
}
