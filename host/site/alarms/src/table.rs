//! Alarm table: the state of every alarm.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use busbar_tags::{Change, Moment, SourceTime};
use busbar_types::{AlarmAction, AlarmState, Origin, Priority, Value};

use crate::chatter::Chatter;
use crate::first_out::Group;
use crate::state_transitions::Hold;
use crate::timers::Timers;
use crate::verdict_input::VerdictInput;
use crate::{
    ActionError, AlarmEvent, AlarmFlags, AlarmHandle, AlarmRecord, AlarmSet, AlarmSpec,
    MAX_OPERATOR_BYTES,
};

/// The alarms of a scene and their states.
#[derive(Debug)]
pub struct AlarmTable {
    pub(crate) set: Arc<AlarmSet>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) timers: Timers,
    pub(crate) groups: Vec<Group>,
    /// Alarms whose condition came since the last step, in order.
    pub(crate) pulses: Vec<AlarmHandle>,
    /// Verdicts of overlays since the last step, in order.
    pub(crate) verdicts: Vec<VerdictInput>,
    /// Alarms that are not normal.
    open: BTreeSet<AlarmHandle>,
    counts: [StateCounts; Priority::ALL.len()],
    /// Number of the next record.
    next_number: u64,
    pub(crate) now: Moment,
    pub(crate) wall_clock: SourceTime,
    max_shelving: Duration,
    /// True until the first step, which evaluates every alarm.
    pub(crate) is_new: bool,
    revision: u64,
}

/// Run-time state of an alarm.
#[derive(Debug, Default)]
pub(crate) struct Cell {
    pub(crate) standing: AlarmFlags,
    /// True while the condition holds, delays aside.
    pub(crate) holds: bool,
    /// True while its tag's quality is good, or its verdict is known.
    pub(crate) is_certain: bool,
    /// Reason why its verdict is unknown.
    pub(crate) uncertainty: Option<Arc<str>>,
    /// Change of the condition whose delay is running.
    pub(crate) pending: Option<Pending>,
    /// Time at which shelving expires.
    pub(crate) shelf_ends: Option<Moment>,
    /// Due time in the timer queue.
    pub(crate) queued: Option<Moment>,
    pub(crate) chatter: Chatter,
    pub(crate) is_first_out: bool,
    /// Times of the last change of state and of the last occurrence.
    since: Option<SourceTime>,
    occurred: Option<SourceTime>,
    pub(crate) cause: Cause,
    /// Cause of a condition that came since the last step.
    pub(crate) pulse: Option<Cause>,
}

/// Delay that is running.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pending {
    /// True for a condition that came, false for one that went.
    pub(crate) holds: bool,
    pub(crate) due: Moment,
    pub(crate) cause: Cause,
}

/// Value or verdict by which a condition was evaluated.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Cause {
    pub(crate) value: Option<Value>,
    pub(crate) source_time: Option<SourceTime>,
    pub(crate) origin: Origin,
    /// True for a verdict that rests on a default of its overlay.
    pub(crate) is_assumed: bool,
    /// Reason of the verdict.
    pub(crate) reason: Option<Arc<str>>,
}

/// An alarm at the instant of the last step.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmStatus {
    /// Flags from which the state follows.
    pub standing: AlarmFlags,
    /// State by IEC 62682.
    pub state: AlarmState,
    /// True where the quality of its tag is good or its verdict is known; always for a mirrored
    /// one.
    pub is_certain: bool,
    /// Time of the last change of state.
    pub since: Option<SourceTime>,
    /// Time of the last occurrence.
    pub occurred: Option<SourceTime>,
    /// Occurrences since the start.
    pub occurrences: u64,
    /// True while the alarm chatters: [`CHATTER_OCCURRENCES`](crate::CHATTER_OCCURRENCES) within
    /// [`CHATTER_WINDOW`](crate::CHATTER_WINDOW).
    pub chatters: bool,
    /// True for the first-out alarm of its group.
    pub is_first_out: bool,
    /// Time until shelving expires.
    pub shelf_left: Option<Duration>,
    /// The value by which its condition came or went last.
    pub value: Option<Value>,
    /// Origin of that value or verdict: live, or simulated, recorded and the like.
    pub origin: Origin,
    /// True where the verdict rests on a default of its overlay.
    pub is_assumed: bool,
}

/// Numbers of alarms by state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StateCounts([usize; AlarmState::ALL.len()]);

impl StateCounts {
    /// Returns the number of alarms in a state.
    pub fn count(&self, state: AlarmState) -> usize {
        self.0[state as usize]
    }

    /// Returns the number of unacknowledged alarms.
    pub fn unacknowledged(&self) -> usize {
        self.sum(AlarmState::is_unacknowledged)
    }

