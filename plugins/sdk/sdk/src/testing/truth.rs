//! Truth oracle: judges at every instant whether a telemetry plugin calls a wrong or old
//! value good.

mod history;
mod shown_tag;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write;
use std::time::{Duration, Instant, SystemTime};

use self::history::{Evidence, TagHistory};
pub use self::shown_tag::ShownTag;
use super::Recorder;
use crate::{LinkState, SampleSink, TagSpec, Value};

/// Link reports in the report of a fault.
const MAX_TOLD_LINKS: usize = 6;
/// Time between two checks of the samples on the real clock.
const LOOK: Duration = Duration::from_millis(2);

/// Judge of a telemetry plugin against the truth of its device.
///
/// A test tells it the truth of each tag ([`TruthOracle::set_truth`]), each message that
/// tells it ([`TruthOracle::note_message`]), and each sign that something was sent which
/// cannot be understood ([`TruthOracle::note_sign`]). The plugin publishes into
/// [`TruthOracle::sink`]; the oracle applies the host's rules to these samples. From a
/// bound after each message or sign on, [`TruthOracle::check`] fails
///
/// - when a value is good that was not true at that message or later, or never,
/// - when a value is good that has stayed as it was through a sign,
/// - when a value is good that ceased to be true longer ago than the bound and the tag's
///   freshness limit.
///
/// [`TruthOracle::check_recovered`] fails when a tag is not good again once faults have
/// ended. Every failure tells seed, step, tag, truth and samples.
///
/// ```
/// use std::time::Duration;
/// use busbar_plugin_sdk::testing::{TruthOracle, tag_spec};
/// use busbar_plugin_sdk::{Reason, Sample, Value, ValueKind};
///
/// let tags = [tag_spec(1, "Oil", ValueKind::F64, "oil".into())];
/// let mut oracle = TruthOracle::new(42, Duration::from_millis(100), &tags);
/// let plugin = oracle.sink();
///
/// oracle.set_truth(1, Some(Value::F64(60.5)));
/// oracle.note_message(1);
/// plugin.publish(&[Sample::good(1, Value::F64(60.5))]);
/// oracle.advance(Duration::from_secs(1));
/// oracle.check();
///
/// // The next message cannot be understood: the value must not stay good.
/// oracle.set_truth(1, Some(Value::F64(98.0)));
/// oracle.note_sign([1], "message of 3 bytes");
/// oracle.advance(Duration::from_millis(100));
/// assert!(oracle.find_fault().is_some());
/// plugin.publish(&[Sample::bad(1, Reason::Communication)]);
/// oracle.check();
/// ```
pub struct TruthOracle {
    seed: u64,
    step: u64,
    /// Order of the last truth, message or sample.
    order: u64,
    bound: Duration,
    delay: Duration,
    clock: OracleClock,
    wall_start: SystemTime,
    recorder: Recorder,
    tags: BTreeMap<u32, TagHistory>,
    links: VecDeque<(Duration, LinkState, String)>,
    counts: TruthCounts,
}

/// Counts of an oracle, by which a test shows that it judged anything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TruthCounts {
    /// Number of tags judged.
    pub judged: u64,
    /// Number of tags judged that were good, and right.
    pub good: u64,
    /// Number of messages that could be understood.
    pub messages: u64,
    /// Number of messages that could not be understood.
    pub signs: u64,
}

/// Instant in the order of all that an oracle records, for messages that arrive later than they are
/// sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TruthMoment(u64);

/// Clock of an oracle.
enum OracleClock {
    /// Simulated clock, moved by the test.
    Simulated(Duration),
    /// Clock of the system, since this instant.
    Real(Instant),
}

impl TruthOracle {
    /// Creates an oracle on a simulated clock, for a plugin that reacts within `bound`; the seed is
    /// part of each fault's report.
    pub fn new(seed: u64, bound: Duration, tags: &[TagSpec]) -> Self {
        let tags = tags.iter().map(|spec| (spec.tag, TagHistory::new(spec))).collect();
        Self {
            seed,
            step: 0,
            order: 0,
            bound,
            delay: Duration::ZERO,
            clock: OracleClock::Simulated(Duration::ZERO),
            wall_start: SystemTime::now(),
            recorder: Recorder::new(),
            tags,
            links: VecDeque::new(),
            counts: TruthCounts::default(),
        }
    }

