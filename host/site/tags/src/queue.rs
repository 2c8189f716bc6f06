//! The bounded queue between adapters and the tag table.

use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, PoisonError};

use crate::Sample;
use busbar_types::{Quality, Text, Value};

/// Updates that a backlog holds before it thins itself out; a text counts by its length.
pub const MAX_QUEUED_SAMPLES: usize = 1 << 18;

/// Queued update of a tag, in any representation.
pub trait Update {
    /// Returns the tag's handle.
    fn tag(&self) -> u32;

    /// Reports whether the update has a value; otherwise it has a quality alone.
    fn has_value(&self) -> bool;

    /// Reports whether its quality is good.
    fn is_good(&self) -> bool;

    /// Time at the source, nanoseconds since 1970-01-01 UTC, if it has a usable one.
    fn source_nanos(&self) -> Option<i64>;

    /// The same of an update with a value that comes out of a buffer, so that this time
    /// orders it; `None` for one that counts in order of arrival.
    fn buffered_time(&self) -> Option<i64>;

    /// Returns the number of updates that it counts for, by its memory.
    fn weight(&self) -> usize {
        1
    }

    /// Returns the host's doubt about the value; good where the host has not judged it yet.
    fn doubt(&self) -> Quality {
        Quality::Good
    }

    /// Adds the doubt of an earlier update without a value, which this one replaces. A value
    /// of its own is too old to count, and goes.
    fn add_doubt(&mut self, _doubt: Quality) {}
}

impl Update for Sample {
    fn tag(&self) -> u32 {
        self.tag.0
    }

    fn has_value(&self) -> bool {
        self.value.is_some()
    }

    fn is_good(&self) -> bool {
        self.quality.is_good()
    }

    fn buffered_time(&self) -> Option<i64> {
        self.is_buffered.then_some(self.source_time?.0)
    }

    fn source_nanos(&self) -> Option<i64> {
        self.source_time.map(|time| time.0)
    }

    fn weight(&self) -> usize {
        text_weight(match &self.value {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        })
    }

    fn doubt(&self) -> Quality {
        self.doubt
    }

    fn add_doubt(&mut self, doubt: Quality) {
        let own = if self.value.is_none() { self.doubt } else { Quality::Good };
        let last = Self { value: None, ..self.clone() };
        *self = Self { doubt: own, ..last }.with_doubt(doubt);
    }
}

/// Bytes of a text that count for one update.
const BYTES_AN_UPDATE: usize = 32;

/// Returns the number of updates that one with this text counts for.
#[inline]
fn text_weight(text: Option<&Text>) -> usize {
    1 + text.map_or(0, |text| text.as_str().len()).div_ceil(BYTES_AN_UPDATE)
}

/// Updates that wait, in order.
///
/// One that is never drained stays bounded and loses no tag: when it is full, every
/// tag keeps its last value, what is newer out of a buffer, and what was said of its
/// quality after each; what came before goes, and is counted.
#[derive(Clone, Debug)]
pub struct Backlog<U> {
    updates: VecDeque<U>,
    /// Sum of the weights of the updates.
    weight: usize,
    /// Weight at which the backlog coalesces: a multiple of its weight after the last time, so
    /// that the cost is linear in pushes.
    thin_at: usize,
    dropped: u64,
}

/// A [`Backlog`] that adapters' threads fill and the frame drains. One a plugin, so
/// that a flooding plugin loses its own updates only.
#[derive(Debug, Default)]
pub struct SampleQueue {
    backlog: Mutex<Backlog<Sample>>,
}

impl<U> Default for Backlog<U> {
    fn default() -> Self {
        Self { updates: VecDeque::new(), weight: 0, thin_at: MAX_QUEUED_SAMPLES, dropped: 0 }
    }
}

impl<U: Update> Backlog<U> {
    /// Adds an update at the end.
    pub fn push(&mut self, update: U) {
        if self.weight >= self.thin_at {
            self.coalesce();
        }
        self.weight += update.weight();
        self.updates.push_back(update);
    }

