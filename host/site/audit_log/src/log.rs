//! The log as a viewer has it: a queue, and a thread that writes.

use std::mem;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use busbar_alarms::AlarmRecord;

use crate::anchor::{self, Anchor};
use crate::log_writer::LogWriter;
use crate::{AuditLogOptions, LogError, RecoveredLog};

/// Records that wait for the disk before new ones are lost.
pub const MAX_WAITING_RECORDS: usize = 100_000;
/// Batches, a frame each, that lie in the queue.
const MAX_BATCHES: usize = 64;
/// Records that are written and synced at once.
const MAX_RECORDS_AT_ONCE: usize = 10_000;
/// Delay before a failed write is repeated.
const RETRY_DELAY: Duration = Duration::from_secs(1);
/// The longest that the anchor is behind a record that is on the disk.
pub const ANCHOR_INTERVAL: Duration = Duration::from_secs(1);

/// Audit log that is open for writing.
#[derive(Debug)]
pub struct AuditLog {
    /// Gone when the log is to end.
    sender: Option<SyncSender<Vec<AlarmRecord>>>,
    thread: Option<JoinHandle<()>>,
    shared: Arc<Shared>,
    /// Records not handed over yet.
    waiting: Vec<AlarmRecord>,
    lost: u64,
}

/// State shared with the writing thread.
#[derive(Debug, Default)]
struct Shared {
    durable: AtomicU64,
    fault: Mutex<Option<String>>,
    anchor_fault: Mutex<Option<String>>,
    /// True once nobody waits any more for a disk that refuses to write.
    is_ending: AtomicBool,
}

impl AuditLog {
    /// Opens a log, or creates it; returns the recovered state.
    ///
    /// # Errors
    /// A folder that cannot be used, or a log that another viewer writes.
    pub fn open(rules: AuditLogOptions) -> Result<(Self, RecoveredLog), LogError> {
        let (writer, found) = LogWriter::open(&rules)?;
        let shared = Arc::new(Shared::default());
        shared.durable.store(found.last_number, Ordering::Release);
        let (sender, receiver) = sync_channel(MAX_BATCHES);
        let of_thread = shared.clone();
        let AuditLogOptions { directory, anchor_file, .. } = rules;
        let thread = thread::Builder::new()
            .name("alarm log".into())
            .spawn(move || {
                let keeper = AnchorKeeper { path: anchor_file, written: None, last: None };
                write_all(writer, keeper, &receiver, &of_thread);
            })
            .map_err(|source| LogError::Unusable { path: directory, source })?;
        let (sender, thread) = (Some(sender), Some(thread));
        Ok((Self { sender, thread, shared, waiting: Vec::new(), lost: 0 }, found))
    }

    /// Appends a record; [`AuditLog::flush`] hands it to the disk. Where the disk is behind by
    /// [`MAX_WAITING_RECORDS`], the record is lost and counted.
    pub fn append(&mut self, record: AlarmRecord) {
        if self.waiting.len() < MAX_WAITING_RECORDS {
            self.waiting.push(record);
        } else {
            self.lost += 1;
        }
    }

    /// Hands over what was taken, once a frame. Never waits.
    pub fn flush(&mut self) {
        if self.waiting.is_empty() {
            return;
        }
        let Some(sender) = &self.sender else { return };
        match sender.try_send(mem::take(&mut self.waiting)) {
            Ok(()) => {}
            // The next frame tries again.
            Err(TrySendError::Full(records) | TrySendError::Disconnected(records)) => {
                self.waiting = records;
            }
        }
    }

    /// Number of the newest record that is on the disk; all before it are there too.
    pub fn durable(&self) -> u64 {
        self.shared.durable.load(Ordering::Acquire)
    }

    /// Reports whether the disk keeps up, so that operators may act.
    pub fn keeps_up(&self) -> bool {
        self.lost == 0 && self.waiting.len() < MAX_WAITING_RECORDS / 2
    }

