//! The server behind its connections: what to ask it, and what comes of its answers.

mod browse;
mod reporting;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Range;
use std::time::{Duration, Instant};

use busbar_link::{Notice, Notices};
use busbar_plugin_sdk::{Host, LinkState, LogLevel, Reason, SampleSink};
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::typespec::TypeSpec;

use self::browse::Search;
use crate::block::ReportBlock;
use crate::control::Control;
use crate::convert::reason_of;
use crate::locate::{Place, Share, locate};
use crate::point_states::{Origin, PointStates};
use crate::points::Points;
use crate::service::{Answer, Name, Request};
use crate::settings::Config;
use crate::units::{StatedUnit, variable_of_unit};

/// Variables of one read request, where messages are large enough.
const MAX_READ: usize = 60;
/// Units of one read request.
const MAX_UNITS: usize = 20;
/// Bytes of an answer that one variable may take.
const VARIABLE_BYTES: usize = 400;
/// Shortest time between readings of what reports left doubtful.
const REREAD_INTERVAL: Duration = Duration::from_secs(1);

/// Purpose of a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Job {
    /// The type of a data object.
    Type(usize),
    /// The values of variables.
    Read {
        variables: Vec<usize>,
        /// Reports that the server had sent for certain when it was asked.
        reports: u64,
        /// Number of the request: of two answers that of the later one counts.
        number: u64,
    },
    /// The units of measured values, by their index.
    Units(Vec<usize>),
    /// The next step of a control block.
    Control(usize),
    /// Names beside an object that does not exist.
    Browse,
    /// Test of the connection.
    Test,
}

/// Order of a request among the reports and requests of the connection.
#[derive(Clone, Copy, Debug)]
struct RequestOrder {
    /// Reports that the server had sent for certain.
    reports: u64,
    /// Number of the request.
    number: u64,
}

/// Something that is read at once, with all points in it.
#[derive(Debug)]
struct Variable {
    name: Name,
    points: Vec<(usize, Share)>,
    /// Number of the latest request that was answered.
    answered: u64,
}

pub(crate) struct Server {
    point_states: PointStates,
    objects: Vec<(Name, Range<usize>)>,
    /// By point, where it is known.
    places: Vec<Option<Place>>,
    variables: Vec<Variable>,
    controls: Vec<Control>,
    queue: VecDeque<Job>,
    /// Data objects whose type is not known yet.
    types_left: usize,
    /// Units to read, each with its points.
    units: Vec<(Name, Vec<usize>)>,
    /// Units that are not known yet: no value is asked for before.
    units_left: usize,
    /// Variables whose values are asked for.
    reads_open: usize,
    /// Requests for values so far.
    reads: u64,
    poll: Duration,
    next_poll: Option<Instant>,
    max_read: usize,
    /// Variables whose values are doubtful, and when they may be read.
    rereads: BTreeSet<usize>,
    reread_not_before: Option<Instant>,
    /// Reports that could not be used.
    notices: Notices,
    sink: SampleSink,
    /// One, of the first name that the server did not have.
    search: Option<Search>,
}

impl Server {
    pub(crate) fn new(config: &Config, points: Points, sink: SampleSink, host: Host) -> Self {
        let objects = points.objects();
        let places = vec![None; points.all().len()];
        let server = config.endpoints[0].to_string();
        Self {
            point_states: PointStates::new(points, sink.clone(), host, server),
            sink,
            objects,
            places,
            variables: Vec::new(),
            controls: controls_of(config),
            queue: VecDeque::new(),
            types_left: 0,
            units: Vec::new(),
            units_left: 0,
            reads_open: 0,
            reads: 0,
            poll: config.poll,
            next_poll: None,
            max_read: MAX_READ,
            rereads: BTreeSet::new(),
            reread_not_before: None,
            notices: Notices::default(),
            search: None,
        }
    }

    /// Begins an association: nothing is known of the server.
    pub(crate) fn begin(&mut self) {
        self.point_states.reset(Reason::NotConnected);
        self.places.fill(None);
        self.variables.clear();
        self.controls.iter_mut().for_each(Control::begin);
        self.queue = (0..self.objects.len()).map(Job::Type).collect();
        self.types_left = self.objects.len();
        self.units.clear();
        self.units_left = 0;
        (self.reads_open, self.next_poll, self.max_read) = (0, None, MAX_READ);
        self.rereads.clear();
        self.reread_not_before = None;
    }

    /// Ends the association, or records that there is none yet.
    pub(crate) fn end(&mut self, reason: Reason) {
        self.point_states.reset(reason);
        self.queue.clear();
        self.rereads.clear();
        self.next_poll = None;
        if let Some(notice) = self.notices.take_rest() {
            self.log_notice(&notice);
        }
    }

    /// Publishes the samples received.
    pub(crate) fn flush(&mut self) {
        self.point_states.flush();
    }

