//! Reads a plugin's records beside the frames: a call may take as long as the plugin takes.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_plugin_host::{MAX_PAGE_ROWS, PluginError};
use busbar_plugin_process::{Plugin, RunningRecords};
use busbar_records::{List, MAX_BYTES};

/// Period of polling for a new revision.
const POLL_PERIOD: Duration = Duration::from_secs(1);
/// Largest number of read attempts while records change.
const MAX_TRIES: u32 = 5;

#[derive(Default)]
struct State {
    ends: bool,
    read: Option<Vec<List>>,
    /// Lists to free on this thread: freeing many rows takes longer than a frame.
    discarded: Vec<Vec<List>>,
    fault: Option<String>,
    polls: u64,
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

/// Records that are read on a thread of their own.
pub(super) struct RecordPoller {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl RecordPoller {
    pub(super) fn start(plugin: &Plugin) -> Result<Self, PluginError> {
        let records = RunningRecords::from_plugin(plugin)?;
        let shared = Arc::new(Shared::default());
        let (theirs, plugin) = (shared.clone(), plugin.clone());
        let id = plugin.info().id.clone();
        let work = move || run(&plugin, &records, &theirs);
        let thread = std::thread::Builder::new().name("records".into()).spawn(work);
        let thread = thread.map_err(|error| PluginError::Failed {
            id,
            settings_at_fault: false,
            message: format!("no thread can be started to read its records: {error}"),
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Waits until it was read once, or could not be.
    pub(super) fn wait_for_first(&self, timeout: Duration) {
        let is_new = |state: &mut State| state.polls == 0;
        let state = self.shared.state();
        drop(self.shared.changed.wait_timeout_while(state, timeout, is_new));
    }

    /// Takes the lists if they were read since the last call; reports whether they were.
    pub(super) fn take(&self, lists: &mut Vec<List>) -> bool {
        let mut state = self.shared.state();
        let Some(read) = state.read.take() else { return false };
        state.discarded.push(std::mem::replace(lists, read));
        true
    }

    /// Returns the fault that keeps the records from being read.
    pub(super) fn fault(&self) -> Option<String> {
        self.shared.state().fault.clone()
    }
}

impl Drop for RecordPoller {
    fn drop(&mut self) {
        self.shared.state().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // It ends with its call, which has a deadline.
            let _ = thread.join();
        }
    }
}

fn run(plugin: &Plugin, records: &RunningRecords, shared: &Shared) {
    let (mut known, mut deaths) = (None, 0);
    loop {
        // What another process counts may be the same by chance.
        let died = plugin.status().deaths;
        known = known.filter(|_| died == deaths);
        deaths = died;
        let read = poll(records, known);
        let mut state = shared.state();
        let mut discarded = std::mem::take(&mut state.discarded);
        state.polls += 1;
        match read {
            Ok(read) => {
                state.fault = None;
                if let Some((revision, lists)) = read {
                    known = Some(revision);
                    discarded.extend(state.read.replace(lists));
                }
            }
            Err(fault) => {
                if state.fault.as_ref() != Some(&fault) {
                    tracing::error!(plugin = plugin.name(), "records cannot be read: {fault}");
                }
                (known, state.fault) = (None, Some(fault));
            }
        }
        shared.changed.notify_all();
        drop(state);
        drop(discarded);
        let mut state = shared.state();
        let next = Instant::now() + POLL_PERIOD;
        while !state.ends && Instant::now() < next {
            let left = next.saturating_duration_since(Instant::now());
            let waited = shared.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        if state.ends {
            return;
        }
    }
}

/// Reads all lists if the revision differs from the known one.
fn poll(records: &RunningRecords, known: Option<u64>) -> Result<Option<(u64, Vec<List>)>, String> {
    let words = |error: PluginError| error.to_string();
    for _ in 0..MAX_TRIES {
        let revision = records.read(0, 0, 0, 0).map_err(words)?.revision;
        if Some(revision) == known {
            return Ok(None);
        }
        if let Some(lists) = read_all(records, revision)? {
            return Ok(Some((revision, lists)));
        }
    }
    Err(format!("its records changed {MAX_TRIES} times while they were read"))
}

/// `None` where records changed meanwhile.
fn read_all(records: &RunningRecords, revision: u64) -> Result<Option<Vec<List>>, String> {
    let words = |error: PluginError| error.to_string();
    let mut lists = Vec::new();
    let mut bytes = 0;
    for (index, info) in (0..).zip(records.describe().map_err(words)?.lists) {
        let columns = info.columns.len() as u32;
        let mut list = List::new(info);
        loop {
            let first = list.len() as u64;
            let page = records.read(index, columns, first, MAX_PAGE_ROWS);
            let page = match page {
                Ok(page) if page.revision == revision => page,
                Ok(_) => return Ok(None),
                Err(error) => return Err(words(error)),
            };
            let is_all = page.rows.is_empty() || first + page.rows.len() as u64 >= page.total;
            list.append(page.rows).map_err(|fault| fault.to_string())?;
            if bytes + list.bytes() > MAX_BYTES {
                return Err(format!("its lists have more than {MAX_BYTES} bytes in all"));
            }
            if is_all {
                break;
            }
        }
        bytes += list.bytes();
        lists.push(list);
    }
    Ok(Some(lists))
}
