//! Hand-over of changes to one plugin, on a thread of its own: a call may take as long as the
//! plugin takes. A change stays in the queue until the plugin has taken it.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use busbar_alarms::{
    AlarmNotification, DeliveryState, MAX_BATCH_CHANGES, NotificationBatch, NotificationReport,
    StandingAlarms,
};
use busbar_plugin_host::{LinkReport, LinkState};
use busbar_plugin_process::{Plugin, RunningNotifier};

/// Changes that wait for one plugin; further ones are counted, and the plugin is told.
const MAX_WAITING_CHANGES: usize = 10_000;
/// Period of calls without changes, which fetch the report.
const REPORT_PERIOD: Duration = Duration::from_secs(1);
/// Period of calls while the plugin has not taken what it was handed.
const REPEAT_PERIOD: Duration = Duration::from_millis(200);

/// Link and fault of a plugin that tells of alarms.
#[derive(Clone, Debug, Default)]
pub(crate) struct NotifierHealth {
    /// State of delivery to people.
    pub(crate) link: LinkReport,
    /// Reason why nothing can be handed over; none while the plugin answers.
    pub(crate) fault: Option<String>,
}

/// Item of the queue.
#[derive(Clone)]
enum Item {
    Change(Arc<AlarmNotification>),
    List(Arc<StandingAlarms>),
}

impl Item {
    fn number(&self) -> u64 {
        match self {
            Self::Change(change) => change.number,
            Self::List(list) => list.number,
        }
    }
}

