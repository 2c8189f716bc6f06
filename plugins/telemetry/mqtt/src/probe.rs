//! The way from bytes to samples without a socket: for fuzzing.

use std::time::{Duration, Instant};

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, SampleSink, TagSpec};

use crate::points;
use crate::session::{Event, Parameters, Session, Version};
use crate::settings::{Config, Settings};
use crate::subscriber::{Plan, Subscriber};

/// A client, and the clock in the caller's hands.
pub struct ClientProbe {
    config: Config,
    subscriber: Subscriber,
    now: Instant,
}

impl ClientProbe {
    /// Creates a client that has just connected.
    ///
    /// # Errors
    /// Faults of the settings and addresses.
    pub fn new(settings: Settings, tags: &[TagSpec], sink: SampleSink) -> Result<Self, Error> {
        let (config, now) = (settings.parse()?, Instant::now());
        let plan = Plan::new(points::parse(tags.iter())?, &config)?;
        let mut subscriber = Subscriber::new(plan, &config, sink, host());
        subscriber.note(Event::Connected, now);
        Ok(Self { config, subscriber, now })
    }

    /// Takes a message as from the broker, and publishes its values.
    pub fn message(&mut self, topic: &str, payload: &[u8], is_retained: bool) {
        let event = Event::Message { topic: topic.as_bytes(), payload, is_retained };
        self.subscriber.note(event, self.now);
        self.subscriber.flush();
    }

    /// Takes bytes of a broker, from the answer to the connection on, in pieces of this
    /// length. False if they end the connection.
    pub fn bytes(&mut self, bytes: &[u8], piece: usize, is_version_5: bool) -> bool {
        let parameters = Parameters {
            version: if is_version_5 { Version::V5 } else { Version::V4 },
            client_id: "probe".into(),
            login: None,
            will: None,
            keep_alive: Duration::from_secs(10),
            answer_timeout: Duration::from_secs(10),
            qos: 1,
            max_payload: self.config.max_payload,
        };
        let filters = self.subscriber.filters().to_vec();
        let Ok(mut session) = Session::new(&parameters, filters, self.now) else { return false };
        for piece in bytes.chunks(piece.max(1)) {
            session.input().extend_from_slice(piece);
            let subscriber = &mut self.subscriber;
            let now = self.now;
            if session.advance(now, |event| subscriber.note(event, now)).is_err() {
                return false;
            }
            self.subscriber.flush();
            session.take_output();
        }
        true
    }
}
