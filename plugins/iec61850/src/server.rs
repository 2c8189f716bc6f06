//! The server behind its connections: what to ask it, and what comes of its answers.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{Host, LogLevel, Reason, SampleSink};
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::report::Report;
use iec61850_rs::proto::mms::typespec::TypeSpec;

use crate::board::{Board, Origin};
use crate::control::{Control, Mismatch, Outcome, Use};
use crate::convert::{entry_time_of, reason_of};
use crate::locate::{Place, Share, locate};
use crate::points::Points;
use crate::service::{AccessError, Answer, Name, Request};
use crate::settings::Config;

/// Variables of one read request, where messages are large enough.
const MAX_READ: usize = 60;
/// Bytes of an answer that one variable may take.
const VARIABLE_BYTES: usize = 400;

/// What a request is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Job {
    /// The type of a data object.
    Type(usize),
    /// The values of variables.
    Read(Vec<usize>),
    /// The next step of a control block.
    Control(usize),
    /// To hear something.
    Test,
}

/// Something that is read at once, with all points in it.
#[derive(Debug)]
struct Variable {
    name: Name,
    points: Vec<(usize, Share)>,
}

pub(crate) struct Server {
    board: Board,
    objects: Vec<(Name, Range<usize>)>,
    /// By point, where it is known.
    places: Vec<Option<Place>>,
    variables: Vec<Variable>,
    controls: Vec<Control>,
    queue: VecDeque<Job>,
    /// Data objects whose type is not known yet.
    types_left: usize,
    /// Variables whose values are asked for.
    reads_open: usize,
    poll: Duration,
    next_poll: Option<Instant>,
    max_read: usize,
    is_unreadable_told: bool,
}

impl Server {
    pub(crate) fn new(config: &Config, points: Points, sink: SampleSink, host: Host) -> Self {
        let objects = points.objects();
        let places = vec![None; points.all().len()];
        let server = config.endpoints[0].to_string();
        Self {
            board: Board::new(points, sink, host, server),
            objects,
            places,
            variables: Vec::new(),
            controls: config.reports.iter().cloned().map(Control::new).collect(),
            queue: VecDeque::new(),
            types_left: 0,
            reads_open: 0,
            poll: config.poll,
            next_poll: None,
            max_read: MAX_READ,
            is_unreadable_told: false,
        }
    }

    /// There is an association: nothing is known of the server.
    pub(crate) fn begin(&mut self) {
        self.board.reset(Reason::NotConnected);
        self.places.fill(None);
        self.variables.clear();
        self.controls.iter_mut().for_each(Control::begin);
        self.queue = (0..self.objects.len()).map(Job::Type).collect();
        self.types_left = self.objects.len();
        (self.reads_open, self.next_poll, self.max_read) = (0, None, MAX_READ);
    }

    /// There is none any more, or none yet.
    pub(crate) fn end(&mut self, reason: Reason) {
        self.board.reset(reason);
        self.queue.clear();
        self.next_poll = None;
    }

    /// Publishes what came.
    pub(crate) fn flush(&mut self) {
        self.board.flush();
    }

    /// What to ask now, with messages of at most so many bytes.
    pub(crate) fn next_request(
        &mut self,
        now: Instant,
        max_message: usize,
    ) -> Option<(Job, Request)> {
        if self.types_left == 0 {
            for (index, control) in self.controls.iter_mut().enumerate() {
                if let Some(request) = control.next_request(now) {
                    return Some((Job::Control(index), request));
                }
            }
            self.max_read = self.max_read.min(max_message / VARIABLE_BYTES).max(1);
            self.queue_poll(now);
        }
        let job = self.queue.pop_front()?;
        let request = match &job {
            Job::Type(object) => Request::Type(self.objects[*object].0.clone()),
            Job::Read(variables) => {
                let name = |index: &usize| self.variables[*index].name.clone();
                Request::Read(variables.iter().map(name).collect())
            }
            // Neither waits in the queue.
            Job::Control(_) | Job::Test => return None,
        };
        Some((job, request))
    }

