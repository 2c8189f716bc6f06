//! Test oracle of a tag's state, from nothing but what was sent and when.
//!
//! No claim is made where a sample may or may not have arrived. All claims follow from one promise.
//! A value is not good past its freshness limit, with bad quality, as no number, or from a plugin
//! that is dead or stopped.

use crate::script::{STEP_MILLIS, Said, Script, Sent, Worth};

/// Freshness limit of a value, milliseconds.
pub(crate) const FRESHNESS_MILLIS: u64 = 300;
/// Time that a value must stay good after a frame for the frame to be claimed good, nanoseconds.
const MARGIN_NANOS: i64 = 50_000_000;
/// Samples of a tag that are looked at: those before have gone stale.
const MAX_SAMPLES: usize = 64;
const MILLI: i64 = 1_000_000;

/// State of a tag that a picture must show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Claim {
    /// The tag must not look good.
    NotGood,
    /// The tag must look good and show this value.
    Good(bool),
    /// Nothing can be said.
    Nothing,
}

/// When a frame began and ended, nanoseconds since 1970.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Times {
    pub(crate) began: i64,
    pub(crate) ended: i64,
}

#[derive(Clone, Copy, PartialEq)]
enum Arrival {
    /// Unknown arrival: the batch may still be on its way.
    Unknown,
    /// Arrival before this time, or loss; nanoseconds since 1970.
    Lost(i64),
    /// Certain arrival, before this time, nanoseconds since 1970.
    Before(i64),
}

/// ExpectedState that knows the sent samples and their arrivals.
pub(crate) struct ExpectedState {
    script: Script,
    start: i64,
    /// Arrival of each batch, by its index.
    arrivals: Vec<Arrival>,
    /// Batches up to here are no longer unknown.
    known: usize,
    first: usize,
    /// When the plugin was last disturbed.
    disturbed: i64,
}

impl ExpectedState {
    pub(crate) fn new(script: Script, start_unix_millis: u64) -> Self {
        let last = script.tags.iter().filter_map(|sent| sent.last());
        let batches = last.map(|sent| sent.batch + 1).max().unwrap_or(0);
        let start = start_unix_millis as i64 * MILLI;
        let arrivals = vec![Arrival::Unknown; batches];
        Self { script, start, arrivals, known: 0, first: 0, disturbed: 0 }
    }

    /// Notes that the plugin was stopped, started or killed.
    pub(crate) fn note_disturbance(&mut self, now: i64) {
        self.disturbed = now;
    }

    /// Notes that batches from `first` on and before `sent` have arrived, as a frame showed.
    pub(crate) fn note_progress(&mut self, first: usize, sent: usize, times: Times) {
        if first > self.first {
            // Those before were lost with the process, or came before that.
            self.first = first;
            self.settle(first, Arrival::Lost(times.ended));
        }
        self.settle(sent, Arrival::Before(times.ended));
    }

    fn settle(&mut self, until: usize, arrival: Arrival) {
        let until = until.min(self.arrivals.len());
        if self.known < until {
            self.arrivals[self.known..until].fill(arrival);
            self.known = until;
        }
    }

    /// Returns the claim that a frame must satisfy for a tag.
    pub(crate) fn claim(&self, tag: usize, times: Times) -> Claim {
        let sent = &self.script.tags[tag];
        let begun = sent.partition_point(|sent| self.due(sent) <= times.ended);
        let possible = &sent[begun.saturating_sub(MAX_SAMPLES)..begun];
        let may_be_fresh = possible
            .iter()
            .any(|sent| matches!(sent.said, Said::Value(_)) && !self.is_stale(sent, times.began));
        if !may_be_fresh {
            return Claim::NotGood;
        }
        let is_certain = |sent: &Sent| matches!(self.arrivals[sent.batch], Arrival::Before(_));
        let Some(last) = possible.iter().rposition(is_certain) else { return Claim::Nothing };
        let (before, after) = (&possible[..last], &possible[last + 1..]);
        let last = &possible[last];
        let may_be_good = after.iter().any(Sent::may_be_good);
        // Out of a buffer, a time that is not believed may have it passed over.
        let is_told = last.worth != Worth::Good || !last.is_buffered;
        let may_be_number = after.iter().any(|sent| matches!(sent.said, Said::Value(_)));
        match last.said {
            // Bad quality is never passed over as old.
            _ if !last.may_be_good() && is_told && !may_be_good => Claim::NotGood,
            _ if !self.is_taken(last, before) => Claim::Nothing,
            Said::NotANumber if !may_be_number => Claim::NotGood,
            // A quality alone takes back no doubt about the value before it.
            Said::Nothing if !may_be_number && self.is_value_doubted(before) => Claim::NotGood,
            Said::Value(value) if self.stays_good(last, before, times) && after.is_empty() => {
                Claim::Good(value)
            }
            _ => Claim::Nothing,
        }
    }

