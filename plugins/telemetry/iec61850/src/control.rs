//! One report control block: what it is asked until it reports (IEC 61850-7-2, 17.2;
//! IEC 61850-8-1, 17).

mod reports;

use std::time::{Duration, Instant};

use iec61850_rs::common::{OptFlds, TrgOps};
use iec61850_rs::proto::data::{Typed, Value};

pub(crate) use self::reports::Mismatch;
use crate::block::ReportBlock;
use crate::locate::Share;
use crate::service::{AccessError, Answer, Name, Request};

/// Pause after a block that cannot be enabled.
const RETRY: Duration = Duration::from_secs(10);
/// Pause after which nothing more comes out of a buffer: a general interrogation is asked for
/// then, so that the answer to a former one is not taken for its answer.
const REPLAY_PAUSE: Duration = Duration::from_millis(500);
/// Attributes read of a block, in this order.
const ATTRIBUTES: [&str; 7] = ["RptID", "RptEna", "DatSet", "OptFlds", "TrgOps", "IntgPd", "BufTm"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Inspect,
    Members,
    Configure,
    Enable,
    Interrogate,
    Running,
    /// Failure: the block is retried at that time; without one, not on this connection.
    Failed(Option<Instant>),
}

/// Use of a data set member by a point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MemberUse {
    pub(crate) point: usize,
    pub(crate) share: Share,
}

/// Outcome of an answer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// Further requests follow, or nothing is to be reported.
    InProgress,
    /// The members of its data set, to be mapped.
    Members(Vec<Option<Name>>),
    /// Block that reports, but does not send its values now: they have to be read.
    NotInterrogated(String),
    /// Block that does not report, for a reason in words.
    Failed(String),
    /// Block that works without something, in words.
    Degraded(String),
}

/// A control block and how far it is.
#[derive(Debug)]
pub(crate) struct Control {
    pub(crate) block: ReportBlock,
    step: Step,
    /// Reports whether an answer is awaited.
    is_asked: bool,
    /// Tells whether it was enabled in this connection.
    is_enabled: bool,
    /// Identifier of the block's reports.
    report_id: String,
    data_set: Option<Name>,
    options: OptFlds,
    triggers: TrgOps,
    writes: Vec<(Name, Value)>,
    revision: Option<u32>,
    /// Uses of each member.
    pub(crate) uses: Vec<Vec<MemberUse>>,
    /// Names of the members of the data set.
    members: Vec<Option<Name>>,
    /// `SqNum` of the last report since it was enabled.
    sequence: Option<u32>,
    /// Reports in a row that could not be used.
    faults: u32,
    /// The last entry that came, also of former connections.
    entry_id: Option<Vec<u8>>,
    /// Reports whether past entries arrive, until the answer to the general interrogation.
    is_replaying: bool,
    /// Instant at which a buffer counts as read for lack of reports, and the instant at which that
    /// is no longer awaited.
    quiet_at: Option<Instant>,
    quiet_by: Option<Instant>,
    /// Until when the report that a general interrogation asks for has to come.
    answer_by: Option<Instant>,
    /// Reports whether the answer came; it may come before the request is confirmed.
    is_answered: bool,
    /// Time that the server has for the answer.
    timeout: Duration,
    /// Last message on the block, also of former connections.
    told: Option<String>,
}

impl Control {
    pub(crate) fn new(block: ReportBlock, timeout: Duration) -> Self {
        Self {
            block,
            step: Step::Inspect,
            is_asked: false,
            is_enabled: false,
            report_id: String::new(),
            data_set: None,
            options: OptFlds::NONE,
            triggers: TrgOps::NONE,
            writes: Vec::new(),
            revision: None,
            uses: Vec::new(),
            members: Vec::new(),
            sequence: None,
            faults: 0,
            entry_id: None,
            is_replaying: false,
            quiet_at: None,
            quiet_by: None,
            answer_by: None,
            is_answered: false,
            timeout,
            told: None,
        }
    }

    /// A new connection: all of it but the last entry is asked anew.
    pub(crate) fn begin(&mut self) {
        (self.step, self.is_asked, self.is_enabled) = (Step::Inspect, false, false);
        self.uses.clear();
        (self.revision, self.answer_by, self.sequence, self.faults) = (None, None, None, 0);
        (self.quiet_at, self.quiet_by) = (None, None);
    }

    /// Reports whether the block reports, or does not for the time being.
    pub(crate) fn is_settled(&self) -> bool {
        self.is_running() || matches!(self.step, Step::Failed(_))
    }

    pub(crate) fn is_running(&self) -> bool {
        matches!(self.step, Step::Interrogate | Step::Running)
    }