    /// Returns the number of alarms in the alarm list.
    pub fn annunciated(&self) -> usize {
        self.sum(AlarmState::is_annunciated)
    }

    fn sum(&self, counts: impl Fn(AlarmState) -> bool) -> usize {
        AlarmState::ALL
            .into_iter()
            .filter(|state| counts(*state))
            .map(|state| self.count(state))
            .sum()
    }
}

impl AlarmTable {
    /// Creates a table with all alarms normal at `now`. `max_shelving` is the longest shelving
    /// time.
    pub fn new(set: Arc<AlarmSet>, max_shelving: Duration, now: Moment) -> Self {
        let mut counts = [StateCounts::default(); Priority::ALL.len()];
        let cell = |spec: &AlarmSpec| {
            counts[spec.priority as usize].0[AlarmState::Normal as usize] += 1;
            Cell::new(spec)
        };
        Self {
            cells: set.specs().iter().map(cell).collect(),
            groups: vec![Group::default(); set.group_count() as usize],
            timers: Timers::default(),
            pulses: Vec::new(),
            verdicts: Vec::new(),
            open: BTreeSet::new(),
            counts,
            next_number: 1,
            now,
            wall_clock: SourceTime(0),
            max_shelving,
            is_new: true,
            revision: 0,
            set,
        }
    }

    /// Adopts a set with further alarms behind those of the present one
    /// ([`AlarmSet::extended`]). They are normal, and uncertain until they are judged.
    pub fn extend(&mut self, set: Arc<AlarmSet>) {
        debug_assert!(set.specs().starts_with(self.set.specs()), "alarms keep their handles");
        for spec in set.specs().iter().skip(self.cells.len()) {
            self.counts[spec.priority as usize].0[AlarmState::Normal as usize] += 1;
            self.cells.push(Cell::new(spec));
        }
        self.groups.resize(set.group_count() as usize, Group::default());
        self.set = set;
        self.revision += 1;
        // What suppresses a new alarm may hold already.
        self.is_new = true;
    }

    /// Records an overlay's verdict on the equipment of an alarm, which the next step evaluates.
    /// A verdict that changed nothing need not be recorded.
    pub fn note_verdict(&mut self, input: VerdictInput) {
        self.verdicts.push(input);
    }

    /// Restores the state from an audit log: the last flags of each alarm and the number of the
    /// last record. Alarms that no longer exist are skipped. Active and suppressed alarms stay so
    /// until a tag decides otherwise. To be called before the first step.
    pub fn restore<'a>(
        &mut self,
        standings: impl IntoIterator<Item = (&'a str, AlarmFlags, SourceTime)>,
        last_number: u64,
        wall_clock: SourceTime,
    ) {
        self.next_number = last_number + 1;
        self.wall_clock = wall_clock;
        for (id, standing, since) in standings {
            let Some(alarm) = self.set.find(id) else { continue };
            let spec = &self.set.specs()[alarm.0 as usize];
            let cell = &mut self.cells[alarm.0 as usize];
            let before = cell.standing.state();
            cell.standing = standing;
            cell.standing.is_latched &= spec.latched || spec.source.is_mirrored();
            if standing.is_suppressed && !spec.source.is_suppressible() {
                // The configuration no longer suppresses it.
                cell.standing.release(Hold::Suppression, spec.latched);
            }
            cell.holds = standing.is_active;
            (cell.since, cell.occurred) = (Some(since), standing.is_active.then_some(since));
            if let Some(until) = standing.shelved_until {
                let left = until.0.saturating_sub(wall_clock.0).max(0) as u64;
                let left = Duration::from_nanos(left).min(self.max_shelving);
                cell.shelf_ends = Some(self.now.after(left));
            }
            let after = cell.standing.state();
            self.recount(alarm, before, after);
            if let Some(group) = self.set.group(alarm).filter(|_| after.is_annunciated()) {
                self.groups[group as usize].enter_unordered();
            }
            self.queue(alarm);
        }
    }

