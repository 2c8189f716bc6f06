//! The reports of a control block: whose they are, and whether they fit.

use std::fmt;

use iec61850_rs::proto::mms::report::Report;

use super::{Control, Step};

/// Longest entry id, bytes; it is eight by the standard.
const MAX_ENTRY_ID: usize = 64;
/// Reports in a row that cannot be used, after which a block is left alone and its values
/// are polled.
const MAX_FAULTS: u32 = 5;
/// Last numbers before `SqNum` begins anew: of 8, 16 and 32 bits.
const LAST_SEQUENCES: [u32; 3] = [u8::MAX as u32, u16::MAX as u32, u32::MAX];

/// Findings on a report's sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ReportFlags {
    pub(crate) is_replayed: bool,
    pub(crate) is_lossy: bool,
}

/// Reason for which the values of a report cannot be assigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mismatch {
    Members {
        told: usize,
        sent: usize,
    },
    /// `ConfRev` changed while it reported.
    Revision,
    /// A member is another than the data set had there.
    Member(usize),
    /// Reports before this one are missing, or it is an old one.
    Sequence {
        last: u32,
        found: u32,
    },
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Members { told, sent } => {
                write!(f, "it reports {sent} members, and its data set has {told}")
            }
            Self::Revision => f.write_str("its data set has changed (ConfRev)"),
            Self::Member(index) => {
                write!(f, "member {index} is another than its data set has there")
            }
            Self::Sequence { last, found } => {
                write!(f, "its report {found} came after {last} (SqNum)")
            }
        }
    }
}

impl Control {
    /// Reports whether it may report, so that its reports bring values.
    pub(crate) fn is_reporting(&self) -> bool {
        self.is_running() || self.step == Step::Enable
    }

    /// Reports whether reports of this `RptID` are its own.
    pub(crate) fn has_id(&self, report_id: &str) -> bool {
        !self.report_id.is_empty() && is_alike(&self.report_id, report_id)
    }

    /// Reports whether a data set of this name is its own.
    pub(crate) fn has_data_set(&self, data_set: &str) -> bool {
        self.data_set.as_ref().is_some_and(|own| is_alike(&own.to_string(), data_set))
    }

    /// Reports whether it was enabled in this connection, and may send reports.
    pub(crate) fn is_enabled(&self) -> bool {
        self.is_enabled
    }

    /// Reports whether entries of the past may come.
    #[cfg(test)]
    pub(crate) fn is_replaying(&self) -> bool {
        self.is_replaying
    }

    /// Reports whether a report is one of its own.
    pub(crate) fn has_sent(&self, report: &Report) -> bool {
        self.has_id(&report.rpt_id)
            && report.data_set.as_ref().is_none_or(|data_set| self.has_data_set(data_set))
    }

    /// Checks that the values of a report are where they should be.
    ///
    /// # Errors
    /// [`Mismatch`]: they cannot be told apart, or others are missing.
    pub(crate) fn check(&mut self, report: &Report) -> Result<(), Mismatch> {
        if report.data_set_len() != self.uses.len() {
            return Err(Mismatch::Members { told: self.uses.len(), sent: report.data_set_len() });
        }
        let revision = report.conf_rev.or(self.revision);
        if self.revision.is_some() && revision != self.revision {
            return Err(Mismatch::Revision);
        }
        self.revision = revision;
        if let Some(other) = report.entries.iter().find(|entry| {
            let ours = self.members.get(entry.index).and_then(Option::as_ref);
            // What is written in another way than MMS has it is not compared.
            let theirs = entry.reference.as_ref().filter(|reference| reference.contains('$'));
            ours.zip(theirs).is_some_and(|(ours, theirs)| ours.to_string() != *theirs)
        }) {
            return Err(Mismatch::Member(other.index));
        }
        self.follow_sequence(report.seq_num)?;
        self.faults = 0;
        Ok(())
    }

    /// A report of it could not be used. Returns whether it is to be left alone.
    pub(crate) fn note_fault(&mut self) -> bool {
        self.faults += 1;
        self.faults >= MAX_FAULTS
    }

    fn follow_sequence(&mut self, found: Option<u32>) -> Result<(), Mismatch> {
        let Some(found) = found else { return Ok(()) };
        let Some(last) = self.sequence.replace(found) else { return Ok(()) };
        let is_next = last.checked_add(1) == Some(found);
        let begins_anew = found == 0 && LAST_SEQUENCES.contains(&last);
        if is_next || begins_anew { Ok(()) } else { Err(Mismatch::Sequence { last, found }) }
    }

    /// Reports whether a general interrogation was asked for.
    fn is_interrogating(&self) -> bool {
        self.step == Step::Running || (self.step == Step::Interrogate && self.is_asked)
    }

    /// Takes notice of a report: whether it is of the past, and whether entries before it
    /// were lost.
    pub(crate) fn note(&mut self, report: &Report) -> ReportFlags {
        if let Some(id) = report.entry_id.as_ref().filter(|id| id.len() <= MAX_ENTRY_ID) {
            self.entry_id = Some(id.clone());
        }
        let is_whole = report.entries.len() == report.data_set_len();
        let is_answer = self.is_interrogating()
            && report.entries.iter().any(|entry| match entry.reason {
                Some(reason) => reason.general_interrogation(),
                // Without reasons, the first that has all members is taken for it.
                None => is_whole,
            });
        self.is_replaying &= !is_answer;
        self.is_answered |= is_answer;
        self.answer_by = self.answer_by.filter(|_| !is_answer);
        ReportFlags { is_replayed: self.is_replaying, is_lossy: report.buf_ovfl == Some(true) }
    }
}

/// Reports whether two references are the same, with dots or as MMS has them.
fn is_alike(a: &str, b: &str) -> bool {
    a.replace('.', "$") == b.replace('.', "$")
}
