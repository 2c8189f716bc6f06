//! Alarms that another system decides on, as it reports them.

use std::collections::HashSet;

use busbar_tags::SourceTime;
use busbar_types::{AlarmState, QualityLevel};
use serde::{Deserialize, Serialize};

use crate::AlarmFlags;

/// Alarms of one report.
pub const MAX_SOURCE_ALARMS: usize = 5_000;
/// Bytes of an id, a name, a source or a message.
pub const MAX_SOURCE_ALARM_TEXT: usize = 512;
/// Bytes of why a source is not current.
const MAX_REASON_BYTES: usize = 512;
/// The most urgent severity (OPC 10000-5, 6.4.2).
pub const MAX_SEVERITY: u16 = 1000;

/// Report of an external alarm system.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SourceReport {
    /// Grows with every change of any alarm; never 0.
    pub revision: u64,
    /// Time since the last sign of life of the source, milliseconds; `None` where there was none.
    pub heard_millis: Option<u64>,
    /// Reason why the source is not current; its alarms are the last known ones.
    pub fault: Option<String>,
    /// Alarms that it has beyond those that it reports.
    pub left_out: u64,
    /// Alarms of interest; `None` where they are unchanged, or where the fault makes them
    /// unknown.
    pub alarms: Option<Vec<SourceAlarm>>,
}

/// An alarm as its source has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SourceAlarm {
    /// Unique in the source.
    pub id: String,
    /// Name of the alarm; may be empty.
    pub name: String,
    /// Object of the alarm, as the source calls it.
    pub source: String,
    /// Message for people; may be empty.
    pub message: String,
    /// 1 to [`MAX_SEVERITY`], the most urgent.
    pub severity: u16,
    /// True while its condition holds.
    pub is_active: bool,
    /// True until an operator acknowledges it.
    pub is_unacknowledged: bool,
    /// True until an operator confirms it (OPC 10000-9, 5.7.2).
    pub is_unconfirmed: bool,
    /// True while an operator has it shelved.
    pub is_shelved: bool,
    /// True while it is suppressed by design.
    pub is_suppressed: bool,
    /// True while it is out of service.
    pub is_out_of_service: bool,
    /// Time of its last change of state, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: Option<i64>,
    /// Quality as the source rates it.
    pub quality: QualityLevel,
}

/// The rule that a report breaks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its report of alarms: {0}")]
pub struct SourceReportError(String);

impl SourceReport {
    /// Validates a report for a reader that knows a revision; 0 for none.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self, known: u64) -> Result<(), SourceReportError> {
        let rule = |holds: bool, what: &str| match holds {
            true => Ok(()),
            false => Err(SourceReportError(what.to_owned())),
        };
        rule(self.revision > 0, "its revision is 0")?;
        let fault = self.fault.as_deref().unwrap_or("-");
        rule(is_line(fault, 1, MAX_REASON_BYTES), "its fault is empty, too long or not one line")?;
        let Some(alarms) = &self.alarms else {
            let may_lack = self.revision == known || self.fault.is_some();
            return rule(may_lack, "it is of another revision, and has no alarms");
        };
        rule(alarms.len() <= MAX_SOURCE_ALARMS, "it has more than 5,000 alarms")?;
        let mut ids = HashSet::with_capacity(alarms.len());
        for alarm in alarms {
            alarm.check().map_err(|what| SourceReportError(what.to_owned()))?;
            rule(ids.insert(alarm.id.as_str()), "two alarms have the same id")?;
        }
        Ok(())
    }
}

