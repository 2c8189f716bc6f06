//! Schedule of requests to a station: one at a time, each confirmed and terminated before the next.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::codec::{Header, cause};
use crate::settings::Config;

/// Longest time that a station may take to answer a request that it has confirmed.
const ANSWER_LIMIT: Duration = Duration::from_secs(120);
/// Shortest time between interrogations of a common address whose values are doubtful.
pub(crate) const DEMAND_INTERVAL: Duration = Duration::from_secs(5);
/// Time after which an interrogation is tried again that was refused or not answered.
pub(crate) const RETRY_INTERVAL: Duration = Duration::from_secs(30);

/// Kind of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RequestKind {
    ClockSync,
    Interrogation,
    Counters,
}

/// A request to one common address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ScheduledRequest {
    pub(crate) kind: RequestKind,
    pub(crate) common_address: u16,
}

/// Outcome of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All values have come.
    Done,
    /// The station knows no such common address.
    UnknownCommonAddress,
    /// Refusal by the station, with this cause of transmission.
    Refused(u8),
    /// Request that was not confirmed, or not terminated, in time.
    Unanswered,
}

/// An interrogation beside those of the period: wanted until it is asked for.
#[derive(Clone, Copy, Debug)]
struct Demand {
    common_address: u16,
    is_wanted: bool,
    not_before: Option<Instant>,
}

/// The requests of one period of data transfer.
#[derive(Debug)]
pub(crate) struct RequestSchedule {
    common_addresses: Vec<u16>,
    /// Demands by common address.
    demands: Vec<Demand>,
    /// By kind: its period, and when it is due next.
    periods: [(RequestKind, Option<Duration>, Option<Instant>); 3],
    interrogate_on_start: bool,
    /// Longest time that a station may take to confirm a request: t1, as for the frame.
    confirm_limit: Duration,
    queue: VecDeque<ScheduledRequest>,
    current: Option<(ScheduledRequest, Instant)>,
}

impl RequestSchedule {
    pub(crate) fn new(config: &Config, common_addresses: Vec<u16>) -> Self {
        let demand =
            |&common_address| Demand { common_address, is_wanted: false, not_before: None };
        Self {
            demands: common_addresses.iter().map(demand).collect(),
            common_addresses,
            periods: [
                (RequestKind::ClockSync, config.clock_sync_period, None),
                (RequestKind::Interrogation, config.interrogation_period, None),
                (RequestKind::Counters, config.counter_period, None),
            ],
            interrogate_on_start: config.interrogate_on_start,
            confirm_limit: config.parameters.t1,
            queue: VecDeque::new(),
            current: None,
        }
    }

