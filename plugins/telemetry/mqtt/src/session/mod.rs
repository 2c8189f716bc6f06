//! Client session of MQTT: bytes in, messages and bytes out. It has no socket, and no clock but the
//! times that its caller passes.

mod head;
pub(crate) mod packet;

use std::time::{Duration, Instant};

use busbar_plugin_sdk::SecretText;
use bytes::{Buf, Bytes, BytesMut};
use thiserror::Error;

use self::head::{MessageHead, is_message, read_message_head};
pub(crate) use self::packet::Version;
use self::packet::{Codec, Incoming, PacketFault, QosLevel, Reply};

/// Fault of a message that cannot be of any topic.
const NO_TOPIC: &str = "a message without a readable topic";
/// Most topic filters in one SUBSCRIBE packet.
const MAX_FILTERS_A_PACKET: usize = 100;

/// Parameters of a client connection.
#[derive(Clone, Debug)]
pub(crate) struct Parameters {
    pub(crate) version: Version,
    pub(crate) client_id: String,
    pub(crate) login: Option<Login>,
    /// Will message, which the broker publishes when the connection is lost.
    pub(crate) will: Option<Announcement>,
    /// Keep-alive: a broker that sends nothing for so long is lost.
    pub(crate) keep_alive: Duration,
    /// Deadline of the broker's answer to the connection, and to a subscription.
    pub(crate) answer_timeout: Duration,
    pub(crate) qos: QosLevel,
    /// Longest payload, bytes; messages with a longer one are left out.
    pub(crate) max_payload: usize,
}

/// User name and password of the client.
#[derive(Clone, Debug)]
pub(crate) struct Login {
    pub(crate) username: SecretText,
    pub(crate) password: Option<SecretText>,
}

/// Retained message of the client, such as its will.
#[derive(Clone, Debug)]
pub(crate) struct Announcement {
    pub(crate) topic: String,
    pub(crate) payload: String,
}

/// Event of a session, for its caller.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// The broker accepted the connection.
    Connected,
    /// A filter was refused: its index, and the reason.
    Refused(usize, &'static str),
    /// All filters were answered.
    Subscribed,
    Message {
        topic: &'a [u8],
        payload: &'a [u8],
        /// True where the broker had retained the message from before the subscription.
        is_retained: bool,
    },
    /// A message was left out: its payload, or its packet, has more bytes than are taken.
    TooLong { topic: &'a str, bytes: usize, is_retained: bool },
}

/// Reason for which a connection cannot go on.
#[derive(Debug, Error, PartialEq, Eq)]
pub(crate) enum SessionFault {
    #[error("{0}")]
    Refused(String),
    #[error("the broker ended the connection: {0}")]
    Ended(String),
    #[error("the broker said nothing for {} ms (keep_alive_seconds)", .0.as_millis())]
    Silent(Duration),
    #[error("the broker did not answer within {} ms; does it speak MQTT on this port?",
        .0.as_millis())]
    NoAnswer(Duration),
    #[error("the broker did not answer a subscription within {} ms", .0.as_millis())]
    NoSubscription(Duration),
    #[error("what came is no MQTT: {0}; is the port right, and is it encrypted?")]
    Malformed(String),
    #[error("the broker said something before it took the connection")]
    OutOfOrder,
    #[error("a packet cannot be written: {0}")]
    CannotWrite(String),
}

