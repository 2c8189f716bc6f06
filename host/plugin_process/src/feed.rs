//! The samples of one isolated telemetry plugin, on the host's side.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_host::{
    LinkReport, LinkState, MAX_LINK_MESSAGE_BYTES, SampleCheck, TelemetryTag, shown,
};
use busbar_tags::{MAX_QUEUED_SAMPLES, Quality, Reason, Sample};

use crate::clock::Instants;
use crate::ring::RingReader;

/// Takes samples out of rings, checks them, and says so when the plugin is gone.
pub(crate) struct Feed {
    tags: Vec<TelemetryTag>,
    check: SampleCheck,
    ring: Option<RingReader>,
    /// What came before the ring there is now.
    backlog: VecDeque<Sample>,
    link: (LinkState, String),
    last_sample: Option<Instant>,
    /// Of the rings that are gone, and of the samples refused here.
    rejected: u64,
    dropped: u64,
}

impl Feed {
    /// A feed of these tags that reads nothing yet.
    pub(crate) fn new(tags: &[TelemetryTag]) -> Self {
        Self {
            tags: tags.to_vec(),
            check: SampleCheck::new(tags),
            ring: None,
            backlog: VecDeque::new(),
            link: Default::default(),
            last_sample: None,
            rejected: 0,
            dropped: 0,
        }
    }

    pub(crate) fn tags(&self) -> &[TelemetryTag] {
        &self.tags
    }

    /// Reads from this ring from now on.
    pub(crate) fn attach(&mut self, ring: RingReader) {
        self.retire_ring();
        self.ring = Some(ring);
        self.link = Default::default();
    }

    /// Samples since the last call, the oldest first.
    pub(crate) fn drain(&mut self) -> Vec<Sample> {
        let mut samples: Vec<Sample> = self.backlog.drain(..).collect();
        self.take_ring(&mut samples);
        samples
    }

    /// The plugin is gone: all its tags are bad until they get new values.
    pub(crate) fn lose(&mut self, reason: &str) {
        self.retire_ring();
        self.link = (LinkState::Down, reason.to_owned());
        let received = Instant::now();
        let lost = |tag: &TelemetryTag| Sample {
            tag: tag.tag,
            value: None,
            quality: Quality::Bad(Reason::Communication),
            source_time: None,
            lag: Duration::ZERO,
            received,
        };
        self.backlog.extend(self.tags.iter().map(lost));
    }

    /// What the plugin said of its link.
    pub(crate) fn note_link(&mut self, state: LinkState, message: &str) {
        self.link = (state, shown(message, MAX_LINK_MESSAGE_BYTES));
    }

    /// What came through, and how the link is.
    pub(crate) fn link(&self) -> LinkReport {
        let ring = self.ring.as_ref();
        LinkReport {
            state: self.link.0,
            message: self.link.1.clone(),
            silent_for: self.last_sample.map(|last| last.elapsed()),
            longest_freshness: self.tags.iter().map(|t| t.freshness).max().unwrap_or_default(),
            rejected: self.rejected.saturating_add(ring.map_or(0, RingReader::rejected)),
            dropped: self.dropped.saturating_add(ring.map_or(0, RingReader::dropped)),
        }
    }

    fn take_ring(&mut self, samples: &mut Vec<Sample>) {
        let Some(ring) = &mut self.ring else { return };
        let (instants, wall_clock) = (Instants::now(), SystemTime::now());
        let before = samples.len();
        let raw = ring.read();
        samples.extend(raw.iter().filter_map(|raw| {
            self.check.check(&raw.sample, instants.at(raw.monotonic_nanos), wall_clock)
        }));
        self.rejected += (raw.len() - (samples.len() - before)) as u64;
        if let Some(last) = samples[before..].last() {
            self.last_sample = Some(last.received);
        }
    }

    /// Keeps what the ring still holds, as much as a queue would.
    fn retire_ring(&mut self) {
        let mut last = Vec::new();
        self.take_ring(&mut last);
        self.backlog.extend(last);
        if let Some(ring) = self.ring.take() {
            self.rejected = self.rejected.saturating_add(ring.rejected());
            self.dropped = self.dropped.saturating_add(ring.dropped());
        }
        while self.backlog.len() > MAX_QUEUED_SAMPLES {
            self.backlog.pop_front();
            self.dropped += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use busbar_plugin_abi::{BUSBAR_NO_TIME, BusbarSample};
    use busbar_tags::{TagHandle, Value, ValueKind};

    use super::*;
    use crate::clock::monotonic_nanos;
    use crate::memory;
    use crate::ring::{RING_BYTES, RingWriter};

    fn feed() -> (RingWriter, Feed) {
        let tag = TelemetryTag {
            tag: TagHandle(1),
            kind: ValueKind::F64,
            freshness: Duration::from_secs(3),
            id: "T".into(),
            address_json: "{}".into(),
        };
        let memory = memory::zeroed("ring", RING_BYTES).unwrap();
        let mut feed = Feed::new(&[tag]);
        feed.attach(RingReader::new(&memory).unwrap());
        (RingWriter::new(&memory).unwrap(), feed)
    }

    fn sample(tag: u32, value: f64) -> BusbarSample {
        BusbarSample {
            tag,
            kind: 1,
            quality: 0,
            reason: 0,
            reserved: 0,
            value: value.to_bits(),
            source_time_unix_nanos: BUSBAR_NO_TIME,
        }
    }

    #[test]
    fn samples_keep_the_time_at_which_they_were_published() {
        let (mut ring, mut feed) = feed();
        let second = 1_000_000_000;
        ring.write(&[sample(1, 4.5)], monotonic_nanos() - second);
        ring.write(&[sample(1, 5.5)], monotonic_nanos() + 60 * second);
        let samples = feed.drain();
        assert_eq!(samples[0].value, Some(Value::F64(4.5)));
        assert!(samples[0].received.elapsed() >= Duration::from_secs(1));
        assert!(samples[1].received <= Instant::now(), "nothing comes from the future");
    }

    #[test]
    fn what_the_plugin_must_not_send_is_counted_and_dropped() {
        let (mut ring, mut feed) = feed();
        let unknown_kind = BusbarSample { kind: 9, ..sample(1, 0.0) };
        let unknown_reason = BusbarSample { reason: 99, quality: 1, ..sample(1, 0.0) };
        ring.write(&[sample(0, 1.0), sample(7, 1.0), unknown_kind, unknown_reason], 0);
        ring.reject(3);
        assert_eq!(feed.drain(), []);
        assert_eq!(feed.link().rejected, 7);
    }

    #[test]
    fn a_lost_plugin_makes_its_tags_bad_after_its_last_values() {
        let (mut ring, mut feed) = feed();
        ring.write(&[sample(1, 4.5)], monotonic_nanos());
        feed.lose("killed by SIGSEGV");
        ring.write(&[sample(1, 6.5)], monotonic_nanos());
        let samples = feed.drain();
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].value, Some(Value::F64(4.5)));
        assert_eq!(samples[1].value, None);
        assert_eq!(samples[1].quality, Quality::Bad(Reason::Communication));
        assert_eq!(feed.link().state, LinkState::Down);
        assert_eq!(feed.drain(), []);
    }
}