    /// When [`Server::next_request`] has something that it has not now.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let retries = self.controls.iter().filter_map(Control::retry_at);
        let poll = self.next_poll.filter(|_| self.reads_open == 0);
        if self.types_left > 0 { None } else { retries.chain(poll).min() }
    }

    /// Takes an answer.
    pub(crate) fn heed(&mut self, job: Job, answer: Answer, now: Instant) {
        match job {
            Job::Type(object) => {
                self.take_type(object, answer);
                self.types_left = self.types_left.saturating_sub(1);
                if self.types_left == 0 {
                    self.gather_variables();
                }
            }
            Job::Read(variables) => self.take_values(&variables, answer),
            Job::Control(index) => self.take_step(index, answer, now),
            Job::Test => {}
        }
    }

    /// Takes a report.
    ///
    /// # Errors
    /// In words: the server is another than it was, so all of it has to be asked anew.
    pub(crate) fn take_report(&mut self, report: &Report, now: Instant) -> Result<(), String> {
        let Some(control) = self.controls.iter_mut().find(|control| control.has_sent(report))
        else {
            return Ok(());
        };
        let name = control.block.reference();
        match control.check(report) {
            Ok(()) => {}
            Err(Mismatch::Revision) => {
                return Err(format!("the data set of {name} has changed (ConfRev)"));
            }
            Err(Mismatch::Members { told, sent }) => {
                control.fail(now);
                self.board.log(
                    LogLevel::Warning,
                    &format!(
                        "{name} reports {sent} members, and its data set has {told}: its values \
                         are polled"
                    ),
                );
                return Ok(());
            }
        }
        let noted = control.note(report);
        if noted.is_lossy {
            let text = format!("{name}: its buffer ran over, so changes before this are missing");
            self.board.log(LogLevel::Warning, &text);
        }
        for entry in &report.entries {
            for Use { point, share } in control.uses.get(entry.index).into_iter().flatten() {
                self.board.take(*point, share, &entry.value);
            }
        }
        let is_change = report.entries.iter().any(|entry| {
            entry.reason.is_none_or(|reason| {
                reason.data_change() || reason.quality_change() || reason.data_update()
            })
        });
        let entry_time = report.time_of_entry.and_then(entry_time_of);
        self.board.commit(Origin { is_change, is_replayed: noted.is_replayed, entry_time });
        Ok(())
    }

    /// Tells of a report that cannot be read, once a connection.
    pub(crate) fn note_unreadable(&mut self, why: &str) {
        if !std::mem::replace(&mut self.is_unreadable_told, true) {
            self.board.log(LogLevel::Warning, &format!("a report cannot be read: {why}"));
        }
    }

    fn take_type(&mut self, object: usize, answer: Answer) {
        let (name, points) = self.objects[object].clone();
        let spec: Result<TypeSpec, String> = match answer {
            Answer::Type(spec) => Ok(spec),
            Answer::Refused(why) => Err(format!("the server has no {name}: {why}")),
            // Sessions hand on answers of the service that was asked for alone.
            _ => return,
        };
        for index in points {
            let path = &self.board.points().all()[index].path;
            match spec.as_ref().map_err(Clone::clone).and_then(|spec| locate(spec, path)) {
                Ok(place) => {
                    self.board.note_type(index, place.has_quality());
                    self.places[index] = Some(place);
                }
                Err(what) => {
                    self.board.fail(index, Reason::Configuration);
                    self.board.tell(index, &what);
                }
            }
        }
    }

    fn gather_variables(&mut self) {
        let mut variables: BTreeMap<Name, Vec<(usize, Share)>> = BTreeMap::new();
        for (index, (place, point)) in self.places.iter().zip(self.board.points().all()).enumerate()
        {
            let Some(place) = place else { continue };
            let name = place.variable(&point.object);
            let below: Vec<_> = parts_below(&point.object, &name);
            let share = place.share(&below);
            variables.entry(name).or_default().extend(share.map(|share| (index, share)));
        }
        let variable = |(name, points)| Variable { name, points };
        self.variables = variables.into_iter().map(variable).collect();
    }

    /// Asks for what no report brings, in the period of polls.
    fn queue_poll(&mut self, now: Instant) {
        let is_settled = self.controls.iter().all(Control::is_settled);
        let is_due = self.next_poll.is_none_or(|at| at <= now);
        if !is_settled || !is_due || self.reads_open > 0 {
            return;
        }
        let reported = self.reported();
        let is_polled = |&index: &usize| {
            self.variables[index].points.iter().any(|(point, _)| !reported[*point])
        };
        let polled: Vec<_> = (0..self.variables.len()).filter(is_polled).collect();
        self.queue_reads(&polled);
        let next = self.next_poll.map_or(now, |at| at) + self.poll;
        self.next_poll = Some(if next > now { next } else { now + self.poll });
    }

    fn queue_reads(&mut self, variables: &[usize]) {
        self.reads_open += variables.len();
        self.queue.extend(variables.chunks(self.max_read).map(|part| Job::Read(part.into())));
    }

    /// By point: whether reports bring its value, and its quality if it has one.
    fn reported(&self) -> Vec<bool> {
        let mut reported = vec![false; self.places.len()];
        for control in self.controls.iter().filter(|control| control.is_running()) {
            let mut found: BTreeMap<usize, [bool; 2]> = BTreeMap::new();
            for Use { point, share } in control.uses.iter().flatten() {
                let [value, quality] = found.entry(*point).or_default();
                *value |= share.value.is_some();
                *quality |= share.quality.is_some();
            }
            for (point, [value, quality]) in found {
                let has_quality = self.places[point].as_ref().is_some_and(Place::has_quality);
                reported[point] |= value && (quality || !has_quality);
            }
        }
        reported
    }

    fn take_values(&mut self, variables: &[usize], answer: Answer) {
        match answer {
            Answer::Values(values) => {
                for (index, value) in variables.iter().zip(&values) {
                    self.take_value(*index, value);
                }
            }
            Answer::Refused(why) if variables.len() == 1 => {
                for (point, _) in &self.variables[variables[0]].points {
                    self.board.fail(*point, Reason::Configuration);
                    self.board.tell(*point, &format!("it cannot be read: {why}"));
                }
            }
            // Perhaps the answer would be too long.
            Answer::Refused(_) => {
                self.max_read = variables.len().div_ceil(2);
                self.queue
                    .extend(variables.chunks(self.max_read).map(|part| Job::Read(part.into())));
                return;
            }
            _ => {}
        }
        self.reads_open = self.reads_open.saturating_sub(variables.len());
        self.board.commit(Origin::default());
    }

    fn take_value(&mut self, index: usize, value: &Result<Value, AccessError>) {
        for (point, share) in &self.variables[index].points {
            match value {
                Ok(value) => self.board.take(*point, share, value),
                Err(error) => {
                    self.board.fail(*point, reason_of(*error));
                    self.board.tell(*point, &format!("the server does not tell it: {error}"));
                }
            }
        }
    }

    fn take_step(&mut self, index: usize, answer: Answer, now: Instant) {
        let outcome = self.controls[index].heed(answer, now);
        let name = self.controls[index].block.reference();
        let is_taken = self.controls[index].identity().is_some_and(|identity| {
            self.controls[..index].iter().any(|other| other.identity() == Some(identity))
        });
        if is_taken {
            self.controls[index].fail(now);
            let text = format!(
                "{name} has the RptID and data set of another block: give it a RptID of its own; \
                 its values are polled"
            );
            return self.board.log(LogLevel::Warning, &text);
        }
        match outcome {
            Outcome::Going | Outcome::Enabled => {}
            Outcome::Members(members) => {
                let uses = members.iter().map(|member| self.uses_of(member.as_ref())).collect();
                self.controls[index].uses = uses;
            }
            Outcome::NotInterrogated(what) => {
                self.board.log(LogLevel::Info, &format!("{name}: {what}; its values are read"));
                self.read_all_of(index);
            }
            Outcome::Failed(what) => {
                let text = format!("{name}: {what}; its values are polled, and it is tried again");
                self.board.log(LogLevel::Warning, &text);
            }
            Outcome::Lacking(what) => self.board.log(LogLevel::Info, &format!("{name}: {what}")),
        }
    }

    fn read_all_of(&mut self, index: usize) {
        let points: Vec<_> =
            self.controls[index].uses.iter().flatten().map(|used| used.point).collect();
        let is_of_it =
            |&index: &usize| self.variables[index].points.iter().any(|(p, _)| points.contains(p));
        let variables: Vec<_> = (0..self.variables.len()).filter(is_of_it).collect();
        self.queue_reads(&variables);
    }

    /// What a member of a data set is to the points.
    fn uses_of(&self, member: Option<&Name>) -> Vec<Use> {
        let Some(member) = member else { return Vec::new() };
        let parts: Vec<_> = member.item.split('$').collect();
        // A whole logical node has no type here: its values are polled.
        let Some((object, below)) = parts.split_at_checked(3) else { return Vec::new() };
        let object = Name { domain: member.domain.clone(), item: object.join("$") };
        let found = self.objects.binary_search_by(|(name, _)| name.cmp(&object));
        let Ok(found) = found else { return Vec::new() };
        let points = self.objects[found].1.clone();
        points
            .filter_map(|point| {
                let share = self.places[point].as_ref()?.share(below)?;
                Some(Use { point, share })
            })
            .collect()
    }
}

/// What a variable's name has beyond its data object's.
fn parts_below<'n>(object: &Name, variable: &'n Name) -> Vec<&'n str> {
    let below = variable.item.strip_prefix(object.item.as_str()).unwrap_or_default();
    below.split('$').filter(|part| !part.is_empty()).collect()
}
