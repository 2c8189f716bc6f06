//! Reports on the wire -> whole reports: decoding, and joining of segments
//! (IEC 61850-8-1, 17.3).

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use iec61850_rs::Error;
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::report::{Report, ReportAssembler};
use iec61850_rs::proto::mms::{AccessResult, Mms, Unconfirmed};

use crate::service::{LIMITS, value_of};

/// Reports whose segments are being gathered at once.
const MAX_OPEN_REPORTS: usize = 8;

/// A report, or a part of one, that brings no values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Unusable {
    /// `RptID`, as far as it can be read.
    pub(crate) report_id: Option<String>,
    pub(crate) why: String,
}

/// Segments of a report that are joined, by `RptID` and `SqNum`: what all of them have.
#[derive(Debug, PartialEq, Eq)]
struct Run {
    report_id: String,
    number: Option<u32>,
    data_set: Option<String>,
    revision: Option<u32>,
    /// Members of the data set.
    members: usize,
}

/// Reader of the reports of one connection.
#[derive(Debug)]
pub(crate) struct ReportReader {
    assembler: ReportAssembler,
    /// Segments of reports being assembled, at most [`MAX_OPEN_REPORTS`].
    runs: VecDeque<Run>,
    /// Longest time that the segments of a report may take.
    limit: Duration,
    /// Instant by which the segments being assembled must be complete.
    complete_by: Option<Instant>,
}

impl ReportReader {
    pub(crate) fn new(limit: Duration) -> Self {
        let max_members = LIMITS.max_dataset_members;
        let assembler = ReportAssembler::with_max_entries(MAX_OPEN_REPORTS, max_members);
        Self { assembler, runs: VecDeque::new(), limit, complete_by: None }
    }

    /// Takes an unconfirmed message; nothing while segments are missing.
    ///
    /// # Errors
    /// [`Unusable`]: something was sent that brings no values.
    pub(crate) fn take(&mut self, pdu: &[u8], now: Instant) -> Result<Option<Report>, Unusable> {
        let report = read(pdu)?;
        let report_id = report.rpt_id.clone();
        // The assembler hands on a last segment without those before it.
        let is_later_segment =
            report.opt_flds.segmentation() && report.sub_seq_num.unwrap_or_default() != 0;
        if report.opt_flds.segmentation() && !self.continues_its_run(&report, is_later_segment) {
            let why = "segments of several reports are mixed up".into();
            return Err(Unusable { report_id: Some(report_id), why });
        }
        let before = self.assembler.stats();
        let whole = self.assembler.push(report);
        let after = self.assembler.stats();
        let is_joined = after.reassembled > before.reassembled;
        let is_pending = self.assembler.pending() > 0;
        self.complete_by = match self.complete_by {
            Some(by) if is_pending && !is_joined => Some(by),
            _ => is_pending.then(|| now + self.limit),
        };
        let unusable = |why: &str| Err(Unusable { report_id: Some(report_id), why: why.into() });
        if after.evicted > before.evicted {
            let why = format!("more than {MAX_OPEN_REPORTS} reports are in segments at once");
            return Err(Unusable { report_id: None, why });
        }
        if after.oversized > before.oversized {
            return unusable("it has more members than any data set");
        }
        let has_hole = whole.is_some() && is_later_segment && !is_joined;
        if has_hole || after.out_of_order > before.out_of_order {
            return unusable("a segment of it is missing");
        }
        Ok(whole)
    }

    /// Notes the first segment of a report; reports of a later one whether it is of the same
    /// report as the first.
    fn continues_its_run(&mut self, report: &Report, is_later_segment: bool) -> bool {
        let run = Run {
            report_id: report.rpt_id.clone(),
            number: report.seq_num,
            data_set: report.data_set.clone(),
            revision: report.conf_rev,
            members: report.data_set_len(),
        };
        let is_alike =
            |other: &Run| (&other.report_id, other.number) == (&run.report_id, run.number);
        let known = self.runs.iter().position(is_alike);
        if is_later_segment {
            return known.is_none_or(|index| self.runs.get(index) == Some(&run));
        }
        if let Some(index) = known {
            self.runs.remove(index);
        }
        if self.runs.len() == MAX_OPEN_REPORTS {
            self.runs.pop_front();
        }
        self.runs.push_back(run);
        true
    }

    /// Reports whether segments of a report did not come in time.
    pub(crate) fn is_late(&self, now: Instant) -> bool {
        self.complete_by.is_some_and(|by| by <= now)
    }

    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.complete_by
    }
}

fn read(pdu: &[u8]) -> Result<Report, Unusable> {
    let unknown = |error: Error| Unusable { report_id: None, why: error.to_string() };
    let message = Mms::parse(pdu, &LIMITS).map_err(unknown)?;
    let Mms::Unconfirmed(Unconfirmed::InformationReport { results, .. }) = message else {
        return Err(unknown(Error::InvalidValue("it is no report")));
    };
    Report::parse(&results, &LIMITS)
        .map_err(|error| Unusable { report_id: report_id_of(&results), why: error.to_string() })
}

/// `RptID`, which comes first in every report.
fn report_id_of(results: &[AccessResult<'_>]) -> Option<String> {
    match value_of(results.first()?) {
        Ok(Ok(Value::VisibleString(id))) => Some(id),
        _ => None,
    }
}

#[cfg(test)]
#[path = "report_reader_tests.rs"]
mod tests;