    /// Returns the next request, with messages of at most so many bytes.
    pub(crate) fn next_request(
        &mut self,
        now: Instant,
        max_message: usize,
    ) -> Option<(Job, Request)> {
        self.tell_due(now);
        if self.is_located() {
            self.make_up_for_late(now);
            for (index, control) in self.controls.iter_mut().enumerate() {
                if let Some(request) = control.next_request(now) {
                    return Some((Job::Control(index), request));
                }
            }
            self.max_read = self.max_read.min(max_message / VARIABLE_BYTES).max(1);
            self.queue_rereads(now);
            self.queue_poll(now);
        }
        let mut job = self.queue.pop_front()?;
        let request = match &mut job {
            Job::Type(object) => Request::Type(self.objects[*object].0.clone()),
            Job::Read { variables, reports, number } => {
                self.reads += 1;
                (*reports, *number) = (self.point_states.reports(), self.reads);
                let name = |index: &usize| self.variables[*index].name.clone();
                Request::Read(variables.iter().map(name).collect())
            }
            Job::Browse => self.browse_request()?,
            Job::Units(units) => {
                let name = |index: &usize| self.units[*index].0.clone();
                Request::Read(units.iter().map(name).collect())
            }
            // Neither waits in the queue.
            Job::Control(_) | Job::Test => return None,
        };
        Some((job, request))
    }

