//! The life of one connection, without a socket and without a clock: bytes and instants
//! in, bytes, answers and reports out.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use iec61850_rs::proto::mms::Mms;
use iec61850_rs::proto::mms::association::{
    Association, AssociationConfig, AssociationEvent, CloseReason, Selectors,
};
use iec61850_rs::proto::mms::report::Report;
use iec61850_rs::{DecodeReason, Error};
use thiserror::Error;

use crate::addressing;
use crate::report_reader::{ReportReader, Unusable};
use crate::service::{Answer, LIMITS, Request};

/// Requests that wait for their answers at once.
const MAX_IN_FLIGHT: usize = 4;
/// Bytes that are handed to the association at once: fewer messages than [`MAX_EVENTS`].
const MAX_PIECE: usize = 16 * 1024;
const MAX_EVENTS: usize = 4096;
/// Largest message that is asked for, and that is put together, bytes.
const MAX_PDU: u32 = 65_000;
const MAX_MESSAGE: usize = 256 * 1024;

/// Addresses of both ends of a connection, and their timeouts.
#[derive(Clone, Debug)]
pub(crate) struct Parameters {
    pub(crate) selectors: addressing::Selectors,
    pub(crate) password: Option<String>,
    pub(crate) timeout: Duration,
    pub(crate) test: Duration,
}