    /// Returns the identity of the block's reports.
    pub(crate) fn identity(&self) -> Option<(&str, &Name)> {
        let is_known = !matches!(self.step, Step::Inspect | Step::Failed(_));
        self.data_set.as_ref().filter(|_| is_known).map(|set| (self.report_id.as_str(), set))
    }

    /// Returns the instant at which the block is retried, or misses a report.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        match self.step {
            Step::Failed(at) => at,
            Step::Interrogate if !self.is_asked => self.interrogate_at(),
            _ => self.answer_by,
        }
    }

    /// Reports whether the answer to a general interrogation did not come in time; true only once.
    pub(crate) fn take_late(&mut self, now: Instant) -> bool {
        let is_late = self.answer_by.take_if(|by| *by <= now).is_some();
        self.is_replaying &= !is_late;
        is_late
    }

    /// Returns the next request, if there is one now.
    pub(crate) fn next_request(&mut self, now: Instant) -> Option<Request> {
        if matches!(self.step, Step::Failed(Some(at)) if at <= now) {
            self.begin();
        }
        let is_early = self.interrogate_at().is_some_and(|at| now < at);
        if self.is_asked || (self.step == Step::Interrogate && is_early) {
            return None;
        }
        let name = &self.block.name;
        let request = match self.step {
            Step::Inspect => Request::Read(ATTRIBUTES.map(|part| name.part(part)).into()),
            Step::Members => Request::Members(self.data_set.clone()?),
            Step::Configure => {
                self.writes = self.settings();
                Request::Write(self.writes.clone())
            }
            Step::Enable => Request::Write(vec![(name.part("RptEna"), Value::Boolean(true))]),
            Step::Interrogate => Request::Write(vec![(name.part("GI"), Value::Boolean(true))]),
            Step::Running | Step::Failed(_) => return None,
        };
        if self.step == Step::Enable {
            // Entries of the past may come before the answer does.
            self.is_replaying = self.block.is_buffered && self.triggers.general_interrogation();
            (self.is_answered, self.sequence, self.is_enabled) = (false, None, true);
        }
        self.is_asked = true;
        Some(request)
    }

    /// A report came, usable or not.
    pub(crate) fn note_report(&mut self, now: Instant) {
        if self.block.is_buffered {
            self.quiet_at = Some(now + REPLAY_PAUSE);
        }
    }

    /// Returns the instant at which a general interrogation may be requested; nothing where that is
    /// at once.
    fn interrogate_at(&self) -> Option<Instant> {
        self.quiet_at.min(self.quiet_by)
    }

    /// Takes the answer to [`Control::next_request`].
    pub(crate) fn handle_answer(&mut self, answer: Answer, now: Instant) -> Outcome {
        self.is_asked = false;
        let outcome = match (self.step, answer) {
            (Step::Interrogate, Answer::Refused(why)) => self.not_interrogated(&why),
            (_, Answer::Refused(why)) => Outcome::Failed(why),
            (Step::Inspect, Answer::Values(values)) => self.inspect(&values),
            (Step::Members, Answer::Members(members)) => {
                self.step = Step::Configure;
                self.members.clone_from(&members);
                Outcome::Members(members)
            }
            (Step::Configure, Answer::Written(results)) => self.configured(&results),
            (Step::Enable, Answer::Written(results)) => self.enabled(&results, now),
            (Step::Interrogate, Answer::Written(results)) => match results[..] {
                [Err(error)] => self.not_interrogated(&error.to_string()),
                _ => {
                    self.step = Step::Running;
                    self.answer_by = (!self.is_answered).then(|| now + self.timeout);
                    Outcome::InProgress
                }
            },
            // Sessions hand on answers of the service that was asked for alone.
            _ => Outcome::InProgress,
        };
        if matches!(outcome, Outcome::Failed(_)) {
            self.fail(now);
        }
        outcome
    }

    /// Pauses the block for a while.
    pub(crate) fn fail(&mut self, now: Instant) {
        self.abandon(Some(now + RETRY));
    }

    /// Gives up the block, with all that it may still report, until an instant or for good.
    pub(crate) fn abandon(&mut self, until: Option<Instant>) {
        self.step = Step::Failed(until);
        self.answer_by = None;
        self.uses.clear();
    }

    /// Reports whether a message on the block differs from the last one: attempts are repeated.
    pub(crate) fn has_changed(&mut self, text: &str) -> bool {
        self.told.replace(text.to_owned()).as_deref() != Some(text)
    }

    fn inspect(&mut self, values: &[Result<Value, AccessError>]) -> Outcome {
        let value = |name: &str| {
            let index = ATTRIBUTES.iter().position(|attribute| *attribute == name)?;
            values.get(index)?.as_ref().ok()
        };
        if let Some(Err(error)) = values.iter().find(|_| values.iter().all(Result::is_err)) {
            return Outcome::Failed(format!("it cannot be read: {error}; is its name right?"));
        }
        if value("RptEna").and_then(Value::as_bool) == Some(true) {
            return Outcome::Failed("another client has enabled it: use another instance".into());
        }
        let text = |name: &str| value(name).and_then(Value::as_str).filter(|text| !text.is_empty());
        self.report_id = text("RptID").map_or_else(|| self.block.reference(), str::to_owned);
        let own = text("DatSet").and_then(Name::parse);
        let Some(set) = self.block.data_set.clone().or(own) else {
            let remedy = "it has no data set: name one as \"data_set\"";
            return Outcome::Failed(remedy.into());
        };
        self.data_set = Some(set);
        self.options = value("OptFlds").and_then(OptFlds::from_value).unwrap_or_default();
        self.triggers = value("TrgOps").and_then(TrgOps::from_value).unwrap_or_default();
        self.writes = ATTRIBUTES
            .iter()
            .filter_map(|part| Some((self.block.name.part(part), value(part)?.clone())))
            .collect();
        self.step = Step::Members;
        Outcome::InProgress
    }

    /// Returns the attributes to be written, where the block has other values: some servers empty a
    /// buffer whose settings are written.
    fn settings(&mut self) -> Vec<(Name, Value)> {
        let is_buffered = self.block.is_buffered;
        let options = self
            .options
            .with_sequence_number(true)
            .with_report_time_stamp(true)
            .with_reason_for_inclusion(true)
            .with_data_set_name(true)
            .with_buffer_overflow(is_buffered)
            .with_entry_id(is_buffered)
            .with_conf_revision(true);
        let triggers = self
            .triggers
            .with_data_change(true)
            .with_quality_change(true)
            .with_general_interrogation(true);
        let triggers = match self.block.integrity {
            Some(_) => triggers.with_integrity(true),
            None => triggers,
        };
        let millis = |period: Option<Duration>| {
            period.map(|period| Value::Unsigned(period.as_millis() as u64))
        };
        let set = self.block.data_set.as_ref().map(|set| Value::VisibleString(set.to_string()));
        let wanted = [
            ("DatSet", set),
            ("OptFlds", Some(options.to_value())),
            ("TrgOps", Some(triggers.to_value())),
            ("IntgPd", millis(self.block.integrity)),
            ("BufTm", millis(self.block.buffer_time)),
        ];
        let found = std::mem::take(&mut self.writes);
        let name = |part: &str| self.block.name.part(part);
        let mut writes = Vec::new();
        if !is_buffered {
            writes.push((name("Resv"), Value::Boolean(true)));
        }
        for (part, value) in wanted {
            writes.extend(value.map(|v| (name(part), v)).filter(|write| !found.contains(write)));
        }
        if let Some(entry) = self.entry_id.clone().filter(|_| is_buffered) {
            writes.push((name("EntryID"), Value::OctetString(entry)));
        }
        (self.options, self.triggers) = (options, triggers);
        writes
    }

    fn configured(&mut self, results: &[Result<(), AccessError>]) -> Outcome {
        self.step = Step::Enable;
        let mut lacking = Vec::new();
        for ((name, _), result) in self.writes.iter().zip(results) {
            let part = name.item.rsplit('$').next().unwrap_or_default();
            match (part, result) {
                // Before edition 2 there was none everywhere.
                (_, Ok(())) | ("Resv", Err(AccessError::NON_EXISTENT)) => {}
                ("DatSet", Err(error)) => {
                    return Outcome::Failed(format!("its data set cannot be set: {error}"));
                }
                ("EntryID", Err(_)) => {
                    self.entry_id = None;
                    let text = "the server has not the last entry any more: changes may be missing";
                    lacking.push(text.to_owned());
                }
                (_, Err(error)) => lacking.push(format!("{part} cannot be set: {error}")),
            }
        }
        match lacking[..] {
            [] => Outcome::InProgress,
            _ => Outcome::Degraded(lacking.join("; ")),
        }
    }

    fn enabled(&mut self, results: &[Result<(), AccessError>], now: Instant) -> Outcome {
        match results {
            [Err(error)] => Outcome::Failed(format!(
                "it cannot be enabled: {error}; does another client have it?"
            )),
            _ => {
                (self.step, self.told) = (Step::Interrogate, None);
                self.note_report(now);
                self.quiet_by = self.quiet_at.map(|_| now + self.timeout);
                Outcome::InProgress
            }
        }
    }

    fn not_interrogated(&mut self, why: &str) -> Outcome {
        (self.step, self.is_replaying) = (Step::Running, false);
        Outcome::NotInterrogated(format!("it refuses a general interrogation: {why}"))
    }
}

#[cfg(test)]
#[path = "control_tests.rs"]
mod tests;
