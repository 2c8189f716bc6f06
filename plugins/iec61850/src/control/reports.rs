//! The reports of a control block: whose they are, and whether they fit.

use iec61850_rs::proto::mms::report::Report;

use super::{Control, Step};

/// Longest entry id, bytes; it is eight by the standard.
const MAX_ENTRY_ID: usize = 64;

/// What is to be known of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Noted {
    pub(crate) is_replayed: bool,
    pub(crate) is_lossy: bool,
}

/// Why the values of a report cannot be told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mismatch {
    Members {
        told: usize,
        sent: usize,
    },
    /// `ConfRev` changed while it reported.
    Revision,
}

impl Control {
    /// Whether a report is one of its own.
    pub(crate) fn has_sent(&self, report: &Report) -> bool {
        let alike = |a: &str, b: &str| a.replace('.', "$") == b.replace('.', "$");
        let may_report = self.is_running() || self.step == Step::Enable;
        may_report
            && alike(&self.report_id, &report.rpt_id)
            && self
                .data_set
                .as_ref()
                .zip(report.data_set.as_ref())
                .is_none_or(|(ours, theirs)| alike(&ours.to_string(), theirs))
    }

    /// Whether the values of a report are where they should be.
    ///
    /// # Errors
    /// The data set is not the one that was mapped; in words.
    pub(crate) fn check(&mut self, report: &Report) -> Result<(), Mismatch> {
        if report.data_set_len() != self.uses.len() {
            return Err(Mismatch::Members { told: self.uses.len(), sent: report.data_set_len() });
        }
        let revision = report.conf_rev.or(self.revision);
        if self.revision.is_some() && revision != self.revision {
            return Err(Mismatch::Revision);
        }
        self.revision = revision;
        Ok(())
    }

    /// Takes notice of a report: whether it is of the past, and whether entries before it
    /// were lost.
    pub(crate) fn note(&mut self, report: &Report) -> Noted {
        if let Some(id) = report.entry_id.as_ref().filter(|id| id.len() <= MAX_ENTRY_ID) {
            self.entry_id = Some(id.clone());
        }
        let is_answer = report
            .entries
            .iter()
            .any(|entry| entry.reason.is_none_or(|reason| reason.general_interrogation()));
        self.is_replaying &= !is_answer;
        self.is_answered |= is_answer;
        self.answer_by = self.answer_by.filter(|_| !is_answer);
        Noted { is_replayed: self.is_replaying, is_lossy: report.buf_ovfl == Some(true) }
    }
}