/// Reason for which a connection must be closed.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(crate) enum SessionFault {
    #[error(
        "the server refuses the association ({layer} layer{}): are the selectors and the \
         password right, and does it take another client?",
        .code.map(|code| format!(", code {code}")).unwrap_or_default()
    )]
    Refused { layer: &'static str, code: Option<i64> },
    #[error("no association within {} ms; is this a server of IEC 61850?", .0.as_millis())]
    NoAssociation(Duration),
    #[error("no answer to {what} within {} ms", .limit.as_millis())]
    Timeout { what: &'static str, limit: Duration },
    #[error("the rest of a report did not come within {} ms", .0.as_millis())]
    Segments(Duration),
    #[error("the server ended the association")]
    Ended,
    #[error("what the server sends is not MMS ({0})")]
    Malformed(String),
    #[error("the answer to {what} cannot be used: {error}")]
    Answer { what: &'static str, error: Error },
    #[error("a request cannot be sent: {0}")]
    Request(Error),
}

/// Event of received bytes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Event<J> {
    /// Requests may be sent.
    Up,
    Answer(J, Answer),
    /// Report with all its segments.
    Report(Box<Report>),
    /// A report that cannot be used.
    Unusable(Unusable),
}

/// A connection as the client sees it; `J` is what each request is for.
#[derive(Debug)]
pub(crate) struct Session<J> {
    association: Association,
    reports: ReportReader,
    /// By invoke id: what was asked, what for, until when.
    in_flight: BTreeMap<i64, (Request, J, Instant)>,
    /// Upper half of this connection's request ids. An answer to a request of a former connection
    /// matches none.
    key: i64,
    next: u16,
    began: Instant,
    heard_at: Instant,
    timeout: Duration,
    test: Duration,
}

impl<J> Session<J> {
    /// A connection that was just made; keys of connections should differ.
    pub(crate) fn new(parameters: &Parameters, key: u16, now: Instant) -> Self {
        let Parameters { selectors, password, timeout, test } = parameters;
        let millis = u64::try_from(timeout.as_millis()).unwrap_or(u64::MAX);
        let config = AssociationConfig {
            local: Selectors::clone(&selectors.local),
            remote: Selectors::clone(&selectors.remote),
            max_pdu: MAX_PDU,
            max_outstanding: MAX_IN_FLIGHT as u8,
            password: password.clone(),
            connect_timeout_ms: millis,
            request_timeout_ms: 0,
            max_tsdu: MAX_MESSAGE,
            limits: LIMITS,
            event_capacity: MAX_EVENTS,
            ..AssociationConfig::default()
        };
        Self {
            association: Association::client(config),
            reports: ReportReader::new(*timeout),
            in_flight: BTreeMap::new(),
            key: i64::from(key & 0x7FFF) << 16,
            next: 0,
            began: now,
            heard_at: now,
            timeout: *timeout,
            test: *test,
        }
    }

    /// Asks for an association.
    ///
    /// # Errors
    /// [`SessionFault::Request`].
    pub(crate) fn start(&mut self, now: Instant) -> Result<(), SessionFault> {
        self.association.start(self.at(now)).map_err(SessionFault::Request)
    }

    /// Reports whether another request may be sent.
    pub(crate) fn has_room(&self) -> bool {
        let agreed = self.association.negotiated();
        let limit = agreed.map_or(0, |agreed| agreed.max_outstanding.min(MAX_IN_FLIGHT));
        self.association.is_established() && self.in_flight.len() < limit
    }

    /// Largest message that the server takes, bytes.
    pub(crate) fn max_message(&self) -> usize {
        self.association.negotiated().map_or(0, |agreed| agreed.max_pdu)
    }

    /// Reports whether the silence is so long that the connection should be tested.
    pub(crate) fn is_idle(&self, now: Instant) -> bool {
        self.in_flight.is_empty() && now >= self.heard_at + self.test
    }

    /// Sends a request to the server.
    ///
    /// # Errors
    /// [`SessionFault::Request`].
    pub(crate) fn send(
        &mut self,
        request: Request,
        job: J,
        now: Instant,
    ) -> Result<(), SessionFault> {
        let id = self.take_id();
        let association = &mut self.association;
        request
            .with_service(|service| {
                association.send(&Mms::ConfirmedRequest { invoke_id: id, service })
            })
            .map_err(SessionFault::Request)?;
        self.in_flight.insert(id, (request, job, now + self.timeout));
        Ok(())
    }

    /// Processes bytes that were received.
    ///
    /// # Errors
    /// After any [`SessionFault`] the connection must be closed.
    pub(crate) fn receive(
        &mut self,
        bytes: &[u8],
        now: Instant,
        mut handle: impl FnMut(Event<J>),
    ) -> Result<(), SessionFault> {
        for piece in bytes.chunks(MAX_PIECE) {
            self.association.on_bytes(self.at(now), piece);
            while let Some(event) = self.association.poll_event() {
                if let Some(event) = self.take(event, now)? {
                    handle(event);
                }
            }
        }
        Ok(())
    }

    /// Finds out what is late.
    ///
    /// # Errors
    /// The connection must be closed.
    pub(crate) fn tick(&mut self, now: Instant) -> Result<(), SessionFault> {
        self.association.on_timeout(self.at(now));
        while let Some(event) = self.association.poll_event() {
            self.take(event, now)?;
        }
        if self.reports.is_late(now) {
            return Err(SessionFault::Segments(self.timeout));
        }
        match self.in_flight.values().find(|(.., by)| *by <= now) {
            Some((request, ..)) => {
                Err(SessionFault::Timeout { what: request.what(), limit: self.timeout })
            }
            None => Ok(()),
        }
    }

    /// Returns the latest instant at which [`Session::tick`] or [`Session::is_idle`] has something.
    pub(crate) fn deadline(&self) -> Instant {
        let of_association =
            self.association.next_timeout().map(|at| self.began + Duration::from_nanos(at.0));
        let of_requests = self.in_flight.values().map(|(.., by)| *by).min();
        let of_test = self.in_flight.is_empty().then_some(self.heard_at + self.test);
        let all = [of_association, of_requests, of_test, self.reports.deadline()];
        all.into_iter().flatten().min().unwrap_or(self.heard_at + self.test)
    }

    /// Takes the bytes to send.
    pub(crate) fn take_output(&mut self) -> Vec<u8> {
        let mut output = Vec::new();
        while let Some(packet) = self.association.poll_transmit() {
            output.extend_from_slice(packet);
        }
        output
    }

    fn take(
        &mut self,
        event: AssociationEvent,
        now: Instant,
    ) -> Result<Option<Event<J>>, SessionFault> {
        match event {
            AssociationEvent::Established(_) => {
                self.heard_at = now;
                Ok(Some(Event::Up))
            }
            AssociationEvent::Response { invoke_id, pdu } => {
                self.heard_at = now;
                // One that nobody waits for is an answer of a former connection.
                let Some((request, job, _)) = self.in_flight.remove(&invoke_id) else {
                    return Ok(None);
                };
                let what = request.what();
                let answer = request.answer(&pdu);
                let answer = answer.map_err(|error| SessionFault::Answer { what, error })?;
                Ok(Some(Event::Answer(job, answer)))
            }
            AssociationEvent::Rejected { invoke_id, reject } => {
                self.heard_at = now;
                let waiting = invoke_id.and_then(|id| self.in_flight.remove(&id));
                let refused = Answer::Refused(reject.reason.to_string());
                Ok(waiting.map(|(_, job, _)| Event::Answer(job, refused)))
            }
            AssociationEvent::Unconfirmed { pdu } => {
                self.heard_at = now;
                Ok(match self.reports.take(&pdu, now) {
                    Ok(report) => report.map(Box::new).map(Event::Report),
                    Err(unusable) => Some(Event::Unusable(unusable)),
                })
            }
            AssociationEvent::Refused { layer, code } => Err(SessionFault::Refused { layer, code }),
            // No answer to a request, so perhaps a report with such a text.
            AssociationEvent::Malformed {
                invoke_id: None,
                error: error @ Error::Decode { reason: DecodeReason::NotAscii, .. },
            } => {
                self.heard_at = now;
                let why = format!("a text in it is not ASCII ({error})");
                Ok(Some(Event::Unusable(Unusable { report_id: None, why })))
            }
            AssociationEvent::Malformed { error, .. } => {
                Err(SessionFault::Malformed(error.to_string()))
            }
            AssociationEvent::Closed(reason) => Err(match reason {
                CloseReason::ConnectTimeout => SessionFault::NoAssociation(self.timeout),
                CloseReason::ProtocolError => {
                    SessionFault::Malformed("is host and port right?".into())
                }
                _ => SessionFault::Ended,
            }),
            // Nothing is cancelled here, and no request of the server's is served.
            AssociationEvent::Request { .. }
            | AssociationEvent::Cancelled { .. }
            | AssociationEvent::CancelRefused { .. }
            | AssociationEvent::Timeout { .. } => Ok(None),
        }
    }

    fn take_id(&mut self) -> i64 {
        // Far fewer are in flight than there are numbers, so one that comes round is free.
        self.next = self.next.wrapping_add(1);
        self.key | i64::from(self.next)
    }

    fn at(&self, now: Instant) -> iec61850_rs::Instant {
        let since = now.saturating_duration_since(self.began).as_nanos();
        iec61850_rs::Instant(u64::try_from(since).unwrap_or(u64::MAX))
    }
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