impl SourceAlarm {
    fn check(&self) -> Result<(), &'static str> {
        let line = |text: &str, least| is_line(text, least, MAX_SOURCE_ALARM_TEXT);
        if !line(&self.id, 1) || !line(&self.source, 0) {
            return Err("the id or source of an alarm is empty, too long or not one line");
        }
        if !line(&self.name, 0) || !line(&self.message, 0) {
            return Err("the name or message of an alarm is too long or not one line");
        }
        if !(1..=MAX_SEVERITY).contains(&self.severity) {
            return Err("the severity of an alarm is not 1 to 1000");
        }
        Ok(())
    }

    /// Converts the reported flags.
    pub fn standing(&self) -> AlarmFlags {
        AlarmFlags {
            is_active: self.is_active,
            is_unacknowledged: self.is_unacknowledged,
            is_latched: false,
            is_shelved: self.is_shelved,
            shelved_until: None,
            is_suppressed: self.is_suppressed,
            is_out_of_service: self.is_out_of_service,
        }
    }

    /// Returns the time of the last change of state.
    pub fn since(&self) -> Option<SourceTime> {
        self.unix_nanos.map(SourceTime)
    }

    /// Returns the name of the state. A normal alarm that a source still reports is kept for the
    /// source's own reason.
    pub fn state_name(&self) -> &'static str {
        match self.standing().state() {
            AlarmState::Normal if self.is_unconfirmed => "returned, unconfirmed",
            AlarmState::Normal => "returned, kept by its source",
            AlarmState::Acknowledged if self.is_unconfirmed => "acknowledged, unconfirmed",
            state => state.name(),
        }
    }
}

/// Reports whether a text is one line of `least` to `most` bytes.
fn is_line(text: &str, least: usize, most: usize) -> bool {
    (least..=most).contains(&text.len()) && !text.chars().any(char::is_control)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alarm(id: &str) -> SourceAlarm {
        SourceAlarm { id: id.to_owned(), severity: 500, ..SourceAlarm::default() }
    }

    fn report(alarms: Vec<SourceAlarm>) -> SourceReport {
        SourceReport { revision: 3, alarms: Some(alarms), ..SourceReport::default() }
    }

    #[track_caller]
    fn check(report: &SourceReport, expected: &str) {
        let fault = report.check(3).map_or_else(|fault| fault.to_string(), |()| "fine".to_owned());
        assert!(fault.contains(expected), "{fault}");
    }

    #[test]
    fn reports_keep_their_rules() {
        check(&report(vec![alarm("a"), alarm("b")]), "fine");
        check(&report(vec![alarm("a"), alarm("a")]), "the same id");
        check(&report(vec![alarm("")]), "is empty");
        check(&report(vec![alarm("a\nb")]), "not one line");
        check(&report(vec![alarm(&"x".repeat(MAX_SOURCE_ALARM_TEXT + 1))]), "too long");
        check(&report(vec![SourceAlarm { severity: 0, ..alarm("a") }]), "1 to 1000");
        check(&report(vec![SourceAlarm { severity: 1001, ..alarm("a") }]), "1 to 1000");
        let long = "m".repeat(MAX_SOURCE_ALARM_TEXT + 1);
        check(&report(vec![SourceAlarm { message: long, ..alarm("a") }]), "message");
        let many = (0..=MAX_SOURCE_ALARMS).map(|number| alarm(&number.to_string()));
        check(&report(many.collect()), "more than 5,000");
        check(&SourceReport { revision: 0, ..report(Vec::new()) }, "revision is 0");
        check(&SourceReport { fault: Some(String::new()), ..report(Vec::new()) }, "its fault");
        let same = SourceReport { alarms: None, ..report(Vec::new()) };
        check(&same, "fine");
        check(&SourceReport { revision: 4, ..same.clone() }, "another revision");
        let fault = Some("not connected yet".to_owned());
        check(&SourceReport { revision: 4, fault, ..same }, "fine");
    }

    #[test]
    fn states_are_those_of_the_source() {
        let with = |is_active, is_unacknowledged| SourceAlarm {
            is_active,
            is_unacknowledged,
            ..alarm("a")
        };
        assert_eq!(with(true, true).standing().state(), AlarmState::Unacknowledged);
        assert_eq!(with(true, false).standing().state(), AlarmState::Acknowledged);
        assert_eq!(with(false, true).standing().state(), AlarmState::ReturnedUnacknowledged);
        assert_eq!(with(false, false).state_name(), "returned, kept by its source");
        let unconfirmed = SourceAlarm { is_unconfirmed: true, ..with(false, false) };
        assert_eq!(unconfirmed.state_name(), "returned, unconfirmed");
        let shelved = SourceAlarm { is_shelved: true, ..with(true, true) };
        assert_eq!(shelved.standing().state(), AlarmState::Shelved);
        let out = SourceAlarm { is_out_of_service: true, ..shelved };
        assert_eq!(out.state_name(), "out of service");
    }
}
