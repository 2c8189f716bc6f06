//! The life of one connection as the controlled station sees it, without a socket and
//! without a clock (IEC 60870-5-104, 5.2 to 5.5).

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::apci_session::Parameters;
use crate::codec::{Frame, FrameError, Function, Sequence, split_frame};

/// Reason for which a connection must be closed.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub(crate) enum CloseReason {
    /// Bytes that break the protocol.
    #[error("{0}")]
    Frame(#[from] FrameError),
    /// Frames were lost or repeated.
    #[error("frame {found} came where {wanted} was due")]
    Sequence {
        /// Send number N(S) that was received.
        found: u16,
        /// N(S) that was due.
        wanted: u16,
    },
    /// Acknowledgement of frames that were not sent.
    #[error("frames before {0} are acknowledged, which were never sent")]
    Acknowledgement(u16),
    /// Data on a connection where it was not started.
    #[error("a request came before data transfer was started")]
    NotStarted,
    /// Something that only a controlled station says.
    #[error("the other end acts as a controlled station, as this one does")]
    Controlled,
    /// A frame was not acknowledged within t1.
    #[error("no answer within {} ms (t1)", .0.as_millis())]
    Timeout(Duration),
}

/// Event of received bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event<'a> {
    /// Data transfer has begun.
    Started,
    /// Data transfer has ended.
    Stopped,
    /// Request that was received.
    Asdu(&'a [u8]),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Stopped,
    Started,
    /// To be stopped once all that was sent is acknowledged (5.3, figure 12).
    Stopping,
}

/// A connection as the controlled station sees it.
#[derive(Debug)]
pub(crate) struct Session {
    parameters: Parameters,
    phase: Phase,
    /// Bytes of a frame that is not whole.
    input: Vec<u8>,
    output: Vec<u8>,
    /// Send state variable V(S).
    send_next: Sequence,
    /// Instants of the frames that are not acknowledged, oldest first.
    sent_at: VecDeque<Instant>,
    /// Receive state variable V(R).
    receive_next: Sequence,
    unacknowledged: u16,
    acknowledge_by: Option<Instant>,
    test_confirm_by: Option<Instant>,
    test_at: Instant,
}

impl Session {
    /// A connection that was just taken.
    pub(crate) fn new(parameters: Parameters, now: Instant) -> Self {
        Self {
            parameters,
            phase: Phase::Stopped,
            input: Vec::new(),
            output: Vec::new(),
            send_next: Sequence::default(),
            sent_at: VecDeque::new(),
            receive_next: Sequence::default(),
            unacknowledged: 0,
            acknowledge_by: None,
            test_confirm_by: None,
            test_at: now + parameters.t3,
        }
    }

    /// Reports whether data transfer is started.
    pub(crate) fn is_started(&self) -> bool {
        self.phase == Phase::Started
    }

    /// Reports whether data transfer is started, and the window has room.
    pub(crate) fn can_send(&self) -> bool {
        self.phase == Phase::Started && self.sent_at.len() < usize::from(self.parameters.k)
    }

    /// Sends a data unit; only where [`Session::can_send`].
    pub(crate) fn send(&mut self, asdu: &[u8], now: Instant) {
        let (send, receive) = (self.send_next, self.receive_next);
        self.write(Frame::Information { send, receive, asdu });
        self.send_next = send.next();
        self.sent_at.push_back(now);
        self.note_acknowledged();
    }

    /// Processes bytes that were received.
    ///
    /// # Errors
    /// After any [`CloseReason`] the connection must be closed.
    pub(crate) fn receive(
        &mut self,
        bytes: &[u8],
        now: Instant,
        mut handle: impl FnMut(Event<'_>),
    ) -> Result<(), CloseReason> {
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
        Ok(())
    }

    /// Does what is due.
    ///
    /// # Errors
    /// [`CloseReason::Timeout`]: the connection must be closed.
    pub(crate) fn tick(&mut self, now: Instant) -> Result<(), CloseReason> {
        let is_late = |by: Option<Instant>| by.is_some_and(|by| by <= now);
        if is_late(self.test_confirm_by) || is_late(self.answer_due()) {
            return Err(CloseReason::Timeout(self.parameters.t1));
        }
        if is_late(self.acknowledge_by) {
            self.acknowledge();
        }
        if self.test_at <= now {
            self.test_at = now + self.parameters.t3;
            if self.test_confirm_by.is_none() {
                self.test_confirm_by = Some(now + self.parameters.t1);
                self.write(Frame::Unnumbered(Function::TestAct));
            }
        }
        Ok(())
    }

    /// Returns the latest instant at which [`Session::tick`] has something to do.
    pub(crate) fn deadline(&self) -> Instant {
        [self.test_confirm_by, self.answer_due(), self.acknowledge_by]
            .into_iter()
            .flatten()
            .fold(self.test_at, Instant::min)
    }

    /// Takes the bytes to send.
    pub(crate) fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    fn answer_due(&self) -> Option<Instant> {
        self.sent_at.front().map(|&sent| sent + self.parameters.t1)
    }

    fn take(
        &mut self,
        frame: Frame<'_>,
        now: Instant,
        handle: &mut impl FnMut(Event<'_>),
    ) -> Result<(), CloseReason> {
        match frame {
            Frame::Information { send, receive, asdu } => {
                self.note_acknowledgement(receive)?;
                if self.phase != Phase::Started {
                    return Err(CloseReason::NotStarted);
                }
                if send != self.receive_next {
                    let wanted = self.receive_next.number();
                    return Err(CloseReason::Sequence { found: send.number(), wanted });
                }
                self.receive_next = send.next();
                self.unacknowledged += 1;
                self.acknowledge_by.get_or_insert(now + self.parameters.t2);
                if self.unacknowledged >= self.parameters.w {
                    self.acknowledge();
                }
                handle(Event::Asdu(asdu));
            }
            Frame::Supervisory(receive) => {
                self.note_acknowledgement(receive)?;
                self.stop_when_acknowledged();
            }
            Frame::Unnumbered(Function::StartAct) => {
                self.write(Frame::Unnumbered(Function::StartCon));
                if std::mem::replace(&mut self.phase, Phase::Started) != Phase::Started {
                    handle(Event::Started);
                }
            }
            Frame::Unnumbered(Function::StopAct) => {
                if self.unacknowledged > 0 {
                    self.acknowledge();
                }
                if std::mem::replace(&mut self.phase, Phase::Stopping) == Phase::Started {
                    handle(Event::Stopped);
                }
                self.stop_when_acknowledged();
            }
            Frame::Unnumbered(Function::TestAct) => {
                self.write(Frame::Unnumbered(Function::TestCon));
            }
            Frame::Unnumbered(Function::TestCon) => self.test_confirm_by = None,
            Frame::Unnumbered(Function::StartCon | Function::StopCon) => {
                return Err(CloseReason::Controlled);
            }
        }
        Ok(())
    }

    fn stop_when_acknowledged(&mut self) {
        if self.phase == Phase::Stopping && self.sent_at.is_empty() {
            self.phase = Phase::Stopped;
            self.write(Frame::Unnumbered(Function::StopCon));
        }
    }

    /// N(R) says that all frames before it have arrived.
    fn note_acknowledgement(&mut self, receive: Sequence) -> Result<(), CloseReason> {
        let open = usize::from(self.send_next.since(receive));
        let acknowledged = self.sent_at.len().checked_sub(open);
        let count = acknowledged.ok_or(CloseReason::Acknowledgement(receive.number()))?;
        self.sent_at.drain(..count);
        Ok(())
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
#[path = "session_tests.rs"]
mod tests;
