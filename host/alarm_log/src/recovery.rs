//! What a log tells when it is opened.

use std::collections::{BTreeMap, VecDeque};

use busbar_alarms::{Record, State};

use crate::MAX_TAIL;
use crate::line::{self, Line};

/// What a log knew.
#[derive(Clone, Debug, Default)]
pub struct Recovered {
    /// The last record of each alarm that is not normal, by id.
    pub open: BTreeMap<String, Record>,
    /// The newest records, at most [`MAX_TAIL`], the oldest first.
    pub tail: VecDeque<Record>,
    /// Number of the newest record; 0 for none.
    pub last_number: u64,
    /// What was found wrong, for people.
    pub remarks: Vec<String>,
}

/// A file of the log, read.
#[derive(Debug, Default)]
pub(crate) struct Reading {
    pub(crate) found: Recovered,
    /// Bytes up to the end of the last line that is whole.
    pub(crate) good_bytes: u64,
    damaged: usize,
    missing: u64,
}

impl Reading {
    /// Reads the bytes of a file. After its end lies what a crash cut short.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let mut reading = Self::default();
        let mut start = 0;
        for line in bytes.split_inclusive(|&byte| byte == b'\n') {
            let end = start + line.len();
            match line.strip_suffix(b"\n").map(line::read) {
                Some(Some(line)) => {
                    reading.take(line);
                    reading.good_bytes = end as u64;
                }
                // Whole lines after it make it a damaged one; see `finish`.
                Some(None) => reading.damaged += 1,
                None => {}
            }
            start = end;
        }
        reading.finish(bytes);
        reading
    }

    fn take(&mut self, line: Line) {
        let found = &mut self.found;
        let last = found.last_number;
        let record = match &line {
            Line::News(record) | Line::Carried(record) => record,
        };
        found.last_number = last.max(record.number);
        if record.to == State::A {
            found.open.remove(&record.alarm);
        } else {
            found.open.insert(record.alarm.clone(), record.clone());
        }
        let Line::News(record) = line else { return };
        if last > 0 {
            self.missing += record.number.saturating_sub(last + 1);
        }
        if found.tail.len() == MAX_TAIL {
            found.tail.pop_front();
        }
        found.tail.push_back(record);
    }

    fn finish(&mut self, bytes: &[u8]) {
        let torn = &bytes[self.good_bytes as usize..];
        let torn_lines = torn.iter().filter(|&&byte| byte == b'\n').count();
        let damaged = self.damaged.saturating_sub(torn_lines);
        if !torn.is_empty() {
            let remark = format!("{} bytes at its end were cut short and are left out", torn.len());
            self.found.remarks.push(remark);
        }
        if damaged > 0 {
            self.found.remarks.push(format!("{damaged} damaged lines in it are passed over"));
        }
        if self.missing > 0 {
            self.found.remarks.push(format!("{} records in it are missing", self.missing));
        }
    }
}
