//! Timing wheel of staleness deadlines (G. Varghese and A. Lauck, "Hashed and Hierarchical Timing
//! Wheels", SOSP 1987). A frame visits only the tags whose deadline may have passed.

use crate::Moment;

/// Width of a slot, as a power of two of nanoseconds: some 17 ms, about a frame.
const SLOT_BITS: u32 = 24;
/// Number of slots, some 68 s; a later deadline waits in the last slot and is inserted again when
/// that is due.
const SLOTS: u64 = 4096;

/// The number of a slot, counted since boot.
pub(crate) type Slot = u64;
/// Mark of an entry that is in no slot.
pub(crate) const NO_SLOT: Slot = Slot::MAX;

/// Tags by the slot of their deadline.
#[derive(Debug)]
pub(crate) struct TimingWheel {
    slots: Vec<Vec<u32>>,
    /// The first slot that may hold something.
    first: Slot,
}

impl TimingWheel {
    /// An empty wheel for deadlines from `now` on.
    pub(crate) fn new(now: Moment) -> Self {
        Self { slots: vec![Vec::new(); SLOTS as usize], first: now.0 >> SLOT_BITS }
    }

    /// The slot in which a deadline waits now.
    #[inline]
    pub(crate) fn slot_of(&self, deadline: Moment) -> Slot {
        (deadline.0 >> SLOT_BITS).clamp(self.first, self.first + SLOTS - 1)
    }

    /// Inserts a tag into a slot that [`Self::slot_of`] returned.
    pub(crate) fn put(&mut self, tag: u32, slot: Slot) {
        self.slots[(slot % SLOTS) as usize].push(tag);
    }

    /// Returns the number of entries.
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.slots.iter().map(Vec::len).sum()
    }

    /// Removes the entries that may be due at `now`, slot by slot. The slot of `now` itself is
    /// among them: entries that are not due yet must be inserted again.
    pub(crate) fn take_due(&mut self, now: Moment) -> Vec<(Slot, Vec<u32>)> {
        let last = (now.0 >> SLOT_BITS).max(self.first);
        let full = self.first..=last.min(self.first + SLOTS - 1);
        let due = full.filter_map(|slot| {
            // Taken, not emptied: a slot that was once full keeps no memory.
            let tags = std::mem::take(&mut self.slots[(slot % SLOTS) as usize]);
            (!tags.is_empty()).then_some((slot, tags))
        });
        let due = due.collect();
        self.first = last;
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLOT: u64 = 1 << SLOT_BITS;

    fn put(wheel: &mut TimingWheel, tag: u32, deadline: u64) {
        let slot = wheel.slot_of(Moment(deadline));
        wheel.put(tag, slot);
    }

    fn take(wheel: &mut TimingWheel, now: u64) -> Vec<u32> {
        wheel.take_due(Moment(now)).into_iter().flat_map(|(_, tags)| tags).collect()
    }

    #[test]
    fn tags_come_out_when_their_time_has_come() {
        let mut wheel = TimingWheel::new(Moment(10 * SLOT));
        put(&mut wheel, 1, 0);
        put(&mut wheel, 2, 12 * SLOT + 5);
        put(&mut wheel, 3, 13 * SLOT);
        assert_eq!(take(&mut wheel, 10 * SLOT), [1], "what is late already is due now");
        assert!(take(&mut wheel, 12 * SLOT - 1).is_empty());
        assert_eq!(take(&mut wheel, 12 * SLOT), [2], "of a slot that has begun");
        assert_eq!(take(&mut wheel, 14 * SLOT), [3]);
        assert!(take(&mut wheel, 5 * SLOT).is_empty(), "time that goes back is no time");
    }

    #[test]
    fn after_any_leap_each_tag_comes_out_once() {
        let mut wheel = TimingWheel::new(Moment(0));
        (0..3 * SLOTS as u32).for_each(|tag| put(&mut wheel, tag, u64::from(tag) * SLOT));
        let mut all = take(&mut wheel, u64::MAX / 2);
        all.sort_unstable();
        assert!(all.into_iter().eq(0..3 * SLOTS as u32));
        put(&mut wheel, 7, u64::MAX);
        assert_eq!(take(&mut wheel, u64::MAX), [7]);
    }
}
