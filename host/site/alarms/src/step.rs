//! State machine of alarms (IEC 62682): evaluation once a frame.
//!
//! The order keeps an alarm from occurring for a cause that another one of the same frame
//! removes: suppressions that begin, pulses since the last frame, current conditions, delays,
//! shelving that expires, suppressions that end. A delay takes effect only if its condition
//! still holds in the frame in which the delay ends.

use std::time::Duration;

use busbar_tags::{Change, Moment, Snapshot, SourceTime, TagHandle, TagState};

use crate::set::User;
use crate::state_transitions::Hold;
use crate::table::{AlarmTable, Cause, Pending};
use crate::verdict_input::VerdictInput;
use crate::{AlarmEvent, AlarmHandle, AlarmRecord, AlarmSource, Condition, TagCondition};

/// Receiver of the records of a step.
type RecordReceiver<'a> = &'a mut dyn FnMut(AlarmRecord);

/// Judgment of an alarm's condition in one step.
struct Finding {
    /// Reports whether the condition holds; none where nothing decides.
    holds: Option<bool>,
    is_certain: bool,
    cause: Cause,
    /// True if an on-delay goes on while nothing decides.
    keeps_on_delay: bool,
}

/// Alarm that uses a tag, with the current state of the tag.
#[derive(Clone)]
struct AlarmInput {
    user: User,
    state: TagState,
}

impl AlarmTable {
    /// Records a change of a tag as it arrives. So a condition that is over before the next step
    /// is not missed, and members of a group keep their order. Changes of tags without alarms
    /// cost next to nothing.
    #[inline]
    pub fn note(&mut self, change: &Change) {
        if !self.set.users(change.tag).is_empty() {
            self.record_pulses(change);
        }
    }

    fn record_pulses(&mut self, change: &Change) {
        let Self { set, cells, pulses, .. } = self;
        for user in set.users(change.tag).iter().filter(|user| !user.suppresses) {
            let AlarmSource::Tag { trigger, on_delay, .. } =
                &set.specs()[user.alarm.0 as usize].source
            else {
                continue;
            };
            let cell = &mut cells[user.alarm.0 as usize];
            // What is delayed, or holds already, is judged by the step.
            let is_news = on_delay.is_zero() && !cell.holds && cell.pulse.is_none();
            if is_news
                && trigger.condition.evaluate(change.value.as_ref(), change.quality, false)
                    == Some(true)
            {
                cell.pulse = Some(Cause::from_change(change));
                pulses.push(user.alarm);
            }
        }
    }

    /// Evaluates all due alarms at `now`. `wall_clock` is the same instant by the wall clock,
    /// which may jump: it is stored in records and decides nothing.
    pub fn step(
        &mut self,
        tags: Snapshot<'_>,
        now: Moment,
        wall_clock: SourceTime,
        mut each: impl FnMut(AlarmRecord),
    ) {
        self.now = self.now.max(now);
        self.wall_clock = wall_clock;
        let inputs = self.inputs(tags);
        let each: RecordReceiver<'_> = &mut each;
        self.suppress(&inputs, true, each);
        self.take_pulses(each);
        for input in inputs.iter().filter(|input| !input.user.suppresses) {
            self.evaluate(input, each);
        }
        self.take_verdicts(each);
        self.end_delays(each);
        self.suppress(&inputs, false, each);
    }

    /// The alarms whose tags changed; all of them in the first step.
    fn inputs(&mut self, tags: Snapshot<'_>) -> Vec<AlarmInput> {
        let set = self.set.clone();
        let looks_of = |tag: TagHandle| {
            let users = set.users(tag);
            let state = if users.is_empty() { None } else { tags.state(tag) };
            users
                .iter()
                .zip(state.into_iter().cycle())
                .map(|(&user, state)| AlarmInput { user, state })
        };
        if std::mem::take(&mut self.is_new) {
            (0..tags.states().len() as u32).map(TagHandle).flat_map(looks_of).collect()
        } else {
            tags.changed().iter().copied().flat_map(looks_of).collect()
        }
    }

    /// Begins or ends suppressions by design.
    fn suppress(&mut self, inputs: &[AlarmInput], begins: bool, each: RecordReceiver<'_>) {
        for AlarmInput { user, state } in inputs.iter().filter(|input| input.user.suppresses) {
            let Some(by) = self.spec(user.alarm).source.suppressed_by() else { continue };
            let is_suppressed = self.cells[user.alarm.0 as usize].standing.is_suppressed;
            let verdict = by.condition.evaluate(state.value.as_ref(), state.quality, is_suppressed);
            if verdict != Some(begins) || begins == is_suppressed {
                continue;
            }
            let latches = self.spec(user.alarm).latched;
            each(self.change(user.alarm, |standing| match begins {
                true => {
                    standing.hold(Hold::Suppression);
                    AlarmEvent::Suppressed
                }
                false => {
                    standing.release(Hold::Suppression, latches);
                    AlarmEvent::Unsuppressed
                }
            }));
        }
    }

