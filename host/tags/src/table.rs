//! The tag table: the last value of every tag, and what it is worth.

use std::sync::Arc;

use crate::cell::{Cell, NO_TIME, judge};
use crate::value::Packed;
use crate::wheel::{NO_SLOT, Slot, Wheel};
use crate::{
    Change, Moment, QualityCounts, Sample, Snapshot, SourceTime, TagHandle, TagSet, TagState,
};

/// How far the wall clock may go back, as when it is kept in step, nanoseconds.
const MAX_CLOCK_BACK: i64 = 1_000_000_000;

/// The tags of a scene and their last values.
///
/// Updates go in by [`TagTable::apply`]; [`TagTable::advance`] moves its time on, once
/// a frame. The cost of both is that of what changed, not of the tags there are.
#[derive(Debug)]
pub struct TagTable {
    tags: Arc<TagSet>,
    cells: Vec<Cell>,
    wheel: Wheel,
    now: Moment,
    /// The wall clock less the clock of `now`, as it was last, nanoseconds.
    clock_offset: Option<i64>,
    /// Tags that changed up to `now`, and those that changed since.
    changed: Vec<TagHandle>,
    changing: Vec<TagHandle>,
    /// How often time was moved on.
    turn: u64,
    /// Inputs of derived tags that came or went stale since.
    touched: Vec<TagHandle>,
    counts: QualityCounts,
}

impl TagTable {
    /// A table of tags without values, at `now`.
    pub fn new(tags: Arc<TagSet>, now: Moment) -> Self {
        let mut cells: Vec<Cell> = tags.specs().iter().map(Cell::of).collect();
        for TagHandle(tag) in tags.derived().inputs() {
            cells[tag as usize].is_input = true;
        }
        let counts = QualityCounts { bad: cells.len(), ..QualityCounts::default() };
        let wheel = Wheel::new(now);
        let (changed, changing, touched) = (Vec::new(), Vec::new(), Vec::new());
        let clock_offset = None;
        let turn = 1;
        Self { tags, cells, wheel, now, clock_offset, changed, changing, turn, touched, counts }
    }

    /// What the tags are.
    pub fn tags(&self) -> &Arc<TagSet> {
        &self.tags
    }

    /// Takes samples over, in order, and tells `each` what they change, in order too.
    /// Returns how many named no tag of this table that samples may set, or were older,
    /// at their source, than the value there is.
    #[inline]
    pub fn apply(
        &mut self,
        samples: impl IntoIterator<Item = Sample>,
        mut each: impl FnMut(&Change),
    ) -> usize {
        let mut ignored = 0;
        for sample in samples {
            match self.take(&sample) {
                Taken::Ignored => ignored += 1,
                Taken::Alike => {}
                Taken::Changed(change) => each(&change),
            }
        }
        ignored
    }

    /// Moves time on: values past their limit are stale from here on, and derived tags
    /// follow what they rest on. `each` is told how these change.
    pub fn advance(&mut self, now: Moment, mut each: impl FnMut(&Change)) {
        self.now = self.now.max(now);
        for (slot, tags) in self.wheel.take_due(self.now) {
            for tag in tags {
                self.expire(tag, slot);
            }
        }
        self.derive(&mut each);
        std::mem::swap(&mut self.changed, &mut self.changing);
        self.changing.clear();
        self.turn += 1;
    }

    /// Notes the wall clock at `now`. When it was set back, source times from before would
    /// shut out all that follows until it is as late again: they order nothing any more.
    pub fn follow_clock(&mut self, wall_clock: SourceTime, now: Moment) {
        let offset = wall_clock.0.saturating_sub_unsigned(now.0);
        let before = self.clock_offset.replace(offset);
        if before.is_some_and(|before| offset < before.saturating_sub(MAX_CLOCK_BACK)) {
            self.cells.iter_mut().for_each(|cell| cell.source_nanos = NO_TIME);
        }
    }

