//! Packets of MQTT 3.1.1 and 5, as far as a reader of values needs them, in one form.

use bytes::{Bytes, BytesMut};
use rumqttc_v4::mqttbytes as any4;
use rumqttc_v4::mqttbytes::v4;
use rumqttc_v5::mqttbytes as any5;
use rumqttc_v5::mqttbytes::v5;
use thiserror::Error;

use super::{Login, Parameters};

/// Bytes that a packet may have beside its payload: header, topic (at most 65,535 bytes) and
/// properties (some 64 KiB).
const MAX_OVERHEAD: usize = 128 * 1024;

/// Protocol version in which the client speaks to its broker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
pub(crate) enum Version {
    /// Version 3.1.1 of MQTT (ISO/IEC 20922).
    #[default]
    #[serde(rename = "3.1.1")]
    V4,
    /// Version 5 of MQTT (OASIS).
    #[serde(rename = "5")]
    V5,
}

/// Quality of service, 0 to 2; deliveries have at most that of the publisher.
pub(crate) type QosLevel = u8;

/// Packet that came from a broker.
#[derive(Debug)]
pub(crate) enum Incoming {
    /// The connection stands; the broker may demand a shorter keep-alive, seconds.
    Accepted {
        keep_alive: Option<u16>,
    },
    /// Refusal of the connection, in words for operators.
    Refused(String),
    Message {
        topic: Bytes,
        payload: Bytes,
        is_retained: bool,
        reply: Reply,
    },
    /// Reasons for which filters were refused, by filter of the subscription.
    Subscribed {
        id: u16,
        outcomes: Vec<Option<&'static str>>,
    },
    Released(u16),
    Pong,
    /// The broker ends the connection, in words for operators.
    Ended(String),
    /// Says nothing that a reader needs.
    Other,
}

/// Acknowledgement that a message asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reply {
    None,
    /// PUBACK of this packet id, for quality of service 1.
    Acknowledged(u16),
    /// PUBREC of this packet id, for quality of service 2.
    Received(u16),
}

/// A packet that cannot be used.
#[derive(Debug, Error, PartialEq, Eq)]
pub(crate) enum PacketFault {
    /// No message, and longer than any such packet.
    #[error("a packet of {0} bytes that is no message")]
    TooLong(usize),
    #[error("{0}")]
    Malformed(String),
}

/// Reads and writes packets of one version.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Codec {
    pub(crate) version: Version,
    pub(crate) max_payload: usize,
}

impl Codec {
    /// Reports whether a message is left out because its payload, to the byte, or its packet is too
    /// long.
    pub(crate) fn is_too_long(self, payload: usize, packet: usize) -> bool {
        payload > self.max_payload || packet > self.max_packet()
    }

    /// Returns the longest packet that is read, bytes.
    fn max_packet(self) -> usize {
        self.max_payload.saturating_add(MAX_OVERHEAD)
    }

    /// Takes a packet from the beginning of `input`; nothing while it is not whole.
    pub(crate) fn read(self, input: &mut BytesMut) -> Result<Option<Incoming>, PacketFault> {
        match self.version {
            Version::V4 => match v4::Packet::read(input, self.max_packet()) {
                Ok(packet) => Ok(Some(from_v4(packet))),
                Err(any4::Error::InsufficientBytes(_)) => Ok(None),
                Err(any4::Error::PayloadSizeLimitExceeded(bytes)) => {
                    Err(PacketFault::TooLong(bytes))
                }
                Err(error) => Err(PacketFault::Malformed(error.to_string())),
            },
            Version::V5 => match v5::Packet::read(input, Some(narrow(self.max_packet()))) {
                Ok(packet) => Ok(Some(from_v5(packet))),
                Err(any5::Error::InsufficientBytes(_)) => Ok(None),
                Err(any5::Error::PayloadSizeLimitExceeded { pkt_size, .. }) => {
                    Err(PacketFault::TooLong(pkt_size))
                }
                Err(error) => Err(PacketFault::Malformed(error.to_string())),
            },
        }
    }