    /// Conditions without delay that came since the last step; by their source time, where
    /// all have one.
    fn take_pulses(&mut self, each: RecordReceiver<'_>) {
        let mut pulses = std::mem::take(&mut self.pulses);
        let time = |alarm: &AlarmHandle| {
            self.cells[alarm.0 as usize].pulse.as_ref().and_then(|p| p.source_time)
        };
        if pulses.iter().all(|alarm| time(alarm).is_some()) {
            pulses.sort_by_key(time);
        }
        for alarm in pulses.drain(..) {
            let cell = &mut self.cells[alarm.0 as usize];
            if let Some(cause) = cell.pulse.take() {
                cell.holds = true;
                self.change_condition(alarm, true, cause, each);
                self.queue(alarm);
            }
        }
        // Kept for its room.
        self.pulses = pulses;
    }

    /// Evaluates a condition by the current state of its tag.
    fn evaluate(&mut self, input: &AlarmInput, each: RecordReceiver<'_>) {
        let AlarmInput { user: User { alarm, .. }, state } = input;
        let alarm = *alarm;
        let AlarmSource::Tag { trigger: TagCondition { condition, .. }, .. } =
            &self.spec(alarm).source
        else {
            return;
        };
        let &TagState { source_time, origin, quality, .. } = state;
        let value = state.value.clone();
        let held = self.cells[alarm.0 as usize].holds;
        let holds = condition.evaluate(value.as_ref(), quality, held);
        let finding = Finding {
            holds,
            is_certain: quality.is_good() || *condition == Condition::BadQuality,
            cause: Cause { value, source_time, origin, ..Cause::default() },
            keeps_on_delay: false,
        };
        self.decide(alarm, finding, each);
    }

    /// Evaluates the verdicts since the last step, in their order.
    fn take_verdicts(&mut self, each: RecordReceiver<'_>) {
        let mut verdicts = std::mem::take(&mut self.verdicts);
        for VerdictInput { alarm, holds, origin, source_time, is_assumed, reason } in
            verdicts.drain(..)
        {
            let Some(cell) = self.cells.get_mut(alarm.0 as usize) else { continue };
            cell.uncertainty = reason.clone().filter(|_| holds.is_none());
            let finding = Finding {
                holds,
                is_certain: holds.is_some(),
                cause: Cause { source_time, origin, is_assumed, reason, ..Cause::default() },
                keeps_on_delay: true,
            };
            self.decide(alarm, finding, each);
        }
        // Kept for its room.
        self.verdicts = verdicts;
    }

    /// Applies the judgment of a condition, with the delays of its alarm.
    fn decide(&mut self, alarm: AlarmHandle, finding: Finding, each: RecordReceiver<'_>) {
        let Finding { holds, is_certain, cause, keeps_on_delay } = finding;
        let [on_delay, off_delay] = self.spec(alarm).source.delays();
        let now = self.now;
        let cell = &mut self.cells[alarm.0 as usize];
        let was_certain = std::mem::replace(&mut cell.is_certain, is_certain);
        let known_origin = cell.cause.origin;
        match holds {
            None => drop(cell.pending.take_if(|pending| !(keeps_on_delay && pending.holds))),
            Some(holds) => {
                cell.holds = holds;
                let delay = if holds { on_delay } else { off_delay };
                if holds == cell.standing.is_active {
                    cell.pending = None;
                    if holds {
                        // Also of an alarm that was taken over from the log.
                        cell.cause.renew(cause);
                    }
                } else if delay == Duration::ZERO {
                    self.change_condition(alarm, holds, cause, each);
                } else if cell.pending.is_none() {
                    cell.pending = Some(Pending { holds, due: now.after(delay), cause });
                }
            }
        }
        let has_origin = self.cells[alarm.0 as usize].cause.origin != known_origin;
        if is_certain != was_certain || has_origin {
            self.touch();
        }
        self.queue(alarm);
    }

    /// The condition came or went, delays counted.
    fn change_condition(
        &mut self,
        alarm: AlarmHandle,
        holds: bool,
        cause: Cause,
        each: RecordReceiver<'_>,
    ) {
        let latches = self.spec(alarm).latched;
        let now = self.now;
        let cell = &mut self.cells[alarm.0 as usize];
        (cell.pending, cell.cause) = (None, cause);
        if cell.standing.is_active == holds {
            return;
        }
        if holds {
            cell.chatter.record(now);
        }
        each(self.change(alarm, |standing| match holds {
            true => {
                standing.occur(latches);
                AlarmEvent::Occurred
            }
            false => {
                standing.return_to_normal();
                AlarmEvent::Returned
            }
        }));
    }

    /// Delays and shelves that are over.
    fn end_delays(&mut self, each: RecordReceiver<'_>) {
        while let Some(alarm) = self.timers.first_due(self.now) {
            let cell = &mut self.cells[alarm.0 as usize];
            let over = cell.pending.take_if(|pending| pending.due <= self.now);
            if let Some(Pending { holds, cause, .. }) = over {
                self.change_condition(alarm, holds, cause, each);
            }
            let latches = self.spec(alarm).latched;
            let cell = &mut self.cells[alarm.0 as usize];
            if cell.shelf_ends.take_if(|ends| *ends <= self.now).is_some() {
                each(self.change(alarm, |standing| {
                    standing.release(Hold::Shelf { until: None }, latches);
                    AlarmEvent::ShelfExpired
                }));
            }
            self.queue(alarm);
        }
    }

    fn spec(&self, alarm: AlarmHandle) -> &crate::AlarmSpec {
        &self.set.specs()[alarm.0 as usize]
    }
}

#[cfg(test)]
#[path = "step_tests.rs"]
mod tests;
