//! Session of the APCI at the controlling station, without socket and clock: bytes and instants in,
//! bytes and data units out (IEC 60870-5-104, 5.2 to 5.5).

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::codec::{Frame, FrameError, Function, Sequence, split_frame};

/// Data units that wait for the window.
const MAX_WAITING: usize = 1024;

/// Windows and deadlines of a connection (IEC 60870-5-104, 9.6).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// Frames that may be sent without acknowledgement.
    pub k: u16,
    /// Frames after which reception is acknowledged at the latest.
    pub w: u16,
    /// Longest time until a frame is acknowledged.
    pub t1: Duration,
    /// Longest time until reception is acknowledged; shorter than `t1`.
    pub t2: Duration,
    /// Idle time after which the connection is tested.
    pub t3: Duration,
}

/// Reason for which a connection must be closed.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum SessionFault {
    /// Bytes that break the protocol.
    #[error("{0}")]
    Frame(#[from] FrameError),
    /// Frames were lost or repeated.
    #[error("the station sent frame {found} where {wanted} was due")]
    Sequence {
        /// Send number N(S) that was received.
        found: u16,
        /// N(S) that was due.
        wanted: u16,
    },
    /// Acknowledgement of frames that were not sent.
    #[error("the station acknowledged frames before {0}, which were never sent")]
    Acknowledgement(u16),
    /// Data on a connection where it was not started.
    #[error("the station sent data before data transfer was started")]
    NotStarted,
    /// Something that only a controlling station says.
    #[error("the other end acts as a controlling station, as this one does")]
    Controlling,
    /// Data transfer has ended without a request.
    #[error("the station has ended data transfer")]
    Stopped,
    /// A frame was not acknowledged within t1.
    #[error("no answer to {what} within {} ms (t1)", .limit.as_millis())]
    Timeout {
        /// Frame that was not acknowledged.
        what: &'static str,
        /// Timeout t1 of the connection.
        limit: Duration,
    },
    /// More requests than the station acknowledges.
    #[error("{MAX_WAITING} requests wait for the station to acknowledge")]
    Overrun,
}

/// Event of received bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// Data transfer has begun.
    Started,
    /// Data unit that was received.
    Asdu(&'a [u8]),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Stopped,
    Starting,
    Started,
}

/// A connection as the controlling station sees it.
#[derive(Debug)]
pub struct Session {
    parameters: Parameters,
    phase: Phase,
    /// Bytes of a frame that is not whole.
    input: Vec<u8>,
    output: Vec<u8>,
    /// Send state variable V(S).
    send_next: Sequence,
    /// Instants of the frames that are not acknowledged, oldest first.
    sent_at: VecDeque<Instant>,
    /// Data units that the window keeps back.
    waiting: VecDeque<Vec<u8>>,
    /// Receive state variable V(R).
    receive_next: Sequence,
    unacknowledged: u16,
    acknowledge_by: Option<Instant>,
    start_confirm_by: Option<Instant>,
    test_confirm_by: Option<Instant>,
    test_at: Instant,
}

impl Session {
    /// A connection that was just made.
    pub fn new(parameters: Parameters, now: Instant) -> Self {
        Self {
            parameters,
            phase: Phase::Stopped,
            input: Vec::new(),
            output: Vec::new(),
            send_next: Sequence::default(),
            sent_at: VecDeque::new(),
            waiting: VecDeque::new(),
            receive_next: Sequence::default(),
            unacknowledged: 0,
            acknowledge_by: None,
            start_confirm_by: None,
            test_confirm_by: None,
            test_at: now + parameters.t3,
        }
    }

    /// Reports whether data transfer is started.
    pub fn is_started(&self) -> bool {
        self.phase == Phase::Started
    }

    /// Asks for data transfer, once.
    pub fn start(&mut self, now: Instant) {
        if self.phase == Phase::Stopped {
            self.phase = Phase::Starting;
            self.start_confirm_by = Some(now + self.parameters.t1);
            self.write(Frame::Unnumbered(Function::StartAct));
        }
    }

    /// Sends a data unit as soon as the window allows.
    ///
    /// # Errors
    /// [`SessionFault::Overrun`].
    pub fn send(&mut self, asdu: Vec<u8>, now: Instant) -> Result<(), SessionFault> {
        if self.waiting.len() >= MAX_WAITING {
            return Err(SessionFault::Overrun);
        }
        self.waiting.push_back(asdu);
        self.send_waiting(now);
        Ok(())
    }

    /// Processes bytes that were received.
    ///
    /// # Errors
    /// After any [`SessionFault`] the connection must be closed.
    pub fn receive(
        &mut self,
        bytes: &[u8],
        now: Instant,
        mut handle: impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        let mut input = std::mem::take(&mut self.input);
        input.extend_from_slice(bytes);
        let mut rest: &[u8] = &input;
        while let Some((frame, taken)) = split_frame(rest)? {
            self.test_at = now + self.parameters.t3;
            self.take(frame, now, &mut handle)?;
            rest = rest.get(taken..).unwrap_or_default();
        }
        let taken = input.len() - rest.len();
        input.drain(..taken);
        self.input = input;
        self.send_waiting(now);
        Ok(())
    }

