//! Tag table: last value and quality of every tag.

use std::sync::Arc;

use busbar_types::{Origin, Quality, Reason, Value};

use crate::changes::Changes;
use crate::packed::Packed;
use crate::tag_state::{
    ColdState, HotState, TagStates, apply_rules, set_value, value_quality, value_quality_in_range,
};
use crate::timing_wheel::{NO_SLOT, Slot, TimingWheel};
use crate::{
    Change, HandleRemap, Moment, Pause, PauseEvidence, QualityCounts, Sample, Snapshot, SourceTime,
    TagHandle, TagSet, TagState,
};

/// The tags of a scene and their last values.
///
/// Updates go in by [`TagTable::apply`]; [`TagTable::advance`] moves its time on, once
/// a frame. The cost of both is that of what changed, not of the tags there are.
#[derive(Debug)]
pub struct TagTable {
    tags: Arc<TagSet>,
    states: TagStates,
    wheel: TimingWheel,
    now: Moment,
    changes: Changes,
    /// Inputs of derived tags that came or went stale since.
    touched: Vec<TagHandle>,
    counts: QualityCounts,
    /// Times before which values are stale whatever their limit: the ends of the last pauses. The
    /// first holds for all tags, the second for those that are not kept current across stops.
    trusted_from: [Moment; 2],
}

impl TagTable {
    /// A table of tags without values, at `now`.
    pub fn new(tags: Arc<TagSet>, now: Moment) -> Self {
        let states = TagStates::new(&tags);
        let counts = QualityCounts { bad: states.len(), ..QualityCounts::default() };
        let wheel = TimingWheel::new(now);
        let changes = Changes::new(states.len());
        let (touched, trusted_from) = (Vec::new(), [Moment(0); 2]);
        Self { tags, states, wheel, now, changes, touched, counts, trusted_from }
    }

    /// Inherits value, times and source quality of the tags that exist in another table, by their
    /// new indices. Ranges and freshness are evaluated by this table's rules; derived tags follow
    /// by themselves.
    pub fn inherit(&mut self, before: &Self, numbers: &HandleRemap) {
        self.now = self.now.max(before.now);
        self.trusted_from = before.trusted_from;
        for index in 0..before.states.len() as u32 {
            let (old, Some(tag)) = (TagHandle(index), numbers.tag(TagHandle(index))) else {
                continue;
            };
            let (was, said) = before.states.get(old);
            let (Some(_), false) = (self.tags.spec(tag), said.is_derived) else { continue };
            self.continue_tag(tag, was, said);
        }
    }

    /// Inherits the state of a tag from another table.
    fn continue_tag(&mut self, tag: TagHandle, was: &HotState, said: &ColdState) {
        let (hot, cold) = self.states.get_mut(tag);
        if cold.is_derived || was.kind != hot.kind {
            return;
        }
        hot.take_over(was);
        cold.take_over_text(said);
        cold.source_quality = said.source_quality;
        cold.doubt = said.doubt;
        if let Some(value) = hot.value().unpack(cold.text()) {
            let spec = &self.tags.specs()[tag.0 as usize];
            let fresh = trust(hot.valid_from, trusted_from(self.trusted_from, cold));
            cold.verdict = value_quality_in_range(&value, hot.kind, spec).worst(fresh);
            cold.slot = self.wheel.slot_of(hot.deadline());
            self.wheel.put(tag.0, cold.slot);
        }
        if cold.is_input {
            self.touched.push(tag);
        }
        self.states.count(tag, &mut self.counts, self.now);
        self.changes.record(tag);
    }

    /// Returns the definitions of the tags.
    pub fn tags(&self) -> &Arc<TagSet> {
        &self.tags
    }

    /// Applies a sample and reports its change to `each`. Returns false for an unknown or derived
    /// tag. The same holds for a good buffered sample that is older, at its source, than the
    /// current value.
    // Always: then nothing of a good measurement is written down between the memory that it
    // came by and its cell.
    #[inline(always)]
    pub fn apply(&mut self, sample: &Sample, each: impl FnOnce(&Change)) -> bool {
        match self.apply_sample(sample) {
            ApplyOutcome::Ignored => return false,
            ApplyOutcome::Unchanged => {}
            ApplyOutcome::Changed(change) => each(&change),
        }
        true
    }