    /// Data transfer starts: everything that has a period is due, and the
    /// interrogation as the settings have it.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.end();
        for (kind, period, due) in &mut self.periods {
            *due = match kind {
                RequestKind::Interrogation if self.interrogate_on_start => Some(now),
                RequestKind::Interrogation => period.map(|period| now + period),
                RequestKind::ClockSync | RequestKind::Counters => period.map(|_| now),
            };
        }
        self.queue_due(now);
    }

    /// Data transfer has ended: nothing is due.
    pub(crate) fn end(&mut self) {
        self.queue.clear();
        self.current = None;
        for (.., due) in &mut self.periods {
            *due = None;
        }
        for demand in &mut self.demands {
            (demand.is_wanted, demand.not_before) = (false, None);
        }
    }

    /// Asks for all values of a common address as soon as that may be, even where the
    /// same is being asked for: what came of it before may be of no use.
    pub(crate) fn demand(&mut self, common_address: u16) {
        if let Some(demand) = self.demand_of(common_address) {
            demand.is_wanted = true;
        }
    }

    /// Asks for it unless that is planned anyway; so no more wait than there are
    /// kinds and common addresses.
    fn add(&mut self, job: ScheduledRequest) {
        if !self.queue.contains(&job) {
            self.queue.push_back(job);
        }
    }

    /// The request to send now, if any.
    pub(crate) fn next(&mut self, now: Instant) -> Option<ScheduledRequest> {
        self.queue_due(now);
        if self.current.is_some() {
            return None;
        }
        let job = self.queue.pop_front()?;
        self.current = Some((job, now + self.confirm_limit));
        Some(job)
    }

    /// The request whose time is over, if any.
    pub(crate) fn take_late(&mut self, now: Instant) -> Option<ScheduledRequest> {
        let late = self.current.take_if(|(_, by)| *by <= now).map(|(job, _)| job);
        late.inspect(|job| self.retry(*job, now))
    }

    /// Returns the instant at which [`RequestSchedule::next`] or [`RequestSchedule::take_late`] has something.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let due = self.periods.iter().filter_map(|(.., due)| *due);
        let demands = self.demands.iter().filter(|demand| demand.is_wanted);
        let demanded = demands.filter_map(|demand| demand.not_before);
        due.chain(demanded).chain(self.current.map(|(_, by)| by)).min()
    }

    /// Takes the station's answer to a request.
    pub(crate) fn handle_answer(
        &mut self,
        kind: RequestKind,
        header: &Header,
        now: Instant,
    ) -> Option<(ScheduledRequest, Outcome)> {
        let outcome = self.outcome_of(kind, header, now);
        if let Some((job, Outcome::Refused(_) | Outcome::UnknownCommonAddress)) = outcome {
            self.retry(job, now);
        }
        outcome
    }

    fn outcome_of(
        &mut self,
        kind: RequestKind,
        header: &Header,
        now: Instant,
    ) -> Option<(ScheduledRequest, Outcome)> {
        let common_address = header.common_address;
        let job = ScheduledRequest { kind, common_address };
        if header.cause == cause::UNKNOWN_COMMON_ADDRESS {
            // It may follow a negative confirmation, which ended the request.
            self.current.take_if(|(current, _)| *current == job);
            let is_ours = self.common_addresses.contains(&common_address);
            return is_ours.then_some((job, Outcome::UnknownCommonAddress));
        }
        let (_, by) = self.current.as_mut().filter(|(current, _)| *current == job)?;
        let outcome = match header.cause {
            cause @ cause::UNKNOWN_TYPE..=cause::UNKNOWN_OBJECT_ADDRESS => Outcome::Refused(cause),
            cause if header.is_negative => Outcome::Refused(cause),
            // There is nothing more to come.
            cause::ACTIVATION_CONFIRMED if kind == RequestKind::ClockSync => Outcome::Done,
            cause::ACTIVATION_CONFIRMED => {
                *by = now + ANSWER_LIMIT;
                return None;
            }
            cause::ACTIVATION_TERMINATED => Outcome::Done,
            _ => return None,
        };
        self.current = None;
        Some((job, outcome))
    }

    /// An interrogation that brought nothing is tried again later: it is never forgotten.
    fn retry(&mut self, job: ScheduledRequest, now: Instant) {
        let is_interrogation = job.kind == RequestKind::Interrogation;
        let demand = self.demand_of(job.common_address).filter(|_| is_interrogation);
        if let Some(demand) = demand {
            (demand.is_wanted, demand.not_before) = (true, Some(now + RETRY_INTERVAL));
        }
    }

    fn demand_of(&mut self, common_address: u16) -> Option<&mut Demand> {
        self.demands.iter_mut().find(|demand| demand.common_address == common_address)
    }

    fn queue_due(&mut self, now: Instant) {
        for index in 0..self.demands.len() {
            let demand = &mut self.demands[index];
            let is_due = demand.is_wanted && demand.not_before.is_none_or(|at| at <= now);
            if !is_due {
                continue;
            }
            (demand.is_wanted, demand.not_before) = (false, Some(now + DEMAND_INTERVAL));
            let common_address = demand.common_address;
            self.add(ScheduledRequest { kind: RequestKind::Interrogation, common_address });
            // Counters are told by an interrogation of their own.
            if self.has_period(RequestKind::Counters) {
                self.add(ScheduledRequest { kind: RequestKind::Counters, common_address });
            }
        }
        for index in 0..self.periods.len() {
            let (kind, period, due) = self.periods[index];
            if due.is_some_and(|due| due <= now) {
                self.periods[index].2 = period.map(|period| now + period);
                for common_address in self.common_addresses.clone() {
                    self.add(ScheduledRequest { kind, common_address });
                }
            }
        }
    }

    fn has_period(&self, wanted: RequestKind) -> bool {
        self.periods.iter().any(|(kind, period, _)| *kind == wanted && period.is_some())
    }
}

#[cfg(test)]
#[path = "request_schedule_tests.rs"]
mod tests;
