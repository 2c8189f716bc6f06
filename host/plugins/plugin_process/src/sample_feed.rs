//! The samples of one isolated telemetry plugin, on the host's side.

use std::time::Duration;

use busbar_plugin_host::{
    LinkReport, LinkState, MAX_LINK_MESSAGE_BYTES, SampleIntake, SampleSink, SourcePolicy,
    TelemetryTag, shown, wall_clock,
};
use busbar_tags::{Backlog, Moment, Sample, SourceTime};
use busbar_types::{Origin, Quality, Reason};

use crate::ring::RingReader;
use crate::simulator_detection::{SimulatorCheck, SimulatorDetector};

/// Time after a pause of the plugin's process in which samples may be from before it, such as an
/// answer that waited in a socket.
const SETTLE_AFTER_PAUSE: Duration = Duration::from_secs(1);

/// Reader of a plugin's samples: takes them out of rings, validates them, and marks the tags of a
/// plugin that ended.
pub(crate) struct SampleFeed {
    tags: Vec<TelemetryTag>,
    intake: SampleIntake,
    ring: Option<RingReader>,
    /// Samples received before the current ring was attached.
    backlog: Backlog<Sample>,
    link: (LinkState, String),
    longest_freshness: Duration,
    last_sample: Option<Moment>,
    simulators: SimulatorDetector,
    /// Reception of the first value in the backlog.
    first_held: Option<Moment>,
    /// Rejected samples of earlier rings, and of the intake.
    rejected: u64,
    dropped: u64,
}

impl SampleFeed {
    /// A feed of these tags that reads nothing yet.
    pub(crate) fn new(tags: &[TelemetryTag], policy: SourcePolicy) -> Self {
        Self {
            tags: tags.to_vec(),
            intake: SampleIntake::new(tags, policy),
            ring: None,
            backlog: Backlog::default(),
            link: Default::default(),
            longest_freshness: tags.iter().map(|tag| tag.freshness).max().unwrap_or_default(),
            last_sample: None,
            simulators: SimulatorDetector::default(),
            first_held: None,
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
        self.simulators.note_new_link();
    }

    /// The check for a connection to a simulator, if it is due. The first samples of a link
    /// are held back for that.
    pub(crate) fn simulator_check(&mut self) -> Option<SimulatorCheck> {
        if self.simulators.awaits_samples() {
            self.hold_samples();
        }
        let first_sample = self.first_held;
        let is_due = self.simulators.is_due(first_sample.is_some());
        is_due.then_some(SimulatorCheck { first_sample })
    }

    /// Records the result of the check: samples from a simulator are marked, held ones included.
    pub(crate) fn note_simulator_check(&mut self, is_simulated: bool) {
        self.simulators.note_check(is_simulated, self.first_held.is_some());
        if is_simulated {
            self.intake.add_origin(Origin::SIMULATED);
            for sample in self.backlog.take() {
                self.backlog.push(Sample { origin: sample.origin | Origin::SIMULATED, ..sample });
            }
        }
    }

    /// Moves the samples in the ring into the backlog.
    fn hold_samples(&mut self) {
        let mut backlog = std::mem::take(&mut self.backlog);
        let mut first = self.first_held;
        self.take_ring(&mut |sample: &Sample| {
            // What says that there is no link comes from nowhere.
            if sample.value.is_some() {
                first = first.or(Some(sample.received));
            }
            backlog.push(sample.clone());
        });
        (self.backlog, self.first_held) = (backlog, first);
    }

    /// Hands over the samples since the last call, the oldest first.
    #[inline(always)]
    pub(crate) fn drain(&mut self, sink: &mut impl SampleSink) {
        self.drain_backlog(sink);
        self.take_ring(sink);
    }

    #[inline(never)]
    fn drain_backlog(&mut self, sink: &mut impl SampleSink) {
        self.first_held = None;
        self.backlog.take().iter().for_each(|sample| sink.take(sample));
    }

    /// Marks all tags bad after the end of the plugin, until new values arrive.
    pub(crate) fn lose(&mut self, reason: &str) {
        self.retire_ring();
        self.link = (LinkState::Down, reason.to_owned());
        let now = Moment::now();
        let lost = |tag: &TelemetryTag| {
            // Of its next process, only a value counts.
            Sample::live(tag.tag, None, Quality::Good, now)
                .with_doubt(Quality::Bad(Reason::Communication))
        };
        self.tags.iter().map(lost).for_each(|sample| self.backlog.push(sample));
    }

    /// Records the link state reported by the plugin.
    pub(crate) fn note_link(&mut self, state: LinkState, message: &str) {
        self.simulators.follow_link(state);
        self.link = (state, shown(message, MAX_LINK_MESSAGE_BYTES));
    }

    /// Time that the values are of, where that is not now.
    pub(crate) fn scene_time(&self) -> Option<SourceTime> {
        self.ring.as_ref().and_then(RingReader::scene_time)
    }

    /// Returns the link state with the counts of samples.
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
            clock: self.intake.clock_report(),
            origin: self.intake.origin(),
            scene_time: ring.and_then(RingReader::scene_time),
        }
    }

    fn take_ring(&mut self, sink: &mut impl SampleSink) {
        let Self { ring: Some(ring), intake, rejected, last_sample, .. } = self else { return };
        let (now, wall_clock) = (Moment::now(), wall_clock());
        intake.follow_clock(wall_clock, now);
        // Nothing takes back what the plugin once said of all its values.
        intake.add_origin(busbar_plugin_abi::origin_of_flags(ring.origin()));
        let mut unsettled = PauseFilter { sink, pause_end: Moment(0) };
        ring.read(|raw, pause_end| {
            // Nothing comes from the future.
            let received = raw.published.min(now);
            unsettled.pause_end = pause_end;
            if intake.take(&raw.sample, received, wall_clock, &mut unsettled) {
                *last_sample = Some(received);
            } else {
                *rejected += 1;
            }
        });
    }

    /// Keeps the samples in a ring that is replaced.
    fn retire_ring(&mut self) {
        self.hold_samples();
        if let Some(ring) = self.ring.take() {
            self.rejected = self.rejected.saturating_add(ring.rejected());
            self.dropped = self.dropped.saturating_add(ring.dropped());
        }
    }
}