    /// Advances time: values past their limit become stale, and derived tags are evaluated.
    /// `each` receives their changes.
    pub fn advance(&mut self, now: Moment, mut each: impl FnMut(&Change)) {
        self.now = self.now.max(now);
        for (slot, tags) in self.wheel.take_due(self.now) {
            for tag in tags {
                self.expire(tag, slot);
            }
        }
        self.derive(&mut each);
        self.changes.finish_turn();
    }

    /// Keeps values of these tags current across stops of this process. Their source reports
    /// every change through a queue that is read afterwards.
    pub fn keep_current_across_stops(&mut self, tags: impl IntoIterator<Item = TagHandle>) {
        tags.into_iter()
            .for_each(|tag| self.states.get_mut(tag).1.stays_current_across_stops = true);
    }

    /// Marks every value from before a pause as stale, whatever its limit, until a value arrives
    /// that is true from then on. Changes during the pause were not observed. `each` receives the
    /// changes.
    pub fn mark_stale_before(&mut self, pause: &Pause, mut each: impl FnMut(&Change)) {
        let moment = pause.trusted_from();
        let [all, stopped] = &mut self.trusted_from;
        *stopped = moment.max(*stopped);
        if pause.evidence != PauseEvidence::Stopped {
            *all = moment.max(*all);
        }
        for tag in (0..self.states.len() as u32).map(TagHandle) {
            let (hot, cold) = self.states.get_mut(tag);
            let trusted_from = trusted_from(self.trusted_from, cold);
            let is_old = hot.valid_from < trusted_from && !hot.value().is_none();
            if cold.is_derived || !is_old || cold.verdict == STALE {
                continue;
            }
            cold.verdict = cold.verdict.worst(STALE);
            if cold.is_input {
                self.touched.push(tag);
            }
            let change = hot.state_change(tag, cold, self.now);
            self.states.count(tag, &mut self.counts, self.now);
            self.changes.record(tag);
            each(&change);
        }
    }