    /// Returns the reason why records are not on the disk. A final loss of records is reported
    /// from then on.
    pub fn fault(&self) -> Option<String> {
        let told = |fault: &Mutex<Option<String>>| {
            fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
        };
        let lost = (self.lost > 0).then(|| format!("{} records were lost", self.lost));
        let faults = [told(&self.shared.fault), lost, told(&self.shared.anchor_fault)];
        let faults: Vec<String> = faults.into_iter().flatten().collect();
        (!faults.is_empty()).then(|| faults.join("; "))
    }
}

impl Drop for AuditLog {
    fn drop(&mut self) {
        self.shared.is_ending.store(true, Ordering::Release);
        let rest = mem::take(&mut self.waiting);
        if let Some(sender) = self.sender.take().filter(|_| !rest.is_empty()) {
            // What a hung disk has no room for is lost with the process.
            let _ = sender.try_send(rest);
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Writes incoming records in batches until the sender is dropped.
fn write_all(
    mut writer: LogWriter,
    mut keeper: AnchorKeeper,
    receiver: &Receiver<Vec<AlarmRecord>>,
    shared: &Shared,
) {
    keeper.keep(&mut writer, shared);
    loop {
        let mut records = match receiver.recv_timeout(keeper.patience(&writer)) {
            Ok(records) => records,
            Err(RecvTimeoutError::Timeout) => {
                keeper.keep(&mut writer, shared);
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => break,
        };
        while records.len() < MAX_RECORDS_AT_ONCE {
            match receiver.try_recv() {
                Ok(more) => records.extend(more),
                Err(_) => break,
            }
        }
        if !write(&mut writer, records, shared) {
            break;
        }
        if keeper.patience(&writer).is_zero() {
            keeper.keep(&mut writer, shared);
        }
    }
    keeper.keep(&mut writer, shared);
}

/// Tries until records are written; not so where the log is to end and the disk refuses.
fn write(writer: &mut LogWriter, records: Vec<AlarmRecord>, shared: &Shared) -> bool {
    let newest = records.last().map_or(0, |record| record.number);
    writer.stage(records);
    loop {
        let fault = writer.write_staged().err().map(|error| format!("not logged: {error}"));
        let is_written = fault.is_none();
        *shared.fault.lock().unwrap_or_else(PoisonError::into_inner) = fault;
        if is_written {
            shared.durable.fetch_max(newest, Ordering::AcqRel);
            return true;
        }
        if shared.is_ending.load(Ordering::Acquire) {
            return false;
        }
        thread::sleep(RETRY_DELAY);
    }
}

/// The anchor's file, written once an interval at most.
struct AnchorKeeper {
    path: Option<PathBuf>,
    /// Time of the last attempt.
    written: Option<Instant>,
    last: Option<Anchor>,
}

impl AnchorKeeper {
    /// Time until the anchor is to be written; long where it is as the log.
    fn patience(&self, writer: &LogWriter) -> Duration {
        const LONG: Duration = Duration::from_secs(3600);
        if self.path.is_none() || self.last == writer.anchor() {
            return LONG;
        }
        self.written.map_or(Duration::ZERO, |at| ANCHOR_INTERVAL.saturating_sub(at.elapsed()))
    }

    /// Writes the anchor where it is not as the log.
    fn keep(&mut self, writer: &mut LogWriter, shared: &Shared) {
        let (Some(path), Some(anchor)) = (&self.path, writer.anchor()) else { return };
        if self.last.as_ref() == Some(&anchor) {
            return;
        }
        self.written = Some(Instant::now());
        let result = anchor::write(path, &anchor, writer.keys().current());
        let fault = result.err().map(|error| format!("the log's anchor is not written: {error}"));
        if fault.is_none() {
            self.last = Some(anchor);
            writer.confirm_anchor();
        }
        *shared.anchor_fault.lock().unwrap_or_else(PoisonError::into_inner) = fault;
    }
}