    /// Returns the instant at which [`Server::next_request`] has more than now.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let retries = self.controls.iter().filter_map(Control::deadline);
        let poll = self.next_poll.filter(|_| self.reads_open == 0);
        let reread = self.reread_not_before.filter(|_| !self.rereads.is_empty());
        let asked = retries.chain(poll).chain(reread).filter(|_| self.is_located());
        asked.chain(self.notices.deadline()).min()
    }

    /// Processes an answer of the server.
    pub(crate) fn handle_answer(&mut self, job: Job, answer: Answer, now: Instant) {
        match job {
            Job::Type(object) => {
                self.take_type(object, answer);
                self.types_left = self.types_left.saturating_sub(1);
                if self.types_left == 0 {
                    self.gather_variables();
                    self.gather_units();
                }
            }
            Job::Read { variables, reports, number } => {
                self.take_values(&variables, RequestOrder { reports, number }, answer);
            }
            Job::Units(units) => self.take_units(&units, answer),
            Job::Control(index) => self.take_step(index, answer, now),
            Job::Browse => self.take_names(answer),
            Job::Test => {}
        }
    }

    /// Tells of reports that could not be used, in log and link panel.
    fn tell_due(&mut self, now: Instant) {
        let Some(notice) = self.notices.take_due(now) else { return };
        self.log_notice(&notice);
        let Notice { last, total, .. } = notice;
        let text = format!(
            "{}: connected; {total} reports could not be used, the last: {last}",
            self.point_states.server()
        );
        self.sink.report_link(LinkState::Up, &text);
    }

    fn log_notice(&self, Notice { last, count, total }: &Notice) {
        let more = match count {
            1 => String::new(),
            _ => format!("; {count} such reports since the line before"),
        };
        let text = format!(
            "{last}; the values that it may have brought are bad until they are read{more} \
             ({total} in this connection)"
        );
        self.point_states.log(LogLevel::Warning, &text);
    }

    fn take_type(&mut self, object: usize, answer: Answer) {
        let (name, points) = self.objects[object].clone();
        let spec: Result<TypeSpec, String> = match answer {
            Answer::Type(spec) => Ok(spec),
            Answer::Refused(why) => {
                self.search(&name);
                Err(format!("the server has no {name}: {why}"))
            }
            // Sessions hand on answers of the service that was asked for alone.
            _ => return,
        };
        for index in points {
            let path = &self.point_states.points().all()[index].path;
            match spec.as_ref().map_err(Clone::clone).and_then(|spec| locate(spec, path)) {
                Ok(place) => {
                    self.point_states.note_type(index, place.has_quality());
                    self.places[index] = Some(place);
                }
                Err(what) => {
                    self.point_states.fail(index, Reason::Configuration);
                    self.point_states.tell(index, &what);
                }
            }
        }
    }

    fn gather_variables(&mut self) {
        let mut variables: BTreeMap<Name, Vec<(usize, Share)>> = BTreeMap::new();
        for (index, (place, point)) in
            self.places.iter().zip(self.point_states.points().all()).enumerate()
        {
            let Some(place) = place else { continue };
            let name = place.variable(&point.object);
            let below: Vec<_> = parts_below(&point.object, &name);
            let share = place.share(&below);
            variables.entry(name).or_default().extend(share.map(|share| (index, share)));
        }
        let variable = |(name, points)| Variable { name, points, answered: 0 };
        self.variables = variables.into_iter().map(variable).collect();
    }

    /// Reports whether all types and units are known, so that values may be asked for.
    fn is_located(&self) -> bool {
        self.types_left == 0 && self.units_left == 0
    }

    /// Queues requests for the units of points whose tags have one to compare them with.
    fn gather_units(&mut self) {
        let mut units: BTreeMap<Name, Vec<usize>> = BTreeMap::new();
        for (index, (place, point)) in
            self.places.iter().zip(self.point_states.points().all()).enumerate()
        {
            let Some(place) = place.as_ref().filter(|_| point.unit.is_known()) else { continue };
            if let Some(name) = variable_of_unit(&point.object, place.names()) {
                units.entry(name).or_default().push(index);
            }
        }
        self.units = units.into_iter().collect();
        self.units_left = self.units.len();
        let all: Vec<usize> = (0..self.units.len()).collect();
        self.queue.extend(all.chunks(MAX_UNITS).map(|some| Job::Units(some.into())));
    }

    fn take_units(&mut self, units: &[usize], answer: Answer) {
        match answer {
            Answer::Values(values) => {
                for (unit, value) in units.iter().zip(values) {
                    // Most servers lack the attribute, which is optional.
                    let Ok(value) = value else { continue };
                    let Some(stated) = StatedUnit::from_value(&value).transpose() else { continue };
                    for point in &self.units[*unit].1 {
                        self.point_states.note_unit(*point, stated);
                    }
                }
            }
            // Perhaps one that is not there is refused with all others.
            Answer::Refused(_) if units.len() > 1 => {
                let halves = units.chunks(units.len().div_ceil(2));
                self.queue.extend(halves.map(|some| Job::Units(some.into())));
                return;
            }
            _ => {}
        }
        self.units_left = self.units_left.saturating_sub(units.len());
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
        self.queue.extend(variables.chunks(self.max_read).map(read_of));
    }

    /// Asks for what reports left doubtful, as soon as that may be.
    fn queue_rereads(&mut self, now: Instant) {
        let is_due = self.reread_not_before.is_none_or(|at| at <= now);
        if self.rereads.is_empty() || !is_due {
            return;
        }
        self.reread_not_before = Some(now + REREAD_INTERVAL);
        let variables: Vec<_> = std::mem::take(&mut self.rereads).into_iter().collect();
        self.queue_reads(&variables);
    }

    fn take_values(&mut self, variables: &[usize], asked: RequestOrder, answer: Answer) {
        match answer {
            Answer::Values(values) => {
                for (index, value) in variables.iter().zip(values) {
                    let value = value.map_err(|error| {
                        (reason_of(error), format!("the server does not tell it: {error}"))
                    });
                    self.take_value(*index, asked, &value);
                }
            }
            Answer::Refused(why) if variables.len() == 1 => {
                let fault = (Reason::Configuration, format!("it cannot be read: {why}"));
                self.take_value(variables[0], asked, &Err(fault));
            }
            // Perhaps the answer would be too long.
            Answer::Refused(_) => {
                self.max_read = variables.len().div_ceil(2);
                self.queue.extend(variables.chunks(self.max_read).map(read_of));
                return;
            }
            _ => {}
        }
        self.reads_open = self.reads_open.saturating_sub(variables.len());
        self.point_states.commit(Origin::default());
    }

    fn take_value(
        &mut self,
        index: usize,
        asked: RequestOrder,
        value: &Result<Value, (Reason, String)>,
    ) {
        let variable = &mut self.variables[index];
        // Answers may overtake each other, and the later question has the newer one.
        if asked.number < variable.answered {
            return;
        }
        variable.answered = asked.number;
        for (point, share) in &variable.points {
            if self.point_states.is_overtaken(*point, asked.reports) {
                self.rereads.insert(index);
                continue;
            }
            match value {
                Ok(value) => _ = self.point_states.take(*point, share, value),
                Err((reason, what)) => {
                    self.point_states.fail(*point, *reason);
                    // What reports bring is not polled, so nobody else would read it again.
                    if self.point_states.is_overtaken(*point, 0) {
                        self.rereads.insert(index);
                    }
                    self.point_states.tell(*point, what);
                }
            }
        }
    }
}

/// A job that reads these variables.
fn read_of(variables: &[usize]) -> Job {
    Job::Read { variables: variables.into(), reports: 0, number: 0 }
}

fn controls_of(config: &Config) -> Vec<Control> {
    let control = |block: &ReportBlock| Control::new(block.clone(), config.timeout);
    config.reports.iter().map(control).collect()
}

/// Returns the names of a variable beyond its data object's.
fn parts_below<'n>(object: &Name, variable: &'n Name) -> Vec<&'n str> {
    let below = variable.item.strip_prefix(object.item.as_str()).unwrap_or_default();
    below.split('$').filter(|part| !part.is_empty()).collect()
}