    /// Does what is due.
    ///
    /// # Errors
    /// [`SessionFault::Timeout`]: the connection must be closed.
    pub fn tick(&mut self, now: Instant) -> Result<(), SessionFault> {
        let limit = self.parameters.t1;
        let is_late = |by: Option<Instant>| by.is_some_and(|by| by <= now);
        let unanswered = self.sent_at.front().map(|&sent| sent + limit);
        for (by, what) in [
            (self.start_confirm_by, "the start of data transfer"),
            (self.test_confirm_by, "a test of the connection"),
            (unanswered, "a request"),
        ] {
            if is_late(by) {
                return Err(SessionFault::Timeout { what, limit });
            }
        }
        if is_late(self.acknowledge_by) {
            self.acknowledge();
        }
        if self.test_at <= now {
            self.test_at = now + self.parameters.t3;
            if self.test_confirm_by.is_none() {
                self.test_confirm_by = Some(now + limit);
                self.write(Frame::Unnumbered(Function::TestAct));
            }
        }
        Ok(())
    }

    /// Returns the latest instant at which [`Session::tick`] has something to do.
    pub fn deadline(&self) -> Instant {
        let unanswered = self.sent_at.front().map(|&sent| sent + self.parameters.t1);
        [self.start_confirm_by, self.test_confirm_by, unanswered, self.acknowledge_by]
            .into_iter()
            .flatten()
            .fold(self.test_at, Instant::min)
    }

    /// Takes the bytes to send.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    fn take(
        &mut self,
        frame: Frame<'_>,
        now: Instant,
        handle: &mut impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        match frame {
            Frame::Information { send, receive, asdu } => {
                self.note_acknowledgement(receive)?;
                if self.phase != Phase::Started {
                    return Err(SessionFault::NotStarted);
                }
                if send != self.receive_next {
                    let wanted = self.receive_next.number();
                    return Err(SessionFault::Sequence { found: send.number(), wanted });
                }
                self.receive_next = send.next();
                self.unacknowledged += 1;
                self.acknowledge_by.get_or_insert(now + self.parameters.t2);
                if self.unacknowledged >= self.parameters.w {
                    self.acknowledge();
                }
                handle(Event::Asdu(asdu));
            }
            Frame::Supervisory(receive) => self.note_acknowledgement(receive)?,
            Frame::Unnumbered(Function::StartCon) => {
                if self.phase == Phase::Starting {
                    self.phase = Phase::Started;
                    self.start_confirm_by = None;
                    handle(Event::Started);
                }
            }
            Frame::Unnumbered(Function::TestAct) => {
                self.write(Frame::Unnumbered(Function::TestCon));
            }
            Frame::Unnumbered(Function::TestCon) => self.test_confirm_by = None,
            // Data transfer is ended by closing, so nobody has asked for it: what is known
            // is not kept up to date any more.
            Frame::Unnumbered(Function::StopCon) if self.is_started() => {
                return Err(SessionFault::Stopped);
            }
            Frame::Unnumbered(Function::StopCon) => {}
            Frame::Unnumbered(Function::StartAct | Function::StopAct) => {
                return Err(SessionFault::Controlling);
            }
        }
        Ok(())
    }

    /// N(R) says that all frames before it have arrived.
    fn note_acknowledgement(&mut self, receive: Sequence) -> Result<(), SessionFault> {
        let open = usize::from(self.send_next.since(receive));
        let acknowledged = self.sent_at.len().checked_sub(open);
        let count = acknowledged.ok_or(SessionFault::Acknowledgement(receive.number()))?;
        self.sent_at.drain(..count);
        Ok(())
    }

    fn send_waiting(&mut self, now: Instant) {
        while self.is_started() && self.sent_at.len() < usize::from(self.parameters.k) {
            let Some(asdu) = self.waiting.pop_front() else { return };
            let (send, receive) = (self.send_next, self.receive_next);
            self.write(Frame::Information { send, receive, asdu: &asdu });
            self.send_next = send.next();
            self.sent_at.push_back(now);
            self.note_acknowledged();
        }
    }

    fn acknowledge(&mut self) {
        self.write(Frame::Supervisory(self.receive_next));
        self.note_acknowledged();
    }

    /// Records that the frame just written acknowledges all received frames.
    fn note_acknowledged(&mut self) {
        self.unacknowledged = 0;
        self.acknowledge_by = None;
    }

    fn write(&mut self, frame: Frame<'_>) {
        frame.write(&mut self.output);
    }
}

#[cfg(test)]
#[path = "apci_session_tests.rs"]
mod tests;
