//! The bounded queue between adapters and the tag table.

use std::collections::{HashMap, VecDeque};
use std::sync::{Mutex, PoisonError};

use crate::Sample;

/// Updates that a backlog holds before it thins itself out.
pub const MAX_QUEUED_SAMPLES: usize = 1 << 18;

/// An update of a tag, in whatever form it waits.
pub trait Update {
    /// The tag's handle.
    fn tag(&self) -> u32;

    /// Whether it carries a value; else it says something about quality alone.
    fn has_value(&self) -> bool;
}

/// Updates that wait, in order.
///
/// One that is never drained stays bounded and loses no tag: when it is full, every
/// tag keeps its last value and what was said of its quality after that; what came
/// before goes, and is counted.
#[derive(Clone, Debug)]
pub struct Backlog<U> {
    updates: VecDeque<U>,
    /// Thin out at this length: twice what the last time left, so that thinning costs
    /// no more than pushing.
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
        Self { updates: VecDeque::new(), thin_at: MAX_QUEUED_SAMPLES, dropped: 0 }
    }
}

impl<U: Update> Backlog<U> {
    /// Adds an update at the end.
    pub fn push(&mut self, update: U) {
        if self.updates.len() >= self.thin_at {
            self.thin_out();
        }
        self.updates.push_back(update);
    }

    /// Takes the oldest updates out, at most `count`.
    pub fn drain(&mut self, count: usize) -> impl Iterator<Item = U> {
        self.updates.drain(..count.min(self.updates.len()))
    }

    /// Takes everything out; the room it took is freed.
    pub fn take(&mut self) -> VecDeque<U> {
        self.thin_at = MAX_QUEUED_SAMPLES;
        std::mem::take(&mut self.updates)
    }

    /// Updates that wait.
    pub fn len(&self) -> usize {
        self.updates.len()
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.updates.is_empty()
    }

    /// Updates overtaken by later ones of their tags since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    fn thin_out(&mut self) {
        let before = self.updates.len();
        // What is known of each tag from its later updates.
        let mut known: HashMap<u32, Known> = HashMap::new();
        let mut kept = VecDeque::with_capacity(before / 2);
        for update in self.updates.drain(..).rev() {
            let known = known.entry(update.tag()).or_default();
            let wanted =
                if update.has_value() { !known.value } else { !known.value && !known.quality };
            known.value |= update.has_value();
            known.quality = true;
            if wanted {
                kept.push_front(update);
            }
        }
        self.dropped += (before - kept.len()) as u64;
        self.thin_at = MAX_QUEUED_SAMPLES.max(2 * kept.len());
        self.updates = kept;
    }
}

#[derive(Clone, Copy, Default)]
struct Known {
    value: bool,
    quality: bool,
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

    /// Takes everything queued, the oldest first.
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

    /// Tag, value, number.
    type Plain = (u32, Option<u32>, usize);

    impl Update for Plain {
        fn tag(&self) -> u32 {
            self.0
        }

        fn has_value(&self) -> bool {
            self.1.is_some()
        }
    }

    /// What a table knows in the end: each tag's last value, and the number of what
    /// was said last of its quality.
    fn outcome(updates: impl IntoIterator<Item = Plain>) -> BTreeMap<u32, (Option<u32>, usize)> {
        let mut table: BTreeMap<u32, (Option<u32>, usize)> = BTreeMap::new();
        for (tag, value, number) in updates {
            let state = table.entry(tag).or_default();
            *state = (value.or(state.0), number);
        }
        table
    }

    #[test]
    fn a_full_backlog_forgets_no_tag() {
        let mut backlog = Backlog::default();
        backlog.push((u32::MAX, Some(7), 0));
        let flood = (0..2 * MAX_QUEUED_SAMPLES).map(|i| (i as u32 % 3, Some(i as u32), i));
        flood.for_each(|update| backlog.push(update));
        assert!(backlog.len() <= MAX_QUEUED_SAMPLES);
        assert_eq!(backlog.dropped() as usize + backlog.len(), 2 * MAX_QUEUED_SAMPLES + 1);
        assert_eq!(backlog.take()[0], (u32::MAX, Some(7), 0), "the only update of its tag");
    }

    #[test]
    fn more_tags_than_room_are_kept_within_twice_their_number() {
        let mut backlog = Backlog::default();
        let tags = 2 * MAX_QUEUED_SAMPLES as u32;
        for round in 0..5 {
            (0..tags).for_each(|tag| backlog.push((tag, Some(round), 0)));
            assert!(backlog.len() <= 2 * tags as usize);
        }
        let left = outcome(backlog.take());
        assert_eq!(left.len(), tags as usize);
        assert!(left.values().all(|state| state.0 == Some(4)));
    }

    proptest! {
        #[test]
        fn thinning_out_changes_no_outcome_and_no_order(
            updates in prop::collection::vec((0..5_u32, prop::option::of(0..9_u32)), 0..60)
        ) {
            let updates: Vec<Plain> =
                updates.into_iter().zip(0..).map(|((tag, value), i)| (tag, value, i)).collect();
            let mut backlog = Backlog::default();
            updates.iter().for_each(|&update| backlog.push(update));
            backlog.thin_out();
            let kept: Vec<Plain> = backlog.take().into();
            prop_assert!(kept.is_sorted_by_key(|update| update.2));
            prop_assert!(kept.len() <= 10);
            prop_assert_eq!(outcome(kept), outcome(updates));
        }
    }
}
