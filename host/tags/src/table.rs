//! The tag table: the last value of every tag, and what it is worth.

use std::sync::Arc;
use std::time::Duration;

use crate::wheel::{NO_SLOT, Slot, Wheel};
use crate::{
    Change, DoublePoint, Moment, Quality, QualityCounts, Reason, Sample, Snapshot, SourceTime,
    TagHandle, TagSet, TagSpec, TagState, Value, ValueKind,
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
    /// Inputs of derived tags that came or went stale since.
    touched: Vec<TagHandle>,
    counts: QualityCounts,
}

/// One tag, on a cache line of its own.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Cell {
    value: Option<Value>,
    source_time: Option<SourceTime>,
    /// When the value was true; of no meaning without one.
    valid_from: Moment,
    /// Where the wheel has it, or [`NO_SLOT`].
    slot: Slot,
    freshness_millis: u32,
    /// What the source says of the tag.
    source_quality: Quality,
    /// What the host says of the value.
    verdict: Quality,
    kind: ValueKind,
    /// Rank of the quality that the counts have it under.
    counted: u8,
    /// Whether range, scale or dead band have to be looked up.
    has_rules: bool,
    is_derived: bool,
    /// Whether derived tags rest on it.
    is_input: bool,
    is_changing: bool,
}

impl TagTable {
    /// A table of tags without values, at `now`.
    pub fn new(tags: Arc<TagSet>, now: Moment) -> Self {
        let mut cells: Vec<Cell> = tags.specs().iter().map(Cell::of).collect();
        tags.derived().inputs().for_each(|tag| cells[tag.0 as usize].is_input = true);
        let counts = QualityCounts { bad: cells.len(), ..QualityCounts::default() };
        let wheel = Wheel::new(now);
        let (changed, changing, touched) = (Vec::new(), Vec::new(), Vec::new());
        let clock_offset = None;
        Self { tags, cells, wheel, now, clock_offset, changed, changing, touched, counts }
    }

    /// What the tags are.
    pub fn tags(&self) -> &Arc<TagSet> {
        &self.tags
    }

