//! The tag table: the last value of every tag, and what it is worth.

use std::sync::Arc;

use crate::cell::{Cells, Live, Standing, judge, judge_by_rules, judge_in_range};
use crate::changes::Changes;
use crate::value::Packed;
use crate::wheel::{NO_SLOT, Slot, Wheel};
use crate::{
    Change, Moment, Quality, QualityCounts, Renumbering, Sample, Snapshot, SourceTime, TagHandle,
    TagSet, TagState, Value,
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
    cells: Cells,
    wheel: Wheel,
    now: Moment,
    /// The wall clock less the clock of `now`, as it was last, nanoseconds.
    clock_offset: Option<i64>,
    changes: Changes,
    /// Inputs of derived tags that came or went stale since.
    touched: Vec<TagHandle>,
    counts: QualityCounts,
}

impl TagTable {
    /// A table of tags without values, at `now`.
    pub fn new(tags: Arc<TagSet>, now: Moment) -> Self {
        let cells = Cells::of(&tags);
        let counts = QualityCounts { bad: cells.len(), ..QualityCounts::default() };
        let wheel = Wheel::new(now);
        let changes = Changes::of(cells.len());
        let (clock_offset, touched) = (None, Vec::new());
        Self { tags, cells, wheel, now, clock_offset, changes, touched, counts }
    }

    /// Takes over what another table has of tags that go on under these numbers: value,
    /// times, and what their sources said last. What rests on ranges and freshness is judged
    /// by this table's; derived tags follow by themselves.
    pub fn inherit(&mut self, before: &Self, numbers: &Renumbering) {
        self.now = self.now.max(before.now);
        self.clock_offset = before.clock_offset;
        for index in 0..before.cells.len() as u32 {
            let (old, Some(tag)) = (TagHandle(index), numbers.tag(TagHandle(index))) else {
                continue;
            };
            let (was, said) = before.cells.get(old);
            let (Some(_), false) = (self.tags.spec(tag), said.is_derived) else { continue };
            self.continue_tag(tag, was, said);
        }
    }

    /// Goes on with a tag of another table.
    fn continue_tag(&mut self, tag: TagHandle, was: &Live, said: &Standing) {
        let (live, standing) = self.cells.get_mut(tag);
        if standing.is_derived || was.kind != live.kind {
            return;
        }
        live.take_over(was);
        standing.source_quality = said.source_quality;
        if let Some(value) = live.value().unpack() {
            let spec = &self.tags.specs()[tag.0 as usize];
            standing.verdict = judge_in_range(value, live.kind, spec);
            standing.slot = self.wheel.slot_of(live.deadline());
            self.wheel.put(tag.0, standing.slot);
        }
        if standing.is_input {
            self.touched.push(tag);
        }
        self.cells.count(tag, &mut self.counts, self.now);
        self.changes.note(tag);
    }

    /// What the tags are.
    pub fn tags(&self) -> &Arc<TagSet> {
        &self.tags
    }

    /// Takes a sample over, and tells `each` what it changes. Returns whether it was taken:
    /// not where it names no tag of this table that samples may set, or is older, at its
    /// source, than the value there is.
    // Always: then nothing of a good measurement is written down between the memory that it
    // came by and its cell.
    #[inline(always)]
    pub fn apply(&mut self, sample: &Sample, each: impl FnOnce(&Change)) -> bool {
        match self.take(sample) {
            Taken::Ignored => return false,
            Taken::Alike => {}
            Taken::Changed(change) => each(&change),
        }
        true
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
        self.changes.turn();
    }

    /// Notes the wall clock at `now`. When it was set back, source times from before would
    /// shut out all that follows until it is as late again: they order nothing any more.
    pub fn follow_clock(&mut self, wall_clock: SourceTime, now: Moment) {
        let offset = wall_clock.0.saturating_sub_unsigned(now.0);
        let before = self.clock_offset.replace(offset);
        if before.is_some_and(|before| offset < before.saturating_sub(MAX_CLOCK_BACK)) {
            self.cells.forget_source_times();
        }
    }