/// Doubts values without a time of their own that came right after a pause of the
/// plugin's process.
struct PauseFilter<'a, S> {
    sink: &'a mut S,
    /// End of the last pause.
    pause_end: Moment,
}

impl<S: SampleSink> SampleSink for PauseFilter<'_, S> {
    #[inline(always)]
    fn take(&mut self, sample: &Sample) {
        let settled_from = self.pause_end.after(SETTLE_AFTER_PAUSE);
        if self.pause_end == Moment(0) || sample.received >= settled_from {
            return self.sink.take(sample);
        }
        let is_doubtful = sample.source_time.is_none() || sample.valid_from < self.pause_end;
        let doubt = if is_doubtful { Quality::Uncertain(Reason::Stale) } else { Quality::Good };
        self.sink.take(&match &sample.value {
            Some(_) => sample.clone().with_doubt(doubt),
            None => Sample { quality: sample.quality.worst(doubt), ..sample.clone() },
        });
    }
}

#[cfg(test)]
mod tests {
    use busbar_plugin_abi::BUSBAR_NO_TIME;
    use busbar_plugin_host::PublishedSample;
    use busbar_tags::TagHandle;
    use busbar_types::{Value, ValueKind};

    use super::*;
    use crate::memory;
    use crate::ring::{RING_BYTES, RingWriter};

    fn feed() -> (RingWriter, SampleFeed) {
        let tag = TelemetryTag {
            tag: TagHandle(1),
            kind: ValueKind::F64,
            freshness: Duration::from_secs(3),
            id: "T".into(),
            address_json: "{}".into(),
            unit: String::new(),
        };
        let memory = memory::zeroed("ring", RING_BYTES).unwrap();
        let mut feed = SampleFeed::new(&[tag], SourcePolicy::default());
        feed.attach(RingReader::new(&memory).unwrap());
        (RingWriter::new(&memory).unwrap(), feed)
    }

    fn sample(tag: u32, value: f64) -> PublishedSample {
        PublishedSample {
            tag,
            kind: 1,
            quality: 0,
            reason: 0,
            flags: 0,
            bits: value.to_bits(),
            source_time_unix_nanos: BUSBAR_NO_TIME,
            text: None,
        }
    }

    fn drained(feed: &mut SampleFeed) -> Vec<Sample> {
        let mut samples = Vec::new();
        feed.drain(&mut |sample: &Sample| samples.push(sample.clone()));
        samples
    }