    /// Returns the oracle of messages that take up to this time on their way. A value that ceased
    /// to be true without a message may be good for so much longer.
    #[must_use]
    pub fn with_delay(self, delay: Duration) -> Self {
        Self { delay, ..self }
    }

    /// Returns the oracle on the system's clock, from now on: [`TruthOracle::advance`] waits.
    #[must_use]
    pub fn on_real_clock(self) -> Self {
        Self { clock: OracleClock::Real(Instant::now()), wall_start: SystemTime::now(), ..self }
    }

    /// Returns the sink that the plugin publishes into.
    pub fn sink(&self) -> SampleSink {
        self.recorder.sink()
    }

    /// Returns the time since the start.
    pub fn now(&self) -> Duration {
        match self.clock {
            OracleClock::Simulated(now) => now,
            OracleClock::Real(start) => start.elapsed(),
        }
    }

    /// Returns the time of the host's clock.
    pub fn wall_clock(&self) -> SystemTime {
        self.wall_start + self.now()
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> TruthCounts {
        self.counts
    }

    /// Sets the device's truth of a tag from now on. `None` where no value is true, for example
    /// while the device says that its sensor failed. The plugin does not know it before a message.
    pub fn set_truth(&mut self, tag: u32, value: Option<Value>) {
        self.take_samples();
        let (order, now) = self.tick();
        self.tag_mut(tag).set_truth(order, now, value);
    }

    /// Returns the truth of a tag.
    pub fn truth(&self, tag: u32) -> Option<Value> {
        self.tags.get(&tag).and_then(TagHistory::truth)
    }

    /// Returns the present instant, at which the last truths set so far hold.
    pub fn moment(&self) -> TruthMoment {
        TruthMoment(self.order + 1)
    }

    /// Records that a message which can be understood is sent now, with the present truth.
    pub fn note_message(&mut self, tag: u32) {
        self.note_late_message(tag, TruthMoment(u64::MAX));
    }

    /// Records that a message which can be understood arrives now, with the truth of the instant at
    /// which it was sent.
    pub fn note_late_message(&mut self, tag: u32, sent: TruthMoment) {
        self.take_samples();
        let (order, at) = self.tick();
        self.counts.messages += 1;
        self.tag_mut(tag).note(Evidence::new(order, sent.0, at, None));
    }

    /// Records that a message about these tags is sent now which cannot be understood: cut, too
    /// large, unknown, misassigned, or missing from a numbered sequence.
    pub fn note_sign(&mut self, tags: impl IntoIterator<Item = u32>, sign: &str) {
        self.note_late_sign(tags, sign, TruthMoment(u64::MAX));
    }

    /// Records that a message arrives now which cannot be understood, and was sent at an earlier
    /// instant.
    pub fn note_late_sign(
        &mut self,
        tags: impl IntoIterator<Item = u32>,
        sign: &str,
        sent: TruthMoment,
    ) {
        self.take_samples();
        self.counts.signs += 1;
        for tag in tags {
            let (order, at) = self.tick();
            self.tag_mut(tag).note(Evidence::new(order, sent.0, at, Some(sign)));
        }
    }

    /// Begins the next step after this time: moves the simulated clock, waits for the real one.
    pub fn advance(&mut self, duration: Duration) {
        self.step += 1;
        let end = self.now() + duration;
        match &mut self.clock {
            OracleClock::Simulated(now) => *now = end,
            OracleClock::Real(_) => {
                while self.now() < end {
                    std::thread::sleep(LOOK.min(end.saturating_sub(self.now())));
                    self.take_samples();
                }
            }
        }
        self.take_samples();
    }

    /// Returns the tag as the host shows it.
    ///
    /// # Panics
    /// When it is none of the oracle's.
    pub fn shown(&mut self, tag: u32) -> &ShownTag {
        self.take_samples();
        self.tag_mut(tag).shown()
    }

    /// Reports whether the tag is shown as good now.
    pub fn is_good(&mut self, tag: u32) -> bool {
        let now = self.wall_clock();
        self.shown(tag).quality(now).is_good()
    }

    /// Judges all tags now.
    ///
    /// # Panics
    /// With the story of a wrong or old value that is good.
    #[track_caller]
    pub fn check(&mut self) {
        if let Some(story) = self.find_fault() {
            panic!("{story}");
        }
    }

    /// Judges all tags now; returns the report of a wrong or old value that is good.
    pub fn find_fault(&mut self) -> Option<String> {
        self.take_samples();
        let (now, wall_clock) = (self.now(), self.wall_clock());
        let mut found = None;
        for (&tag, history) in &mut self.tags {
            self.counts.judged += 1;
            match history.find_fault(now, wall_clock, self.bound, self.delay) {
                Ok(is_good) => self.counts.good += u64::from(is_good),
                Err(fault) => found = found.or(Some((tag, fault))),
            }
        }
        found.map(|(tag, fault)| self.story(tag, &fault))
    }

    /// Judges whether every tag that has a truth is good again and shows it.
    ///
    /// # Panics
    /// With the story of one that does not: a dead end.
    #[track_caller]
    pub fn check_recovered(&mut self) {
        self.check();
        if let Some(story) = self.find_dead_end() {
            panic!("{story}");
        }
    }

    /// Waits, on the real clock, until every tag is good again; checks all the while.
    ///
    /// # Panics
    /// As [`TruthOracle::check_recovered`], after this time.
    #[track_caller]
    pub fn wait_recovered(&mut self, patience: Duration) {
        let end = self.now() + patience;
        while self.find_dead_end().is_some() && self.now() < end {
            self.advance(LOOK);
            self.check();
        }
        self.check_recovered();
    }

    fn find_dead_end(&mut self) -> Option<String> {
        self.take_samples();
        let wall_clock = self.wall_clock();
        let is_dead = |history: &TagHistory| {
            let (truth, shown) = (history.truth(), history.shown());
            let is_good = shown.quality(wall_clock).is_good();
            truth.is_some() && (!is_good || shown.value() != truth)
        };
        let (&tag, _) = self.tags.iter().find(|(_, history)| is_dead(history))?;
        Some(self.story(tag, "is not good again though faults have ended: a dead end"))
    }

    /// Writes the report of a fault: truths, messages and samples of the tag.
    fn story(&self, tag: u32, fault: &str) -> String {
        let (seed, step, now) = (self.seed, self.step, self.now());
        let mut story = format!("seed {seed}, step {step}, after {now:.3?}: tag {tag} ");
        if let Some(history) = self.tags.get(&tag) {
            history.tell(&mut story, fault, self.wall_clock(), self.bound);
        }
        for (at, state, message) in &self.links {
            _ = write!(story, "\n  {at:>12.3?}  link {state:?}: {message}");
        }
        story
    }

    fn take_samples(&mut self) {
        let recording = self.recorder.take();
        let now = self.now();
        let wall_clock = self.wall_start + now;
        for sample in recording.samples {
            self.order += 1;
            if let Some(history) = self.tags.get_mut(&sample.tag) {
                history.take(&sample, self.order, now, wall_clock);
            }
        }
        for (state, message) in recording.links {
            if self.links.len() == MAX_TOLD_LINKS {
                self.links.pop_front();
            }
            self.links.push_back((now, state, message));
        }
    }

    fn tick(&mut self) -> (u64, Duration) {
        self.order += 1;
        (self.order, self.now())
    }

    #[track_caller]
    fn tag_mut(&mut self, tag: u32) -> &mut TagHistory {
        match self.tags.get_mut(&tag) {
            Some(history) => history,
            None => panic!("the oracle knows no tag {tag}"),
        }
    }
}