    /// Removes and returns the oldest updates, at most `count`.
    pub fn drain(&mut self, count: usize) -> impl Iterator<Item = U> {
        let count = count.min(self.updates.len());
        self.weight -= self.updates.range(..count).map(Update::weight).sum::<usize>();
        self.updates.drain(..count)
    }

    /// Iterates over the updates, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &U> {
        self.updates.iter()
    }

    /// Removes and returns all updates, with their memory.
    pub fn take(&mut self) -> VecDeque<U> {
        (self.weight, self.thin_at) = (0, MAX_QUEUED_SAMPLES);
        std::mem::take(&mut self.updates)
    }

    /// Returns the number of updates.
    pub fn len(&self) -> usize {
        self.updates.len()
    }

    /// Reports whether there are no updates.
    pub fn is_empty(&self) -> bool {
        self.updates.is_empty()
    }

    /// Updates overtaken by later ones of their tags since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    fn coalesce(&mut self) {
        let before = self.updates.len();
        let mut known: HashMap<u32, RetainedUpdates> = HashMap::new();
        for index in 0..before {
            let update = &self.updates[index];
            let replaced = known.entry(update.tag()).or_default().observe(index, update);
            if let Some(ReplacedQuality { earlier, later }) = replaced {
                let earlier = &self.updates[earlier];
                let doubt = if earlier.has_value() { Quality::Good } else { earlier.doubt() };
                if !doubt.is_good() {
                    self.updates[later].add_doubt(doubt);
                }
            }
        }
        let mut is_kept = vec![false; before];
        let kept = known.values().flat_map(RetainedUpdates::indices);
        kept.for_each(|index| is_kept[index] = true);
        let mut is_kept = is_kept.into_iter();
        let mut kept = VecDeque::with_capacity(before / 2);
        kept.extend(self.updates.drain(..).filter(|_| is_kept.next() == Some(true)));
        self.dropped += (before - kept.len()) as u64;
        self.weight = kept.iter().map(Update::weight).sum();
        self.thin_at = MAX_QUEUED_SAMPLES.max(MAX_KEPT_A_TAG * self.weight);
        self.updates = kept;
    }
}

/// Updates that a tag keeps at most when a backlog thins itself out.
const MAX_KEPT_A_TAG: usize = 4;

/// Indices of the updates of one tag that decide its final state.
#[derive(Clone, Copy, Default)]
struct RetainedUpdates {
    /// The last value that counts by its arrival, and its source time.
    live: Option<(usize, Option<i64>)>,
    /// Last quality without a value after `live` and before `buffered`.
    quality_before: Option<usize>,
    /// Newest buffered value after `live`, by its source time.
    buffered: Option<BufferedUpdate>,
    /// Last quality without a value after `buffered`.
    quality_after: Option<usize>,
}

/// Value out of a buffer that a tag keeps.
#[derive(Clone, Copy)]
struct BufferedUpdate {
    index: usize,
    /// Source time, nanoseconds since 1970.
    time: i64,
    is_good: bool,
}

/// A quality without a value that gives way to a later one, whose doubt stays.
#[derive(Clone, Copy)]
struct ReplacedQuality {
    earlier: usize,
    later: usize,
}

impl RetainedUpdates {
    /// Takes in the next update of the tag. Returns the quality that goes for it.
    fn observe(&mut self, index: usize, update: &impl Update) -> Option<ReplacedQuality> {
        if !update.has_value() {
            return self.note_quality(index);
        }
        let Some(time) = update.buffered_time() else {
            *self = Self { live: Some((index, update.source_nanos())), ..Self::default() };
            return None;
        };
        let live_time = self.live.and_then(|(_, time)| time);
        let newest = self.buffered.map(|buffered| buffered.time).max(live_time);
        if newest.is_none_or(|newest| time >= newest) {
            // One that is not good says so of the quality even where it is too old to count.
            let said = self.buffered.filter(|buffered| !buffered.is_good).map(|held| held.index);
            let last = self.quality_after.or(said);
            let qualities = self.quality_before.zip(last);
            let replaced = qualities.map(|(earlier, later)| ReplacedQuality { earlier, later });
            let quality_before = last.or(self.quality_before);
            *self = Self {
                quality_before,
                buffered: Some(BufferedUpdate { index, time, is_good: update.is_good() }),
                quality_after: None,
                ..*self
            };
            replaced
        } else if !update.is_good() {
            self.note_quality(index)
        } else {
            None
        }
    }

