//! Reads a plugin's records beside the frames: a call may take as long as the plugin takes.

use std::time::Duration;

use busbar_plugin_host::{MAX_PAGE_ROWS, PluginError};
use busbar_plugin_process::{Plugin, RunningRecords};
use busbar_records::{List, MAX_BYTES};

use crate::plugin_poller::{PluginPoller, PolledCapability, SharedState, note_fault};

/// Largest number of read attempts while records change.
const MAX_TRIES: u32 = 5;

/// Records of a plugin, with the revision that is known.
pub(super) struct PolledRecords {
    records: RunningRecords,
    known: Option<u64>,
}

/// Lists as they were read.
#[derive(Default)]
pub(super) struct ReadRecords {
    read: Option<Vec<List>>,
    /// Lists to free on the polling thread: freeing many rows takes longer than a frame.
    discarded: Vec<Vec<List>>,
    fault: Option<String>,
}

impl PolledCapability for PolledRecords {
    const SUBJECT: &'static str = "records";
    const PERIOD: Duration = Duration::from_secs(1);
    type State = ReadRecords;

    fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError> {
        Ok(Self { records: RunningRecords::from_plugin(plugin)?, known: None })
    }

    fn forget(&mut self) {
        self.known = None;
    }

    fn poll(&mut self, plugin: &Plugin, shared: &SharedState<ReadRecords>) {
        let read = poll(&self.records, self.known);
        let discarded = shared.with(|state| {
            let mut discarded = std::mem::take(&mut state.discarded);
            let fault = match read {
                Ok(None) => None,
                Ok(Some((revision, lists))) => {
                    self.known = Some(revision);
                    discarded.extend(state.read.replace(lists));
                    None
                }
                Err(fault) => {
                    self.known = None;
                    Some(fault)
                }
            };
            note_fault::<Self>(plugin, &mut state.fault, fault);
            discarded
        });
        drop(discarded);
    }
}

/// Takes the lists if they were read since the last call; reports whether they were.
pub(super) fn take_lists(poller: &PluginPoller<PolledRecords>, lists: &mut Vec<List>) -> bool {
    poller.with(|state| {
        let Some(read) = state.read.take() else { return false };
        state.discarded.push(std::mem::replace(lists, read));
        true
    })
}

/// Returns the fault that keeps the records from being read.
pub(super) fn fault_of(poller: &PluginPoller<PolledRecords>) -> Option<String> {
    poller.with(|state| state.fault.clone())
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