    /// Returns the last samples of a tag. Each has its age and that of its known arrival at the
    /// frame's beginning, milliseconds.
    pub(crate) fn last_sent(&self, tag: usize, times: Times) -> Vec<(i64, Option<i64>, Sent)> {
        let sent = &self.script.tags[tag];
        let begun = sent.partition_point(|sent| self.due(sent) <= times.ended);
        let ago = |time: i64| (times.began - time) / MILLI;
        let told = |sent: &Sent| {
            let arrival = match self.arrivals[sent.batch] {
                Arrival::Unknown => None,
                Arrival::Lost(time) | Arrival::Before(time) => Some(ago(time)),
            };
            (ago(self.due(sent)), arrival, *sent)
        };
        sent[begun.saturating_sub(6)..begun].iter().map(told).collect()
    }

    fn due(&self, sent: &Sent) -> i64 {
        self.start + (sent.batch as u64 * STEP_MILLIS) as i64 * MILLI
    }

    /// Returns the source time of a sample; none where it has none or one in the future.
    fn source_time(&self, sent: &Sent) -> Option<i64> {
        sent.age.filter(|&age| age >= 0).map(|age| self.due(sent) - age * MILLI)
    }

    /// Reports whether the value of a sample is certainly older than the freshness limit.
    fn is_stale(&self, sent: &Sent, now: i64) -> bool {
        let of_arrival = match self.arrivals[sent.batch] {
            Arrival::Unknown => None,
            Arrival::Lost(before) | Arrival::Before(before) => Some(before),
        };
        let since = [self.source_time(sent), of_arrival].into_iter().flatten().min();
        since.is_some_and(|since| since + FRESHNESS_MILLIS as i64 * MILLI < now)
    }

    /// Reports whether a sample that came was surely not passed over for being older than another:
    /// one out of a buffer may be. All others count in order of arrival.
    fn is_taken(&self, sent: &Sent, before: &[Sent]) -> bool {
        let Some(age) = sent.age.filter(|_| sent.is_buffered) else { return true };
        let time = |sent: &Sent, age: i64| self.due(sent) - age * MILLI;
        let is_older = |other: &Sent| time(other, other.age.unwrap_or(0)) <= time(sent, age);
        sent.said == Said::Nothing || before.iter().all(is_older)
    }

    /// Reports whether the last value of these samples surely counts and has a time that is not
    /// believed, or is no number.
    fn is_value_doubted(&self, samples: &[Sent]) -> bool {
        let last = samples.iter().rposition(|sent| sent.said != Said::Nothing);
        last.is_some_and(|last| {
            let (before, last) = (&samples[..last], &samples[last]);
            matches!(self.arrivals[last.batch], Arrival::Before(_))
                && self.is_taken(last, before)
                && (!last.is_time_believed() || last.said == Said::NotANumber)
        })
    }

    fn stays_good(&self, sent: &Sent, before: &[Sent], times: Times) -> bool {
        // The first time of a tag is in doubt where the source's clock has been ahead.
        let has_time = |other: &Sent| other.age.is_some() && self.disturbed < self.due(other);
        let is_proven = before.iter().any(has_time);
        let since = self.source_time(sent).unwrap_or(self.due(sent));
        sent.may_be_good()
            && sent.age.is_none_or(|age| age >= 0 && is_proven)
            && since + FRESHNESS_MILLIS as i64 * MILLI > times.ended + MARGIN_NANOS
            && self.disturbed < self.due(sent)
    }
}