    fn note_quality(&mut self, index: usize) -> Option<ReplacedQuality> {
        let last = match self.buffered {
            Some(_) => &mut self.quality_after,
            None => &mut self.quality_before,
        };
        last.replace(index).map(|earlier| ReplacedQuality { earlier, later: index })
    }

    fn indices(&self) -> impl Iterator<Item = usize> {
        let (live, buffered) = (self.live.map(|(i, _)| i), self.buffered.map(|held| held.index));
        [live, self.quality_before, buffered, self.quality_after].into_iter().flatten()
    }
}

impl SampleQueue {
    /// Adds a batch without waiting for room; returns how many updates it has.
    pub fn publish(&self, batch: impl IntoIterator<Item = Sample>) -> usize {
        self.with(|backlog| {
            let mut added = 0;
            for sample in batch {
                backlog.push(sample);
                added += 1;
            }
            added
        })
    }

    /// Removes and returns all updates, the oldest first.
    pub fn drain(&self) -> VecDeque<Sample> {
        self.with(Backlog::take)
    }

    /// Updates overtaken by later ones of their tags since the start.
    pub fn dropped(&self) -> u64 {
        self.with(|backlog| backlog.dropped())
    }

    fn with<T>(&self, act: impl FnOnce(&mut Backlog<Sample>) -> T) -> T {
        act(&mut self.backlog.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;
    use busbar_types::Reason;

    #[derive(Clone, Copy, Debug, PartialEq)]
    struct TestUpdate {
        tag: u32,
        value: Option<u32>,
        is_good: bool,
        is_doubted: bool,
        time: Option<i64>,
        is_buffered: bool,
        number: usize,
    }

    impl Update for TestUpdate {
        fn tag(&self) -> u32 {
            self.tag
        }

        fn has_value(&self) -> bool {
            self.value.is_some()
        }

        fn is_good(&self) -> bool {
            self.is_good
        }

        fn source_nanos(&self) -> Option<i64> {
            self.time
        }

        fn buffered_time(&self) -> Option<i64> {
            self.time.filter(|_| self.is_buffered)
        }

        fn doubt(&self) -> Quality {
            let doubt = Quality::Uncertain(Reason::SourceTime);
            if self.is_doubted { doubt } else { Quality::Good }
        }

        fn add_doubt(&mut self, doubt: Quality) {
            let is_doubted = self.value.is_none() && self.is_doubted;
            (self.value, self.is_doubted) = (None, is_doubted || !doubt.is_good());
        }
    }

    impl TestUpdate {
        /// A doubt makes the quality no better, as the intake has it.
        fn with_consistent_quality(self) -> Self {
            Self { is_good: self.is_good && !self.is_doubted, ..self }
        }
    }

    fn live(tag: u32, value: u32, number: usize) -> TestUpdate {
        TestUpdate {
            tag,
            value: Some(value),
            is_good: true,
            is_doubted: false,
            time: None,
            is_buffered: false,
            number,
        }
    }

    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    struct State {
        value: Option<u32>,
        time: Option<i64>,
        /// Number of the last update of quality.
        said: usize,
        is_doubted: bool,
    }

    /// Returns the final state of the tags, by the rules of a table.
    fn outcome(
        start: State,
        updates: impl IntoIterator<Item = TestUpdate>,
    ) -> BTreeMap<u32, State> {
        let mut table: BTreeMap<u32, State> = BTreeMap::new();
        for update in updates {
            let state = table.entry(update.tag).or_insert(start);
            let is_old = update.buffered_time().is_some_and(|time| Some(time) < state.time);
            match update.value {
                Some(_) if is_old && update.is_good => {}
                Some(value) if !is_old => {
                    *state = State {
                        value: Some(value),
                        time: update.time,
                        said: update.number,
                        is_doubted: update.is_doubted,
                    };
                }
                value => {
                    state.said = update.number;
                    state.is_doubted |= value.is_none() && update.is_doubted;
                }
            }
        }
        table
    }

    #[test]
    fn a_full_backlog_forgets_no_tag() {
        let mut backlog = Backlog::default();
        backlog.push(live(u32::MAX, 7, 0));
        let flood = (0..2 * MAX_QUEUED_SAMPLES).map(|i| live(i as u32 % 3, i as u32, i));
        flood.for_each(|update| backlog.push(update));
        assert!(backlog.len() <= MAX_QUEUED_SAMPLES);
        assert_eq!(backlog.dropped() as usize + backlog.len(), 2 * MAX_QUEUED_SAMPLES + 1);
        assert_eq!(backlog.take()[0], live(u32::MAX, 7, 0), "the only update of its tag");
    }

    #[test]
    fn texts_count_by_their_length() {
        let text = |number: usize| Sample {
            value: Some(Value::Text(Text::cut(&format!("{number:0255}")))),
            ..Sample::live(crate::TagHandle(1), None, Quality::Good, crate::Moment(0))
        };
        assert_eq!(text(0).weight(), 9);
        let mut backlog = Backlog::default();
        (0..MAX_QUEUED_SAMPLES / 4).for_each(|number| backlog.push(text(number)));
        assert!(backlog.len() <= MAX_QUEUED_SAMPLES / 9 + 1, "{}", backlog.len());
        let last = backlog.take().pop_back().unwrap();
        assert_eq!(last.value, text(MAX_QUEUED_SAMPLES / 4 - 1).value);
    }

    #[test]
    fn more_tags_than_room_are_kept_within_twice_their_number() {
        let mut backlog = Backlog::default();
        let tags = 2 * MAX_QUEUED_SAMPLES as u32;
        for round in 0..5 {
            (0..tags).for_each(|tag| backlog.push(live(tag, round, 0)));
            assert!(backlog.len() <= MAX_KEPT_A_TAG * tags as usize);
        }
        let left = outcome(State::default(), backlog.take());
        assert_eq!(left.len(), tags as usize);
        assert!(left.values().all(|state| state.value == Some(4)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn thinning_out_changes_no_outcome_and_no_order(
            updates in prop::collection::vec(
                (0..3_u32, prop::option::of(0..9_u32), any::<bool>(), prop::option::of(0..6_i64),
                 any::<bool>(), any::<bool>()),
                0..60,
            ),
            known in prop::option::of((0..9_u32, prop::option::of(0..6_i64))),
        ) {
            let plain = |(update, number)| {
                let (tag, value, is_good, time, is_buffered, is_doubted) = update;
                TestUpdate { tag, value, is_good, is_doubted, time, is_buffered, number }.with_consistent_quality()
            };
            let updates: Vec<TestUpdate> = updates.into_iter().zip(1..).map(plain).collect();
            let start = known.map_or(State::default(), |(value, time)| {
                State { value: Some(value), time, said: 0, is_doubted: false }
            });
            let mut backlog = Backlog::default();
            updates.iter().for_each(|&update| backlog.push(update));
            backlog.coalesce();
            let kept: Vec<TestUpdate> = backlog.take().into();
            prop_assert!(kept.is_sorted_by_key(|update| update.number));
            prop_assert!(kept.len() <= 3 * MAX_KEPT_A_TAG);
            prop_assert_eq!(outcome(start, kept), outcome(start, updates));
        }
    }
}