impl From<PacketFault> for SessionFault {
    fn from(fault: PacketFault) -> Self {
        Self::Malformed(fault.to_string())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// CONNECT was sent; CONNACK is due by the deadline.
    Connecting {
        deadline: Instant,
    },
    /// The filters before `next` were sent, all but the last packet of them answered.
    Subscribing {
        first: usize,
        next: usize,
        id: u16,
        deadline: Instant,
    },
    Subscribed,
}

/// Client session over one connection, without input and output of its own.
pub(crate) struct Session {
    codec: Codec,
    keep_alive: Duration,
    answer_timeout: Duration,
    qos: QosLevel,
    filters: Vec<String>,
    state: State,
    /// Bytes received but not parsed yet: part of one packet at most.
    input: BytesMut,
    /// Bytes of `input` that had come before.
    known: usize,
    output: BytesMut,
    /// Bytes of a message that is too long, still to come.
    to_skip: usize,
    heard: Instant,
    /// Time of the last PINGREQ.
    pinged: Instant,
}

impl Session {
    /// Begins a connection that subscribes to `filters`.
    pub(crate) fn new(
        parameters: &Parameters,
        filters: Vec<String>,
        now: Instant,
    ) -> Result<Self, SessionFault> {
        let codec = Codec { version: parameters.version, max_payload: parameters.max_payload };
        let mut output = BytesMut::new();
        let connect = codec.connect(parameters);
        connect.and_then(|packet| packet.write(&mut output)).map_err(cannot_write)?;
        Ok(Self {
            codec,
            keep_alive: parameters.keep_alive,
            answer_timeout: parameters.answer_timeout,
            qos: parameters.qos,
            filters,
            state: State::Connecting { deadline: now + parameters.answer_timeout },
            input: BytesMut::new(),
            known: 0,
            output,
            to_skip: 0,
            heard: now,
            pinged: now,
        })
    }

    /// Returns the buffer for bytes received from the broker, to be filled before
    /// [`Session::advance`].
    pub(crate) fn input(&mut self) -> &mut BytesMut {
        &mut self.input
    }

    /// Takes the bytes to send to the broker.
    pub(crate) fn take_output(&mut self) -> Bytes {
        self.output.split().freeze()
    }

    pub(crate) fn is_subscribed(&self) -> bool {
        self.state == State::Subscribed
    }

    /// Returns the time at which [`Session::tick`] has something to do.
    pub(crate) fn deadline(&self) -> Instant {
        let of_state = match self.state {
            State::Connecting { deadline } | State::Subscribing { deadline, .. } => deadline,
            State::Subscribed => self.heard + self.keep_alive,
        };
        of_state.min(self.pinged + self.ping_interval()).min(self.heard + self.keep_alive)
    }

    /// Sends pings and checks deadlines as they are due.
    pub(crate) fn tick(&mut self, now: Instant) -> Result<(), SessionFault> {
        match self.state {
            State::Connecting { deadline } if now >= deadline => {
                return Err(SessionFault::NoAnswer(self.answer_timeout));
            }
            State::Subscribing { deadline, .. } if now >= deadline => {
                return Err(SessionFault::NoSubscription(self.answer_timeout));
            }
            _ => {}
        }
        if self.is_connecting() {
            return Ok(());
        }
        if now >= self.heard + self.keep_alive {
            return Err(SessionFault::Silent(self.keep_alive));
        }
        if now >= self.pinged + self.ping_interval() {
            self.codec.ping().write(&mut self.output).map_err(cannot_write)?;
            self.pinged = now;
        }
        Ok(())
    }

    /// Queues a PUBLISH packet for sending.
    pub(crate) fn publish(
        &mut self,
        topic: &str,
        payload: Vec<u8>,
        retain: bool,
    ) -> Result<(), SessionFault> {
        let packet = self.codec.publish(topic, payload, retain);
        packet.write(&mut self.output).map_err(cannot_write)
    }

    /// Reads the packets that have come whole.
    pub(crate) fn advance(
        &mut self,
        now: Instant,
        mut note: impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        // Half a packet that waits for its rest is no sign of life.
        if self.input.len() > self.known {
            self.heard = now;
        }
        let outcome = self.read_packets(now, &mut note);
        self.known = self.input.len();
        outcome
    }

    fn read_packets(
        &mut self,
        now: Instant,
        note: &mut impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        loop {
            let skipped = self.to_skip.min(self.input.len());
            self.input.advance(skipped);
            self.to_skip -= skipped;
            if is_message(&self.input) {
                let Some(head) = read_message_head(&self.input, self.codec.version)? else {
                    return Ok(());
                };
                if self.is_connecting() {
                    return Err(SessionFault::OutOfOrder);
                }
                if self.codec.is_too_long(head.payload, head.packet) {
                    self.skip_message(&head, note)?;
                    continue;
                }
            }
            match self.codec.read(&mut self.input)? {
                Some(packet) => self.handle(packet, now, note)?,
                None => return Ok(()),
            }
        }
    }