    /// Returns all tags at the instant to which the table was last advanced. Later updates are
    /// included, as of that instant.
    pub fn snapshot(&self) -> Snapshot<'_> {
        Snapshot::new(self)
    }

    pub(crate) fn state(&self, tag: TagHandle) -> Option<TagState> {
        self.states.state(tag, self.now)
    }

    pub(crate) fn states(&self) -> impl ExactSizeIterator<Item = TagState> {
        self.states.states(self.now)
    }

    pub(crate) fn changed(&self) -> &[TagHandle] {
        self.changes.last()
    }

    pub(crate) fn counts(&self) -> QualityCounts {
        self.counts
    }

    #[inline(always)]
    fn apply_sample(&mut self, sample: &Sample) -> ApplyOutcome {
        let Some(hot) = self.states.hot.get_mut(sample.tag.0 as usize) else {
            return ApplyOutcome::Ignored;
        };
        let packed = sample.value.as_ref().and_then(|value| {
            let packed = Packed::from_value(value)?;
            hot.takes_fast_path(value, sample, self.now).then_some(packed)
        });
        match packed {
            Some(value) => {
                hot.set_times(sample);
                if hot.value() == value {
                    return ApplyOutcome::Unchanged;
                }
                hot.set_value(value);
                self.changes.record(sample.tag);
                ApplyOutcome::Changed(hot.change(sample, Quality::Good, None))
            }
            None => {
                let &Sample { tag, source_time, received, valid_from, .. } = sample;
                let value = sample.value.clone();
                let delivery = (sample.origin, sample.is_buffered);
                let times = [received, valid_from];
                let worth = [sample.quality, sample.doubt];
                self.apply_slow_path(tag, value, worth, source_time, times, delivery)
            }
        }
    }

    /// Applies a sample that does not take the fast path. Its parts are passed in registers, so
    /// that a sample on the fast path is never written to memory as a whole.
    #[cold]
    #[inline(never)]
    fn apply_slow_path(
        &mut self,
        tag: TagHandle,
        value: Option<Value>,
        [quality, doubt]: [Quality; 2],
        source_time: Option<SourceTime>,
        [received, valid_from]: [Moment; 2],
        (origin, is_buffered): (Origin, bool),
    ) -> ApplyOutcome {
        if self.states.get_mut(tag).1.is_derived {
            return ApplyOutcome::Ignored;
        }
        self.set(&Sample {
            tag,
            value,
            quality,
            doubt,
            source_time,
            received,
            valid_from,
            origin,
            is_buffered,
        })
    }

    /// Sets a tag that is there.
    fn set(&mut self, sample: &Sample) -> ApplyOutcome {
        let (hot, cold) = self.states.get_mut(sample.tag);
        let before = (hot.value(), cold.own_quality(), hot.origin());
        let mut revived = false;
        // Clocks are set back, so source time orders nothing but what a buffer held. What
        // is said of quality counts in any case.
        let is_outdated = sample.value.is_some() && sample.is_buffered && hot.is_newer_than(sample);
        let quality = sample.quality.worst(sample.doubt);
        if is_outdated && quality.is_good() {
            return ApplyOutcome::Ignored;
        }
        if let (Some(value), false) = (&sample.value, is_outdated) {
            if cold.has_rules {
                let spec = &self.tags.specs()[sample.tag.0 as usize];
                apply_rules(hot, cold, value, spec);
            } else {
                set_value(hot, cold, value);
                cold.verdict = value_quality(value, hot.kind);
            }
            if !cold.is_derived {
                let fresh = trust(sample.valid_from, trusted_from(self.trusted_from, cold));
                cold.verdict = cold.verdict.worst(fresh);
            }
            cold.doubt = sample.doubt;
            hot.set_times(sample);
            let slot = self.wheel.slot_of(hot.deadline());
            if slot < cold.slot {
                // A value that was stale and comes again alike is a change, too.
                revived = cold.slot == NO_SLOT;
                self.wheel.put(sample.tag.0, slot);
                cold.slot = slot;
            }
        }
        if sample.value.is_none() {
            cold.doubt = cold.doubt.worst(sample.doubt);
        }
        cold.source_quality = quality;
        if cold.is_input {
            self.touched.push(sample.tag);
        }
        let after = (hot.value(), cold.own_quality(), hot.origin());
        let change = hot.change(sample, after.1, cold.text());
        self.states.count(sample.tag, &mut self.counts, self.now);
        if before == after && !revived {
            return ApplyOutcome::Unchanged;
        }
        self.changes.record(sample.tag);
        ApplyOutcome::Changed(change)
    }

    /// Checks a tag whose slot in the wheel is due.
    fn expire(&mut self, tag: u32, slot: Slot) {
        let tag = TagHandle(tag);
        let (hot, cold) = self.states.get_mut(tag);
        if cold.slot != slot {
            // It was put in anew, earlier.
            return;
        }
        if hot.is_stale(self.now) {
            cold.slot = NO_SLOT;
            if cold.is_input {
                self.touched.push(tag);
            }
            self.states.count(tag, &mut self.counts, self.now);
            self.changes.record(tag);
        } else {
            cold.slot = self.wheel.slot_of(hot.deadline());
            self.wheel.put(tag.0, cold.slot);
        }
    }

    /// Evaluates the derived tags whose inputs changed or became stale.
    fn derive(&mut self, each: &mut impl FnMut(&Change)) {
        let (now, tags) = (self.now, self.tags.clone());
        let mut due = tags.derived().due(&self.touched);
        while let Some(index) = due.next_due() {
            let rule = tags.derived().rule(index);
            let tag = rule.tag;
            let states = rule.inputs.iter().filter_map(|&input| self.states.state(input, now));
            let kind = self.states.hot[tag.0 as usize].kind;
            let sample = rule.evaluate(states, kind, now);
            if let ApplyOutcome::Changed(change) = self.set(&sample) {
                each(&change);
            }
            tags.derived().dependents(tag, &mut due);
        }
        self.touched.clear();
    }
}

/// Quality of a value that is no longer current.
const STALE: Quality = Quality::Bad(Reason::Stale);

/// Moment from which values of a tag are trusted.
#[inline(always)]
fn trusted_from([all, stopped]: [Moment; 2], cold: &ColdState) -> Moment {
    if cold.stays_current_across_stops { all } else { stopped }
}

/// Quality of a value by when it was true, where values from before are not trusted.
#[inline(always)]
fn trust(valid_from: Moment, trusted_from: Moment) -> Quality {
    if valid_from < trusted_from { STALE } else { Quality::Good }
}

enum ApplyOutcome {
    Ignored,
    Unchanged,
    Changed(Change),
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
