//! Rows read from a source, within limits of number, bytes and time.

use std::time::{Duration, Instant};

use busbar_plugin_sdk::{MAX_RECORD_BYTES, MAX_RECORD_ROWS, Record, RecordRowFault, StopToken};

use crate::{MAX_MESSAGE, one_line};

/// Longest time that reading a source may take.
pub(crate) const MAX_READ: Duration = Duration::from_secs(20);
/// Rows left out that are reported one by one.
const MAX_FAULTS: usize = 100;

/// Deadline of reading a source.
#[derive(Clone)]
pub struct ReadDeadline {
    /// Stop token that ends reading early, if any.
    running: Option<StopToken>,
    until: Instant,
}

impl ReadDeadline {
    pub(crate) fn from_stop_token(running: &StopToken) -> Self {
        Self { running: Some(running.clone()), until: Instant::now() + MAX_READ }
    }

    /// Creates a deadline after this time.
    pub fn within(time: Duration) -> Self {
        Self { running: None, until: Instant::now() + time }
    }

    /// Reports whether reading must end now.
    pub fn has_passed(&self) -> bool {
        let is_stopped = self.running.as_ref().is_some_and(|running| !running.is_running());
        is_stopped || Instant::now() > self.until
    }

    /// Checks that the deadline has not passed.
    ///
    /// # Errors
    /// That it is, in words.
    pub fn check(&self) -> Result<(), String> {
        match self.has_passed() {
            true => Err(format!("reading it took longer than {} s", MAX_READ.as_secs())),
            false => Ok(()),
        }
    }
}

/// Rows of a source read so far.
#[derive(Debug, Default, PartialEq)]
pub struct RowBatch {
    pub(crate) rows: Vec<Record>,
    pub(crate) left_out: u64,
    pub(crate) faults: Vec<RecordRowFault>,
    bytes: usize,
    max_bytes: usize,
}

impl RowBatch {
    /// Creates a batch for one of so many lists, which share [`MAX_RECORD_BYTES`].
    pub fn with_lists(lists: usize) -> Self {
        Self { max_bytes: MAX_RECORD_BYTES / lists.max(1), ..Self::default() }
    }

    /// Takes a row, or its fault; the number is that of a line, or of a row of a result.
    ///
    /// # Errors
    /// That there are more than a list may have, in words.
    pub fn take(&mut self, number: u64, row: Result<Record, String>) -> Result<(), String> {
        match row {
            Ok(row) => {
                self.bytes += row.bytes();
                if self.rows.len() >= MAX_RECORD_ROWS || self.bytes > self.max_bytes {
                    return Err(format!(
                        "it has more than {MAX_RECORD_ROWS} rows or {} bytes: give it fewer rows or \
                         columns",
                        self.max_bytes
                    ));
                }
                self.rows.push(row);
            }
            Err(reason) => {
                self.left_out += 1;
                if self.faults.len() < MAX_FAULTS {
                    let reason = one_line(&reason, MAX_MESSAGE);
                    self.faults.push(RecordRowFault { row: number, reason });
                }
            }
        }
        Ok(())
    }

    /// Returns the rows taken so far.
    pub fn rows(&self) -> &[Record] {
        &self.rows
    }

    /// Returns the faults of the first rows left out.
    pub fn faults(&self) -> &[RecordRowFault] {
        &self.faults
    }
}