    pub(crate) fn connect(self, parameters: &Parameters) -> Result<Packet, PacketFault> {
        let client_id = parameters.client_id.clone();
        let keep_alive = u16::try_from(parameters.keep_alive.as_secs().max(1)).unwrap_or(u16::MAX);
        let Parameters { login, will, .. } = parameters;
        Ok(match self.version {
            Version::V4 => {
                let auth = match login {
                    None => v4::ConnectAuth::None,
                    Some(Login { username, password: None }) => {
                        v4::ConnectAuth::Username { username: username.reveal().into() }
                    }
                    Some(Login { username, password: Some(password) }) => {
                        v4::ConnectAuth::UsernamePassword {
                            username: username.reveal().into(),
                            password: password.reveal().to_owned().into(),
                        }
                    }
                };
                let last_will = will.as_ref().map(|will| {
                    v4::LastWill::new(&*will.topic, &*will.payload, any4::QoS::AtLeastOnce, true)
                });
                let connect =
                    v4::Connect { keep_alive, client_id, clean_session: true, last_will, auth };
                Packet::V4(v4::Packet::Connect(connect))
            }
            Version::V5 => {
                let auth = match login {
                    None => v5::ConnectAuth::None,
                    Some(Login { username, password: None }) => {
                        v5::ConnectAuth::Username { username: username.reveal().into() }
                    }
                    Some(Login { username, password: Some(password) }) => {
                        v5::ConnectAuth::UsernamePassword {
                            username: username.reveal().into(),
                            password: password.reveal().to_owned().into(),
                        }
                    }
                };
                let last_will = will.as_ref().map(|will| {
                    let qos = any5::QoS::AtLeastOnce;
                    v5::LastWill::new(&*will.topic, &*will.payload, qos, true, None)
                });
                // No session outlives the connection. What is too long is left out by us:
                // Mosquitto 2.0.11, told a limit, counts what it left out as unconfirmed, and
                // after 20 of them sends no more.
                let properties = v5::ConnectProperties {
                    session_expiry_interval: Some(0),
                    ..v5::ConnectProperties::new()
                };
                let properties = Some(properties);
                let connect = v5::Connect { keep_alive, client_id, clean_start: true, properties };
                of_5(v5::Packet::Connect(connect, last_will, auth))
            }
        })
    }

    pub(crate) fn subscribe(self, id: u16, filters: &[String], qos: QosLevel) -> Packet {
        match self.version {
            Version::V4 => {
                let filter = |path: &String| v4::SubscribeFilter::new(path.clone(), qos4(qos));
                let filters = filters.iter().map(filter).collect();
                Packet::V4(v4::Packet::Subscribe(v4::Subscribe { pkid: id, filters }))
            }
            Version::V5 => {
                let filter = |path: &String| v5::SubscribeFilter::new(path.clone(), qos5(qos));
                let filters = filters.iter().map(filter).collect();
                let subscribe = v5::Subscribe { pkid: id, filters, properties: None };
                of_5(v5::Packet::Subscribe(subscribe))
            }
        }
    }

    /// Returns a PUBLISH packet of quality of service 0.
    pub(crate) fn publish(self, topic: &str, payload: Vec<u8>, retain: bool) -> Packet {
        match self.version {
            Version::V4 => {
                let message = v4::Publish::new(topic, any4::QoS::AtMostOnce, payload);
                Packet::V4(v4::Packet::Publish(v4::Publish { retain, ..message }))
            }
            Version::V5 => {
                let message = v5::Publish::new(topic, any5::QoS::AtMostOnce, payload, None);
                of_5(v5::Packet::Publish(v5::Publish { retain, ..message }))
            }
        }
    }

    pub(crate) fn ping(self) -> Packet {
        match self.version {
            Version::V4 => Packet::V4(v4::Packet::PingReq),
            Version::V5 => of_5(v5::Packet::PingReq),
        }
    }

    pub(crate) fn reply(self, reply: Reply) -> Option<Packet> {
        Some(match (self.version, reply) {
            (_, Reply::None) => return None,
            (Version::V4, Reply::Acknowledged(id)) => {
                Packet::V4(v4::Packet::PubAck(v4::PubAck { pkid: id }))
            }
            (Version::V4, Reply::Received(id)) => {
                Packet::V4(v4::Packet::PubRec(v4::PubRec { pkid: id }))
            }
            (Version::V5, Reply::Acknowledged(id)) => {
                of_5(v5::Packet::PubAck(v5::PubAck::new(id, None)))
            }
            (Version::V5, Reply::Received(id)) => {
                of_5(v5::Packet::PubRec(v5::PubRec::new(id, None)))
            }
        })
    }

    /// Returns the PUBCOMP packet that answers [`Incoming::Released`].
    pub(crate) fn complete(self, id: u16) -> Packet {
        match self.version {
            Version::V4 => Packet::V4(v4::Packet::PubComp(v4::PubComp { pkid: id })),
            Version::V5 => of_5(v5::Packet::PubComp(v5::PubComp::new(id, None))),
        }
    }
}

/// A packet to send.
#[derive(Debug)]
pub(crate) enum Packet {
    V4(v4::Packet),
    V5(Box<v5::Packet>),
}

impl Packet {
    /// Appends the packet; a failure leaves `output` as it was.
    pub(crate) fn write(&self, output: &mut BytesMut) -> Result<(), PacketFault> {
        let length = output.len();
        let written = match self {
            Self::V4(packet) => packet.write(output, usize::MAX).map_err(|error| error.to_string()),
            Self::V5(packet) => packet.write(output, None).map_err(|error| error.to_string()),
        };
        written.map(|_| ()).map_err(|fault| {
            output.truncate(length);
            PacketFault::Malformed(fault)
        })
    }
}

fn of_5(packet: v5::Packet) -> Packet {
    Packet::V5(Box::new(packet))
}

fn narrow(bytes: usize) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}

fn qos4(qos: QosLevel) -> any4::QoS {
    any4::qos(qos).unwrap_or(any4::QoS::AtMostOnce)
}

fn qos5(qos: QosLevel) -> any5::QoS {
    any5::qos(qos).unwrap_or(any5::QoS::AtMostOnce)
}