    /// Takes samples over, in order, and tells `each` what they change, in order too.
    /// Returns how many named no tag of this table that samples may set, or were older,
    /// at their source, than the value there is.
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
        for &tag in &self.changed {
            let cell = &mut self.cells[tag.0 as usize];
            let rank = cell.quality(self.now).rank();
            *self.counts.of(cell.counted) -= 1;
            *self.counts.of(rank) += 1;
            cell.counted = rank;
            cell.is_changing = false;
        }
    }

    /// Notes the wall clock at `now`. When it was set back, source times from before would
    /// shut out all that follows until it is as late again: they order nothing any more.
    pub fn follow_clock(&mut self, wall_clock: SourceTime, now: Moment) {
        let offset = wall_clock.0.saturating_sub_unsigned(now.0);
        let before = self.clock_offset.replace(offset);
        if before.is_some_and(|before| offset < before.saturating_sub(MAX_CLOCK_BACK)) {
            self.cells.iter_mut().for_each(|cell| cell.source_time = None);
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

    fn take(&mut self, sample: &Sample) -> Taken {
        let index = sample.tag.0 as usize;
        match self.cells.get_mut(index) {
            Some(cell) if !cell.is_derived => {}
            _ => return Taken::Ignored,
        }
        self.set(sample)
    }

    /// Sets a cell that is there.
    fn set(&mut self, sample: &Sample) -> Taken {
        let index = sample.tag.0 as usize;
        let cell = &mut self.cells[index];
        let before = (cell.value, cell.own_quality());
        let had_slot = cell.slot != NO_SLOT;
        if let Some(value) = sample.value {
            // An older source time never overwrites a newer one.
            if let (Some(new), Some(old)) = (sample.source_time, cell.source_time)
                && new < old
            {
                return Taken::Ignored;
            }
            if cell.has_rules {
                cell.judge_by_rules(value, &self.tags.specs()[index]);
            } else {
                (cell.value, cell.verdict) = (Some(value), judge(value, cell.kind));
            }
            cell.source_time = sample.source_time;
            cell.valid_from = sample.valid_from;
            let slot = self.wheel.slot_of(cell.deadline());
            if slot < cell.slot {
                self.wheel.put(sample.tag.0, slot);
                cell.slot = slot;
            }
        }
        cell.source_quality = sample.quality;
        if cell.is_input {
            self.touched.push(sample.tag);
        }
        let after = (cell.value, cell.own_quality());
        // A value that was stale and comes again alike is a change, too.
        let revived = !had_slot && cell.slot != NO_SLOT;
        if alike(before, after) && !revived {
            return Taken::Alike;
        }
        if !cell.is_changing {
            cell.is_changing = true;
            self.changing.push(sample.tag);
        }
        Taken::Changed(Change {
            tag: sample.tag,
            value: after.0,
            quality: after.1,
            source_time: cell.source_time,
            received: sample.received,
        })
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
            if cell.is_input {
                self.touched.push(TagHandle(tag));
            }
            if !cell.is_changing {
                cell.is_changing = true;
                self.changing.push(TagHandle(tag));
            }
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

/// Not-a-number is like itself here.
fn alike(before: (Option<Value>, Quality), after: (Option<Value>, Quality)) -> bool {
    let values_alike = match (before.0, after.0) {
        (Some(Value::F64(a)), Some(Value::F64(b))) => a.to_bits() == b.to_bits(),
        (a, b) => a == b,
    };
    values_alike && before.1 == after.1
}

/// What the host itself says of a value.
fn judge(value: Value, kind: ValueKind) -> Quality {
    if value.kind() != kind {
        return Quality::Bad(Reason::Configuration);
    }
    match value {
        Value::DoublePoint(DoublePoint::BadState) => Quality::Uncertain(Reason::Sensor),
        Value::F64(number) if !number.is_finite() => Quality::Bad(Reason::NotFinite),
        _ => Quality::Good,
    }
}

impl Cell {
    fn of(spec: &TagSpec) -> Self {
        Self {
            value: None,
            source_time: None,
            valid_from: Moment(0),
            slot: NO_SLOT,
            freshness_millis: u32::try_from(spec.freshness.as_millis()).unwrap_or(u32::MAX),
            source_quality: Quality::Bad(Reason::NotConnected),
            verdict: Quality::Good,
            kind: spec.kind,
            counted: Quality::Bad(Reason::NotConnected).rank(),
            has_rules: spec.range.is_some() || spec.scale.is_some() || spec.dead_band > 0.0,
            is_derived: spec.expression.is_some(),
            is_input: false,
            is_changing: false,
        }
    }

    /// Scale, dead band and range.
    fn judge_by_rules(&mut self, value: Value, spec: &TagSpec) {
        let value = match (value, spec.scale) {
            (Value::F64(number), Some(scale)) => Value::F64(scale.apply(number)),
            (value, _) => value,
        };
        let verdict = match judge(value, self.kind) {
            Quality::Good => match (value.as_number(), &spec.range) {
                (Some(number), Some(range)) if !range.contains(&number) => {
                    Quality::Uncertain(Reason::OutOfRange)
                }
                _ => Quality::Good,
            },
            verdict => verdict,
        };
        let within = match (self.value.and_then(Value::as_number), value.as_number()) {
            (Some(old), Some(new)) => (new - old).abs() < spec.dead_band,
            _ => false,
        };
        if !within || verdict != self.verdict {
            self.value = Some(value);
        }
        self.verdict = verdict;
    }

    /// The last moment at which the value is fresh.
    fn deadline(&self) -> Moment {
        self.valid_from.after(Duration::from_millis(u64::from(self.freshness_millis)))
    }

    fn is_stale(&self, now: Moment) -> bool {
        self.value.is_some() && now > self.deadline()
    }

    /// Quality without freshness.
    fn own_quality(&self) -> Quality {
        self.source_quality.worst(self.verdict)
    }

    fn quality(&self, now: Moment) -> Quality {
        let fresh = match self.value {
            None => Quality::Bad(Reason::NotConnected),
            Some(_) if self.is_stale(now) => Quality::Bad(Reason::Stale),
            Some(_) => Quality::Good,
        };
        self.own_quality().worst(fresh)
    }

    fn state(&self, now: Moment) -> TagState {
        TagState {
            value: self.value,
            quality: self.quality(now),
            age: self.value.map(|_| now.since(self.valid_from)),
            source_time: self.source_time,
        }
    }
}

impl QualityCounts {
    fn of(&mut self, rank: u8) -> &mut usize {
        match rank {
            0 => &mut self.good,
            1 => &mut self.uncertain,
            _ => &mut self.bad,
        }
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