    #[test]
    fn samples_keep_the_time_at_which_they_were_published() {
        let (mut ring, mut feed) = feed();
        let published = Moment::now().before(Duration::from_secs(1));
        ring.write([sample(1, 4.5)], published);
        ring.write([sample(1, 5.5)], Moment::now().after(Duration::from_secs(60)));
        let samples = drained(&mut feed);
        assert_eq!(samples[0].value, Some(Value::F64(4.5)));
        assert_eq!(samples[0].received, published);
        assert!(samples[1].received <= Moment::now(), "nothing comes from the future");
    }

    #[test]
    fn what_a_paused_process_had_received_before_is_doubted() {
        let (mut ring, mut feed) = feed();
        let pause_end = Moment::now().before(Duration::from_secs(2));
        ring.note_pause(pause_end);
        let soon = pause_end.after(Duration::from_millis(1));
        ring.write([sample(1, 1.0)], soon);
        ring.write([sample(1, 2.0)], pause_end.after(SETTLE_AFTER_PAUSE));
        let told: Vec<_> = drained(&mut feed).iter().map(|s| (s.quality, s.doubt)).collect();
        let doubt = Quality::Uncertain(Reason::Stale);
        assert_eq!(told, [(doubt, doubt), (Quality::Good, Quality::Good)]);
    }

    #[test]
    fn samples_of_a_simulator_are_marked_from_the_first_on() {
        let origins = |feed: &mut SampleFeed| -> Vec<Origin> {
            drained(feed).iter().map(|sample| sample.origin).collect()
        };
        let (mut ring, mut feed) = feed();
        assert!(feed.simulator_check().is_some(), "the first time");
        feed.note_simulator_check(false);
        assert!(feed.simulator_check().is_none(), "nothing came, and it was looked just now");
        let lost = PublishedSample { kind: 0, quality: 2, reason: 1, ..sample(1, 0.0) };
        ring.write([lost], Moment::now());
        assert!(feed.simulator_check().is_none(), "no value came");
        assert_eq!(origins(&mut feed), [Origin::LIVE]);
        ring.write([sample(1, 1.0)], Moment::now());
        assert!(feed.simulator_check().is_some(), "before the first value is shown");
        feed.note_simulator_check(false);
        assert_eq!(origins(&mut feed), [Origin::LIVE]);
        ring.write([sample(1, 2.0)], Moment::now());
        assert!(feed.simulator_check().is_none());
        assert_eq!(origins(&mut feed), [Origin::LIVE]);
        feed.note_link(LinkState::Up, "connected again");
        ring.write([sample(1, 3.0)], Moment::now());
        assert!(feed.simulator_check().is_some_and(|check| check.first_sample.is_some()));
        feed.note_simulator_check(true);
        ring.write([sample(1, 4.0)], Moment::now());
        assert_eq!(origins(&mut feed), [Origin::SIMULATED; 2]);
        assert_eq!(feed.link().origin, Origin::SIMULATED);
        feed.attach(RingReader::new(&memory::zeroed("ring", RING_BYTES).unwrap()).unwrap());
        assert!(feed.simulator_check().is_none());
        assert_eq!(feed.link().origin, Origin::SIMULATED, "also of its next process");
    }

    #[test]
    fn what_the_plugin_must_not_send_is_counted_and_dropped() {
        let (mut ring, mut feed) = feed();
        let unknown_kind = PublishedSample { kind: 9, ..sample(1, 0.0) };
        let unknown_reason = PublishedSample { reason: 99, quality: 1, ..sample(1, 0.0) };
        ring.write([sample(0, 1.0), sample(7, 1.0), unknown_kind, unknown_reason], Moment(0));
        ring.reject(3);
        assert_eq!(drained(&mut feed), []);
        assert_eq!(feed.link().rejected, 7);
    }

    #[test]
    fn a_lost_plugin_makes_its_tags_bad_after_its_last_values() {
        let (mut ring, mut feed) = feed();
        ring.write([sample(1, 4.5)], Moment::now());
        feed.lose("killed by SIGSEGV");
        ring.write([sample(1, 6.5)], Moment::now());
        let samples = drained(&mut feed);
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].value, Some(Value::F64(4.5)));
        assert_eq!(samples[1].value, None);
        assert_eq!(samples[1].quality, Quality::Bad(Reason::Communication));
        assert_eq!(samples[1].doubt, samples[1].quality, "a quality alone takes it not back");
        assert_eq!(feed.link().state, LinkState::Down);
        assert_eq!(drained(&mut feed), []);
    }
}