    /// All tags as they are at the instant to which the table was advanced last.
    /// Updates that came since are in it, as of that instant.
    pub fn snapshot(&self) -> Snapshot<'_> {
        Snapshot::of(self)
    }

    pub(crate) fn state(&self, tag: TagHandle) -> Option<TagState> {
        self.cells.state(tag, self.now)
    }

    pub(crate) fn states(&self) -> impl ExactSizeIterator<Item = TagState> {
        self.cells.states(self.now)
    }

    pub(crate) fn changed(&self) -> &[TagHandle] {
        self.changes.last()
    }

    pub(crate) fn counts(&self) -> QualityCounts {
        self.counts
    }

    #[inline(always)]
    fn take(&mut self, sample: &Sample) -> Taken {
        let Some(live) = self.cells.live.get_mut(sample.tag.0 as usize) else {
            return Taken::Ignored;
        };
        match sample.value {
            Some(value) if live.stays_good(value, sample, self.now) => {
                let value = Packed::of(value);
                live.set_times(sample);
                if live.value() == value {
                    return Taken::Alike;
                }
                live.set_value(value);
                self.changes.note(sample.tag);
                Taken::Changed(live.change(sample, Quality::Good))
            }
            _ => {
                let &Sample { tag, value, quality, source_time, received, valid_from } = sample;
                self.take_long_way(tag, value, quality, source_time, [received, valid_from])
            }
        }
    }

    /// In parts, which stay in registers, so that a sample that goes the short way is never
    /// written down as a whole.
    #[cold]
    #[inline(never)]
    fn take_long_way(
        &mut self,
        tag: TagHandle,
        value: Option<Value>,
        quality: Quality,
        source_time: Option<SourceTime>,
        [received, valid_from]: [Moment; 2],
    ) -> Taken {
        if self.cells.get_mut(tag).1.is_derived {
            return Taken::Ignored;
        }
        self.set(&Sample { tag, value, quality, source_time, received, valid_from })
    }

    /// Sets a tag that is there.
    fn set(&mut self, sample: &Sample) -> Taken {
        let (live, standing) = self.cells.get_mut(sample.tag);
        let before = (live.value(), standing.own_quality());
        let mut revived = false;
        if let Some(value) = sample.value {
            // An older source time never overwrites a newer one.
            if live.is_newer_than(sample) {
                return Taken::Ignored;
            }
            if standing.has_rules {
                let spec = &self.tags.specs()[sample.tag.0 as usize];
                judge_by_rules(live, standing, value, spec);
            } else {
                live.set_value(Packed::of(value));
                standing.verdict = judge(value, live.kind);
            }
            live.set_times(sample);
            let slot = self.wheel.slot_of(live.deadline());
            if slot < standing.slot {
                // A value that was stale and comes again alike is a change, too.
                revived = standing.slot == NO_SLOT;
                self.wheel.put(sample.tag.0, slot);
                standing.slot = slot;
            }
        }
        standing.source_quality = sample.quality;
        if standing.is_input {
            self.touched.push(sample.tag);
        }
        let after = (live.value(), standing.own_quality());
        let change = live.change(sample, after.1);
        self.cells.count(sample.tag, &mut self.counts, self.now);
        if before == after && !revived {
            return Taken::Alike;
        }
        self.changes.note(sample.tag);
        Taken::Changed(change)
    }

    /// Looks at a tag that the wheel gave up.
    fn expire(&mut self, tag: u32, slot: Slot) {
        let tag = TagHandle(tag);
        let (live, standing) = self.cells.get_mut(tag);
        if standing.slot != slot {
            // It was put in anew, earlier.
            return;
        }
        if live.is_stale(self.now) {
            standing.slot = NO_SLOT;
            if standing.is_input {
                self.touched.push(tag);
            }
            self.cells.count(tag, &mut self.counts, self.now);
            self.changes.note(tag);
        } else {
            standing.slot = self.wheel.slot_of(live.deadline());
            self.wheel.put(tag.0, standing.slot);
        }
    }

    /// Works out the derived tags that rest on what came or went stale.
    fn derive(&mut self, each: &mut impl FnMut(&Change)) {
        let (now, tags) = (self.now, self.tags.clone());
        let mut due = tags.derived().due(&self.touched);
        while let Some(index) = due.next_due() {
            let rule = tags.derived().rule(index);
            let tag = rule.tag;
            let states = rule.inputs.iter().filter_map(|&input| self.cells.state(input, now));
            let kind = self.cells.live[tag.0 as usize].kind;
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