    /// All tags as they are at the instant to which the table was advanced last.
    /// Updates that came since are in it, as of that instant.
    pub fn snapshot(&self) -> Snapshot<'_> {
        Snapshot::of(self)
    }

    pub(crate) fn state(&self, tag: TagHandle) -> Option<TagState> {
        self.cells.get(tag.0 as usize).map(|cell| cell.state(self.now))
    }

    pub(crate) fn states(&self) -> impl ExactSizeIterator<Item = TagState> {
        self.cells.iter().map(|cell| cell.state(self.now))
    }

    pub(crate) fn changed(&self) -> &[TagHandle] {
        &self.changed
    }

    pub(crate) fn counts(&self) -> QualityCounts {
        self.counts
    }

    #[inline]
    fn take(&mut self, sample: &Sample) -> Taken {
        match (self.cells.get_mut(sample.tag.0 as usize), sample.value) {
            (Some(cell), Some(value)) if cell.stays_good(value, sample, self.now) => {
                let value = Packed::of(value);
                cell.set_times(sample);
                if cell.value() == value {
                    return Taken::Alike;
                }
                cell.set_value(value);
                cell.note_change(sample.tag, self.turn, &mut self.changing);
                Taken::Changed(cell.change(sample))
            }
            (Some(cell), _) if !cell.is_derived => self.set(sample),
            _ => Taken::Ignored,
        }
    }

    /// Sets a cell that is there.
    fn set(&mut self, sample: &Sample) -> Taken {
        let index = sample.tag.0 as usize;
        let cell = &mut self.cells[index];
        let before = (cell.value(), cell.own_quality());
        let mut revived = false;
        if let Some(value) = sample.value {
            // An older source time never overwrites a newer one.
            if cell.is_newer_than(sample) {
                return Taken::Ignored;
            }
            if cell.has_rules {
                cell.judge_by_rules(value, &self.tags.specs()[index]);
            } else {
                cell.set_value(Packed::of(value));
                cell.verdict = judge(value, cell.kind);
            }
            cell.set_times(sample);
            let slot = self.wheel.slot_of(cell.deadline());
            if slot < cell.slot {
                // A value that was stale and comes again alike is a change, too.
                revived = cell.slot == NO_SLOT;
                self.wheel.put(sample.tag.0, slot);
                cell.slot = slot;
            }
        }
        cell.source_quality = sample.quality;
        if cell.is_input {
            self.touched.push(sample.tag);
        }
        cell.count(&mut self.counts, self.now);
        if before == (cell.value(), cell.own_quality()) && !revived {
            return Taken::Alike;
        }
        cell.note_change(sample.tag, self.turn, &mut self.changing);
        Taken::Changed(cell.change(sample))
    }

    /// Looks at a tag that the wheel gave up.
    fn expire(&mut self, tag: u32, slot: Slot) {
        let cell = &mut self.cells[tag as usize];
        if cell.slot != slot {
            // It was put in anew, earlier.
            return;
        }
        if cell.is_stale(self.now) {
            cell.slot = NO_SLOT;
            cell.count(&mut self.counts, self.now);
            if cell.is_input {
                self.touched.push(TagHandle(tag));
            }
            cell.note_change(TagHandle(tag), self.turn, &mut self.changing);
        } else {
            cell.slot = self.wheel.slot_of(cell.deadline());
            self.wheel.put(tag, cell.slot);
        }
    }

    /// Works out the derived tags that rest on what came or went stale.
    fn derive(&mut self, each: &mut impl FnMut(&Change)) {
        let (now, tags) = (self.now, self.tags.clone());
        let mut due = tags.derived().due(&self.touched);
        while let Some(index) = due.next_due() {
            let rule = tags.derived().rule(index);
            let tag = rule.tag;
            let states = rule.inputs.iter().map(|input| self.cells[input.0 as usize].state(now));
            let kind = self.cells[tag.0 as usize].kind;
            let sample = rule.work_out(states, kind, now);
            if let Taken::Changed(change) = self.set(&sample) {
                each(&change);
            }
            tags.derived().dependents(tag, &mut due);
        }
        self.touched.clear();
    }
}

enum Taken {
    Ignored,
    Alike,
    Changed(Change),
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