fn from_v4(packet: v4::Packet) -> Incoming {
    use v4::{ConnectReturnCode as Code, SubscribeReasonCode};
    match packet {
        v4::Packet::ConnAck(ack) => match ack.code {
            Code::Success => Incoming::Accepted { keep_alive: None },
            code => Incoming::Refused(refusal(&match code {
                Code::RefusedProtocolVersion => "the broker does not speak MQTT 3.1.1: set \
                                                 \"version\": \"5\""
                    .to_owned(),
                Code::BadClientId => BAD_CLIENT_ID.into(),
                Code::BadUserNamePassword => BAD_LOGIN.into(),
                Code::NotAuthorized => NOT_AUTHORIZED.into(),
                Code::ServiceUnavailable => "its service is unavailable".into(),
                Code::Success => String::new(),
            })),
        },
        v4::Packet::Publish(message) => Incoming::Message {
            reply: match message.qos {
                any4::QoS::AtMostOnce => Reply::None,
                any4::QoS::AtLeastOnce => Reply::Acknowledged(message.pkid),
                any4::QoS::ExactlyOnce => Reply::Received(message.pkid),
            },
            topic: message.topic,
            payload: message.payload,
            is_retained: message.retain,
        },
        v4::Packet::SubAck(ack) => {
            let outcome = |code: &SubscribeReasonCode| match code {
                SubscribeReasonCode::Success(_) => None,
                SubscribeReasonCode::Failure => Some(NOT_ALLOWED),
            };
            Incoming::Subscribed {
                id: ack.pkid,
                outcomes: ack.return_codes.iter().map(outcome).collect(),
            }
        }
        v4::Packet::PubRel(release) => Incoming::Released(release.pkid),
        v4::Packet::PingResp => Incoming::Pong,
        _ => Incoming::Other,
    }
}

fn from_v5(packet: v5::Packet) -> Incoming {
    use v5::ConnectReturnCode as Code;
    match packet {
        v5::Packet::ConnAck(ack) if ack.code == Code::Success => Incoming::Accepted {
            keep_alive: ack.properties.and_then(|properties| properties.server_keep_alive),
        },
        v5::Packet::ConnAck(ack) => {
            let why = match ack.code {
                Code::RefusedProtocolVersion | Code::UnsupportedProtocolVersion => {
                    "the broker does not speak MQTT 5: set \"version\": \"3.1.1\"".to_owned()
                }
                Code::BadClientId | Code::ClientIdentifierNotValid => BAD_CLIENT_ID.into(),
                Code::BadUserNamePassword => BAD_LOGIN.into(),
                Code::NotAuthorized | Code::Banned => NOT_AUTHORIZED.into(),
                code => format!("{code:?}"),
            };
            let told = ack.properties.and_then(|properties| properties.reason_string);
            let told = told.map(|text| format!(" (it says '{}')", short(&text)));
            Incoming::Refused(refusal(&format!("{why}{}", told.unwrap_or_default())))
        }
        v5::Packet::Publish(message) => Incoming::Message {
            reply: match message.qos {
                any5::QoS::AtMostOnce => Reply::None,
                any5::QoS::AtLeastOnce => Reply::Acknowledged(message.pkid),
                any5::QoS::ExactlyOnce => Reply::Received(message.pkid),
            },
            topic: message.topic,
            payload: message.payload,
            is_retained: message.retain,
        },
        v5::Packet::SubAck(ack) => Incoming::Subscribed {
            id: ack.pkid,
            outcomes: ack.return_codes.iter().map(|code| outcome5(*code)).collect(),
        },
        v5::Packet::PubRel(release) => Incoming::Released(release.pkid),
        v5::Packet::PingResp => Incoming::Pong,
        v5::Packet::Disconnect(end) => {
            let told = end.properties.and_then(|properties| properties.reason_string);
            let told = told.map(|text| format!(" ('{}')", short(&text))).unwrap_or_default();
            Incoming::Ended(format!("{:?}{told}", end.reason_code))
        }
        _ => Incoming::Other,
    }
}

fn outcome5(code: v5::SubscribeReasonCode) -> Option<&'static str> {
    use v5::SubscribeReasonCode as Code;
    match code {
        Code::Success(_) => None,
        Code::TopicFilterInvalid => Some("the broker finds it invalid"),
        Code::QuotaExceeded => Some("the broker's quota is exceeded"),
        Code::WildcardSubscriptionsNotSupported => Some("the broker takes no wildcards"),
        _ => Some(NOT_ALLOWED),
    }
}

const BAD_LOGIN: &str = "it does not know this name and password: check login";
const NOT_AUTHORIZED: &str = "this client is not authorized: check login and the broker's rules";
const BAD_CLIENT_ID: &str = "it does not take this client id: set client_id";
const NOT_ALLOWED: &str = "the broker does not let this client read it";

fn refusal(why: &str) -> String {
    format!("the broker refused the connection: {why}")
}

/// Shortens a text of the broker to one line that may be shown.
fn short(text: &str) -> String {
    const MAX_CHARS: usize = 200;
    text.chars().filter(|character| !character.is_control()).take(MAX_CHARS).collect()
}