    /// Inherits the alarms of another table with the same ids, whatever their limits and tags:
    /// flags, times, shelving and first-out marks. Delays continue for equal conditions. Tags are
    /// evaluated in the next step. To be called before the first step.
    pub fn inherit(&mut self, before: Self, is_same: impl Fn(&str) -> bool) {
        (self.next_number, self.now) = (before.next_number, self.now.max(before.now));
        (self.wall_clock, self.revision) = (before.wall_clock, before.revision + 1);
        for (spec, mut cell) in before.set.specs().iter().zip(before.cells) {
            let Some(alarm) = self.set.find(&spec.id) else { continue };
            let own = &self.set.specs()[alarm.0 as usize];
            let is_mirrored = own.source.is_mirrored();
            if is_mirrored != spec.source.is_mirrored() {
                // Somebody else decides now: nothing that was decided holds.
                continue;
            }
            cell.standing.is_latched &= own.latched || is_mirrored;
            if cell.standing.is_suppressed && !own.source.is_suppressible() {
                cell.standing.release(Hold::Suppression, own.latched);
            }
            if !is_same(&spec.id) {
                // A delay of another condition says nothing.
                cell.pending = None;
            }
            (cell.queued, cell.pulse) = (None, None);
            let (was_first, after) = (cell.is_first_out, cell.standing.state());
            let group = self.set.group(alarm).filter(|_| after.is_annunciated());
            cell.is_first_out &= group.is_some();
            self.cells[alarm.0 as usize] = cell;
            self.recount(alarm, AlarmState::Normal, after);
            if let Some(group) = group {
                let group = &mut self.groups[group as usize];
                group.enter_unordered();
                group.first = group.first.or(was_first.then_some(alarm));
            }
            self.queue(alarm);
        }
    }

    /// Returns the alarm definitions.
    pub fn set(&self) -> &Arc<AlarmSet> {
        &self.set
    }

    /// Returns the current status of an alarm.
    pub fn status(&self, alarm: AlarmHandle) -> Option<AlarmStatus> {
        let cell = self.cells.get(alarm.0 as usize)?;
        Some(AlarmStatus {
            standing: cell.standing,
            state: cell.standing.state(),
            is_certain: cell.is_certain,
            since: cell.since,
            occurred: cell.occurred,
            occurrences: cell.chatter.count,
            chatters: cell.chatter.chatters(self.now),
            is_first_out: cell.is_first_out,
            shelf_left: cell.shelf_ends.map(|ends| ends.since(self.now)),
            value: cell.cause.value.clone(),
            origin: cell.cause.origin,
            is_assumed: cell.cause.is_assumed,
        })
    }

    /// Returns the reason of the verdict by which an alarm came or went last; none of an alarm of
    /// a tag.
    pub fn reason(&self, alarm: AlarmHandle) -> Option<&str> {
        self.cells.get(alarm.0 as usize)?.cause.reason.as_deref()
    }

    /// Returns the reason why an alarm's verdict is unknown.
    pub fn uncertainty(&self, alarm: AlarmHandle) -> Option<&str> {
        self.cells.get(alarm.0 as usize)?.uncertainty.as_deref()
    }

    /// The alarms that are not normal, by handle.
    pub fn open(&self) -> impl ExactSizeIterator<Item = AlarmHandle> {
        self.open.iter().copied()
    }

    /// Reports whether an alarm is not normal.
    pub fn is_open(&self, alarm: AlarmHandle) -> bool {
        self.open.contains(&alarm)
    }

    /// Returns the numbers of alarms of a priority by state.
    pub fn counts(&self, priority: Priority) -> StateCounts {
        self.counts[priority as usize]
    }

    /// Returns a number that changes with every event, and when an alarm becomes certain or
    /// uncertain.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the time at which the next delay or shelving ends.
    pub fn next_due(&self) -> Option<Moment> {
        self.timers.next()
    }

    /// Performs an operator's action at the instant of the last step.
    ///
    /// # Errors
    /// Whatever has no meaning for the alarm as it is; nothing has changed then.
    pub fn perform(
        &mut self,
        alarm: AlarmHandle,
        action: AlarmAction,
        operator: &str,
    ) -> Result<AlarmRecord, ActionError> {
        let spec = self.set.spec(alarm).ok_or(ActionError::Unknown)?;
        let (id, latches) = (|| spec.id.clone(), spec.latched);
        if spec.source.is_mirrored() {
            return Err(ActionError::Mirrored { alarm: id() });
        }
        if operator.trim().is_empty() || operator.len() > MAX_OPERATOR_BYTES {
            return Err(ActionError::Nameless);
        }
        let cell = &mut self.cells[alarm.0 as usize];
        if !cell.standing.allows(action) {
            let state = cell.standing.state();
            return Err(ActionError::Illegal { alarm: id(), action, state });
        }
        let mut until = None;
        if let AlarmAction::Shelve(asked) = action {
            let most = self.max_shelving;
            if asked.is_zero() || asked > most {
                return Err(ActionError::ShelvingTime { alarm: id(), asked, most });
            }
            cell.shelf_ends = Some(self.now.after(asked));
            let nanos = i64::try_from(asked.as_nanos()).unwrap_or(i64::MAX);
            until = Some(SourceTime(self.wall_clock.0.saturating_add(nanos)));
        }
        if action == AlarmAction::Unshelve {
            cell.shelf_ends = None;
        }
        let mut record = self.change(alarm, |standing| standing.apply(action, until, latches));
        record.operator = Some(operator.to_owned());
        self.queue(alarm);
        Ok(record)
    }

