//! What to ask a station for, and when: one request at a time, each confirmed
//! and ended before the next.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::codec::{Header, cause};
use crate::settings::Config;

/// How long a station may take to answer a request that it has confirmed.
const ANSWER_LIMIT: Duration = Duration::from_secs(120);

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    ClockSync,
    Interrogation,
    Counters,
}

/// A request to one common address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Job {
    pub(crate) kind: Kind,
    pub(crate) common_address: u16,
}

/// How a request went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All values have come.
    Done,
    /// The station knows no such common address.
    UnknownCommonAddress,
    /// It refuses, with this cause of transmission.
    Refused(u8),
    /// It did not confirm, or not end, in time.
    Unanswered,
}

/// The requests of one period of data transfer.
#[derive(Debug)]
pub(crate) struct Requests {
    common_addresses: Vec<u16>,
    /// By kind: its period, and when it is due next.
    periods: [(Kind, Option<Duration>, Option<Instant>); 3],
    interrogate_on_start: bool,
    /// How long a station may take to confirm a request: t1, as for the frame.
    confirm_limit: Duration,
    queue: VecDeque<Job>,
    current: Option<(Job, Instant)>,
}

impl Requests {
    pub(crate) fn new(config: &Config, common_addresses: Vec<u16>) -> Self {
        Self {
            common_addresses,
            periods: [
                (Kind::ClockSync, config.clock_sync_period, None),
                (Kind::Interrogation, config.interrogation_period, None),
                (Kind::Counters, config.counter_period, None),
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
                Kind::Interrogation if self.interrogate_on_start => Some(now),
                Kind::Interrogation => period.map(|period| now + period),
                Kind::ClockSync | Kind::Counters => period.map(|_| now),
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
    }

    /// Asks for it unless that is planned anyway; so no more wait than there are
    /// kinds and common addresses.
    pub(crate) fn add(&mut self, job: Job) {
        if !self.queue.contains(&job) {
            self.queue.push_back(job);
        }
    }

    /// The request to send now, if any.
    pub(crate) fn next(&mut self, now: Instant) -> Option<Job> {
        self.queue_due(now);
        if self.current.is_some() {
            return None;
        }
        let job = self.queue.pop_front()?;
        self.current = Some((job, now + self.confirm_limit));
        Some(job)
    }

    /// The request whose time is over, if any.
    pub(crate) fn take_late(&mut self, now: Instant) -> Option<Job> {
        self.current.take_if(|(_, by)| *by <= now).map(|(job, _)| job)
    }

    /// When [`Requests::next`] or [`Requests::take_late`] has something.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let due = self.periods.iter().filter_map(|(.., due)| *due);
        due.chain(self.current.map(|(_, by)| by)).min()
    }

    /// Takes the station's answer to a request.
    pub(crate) fn heed(
        &mut self,
        kind: Kind,
        header: &Header,
        now: Instant,
    ) -> Option<(Job, Outcome)> {
        let common_address = header.common_address;
        let job = Job { kind, common_address };
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
            cause::ACTIVATION_CONFIRMED if kind == Kind::ClockSync => Outcome::Done,
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

    fn queue_due(&mut self, now: Instant) {
        for index in 0..self.periods.len() {
            let (kind, period, due) = self.periods[index];
            if due.is_some_and(|due| due <= now) {
                self.periods[index].2 = period.map(|period| now + period);
                for common_address in self.common_addresses.clone() {
                    self.add(Job { kind, common_address });
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "requests_tests.rs"]
mod tests;