    fn handle(
        &mut self,
        packet: Incoming,
        now: Instant,
        note: &mut impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        let is_connecting = self.is_connecting();
        match packet {
            Incoming::Accepted { keep_alive } if is_connecting => {
                if let Some(seconds) = keep_alive {
                    let demanded = Duration::from_secs(seconds.max(1).into());
                    self.keep_alive = self.keep_alive.min(demanded);
                }
                self.heard = now;
                self.pinged = now;
                note(Event::Connected);
                self.subscribe(0, 1, now, note)
            }
            Incoming::Refused(why) => Err(SessionFault::Refused(why)),
            Incoming::Ended(why) => Err(SessionFault::Ended(why)),
            _ if is_connecting => Err(SessionFault::OutOfOrder),
            // Topic aliases (MQTT 5, 3.3.2.3.4) were not offered.
            Incoming::Message { topic, .. } if topic.is_empty() => {
                Err(SessionFault::Malformed(NO_TOPIC.into()))
            }
            Incoming::Message { topic, payload, is_retained, reply } => {
                note(Event::Message { topic: &topic, payload: &payload, is_retained });
                self.send_reply(reply)
            }
            Incoming::Subscribed { id: answered, outcomes } => match self.state {
                State::Subscribing { first, next, id, .. } if id == answered => {
                    if outcomes.len() != next - first {
                        let text = "an answer to fewer or more topic filters than were sent";
                        return Err(SessionFault::Malformed(text.into()));
                    }
                    for (index, outcome) in (first..next).zip(outcomes) {
                        if let Some(why) = outcome {
                            note(Event::Refused(index, why));
                        }
                    }
                    self.subscribe(next, id.wrapping_add(1).max(1), now, note)
                }
                _ => Ok(()),
            },
            Incoming::Released(id) => {
                self.codec.complete(id).write(&mut self.output).map_err(cannot_write)
            }
            Incoming::Accepted { .. } | Incoming::Pong | Incoming::Other => Ok(()),
        }
    }

    /// Subscribes to the filters from `first` on, as many as go into a packet.
    fn subscribe(
        &mut self,
        first: usize,
        id: u16,
        now: Instant,
        note: &mut impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        let next = self.filters.len().min(first + MAX_FILTERS_A_PACKET);
        let Some(filters @ [_, ..]) = self.filters.get(first..next) else {
            self.state = State::Subscribed;
            note(Event::Subscribed);
            return Ok(());
        };
        let packet = self.codec.subscribe(id, filters, self.qos);
        packet.write(&mut self.output).map_err(cannot_write)?;
        let deadline = now + self.answer_timeout;
        self.state = State::Subscribing { first, next, id, deadline };
        Ok(())
    }

    fn send_reply(&mut self, reply: Reply) -> Result<(), SessionFault> {
        match self.codec.reply(reply) {
            Some(packet) => packet.write(&mut self.output).map_err(cannot_write),
            None => Ok(()),
        }
    }

    /// Leaves out the message that begins here, and confirms it: one that is not confirmed
    /// would be sent for ever.
    fn skip_message(
        &mut self,
        head: &MessageHead,
        note: &mut impl FnMut(Event<'_>),
    ) -> Result<(), SessionFault> {
        let topic = self.input.get(head.topic.clone()).unwrap_or_default();
        let topic = std::str::from_utf8(topic).ok().filter(|topic| !topic.is_empty());
        let topic = topic.ok_or_else(|| SessionFault::Malformed(NO_TOPIC.into()))?;
        let bytes = if head.payload > self.codec.max_payload { head.payload } else { head.packet };
        note(Event::TooLong { topic, bytes, is_retained: head.is_retained });
        self.to_skip = head.packet;
        self.send_reply(head.reply)
    }

    fn is_connecting(&self) -> bool {
        matches!(self.state, State::Connecting { .. })
    }

    fn ping_interval(&self) -> Duration {
        self.keep_alive / 2
    }
}

fn cannot_write(fault: PacketFault) -> SessionFault {
    SessionFault::CannotWrite(fault.to_string())
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