    /// Sets an alarm to the state reported by another alarm system; none where it has that state
    /// already. `until` is the end of shelving.
    ///
    /// # Errors
    /// [`ActionError::Unknown`], also for an alarm that is decided on here.
    pub fn mirror(
        &mut self,
        alarm: AlarmHandle,
        state: AlarmState,
        until: Option<SourceTime>,
        operator: Option<&str>,
    ) -> Result<Option<AlarmRecord>, ActionError> {
        let spec = self.set.spec(alarm).filter(|spec| spec.source.is_mirrored());
        spec.ok_or(ActionError::Unknown)?;
        let standing = AlarmFlags::from_state(state, until);
        let before = self.cells[alarm.0 as usize].standing;
        if before == standing {
            return Ok(None);
        }
        if standing.is_active && !before.is_active {
            self.cells[alarm.0 as usize].chatter.record(self.now);
        }
        let mut record = self.change(alarm, |now| {
            *now = standing;
            AlarmEvent::Mirrored
        });
        record.operator = operator.map(str::to_owned);
        Ok(Some(record))
    }

    /// Changes the standing of an alarm, and all that follows from its state.
    pub(crate) fn change(
        &mut self,
        alarm: AlarmHandle,
        change: impl FnOnce(&mut AlarmFlags) -> AlarmEvent,
    ) -> AlarmRecord {
        let cell = &mut self.cells[alarm.0 as usize];
        let from = cell.standing.state();
        let was_active = cell.standing.is_active;
        let happened = change(&mut cell.standing);
        let (standing, to, cause) = (cell.standing, cell.standing.state(), cell.cause.clone());
        if from != to {
            cell.since = Some(self.wall_clock);
        }
        if standing.is_active && !was_active {
            cell.occurred = Some(self.wall_clock);
        }
        if let Some(group) = self.set.group(alarm) {
            let group = &mut self.groups[group as usize];
            match (from.is_annunciated(), to.is_annunciated()) {
                (false, true) => {
                    group.enter(alarm);
                    cell.is_first_out = group.first == Some(alarm);
                }
                (true, false) => {
                    group.leave(alarm);
                    cell.is_first_out = false;
                }
                _ => {}
            }
        }
        let is_first_out = cell.is_first_out;
        self.recount(alarm, from, to);
        let number = self.next_number;
        self.next_number += 1;
        let is_of_condition = matches!(happened, AlarmEvent::Occurred | AlarmEvent::Returned);
        AlarmRecord {
            number,
            time: self.wall_clock,
            alarm: self.set.specs()[alarm.0 as usize].id.clone(),
            happened,
            from,
            to,
            standing,
            operator: None,
            value: cause.value.filter(|_| is_of_condition),
            source_time: cause.source_time.filter(|_| is_of_condition),
            // Also of what an operator does: it is done to an alarm that is not live.
            origin: cause.origin,
            is_assumed: cause.is_assumed,
            reason: cause.reason.filter(|_| is_of_condition).map(|reason| reason.to_string()),
            is_first_out,
        }
    }

    pub(crate) fn touch(&mut self) {
        self.revision += 1;
    }

    fn recount(&mut self, alarm: AlarmHandle, from: AlarmState, to: AlarmState) {
        self.revision += 1;
        let counts = &mut self.counts[self.set.specs()[alarm.0 as usize].priority as usize];
        counts.0[from as usize] -= 1;
        counts.0[to as usize] += 1;
        if to == AlarmState::Normal {
            self.open.remove(&alarm);
        } else {
            self.open.insert(alarm);
        }
    }

    /// Schedules an alarm in the timer queue for its next due time.
    pub(crate) fn queue(&mut self, alarm: AlarmHandle) {
        let cell = &mut self.cells[alarm.0 as usize];
        let pending = cell.pending.as_ref().map(|pending| pending.due);
        let due = pending.into_iter().chain(cell.shelf_ends).min();
        self.timers.set(alarm, cell.queued, due);
        cell.queued = due;
    }
}

impl Cell {
    fn new(spec: &AlarmSpec) -> Self {
        Self { is_certain: spec.source.is_mirrored(), ..Self::default() }
    }
}

impl Cause {
    pub(crate) fn from_change(change: &Change) -> Self {
        let &Change { source_time, origin, .. } = change;
        Self { value: change.value.clone(), source_time, origin, ..Self::default() }
    }

    /// Adds what a condition that holds still rests on: its origin; of a verdict, the reason too.
    pub(crate) fn renew(&mut self, now: Self) {
        self.origin |= now.origin;
        if now.reason.is_some() {
            (self.reason, self.is_assumed) = (now.reason, now.is_assumed);
        }
    }
}
