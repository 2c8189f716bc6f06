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

/// How long a block that cannot be enabled is left alone.
const RETRY: Duration = Duration::from_secs(10);
/// Pause after which nothing more comes out of a buffer: a general interrogation is asked for
/// then, so that the answer to a former one is not taken for its answer.
const REPLAY_PAUSE: Duration = Duration::from_millis(500);
/// What is read of a block, in this order.
const ATTRIBUTES: [&str; 7] = ["RptID", "RptEna", "DatSet", "OptFlds", "TrgOps", "IntgPd", "BufTm"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Inspect,
    Members,
    Configure,
    Enable,
    Interrogate,
    Running,
    /// It is tried again then; without a time, not on this connection.
    Failed(Option<Instant>),
}

/// What a member of the data set is to a point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Use {
    pub(crate) point: usize,
    pub(crate) share: Share,
}

/// What came of an answer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Outcome {
    /// There is more to ask, or nothing to tell.
    Going,
    /// The members of its data set, to be mapped.
    Members(Vec<Option<Name>>),
    /// It reports, but tells no values now: they have to be read.
    NotInterrogated(String),
    /// It does not report; in words, why.
    Failed(String),
    /// It goes on without something; in words.
    Lacking(String),
}

/// A control block and how far it is.
#[derive(Debug)]
pub(crate) struct Control {
    pub(crate) block: ReportBlock,
    step: Step,
    /// Whether an answer is waited for.
    is_asked: bool,
    /// Tells whether it was enabled in this connection.
    is_enabled: bool,
    /// As its reports have it.
    report_id: String,
    data_set: Option<Name>,
    options: OptFlds,
    triggers: TrgOps,
    writes: Vec<(Name, Value)>,
    revision: Option<u32>,
    /// By member.
    pub(crate) uses: Vec<Vec<Use>>,
    /// Names of the members of the data set.
    members: Vec<Option<Name>>,
    /// `SqNum` of the last report since it was enabled.
    sequence: Option<u32>,
    /// Reports in a row that could not be used.
    faults: u32,
    /// The last entry that came, also of former connections.
    entry_id: Option<Vec<u8>>,
    /// Whether entries of the past come, until the answer to the general interrogation.
    is_replaying: bool,
    /// When a buffer that is read has paused for so long that it is read, and when that is
    /// not waited for any more.
    quiet_at: Option<Instant>,
    quiet_by: Option<Instant>,
    /// Until when the report that a general interrogation asks for has to come.
    answer_by: Option<Instant>,
    /// Whether it came; it may come before the request is confirmed.
    is_answered: bool,
    /// How long the server has for it.
    timeout: Duration,
    /// What was told last, also of former connections.
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

    /// Whether it reports, or does not for the time being.
    pub(crate) fn is_settled(&self) -> bool {
        self.is_running() || matches!(self.step, Step::Failed(_))
    }

    pub(crate) fn is_running(&self) -> bool {
        matches!(self.step, Step::Interrogate | Step::Running)
    }

    /// What its reports are told by.
    pub(crate) fn identity(&self) -> Option<(&str, &Name)> {
        let is_known = !matches!(self.step, Step::Inspect | Step::Failed(_));
        self.data_set.as_ref().filter(|_| is_known).map(|set| (self.report_id.as_str(), set))
    }

    /// When it is tried again, or misses a report.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        match self.step {
            Step::Failed(at) => at,
            Step::Interrogate if !self.is_asked => self.interrogate_at(),
            _ => self.answer_by,
        }
    }

    /// Whether the answer to a general interrogation did not come in time; told once.
    pub(crate) fn take_late(&mut self, now: Instant) -> bool {
        let is_late = self.answer_by.take_if(|by| *by <= now).is_some();
        self.is_replaying &= !is_late;
        is_late
    }

    /// What to ask now, if anything.
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
    pub(crate) fn hear(&mut self, now: Instant) {
        if self.block.is_buffered {
            self.quiet_at = Some(now + REPLAY_PAUSE);
        }
    }

    /// When a general interrogation may be asked for; nothing where that is at once.
    fn interrogate_at(&self) -> Option<Instant> {
        self.quiet_at.min(self.quiet_by)
    }

    /// Takes the answer to [`Control::next_request`].
    pub(crate) fn heed(&mut self, answer: Answer, now: Instant) -> Outcome {
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
                    Outcome::Going
                }
            },
            // Sessions hand on answers of the service that was asked for alone.
            _ => Outcome::Going,
        };
        if matches!(outcome, Outcome::Failed(_)) {
            self.fail(now);
        }
        outcome
    }

    /// It is left alone for a while.
    pub(crate) fn fail(&mut self, now: Instant) {
        self.give_up(Some(now + RETRY));
    }

    /// It is left alone, with what it may still report, until then or for good.
    pub(crate) fn give_up(&mut self, until: Option<Instant>) {
        self.step = Step::Failed(until);
        self.answer_by = None;
        self.uses.clear();
    }

    /// Whether something is to be told of it, and was not told just before: it is tried
    /// again and again.
    pub(crate) fn is_news(&mut self, text: &str) -> bool {
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
        Outcome::Going
    }

    /// What has to be written, where the block has something else: some servers empty a
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
            [] => Outcome::Going,
            _ => Outcome::Lacking(lacking.join("; ")),
        }
    }

    fn enabled(&mut self, results: &[Result<(), AccessError>], now: Instant) -> Outcome {
        match results {
            [Err(error)] => Outcome::Failed(format!(
                "it cannot be enabled: {error}; does another client have it?"
            )),
            _ => {
                (self.step, self.told) = (Step::Interrogate, None);
                self.hear(now);
                self.quiet_by = self.quiet_at.map(|_| now + self.timeout);
                Outcome::Going
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