#[derive(Default)]
struct State {
    ends: bool,
    /// True where the thread has something new to hand over.
    is_new: bool,
    queue: VecDeque<Item>,
    run: u64,
    handed: u64,
    /// Changes of this run that found no room.
    lost: u64,
    wants_list: bool,
    report: NotificationReport,
    fault: Option<String>,
    /// Grows with each change of report, fault or losses.
    revision: u64,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Queue to one plugin, and its thread.
pub(super) struct Handover {
    name: String,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    health: NotifierHealth,
    known_revision: Option<u64>,
}

impl Handover {
    pub(super) fn start(plugin: &Plugin, run: u64) -> Self {
        let shared = Arc::new(Shared::default());
        {
            let mut state = shared.state();
            (state.run, state.wants_list) = (run, true);
        }
        let (theirs, handle) = (Arc::clone(&shared), plugin.clone());
        let started = RunningNotifier::from_plugin(plugin).map_err(|error| error.to_string());
        let spawned = started.and_then(|notifier| {
            let work = move || hand_over_all(&handle, &notifier, &theirs);
            let thread = std::thread::Builder::new().name("notifications".into()).spawn(work);
            thread.map_err(|error| format!("no thread can be started to tell of alarms: {error}"))
        });
        let thread = spawned.inspect_err(|fault| shared.state().fault = Some(fault.clone())).ok();
        let health = NotifierHealth::default();
        Self { name: plugin.name().to_owned(), shared, thread, health, known_revision: None }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn health(&self) -> &NotifierHealth {
        &self.health
    }

    /// Puts a change into the queue; one that finds no room is counted.
    pub(super) fn push(&self, change: Arc<AlarmNotification>) {
        let mut state = self.shared.state();
        if state.queue.len() >= MAX_WAITING_CHANGES {
            state.lose(1);
            return;
        }
        state.queue.push_back(Item::Change(change));
        state.is_new = true;
        self.shared.changed.notify_all();
    }

    /// Counts changes that found no room elsewhere.
    pub(super) fn lose(&self, count: u64) {
        self.shared.state().lose(count);
    }

    /// Requests the list of standing alarms in the next step.
    pub(super) fn request_list(&self) {
        self.shared.state().wants_list = true;
    }

    /// Reports whether a list is wanted and has room.
    pub(super) fn takes_list(&self) -> bool {
        let state = self.shared.state();
        state.wants_list && state.queue.len() < MAX_WAITING_CHANGES
    }

    /// Puts the list of standing alarms into the queue. A first list before the site has settled
    /// may be empty, and is not worth a message.
    pub(super) fn push_list(&self, list: StandingAlarms) {
        let mut state = self.shared.state();
        state.wants_list = false;
        if list.is_complete || !list.alarms.is_empty() {
            state.queue.push_back(Item::List(Arc::new(list)));
            state.is_new = true;
            self.shared.changed.notify_all();
        }
    }

    /// Takes over the report of the plugin, where there is a new one.
    pub(super) fn refresh_health(&mut self) {
        let state = self.shared.state();
        if self.known_revision.replace(state.revision) == Some(state.revision) {
            return;
        }
        let mut message = state.report.message.clone();
        if state.lost > 0 {
            let lost = state.lost;
            message += &format!(
                " · {lost} changes of alarms found no room and are not told; the list of \
                 unacknowledged alarms was handed over after them"
            );
        }
        let link = LinkReport {
            state: match state.report.delivery {
                DeliveryState::Connecting => LinkState::Connecting,
                DeliveryState::Up => LinkState::Up,
                DeliveryState::Down => LinkState::Down,
            },
            message,
            ..LinkReport::default()
        };
        self.health = NotifierHealth { link, fault: state.fault.clone() };
    }

    pub(super) fn set_run(&self, run: u64) {
        self.shared.state().run = run;
    }

    /// Takes over the queue of an ended hand-over to the instance of the same name. Its first
    /// items may have been taken already, which the plugin knows by their numbers.
    pub(super) fn inherit(&self, before: &Self) {
        let mut old = before.shared.state();
        let mut state = self.shared.state();
        state.queue = std::mem::take(&mut old.queue);
        (state.handed, state.lost) = (old.handed, old.lost);
        state.report = std::mem::take(&mut old.report);
        state.revision += 1;
    }

    /// Ends the thread with its call, which has a deadline.
    pub(super) fn end(&mut self) {
        self.shared.state().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for Handover {
    fn drop(&mut self) {
        self.end();
    }
}

impl State {
    fn lose(&mut self, count: u64) {
        if self.lost == 0 {
            tracing::error!(
                "changes of alarms find no room: the plugin that tells of them is late"
            );
        }
        self.lost += count;
        self.revision += 1;
        self.wants_list = true;
    }

    /// Returns the next changes, or the next list of standing alarms.
    fn next_batch(&mut self) -> NotificationBatch {
        let mut batch =
            NotificationBatch { run: self.run, lost: self.lost, ..NotificationBatch::default() };
        for item in self.queue.iter().take(MAX_BATCH_CHANGES) {
            match item {
                Item::Change(change) => batch.changes.push(AlarmNotification::clone(change)),
                Item::List(list) if batch.changes.is_empty() => {
                    batch.standing = Some(StandingAlarms::clone(list));
                }
                Item::List(_) => break,
            }
            self.handed = self.handed.max(item.number());
            if batch.standing.is_some() {
                break;
            }
        }
        batch.handed = self.handed;
        batch
    }

    fn take(&mut self, outcome: Result<NotificationReport, String>) {
        match outcome {
            Ok(report) => {
                while self.queue.front().is_some_and(|item| item.number() <= report.taken) {
                    self.queue.pop_front();
                }
                if self.fault.take().is_some() || self.report != report {
                    self.revision += 1;
                }
                self.report = report;
            }
            Err(fault) => {
                if self.fault.as_ref() != Some(&fault) {
                    tracing::error!("alarms cannot be told: {fault}");
                    (self.fault, self.revision) = (Some(fault), self.revision + 1);
                }
            }
        }
    }
}

fn hand_over_all(plugin: &Plugin, notifier: &RunningNotifier, shared: &Shared) {
    let mut deaths = plugin.status().deaths;
    loop {
        let died = plugin.status().deaths;
        let batch = {
            let mut state = shared.state();
            state.wants_list |= died != deaths;
            state.is_new = false;
            state.next_batch()
        };
        deaths = died;
        let outcome = notifier.notify(batch).map_err(|error| error.to_string());
        let mut state = shared.state();
        state.take(outcome);
        let pause = if state.queue.is_empty() { REPORT_PERIOD } else { REPEAT_PERIOD };
        let idles = |state: &mut State| !state.ends && !state.is_new;
        let waited = shared.changed.wait_timeout_while(state, pause, idles);
        if waited.unwrap_or_else(PoisonError::into_inner).0.ends {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use busbar_alarms::AlarmChange;
    use busbar_tags::SourceTime;

    use busbar_types::{AlarmState, Origin, Priority};

    use super::*;

    fn change(number: u64) -> Item {
        Item::Change(Arc::new(AlarmNotification {
            number,
            alarm: "Hot".to_owned(),
            change: AlarmChange::Raised,
            state: AlarmState::Unacknowledged,
            priority: Priority::High,
            occurred: SourceTime(1),
            time: SourceTime(1),
            place: Vec::new(),
            group: None,
            message: String::new(),
            consequence: String::new(),
            response: String::new(),
            operator: None,
            value: None,
            origin: Origin::LIVE,
            is_certain: true,
            source: None,
        }))
    }

    fn numbers(batch: &NotificationBatch) -> Vec<u64> {
        let list = batch.standing.iter().map(|list| list.number);
        batch.changes.iter().map(|change| change.number).chain(list).collect()
    }

    #[test]
    fn changes_come_again_until_they_are_taken_and_a_list_comes_alone() {
        let list = StandingAlarms { number: 3, ..StandingAlarms::default() };
        let mut state = State { run: 7, ..State::default() };
        state.queue.extend([change(1), change(2), Item::List(Arc::new(list)), change(4)]);
        let report = |taken| Ok(NotificationReport { taken, ..NotificationReport::default() });
        assert_eq!(numbers(&state.next_batch()), [1, 2]);
        state.take(report(0));
        assert_eq!(numbers(&state.next_batch()), [1, 2], "nothing was taken");
        state.take(report(1));
        assert_eq!(numbers(&state.next_batch()), [2]);
        state.take(report(2));
        let batch = state.next_batch();
        assert_eq!((numbers(&batch), batch.handed, batch.run), (vec![3], 3, 7));
        state.take(Err("it died".to_owned()));
        assert_eq!(numbers(&state.next_batch()), [3], "a lost answer");
        state.take(report(3));
        assert_eq!((numbers(&state.next_batch()), &state.fault), (vec![4], &None));
    }

    #[test]
    fn a_batch_is_bounded() {
        let mut state = State::default();
        state.queue.extend((1..=1000).map(change));
        assert_eq!(state.next_batch().changes.len(), MAX_BATCH_CHANGES);
    }
}
