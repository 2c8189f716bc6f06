//! All that tags need of a broker, whatever connection it comes over: filters out,
//! messages in.

use std::time::{Instant, SystemTime};

use busbar_plugin_sdk::{Error, Host, LinkState, LogLevel, Reason, SampleSink};

use crate::point_states::PointStates;
use crate::points::{Place, Point};
use crate::session::Event;
use crate::settings::Config;
use crate::sparkplug::Fleet;
use crate::sparkplug::payload::PayloadFault;
use crate::topics::Topics;

/// Most topic filters of one connection.
const MAX_FILTERS: usize = 20_000;

/// Subscription plan: the topic filters and the points that their messages serve.
pub(crate) struct Plan {
    topics: Topics,
    fleet: Fleet,
    points: Vec<Point>,
    /// Topic filters of plain topics, then those of the edge nodes.
    filters: Vec<String>,
    topic_filters: usize,
}

impl Plan {
    /// # Errors
    /// When more would have to be subscribed to than is allowed.
    pub(crate) fn new(places: Vec<(Place, Point)>, config: &Config) -> Result<Self, Error> {
        let (mut topics, mut metrics, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for (place, point) in places {
            points.push(point);
            match place {
                Place::Topic { topic, pointers } => topics.push((topic, pointers)),
                Place::Metric(metric) => metrics.push(metric),
            }
        }
        let first = topics.len();
        let topics = Topics::new(topics, config);
        let fleet = Fleet::new(metrics, first, config.requests_rebirth);
        let mut filters = topics.filters(&config.subscriptions);
        let topic_filters = filters.len();
        filters.extend(fleet.filters());
        if filters.len() > MAX_FILTERS {
            return Err(Error::settings(format!(
                "{} topics would have to be subscribed to; at most {MAX_FILTERS} are allowed: set \
                 subscriptions to filters that bring many, such as site7/#",
                filters.len()
            )));
        }
        Ok(Self { topics, fleet, points, filters, topic_filters })
    }
}

/// The reader of a cluster's messages.
pub(crate) struct Subscriber {
    topics: Topics,
    fleet: Fleet,
    filters: Vec<String>,
    topic_filters: usize,
    point_states: PointStates,
    sink: SampleSink,
    /// The broker that is connected.
    broker: String,
    refused: usize,
}

impl Subscriber {
    pub(crate) fn new(plan: Plan, config: &Config, sink: SampleSink, host: Host) -> Self {
        let Plan { topics, fleet, points, filters, topic_filters } = plan;
        let broker = config.brokers.first().map(ToString::to_string).unwrap_or_default();
        let point_states = PointStates::new(points, sink.clone(), host, broker.clone());
        Self { topics, fleet, filters, topic_filters, point_states, sink, broker, refused: 0 }
    }

    pub(crate) fn filters(&self) -> &[String] {
        &self.filters
    }

    /// Before the first connection.
    pub(crate) fn open(&mut self, config: &Config) {
        self.point_states.mark_all(Reason::NotConnected);
        self.point_states.flush();
        let brokers: Vec<_> = config.brokers.iter().map(ToString::to_string).collect();
        self.sink
            .report_link(LinkState::Connecting, &format!("{}: connecting", brokers.join(", ")));
    }

    /// Takes an event of the connection.
    pub(crate) fn note(&mut self, event: Event<'_>, now: Instant) {
        self.point_states.advance(now);
        match event {
            Event::Connected => {
                self.point_states.mark_all(Reason::NotConnected);
                self.topics.begin();
                self.fleet.begin();
            }
            Event::Message { topic, payload, is_retained } => {
                // The codec ends the connection at any other topic (MQTT 3.1.1, 1.5.3).
                let Ok(topic) = std::str::from_utf8(topic) else { return };
                self.handle(topic, Ok(payload), is_retained, now);
            }
            Event::Refused(index, why) => self.note_refused(index, why),
            Event::Subscribed => {
                self.fleet.note_subscribed(now);
                let broker = &self.broker;
                let text = match self.refused {
                    0 => format!("{broker}: connected"),
                    refused => format!(
                        "{broker}: connected; it refuses {refused} of {} topic filters: see the log",
                        self.filters.len()
                    ),
                };
                let basis = if self.topics.takes_retained_as_new() {
                    "; retained values without a time count as new (setting retained)"
                } else {
                    ""
                };
                self.sink.report_link(LinkState::Up, &format!("{text}{basis}"));
            }
            Event::TooLong { topic, bytes, is_retained } => {
                self.point_states.ignored.too_long += 1;
                let text = format!(
                    "a message of {bytes} bytes on '{topic}' was left out: raise \
                     max_payload_bytes, or send less"
                );
                self.point_states.tell(LogLevel::Warning, &text);
                self.handle(topic, Err(PayloadFault::TooLong(bytes)), is_retained, now);
            }
        }
    }

    fn handle(
        &mut self,
        topic: &str,
        payload: Result<&[u8], PayloadFault>,
        is_retained: bool,
        now: Instant,
    ) {
        let point_states = &mut self.point_states;
        if !self.fleet.handle(topic, payload.clone(), is_retained, now, point_states) {
            self.topics.handle(topic, payload.ok(), is_retained, point_states);
        }
    }

    /// Returns the next message to send: topic and payload.
    pub(crate) fn next_request(
        &mut self,
        now: Instant,
        wall_clock: fn() -> SystemTime,
    ) -> Option<(String, Vec<u8>)> {
        self.fleet.next_request(now, wall_clock)
    }

    /// Returns the time at which [`Subscriber::next_request`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.fleet.deadline()
    }

    /// Publishes all samples that have come.
    pub(crate) fn flush(&mut self) {
        self.point_states.flush();
    }

    /// Begins an attempt to connect to this broker.
    pub(crate) fn begin(&mut self, broker: &str) {
        broker.clone_into(&mut self.broker);
        self.refused = 0;
        self.point_states.begin(broker.to_owned());
    }

    /// Ends a connection that was lost or could not be made; all tags turn bad.
    pub(crate) fn end(&mut self, text: &str, is_last: bool) {
        self.point_states.mark_all(Reason::Communication);
        self.point_states.flush();
        self.point_states.log_ignored();
        let state = if is_last { LinkState::Down } else { LinkState::Connecting };
        self.sink.report_link(state, &format!("{}: {text}", self.broker));
    }

    fn note_refused(&mut self, index: usize, why: &str) {
        self.refused += 1;
        let Some(filter) = self.filters.get(index) else { return };
        self.point_states
            .tell(LogLevel::Error, &format!("topic filter '{filter}' is refused: {why}"));
        if index < self.topic_filters {
            for points in self.topics.under(filter) {
                self.point_states.mark(points, Reason::Configuration);
            }
        } else {
            self.fleet.refuse(index - self.topic_filters, &mut self.point_states);
        }
    }
}

#[cfg(test)]
#[path = "subscriber_tests.rs"]
mod tests;
