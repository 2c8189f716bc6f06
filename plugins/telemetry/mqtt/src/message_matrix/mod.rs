//! Message matrix: seeded sequences of messages that are lost, cut short, too long, unknown,
//! misassigned, repeated and overtaken, through packets and all, against an oracle that knows
//! the truth: a wrong or old value is never good.
//!
//! `BUSBAR_MATRIX_STEPS` sets the count of steps of each test.

mod plain;
mod sparkplug;

use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_sdk::testing::{Recorder, host};
use busbar_plugin_sdk::{Quality, Reason, SampleFlags, TagSpec, Value};
use fastrand::Rng;
use serde_json::Value as Json;

use crate::points;
use crate::session::{Parameters, Session, Version};
use crate::settings::Settings;
use crate::subscriber::{Plan, Subscriber};

/// Steps of each test where the environment sets none.
const STEPS: u64 = 20_000;
/// Longest payload that the client takes: longer than a metric of Sparkplug B may be.
const MAX_PAYLOAD: usize = 70_000;

fn steps() -> u64 {
    let set = std::env::var("BUSBAR_MATRIX_STEPS").ok();
    set.map_or(STEPS, |text| text.parse().expect("BUSBAR_MATRIX_STEPS is a count"))
}

/// Number of an empty text, which no message counts.
const EMPTY: i64 = 0;
/// Number of a text that is none of a source's.
const NO_NUMBER: i64 = -1;

/// Makes a text that identifies a message by its number.
fn numbered_text(number: i64) -> String {
    format!("Mode {number}")
}

/// Reads the number of a text of [`numbered_text`], whatever stands behind it.
fn number_in(text: &str) -> i64 {
    if text.is_empty() {
        return EMPTY;
    }
    let rest = text.strip_prefix("Mode ").unwrap_or_default();
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[..end].parse().unwrap_or(NO_NUMBER)
}

/// A tag as its host shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shown {
    /// Number that identifies the message of the value; of a text, the one in it.
    value: Option<i64>,
    quality: Quality,
    source_time: Option<SystemTime>,
}

impl Shown {
    fn is_good(self) -> bool {
        self.quality.is_good()
    }
}

/// The plugin between bytes of a broker and samples, and a host that shows these.
struct Client {
    session: Session,
    subscriber: Subscriber,
    recorder: Recorder,
    version: Version,
    rng: Rng,
    now: Instant,
    shown: Vec<Shown>,
}

impl Client {
    fn new(mut settings: Json, tags: &[TagSpec], version: Version, rng: Rng) -> Self {
        settings["max_payload_bytes"] = MAX_PAYLOAD.into();
        let settings: Settings = serde_json::from_value(settings).unwrap();
        let config = settings.parse().unwrap();
        let plan = Plan::new(points::parse(tags.iter()).unwrap(), &config).unwrap();
        let (recorder, now) = (Recorder::new(), Instant::now());
        let subscriber = Subscriber::new(plan, &config, recorder.sink(), host());
        let parameters = Parameters {
            version,
            client_id: "a".into(),
            login: None,
            will: None,
            keep_alive: Duration::from_secs(10),
            answer_timeout: Duration::from_secs(10),
            qos: 1,
            max_payload: config.max_payload,
        };
        let session = Session::new(&parameters, Vec::new(), now).unwrap();
        let bad = Quality::Bad(Reason::NotConnected);
        let shown = vec![Shown { value: None, quality: bad, source_time: None }; tags.len()];
        let mut client = Self { session, subscriber, recorder, version, rng, now, shown };
        client.hear(if version == Version::V5 { &[0x20, 3, 0, 0, 0] } else { &[0x20, 2, 0, 0] });
        client
    }

    /// Brings a message as a broker does, in pieces of any length.
    fn publish(&mut self, topic: &str, payload: &[u8], is_retained: bool) {
        let qos = self.rng.u8(0..=2);
        let mut body = (topic.len() as u16).to_be_bytes().to_vec();
        body.extend_from_slice(topic.as_bytes());
        if qos > 0 {
            body.extend_from_slice(&[0, 7]);
        }
        if self.version == Version::V5 {
            body.push(0);
        }
        body.extend_from_slice(payload);
        let mut packet = vec![0x30 | qos << 1 | u8::from(is_retained)];
        let mut length = body.len();
        loop {
            let digit = (length & 0x7F) as u8;
            length >>= 7;
            packet.push(if length > 0 { digit | 0x80 } else { digit });
            if length == 0 {
                break;
            }
        }
        packet.extend_from_slice(&body);
        self.now += Duration::from_millis(10);
        let piece = if self.rng.u8(..) < 25 { self.rng.usize(1..60) } else { packet.len() };
        for piece in packet.chunks(piece) {
            self.hear(piece);
        }
    }

    fn hear(&mut self, bytes: &[u8]) {
        self.session.input().extend_from_slice(bytes);
        let (subscriber, now) = (&mut self.subscriber, self.now);
        self.session.advance(now, |event| subscriber.note(event, now)).expect("it goes on");
        self.subscriber.flush();
        self.session.take_output();
        self.show();
    }

    /// Applies the published samples as the host does: live ones by arrival, buffered ones by
    /// source time.
    fn show(&mut self) {
        let recording = self.recorder.recording();
        self.recorder.clear();
        for sample in recording.samples {
            let shown = &mut self.shown[sample.tag as usize];
            let is_old = sample.flags.contains(SampleFlags::BUFFERED)
                && sample.value.is_some()
                && sample
                    .source_time
                    .is_some_and(|time| shown.source_time.is_some_and(|t| time < t));
            if is_old && sample.quality.is_good() {
                continue;
            }
            if let (Some(value), false) = (&sample.value, is_old) {
                let value = match value {
                    Value::I64(value) => *value,
                    Value::Text(text) => number_in(text.as_str()),
                    other => panic!("{other:?}"),
                };
                (shown.value, shown.source_time) = (Some(value), sample.source_time);
            }
            shown.quality = match sample.quality {
                Quality::Good if sample.flags.contains(SampleFlags::TIME_UNUSABLE) => {
                    Quality::Uncertain(Reason::SourceTime)
                }
                // A value of the past is marked as such, and none that is live.
                Quality::Good if sample.flags.contains(SampleFlags::HISTORICAL) => {
                    Quality::Uncertain(Reason::Unknown)
                }
                quality => quality,
            };
        }
    }
}
