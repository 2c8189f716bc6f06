//! The samples of one isolated telemetry plugin, on the host's side.

use std::time::Duration;

use busbar_plugin_host::{
    LinkReport, LinkState, MAX_LINK_MESSAGE_BYTES, SampleCheck, SampleSink, TelemetryTag, shown,
    wall_clock,
};
use busbar_tags::{Backlog, Moment, Quality, Reason, Sample};

use crate::ring::RingReader;

/// Takes samples out of rings, checks them, and says so when the plugin is gone.
pub(crate) struct Feed {
    tags: Vec<TelemetryTag>,
    check: SampleCheck,
    ring: Option<RingReader>,
    /// What came before the ring there is now.
    backlog: Backlog<Sample>,
    link: (LinkState, String),
    longest_freshness: Duration,
    last_sample: Option<Moment>,
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
            backlog: Backlog::default(),
            link: Default::default(),
            longest_freshness: tags.iter().map(|tag| tag.freshness).max().unwrap_or_default(),
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

    /// Hands over the samples since the last call, the oldest first.
    #[inline(always)]
    pub(crate) fn drain(&mut self, sink: &mut impl SampleSink) {
        self.drain_backlog(sink);
        self.take_ring(sink);
    }

    #[inline(never)]
    fn drain_backlog(&mut self, sink: &mut impl SampleSink) {
        self.backlog.take().iter().for_each(|sample| sink.take(sample));
    }

    /// The plugin is gone: all its tags are bad until they get new values.
    pub(crate) fn lose(&mut self, reason: &str) {
        self.retire_ring();
        self.link = (LinkState::Down, reason.to_owned());
        let now = Moment::now();
        let lost = |tag: &TelemetryTag| Sample {
            tag: tag.tag,
            value: None,
            quality: Quality::Bad(Reason::Communication),
            source_time: None,
            received: now,
            valid_from: now,
        };
        self.tags.iter().map(lost).for_each(|sample| self.backlog.push(sample));
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
            silent_for: self.last_sample.map(|last| Moment::now().since(last)),
            longest_freshness: self.longest_freshness,
            rejected: self.rejected.saturating_add(ring.map_or(0, RingReader::rejected)),
            dropped: self
                .dropped
                .saturating_add(self.backlog.dropped())
                .saturating_add(ring.map_or(0, RingReader::dropped)),
        }
    }

    fn take_ring(&mut self, sink: &mut impl SampleSink) {
        let Self { ring: Some(ring), check, rejected, last_sample, .. } = self else { return };
        let (now, wall_clock) = (Moment::now(), wall_clock());
        ring.read(|raw| {
            // Nothing comes from the future.
            let received = raw.published.min(now);
            if check.take(&raw.sample, received, wall_clock, sink) {
                *last_sample = Some(received);
            } else {
                *rejected += 1;
            }
        });
    }

    /// Keeps what the ring still holds.
    fn retire_ring(&mut self) {
        let mut backlog = std::mem::take(&mut self.backlog);
        self.take_ring(&mut |sample: &Sample| backlog.push(*sample));
        self.backlog = backlog;
        if let Some(ring) = self.ring.take() {
            self.rejected = self.rejected.saturating_add(ring.rejected());
            self.dropped = self.dropped.saturating_add(ring.dropped());
        }
    }
}

#[cfg(test)]
mod tests {
    use busbar_plugin_abi::{BUSBAR_NO_TIME, BusbarSample};
    use busbar_tags::{TagHandle, Value, ValueKind};

    use super::*;
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

    fn drained(feed: &mut Feed) -> Vec<Sample> {
        let mut samples = Vec::new();
        feed.drain(&mut |sample: &Sample| samples.push(*sample));
        samples
    }

    #[test]
    fn samples_keep_the_time_at_which_they_were_published() {
        let (mut ring, mut feed) = feed();
        let published = Moment::now().before(Duration::from_secs(1));
        ring.write(&[sample(1, 4.5)], published);
        ring.write(&[sample(1, 5.5)], Moment::now().after(Duration::from_secs(60)));
        let samples = drained(&mut feed);
        assert_eq!(samples[0].value, Some(Value::F64(4.5)));
        assert_eq!(samples[0].received, published);
        assert!(samples[1].received <= Moment::now(), "nothing comes from the future");
    }

    #[test]
    fn what_the_plugin_must_not_send_is_counted_and_dropped() {
        let (mut ring, mut feed) = feed();
        let unknown_kind = BusbarSample { kind: 9, ..sample(1, 0.0) };
        let unknown_reason = BusbarSample { reason: 99, quality: 1, ..sample(1, 0.0) };
        ring.write(&[sample(0, 1.0), sample(7, 1.0), unknown_kind, unknown_reason], Moment(0));
        ring.reject(3);
        assert_eq!(drained(&mut feed), []);
        assert_eq!(feed.link().rejected, 7);
    }

    #[test]
    fn a_lost_plugin_makes_its_tags_bad_after_its_last_values() {
        let (mut ring, mut feed) = feed();
        ring.write(&[sample(1, 4.5)], Moment::now());
        feed.lose("killed by SIGSEGV");
        ring.write(&[sample(1, 6.5)], Moment::now());
        let samples = drained(&mut feed);
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].value, Some(Value::F64(4.5)));
        assert_eq!(samples[1].value, None);
        assert_eq!(samples[1].quality, Quality::Bad(Reason::Communication));
        assert_eq!(feed.link().state, LinkState::Down);
        assert_eq!(drained(&mut feed), []);
    }
}
