//! Dispatcher: which recipient is told of which alarm when, and the messages that wait.
//!
//! An alarm is open while it is unacknowledged and not held back. Whoever is to be told of an open
//! alarm gets a message after the recipient's delay. Escalation is a longer delay. An alarm that
//! comes again while it is open is the same alarm: it chatters, and was told.
//!
//! No clock is read and nothing is sent or written here: times are milliseconds since 1970, as the
//! caller has them.

mod escalation;

use std::collections::{BTreeMap, VecDeque};

use busbar_plugin_sdk::{AlarmChange, AlarmNotification, NotificationBatch, StandingAlarms};
use serde::{Deserialize, Serialize};

use crate::composition::{self, Stage};
use crate::settings::{Config, Recipient, Target};

/// Open alarms that are kept; further ones are counted as undelivered.
pub(crate) const MAX_OPEN_ALARMS: usize = 5_000;
/// Messages that wait. While there is no room for a recipient's messages, its alarms wait for the
/// next digest.
pub(crate) const MAX_QUEUED_MESSAGES: usize = 500;
/// Follow-ups of one recipient that wait for the next message; the oldest go first.
const MAX_WAITING_FOLLOW_UPS: usize = 500;
/// Repetitions of one alarm to one recipient.
const MAX_REPETITIONS: u32 = 100;
/// Window of the flood limit.
const FLOOD_WINDOW_MILLIS: u64 = 60_000;

/// All that is kept across a restart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Dispatcher {
    /// Run of the host whose numbers were taken last.
    run: u64,
    /// Greatest number of that run that was taken.
    taken: u64,
    /// Open alarms by their ids.
    open: BTreeMap<String, OpenAlarm>,
    /// Follow-ups by recipient that wait for the next message.
    follow_ups: BTreeMap<String, VecDeque<FollowUp>>,
    /// Messages in the order in which they were made.
    queue: VecDeque<Message>,
    /// Number of the last message.
    last_message: u64,
    /// Random part of message keys: two dispatchers have different ones.
    seed: u64,
    /// Times of the messages of the last minute, by recipient.
    recent: BTreeMap<String, VecDeque<u64>>,
    /// Messages that reached nobody and are not tried again.
    undelivered: u64,
}

/// Alarm that waits for somebody.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct OpenAlarm {
    /// Alarm as it was last handed over, with the time of its first occurrence.
    alarm: AlarmNotification,
    /// Time at which it was first handed over.
    since: u64,
    /// Number of times that it came again meanwhile.
    repetitions: u32,
    /// Recipients that were told, by name.
    told: BTreeMap<String, Told>,
    /// True after the host has named it in this run of the plugin.
    #[serde(skip)]
    is_confirmed: bool,
    has_told_return: bool,
}

/// Messages that a recipient got about an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Told {
    /// Time of the last message.
    last: u64,
    count: u32,
}

/// End or return of an alarm, for a recipient who was told of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct FollowUp {
    alarm: AlarmNotification,
}

/// Message to one address.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Message {
    /// Key that is the same at each try: a receiver can tell a repetition by it.
    pub(crate) key: String,
    pub(crate) recipient: String,
    pub(crate) target: Target,
    /// Word for the kind of message: `alarm`, `escalation`, `repetition`, `follow_up`, `digest` or
    /// `test`.
    pub(crate) kind: String,
    pub(crate) subject: String,
    pub(crate) text: String,
    /// Alarms of the message with their stage.
    pub(crate) alarms: Vec<AlarmNotification>,
    /// Time at which it was made.
    pub(crate) created: u64,
    /// Number of tries that failed.
    pub(crate) tries: u32,
    /// True while it is handed over.
    #[serde(skip)]
    pub(crate) is_in_flight: bool,
}

/// Notice that is due for a recipient.
enum Notice {
    Alarm { id: String, stage: Stage },
    FollowUp(Box<FollowUp>),
}

impl Dispatcher {
    /// Creates an empty dispatcher whose message keys begin with a random number.
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, ..Self::default() }
    }

    /// Returns the greatest number of a run that was taken; 0 for another run.
    pub(crate) fn taken(&self, run: u64) -> u64 {
        if self.run == run { self.taken } else { 0 }
    }

    /// Returns the number of messages that reached nobody.
    pub(crate) fn undelivered(&self) -> u64 {
        self.undelivered
    }

    /// Returns the number of messages that wait.
    pub(crate) fn waiting(&self) -> usize {
        self.queue.len()
    }

    /// Takes over what the host has handed over. What was taken before changes nothing.
    pub(crate) fn take(&mut self, batch: &NotificationBatch, config: &Config, now: u64) -> bool {
        if self.run != batch.run {
            (self.run, self.taken) = (batch.run, 0);
        }
        let before = self.taken;
        for change in batch.changes.iter().filter(|change| change.number > before) {
            self.take_change(change, config, now);
            self.taken = self.taken.max(change.number);
        }
        if let Some(list) = batch.standing.as_ref().filter(|list| list.number > before) {
            self.take_list(list, config, now);
            self.taken = self.taken.max(list.number);
        }
        self.taken > before
    }

    fn take_change(&mut self, change: &AlarmNotification, config: &Config, now: u64) {
        if change.state.is_unacknowledged() {
            self.keep_open(change, now);
            if change.change == AlarmChange::Returned {
                self.tell_return(change, config);
            }
        } else if let Some(open) = self.open.remove(&change.alarm) {
            let alarm = with_texts(change, &open.alarm);
            self.end(&open, &alarm, config);
        }
    }

    /// Adds or updates an open alarm.
    fn keep_open(&mut self, alarm: &AlarmNotification, now: u64) {
        if let Some(open) = self.open.get_mut(&alarm.alarm) {
            if alarm.change == AlarmChange::Raised {
                open.repetitions = open.repetitions.saturating_add(1);
                open.has_told_return = false;
            }
            let occurred = open.alarm.occurred;
            let mut origin = open.alarm.origin.clone();
            origin.extend(&alarm.origin);
            origin.sort_unstable();
            origin.dedup();
            open.alarm = AlarmNotification { occurred, origin, ..alarm.clone() };
            open.is_confirmed = true;
            return;
        }
        if self.open.len() >= MAX_OPEN_ALARMS {
            self.undelivered += 1;
            return;
        }
        let open = OpenAlarm {
            alarm: alarm.clone(),
            since: now,
            repetitions: 0,
            told: BTreeMap::new(),
            is_confirmed: true,
            has_told_return: false,
        };
        self.open.insert(alarm.alarm.clone(), open);
    }

    /// Follows a complete list of unacknowledged alarms: others are open no more.
    fn take_list(&mut self, list: &StandingAlarms, config: &Config, now: u64) {
        for alarm in &list.alarms {
            self.keep_open(alarm, now);
        }
        if !list.is_complete {
            return;
        }
        let is_listed = |id: &String| list.alarms.iter().any(|alarm| alarm.alarm == *id);
        let gone: Vec<String> = self.open.keys().filter(|id| !is_listed(id)).cloned().collect();
        for id in gone {
            if let Some(open) = self.open.remove(&id) {
                // Nobody knows when and by whom.
                let mut alarm = open.alarm.clone();
                (alarm.change, alarm.operator) = (AlarmChange::Standing, None);
                alarm.state = busbar_plugin_sdk::AlarmState::Normal;
                self.end(&open, &alarm, config);
            }
        }
    }

    /// Tells who was told that the alarm waits for nobody any more. Messages about it that wait are
    /// dropped: nobody needs them now.
    fn end(&mut self, open: &OpenAlarm, alarm: &AlarmNotification, config: &Config) {
        let is_about = |message: &Message| {
            matches!(message.alarms.as_slice(), [one] if one.alarm == alarm.alarm)
                && message.kind != "follow_up"
        };
        let mut unsent = Vec::new();
        self.queue.retain(|message| {
            let drops = is_about(message) && !message.is_in_flight && message.tries == 0;
            if drops {
                unsent.push(message.recipient.clone());
            }
            !drops
        });
        for recipient in &config.recipients {
            let Some(told) = open.told.get(&recipient.name) else { continue };
            let was_told = told.count > 1 || !unsent.contains(&recipient.name);
            if recipient.follow_up && was_told {
                self.add_follow_up(recipient, alarm);
            }
        }
    }

    fn tell_return(&mut self, change: &AlarmNotification, config: &Config) {
        let Some(open) = self.open.get_mut(&change.alarm) else { return };
        if std::mem::replace(&mut open.has_told_return, true) {
            return;
        }
        let told = open.told.clone();
        for recipient in &config.recipients {
            if recipient.follow_up && told.contains_key(&recipient.name) {
                self.add_follow_up(recipient, change);
            }
        }
    }

    fn add_follow_up(&mut self, recipient: &Recipient, alarm: &AlarmNotification) {
        let waiting = self.follow_ups.entry(recipient.name.clone()).or_default();
        if waiting.len() >= MAX_WAITING_FOLLOW_UPS {
            waiting.pop_front();
            self.undelivered += 1;
        }
        waiting.push_back(FollowUp { alarm: alarm.clone() });
    }

    /// Makes the messages that are due; reports whether there are any.
    pub(crate) fn plan(&mut self, config: &Config, now: u64) -> bool {
        self.follow_ups.retain(|name, _| config.recipients.iter().any(|one| one.name == *name));
        let mut has_new = false;
        for recipient in &config.recipients {
            has_new |= self.plan_for(recipient, config, now);
        }
        has_new
    }

    fn plan_for(&mut self, recipient: &Recipient, config: &Config, now: u64) -> bool {
        let recent = self.recent.entry(recipient.name.clone()).or_default();
        recent.retain(|time| time.saturating_add(FLOOD_WINDOW_MILLIS) > now && *time <= now);
        let free = recipient.max_per_minute.saturating_sub(recent.len());
        let room = MAX_QUEUED_MESSAGES.saturating_sub(self.queue.len());
        let free = free.min(room / recipient.targets.len().max(1));
        if free == 0 {
            return false;
        }
        let due = self.due_alarms(recipient, now);
        let follow_ups = self.follow_ups.get(&recipient.name).map_or(0, VecDeque::len);
        if due.is_empty() && follow_ups == 0 {
            return false;
        }
        let mut notices: Vec<Notice> =
            due.into_iter().map(|(id, stage)| Notice::Alarm { id, stage }).collect();
        let waiting = self.follow_ups.remove(&recipient.name).unwrap_or_default();
        notices.extend(waiting.into_iter().map(|waits| Notice::FollowUp(Box::new(waits))));
        if notices.len() <= free {
            for notice in notices {
                self.add_message(recipient, config, vec![notice], now);
            }
        } else {
            self.add_message(recipient, config, notices, now);
        }
        true
    }

    /// Puts one message for each address of a recipient into the queue.
    fn add_message(
        &mut self,
        recipient: &Recipient,
        config: &Config,
        notices: Vec<Notice>,
        now: u64,
    ) {
        let mut parts = Vec::new();
        for notice in notices {
            match notice {
                Notice::Alarm { id, stage } => {
                    let Some(open) = self.open.get_mut(&id) else { continue };
                    let told = open.told.entry(recipient.name.clone());
                    let told = told.or_insert(Told { last: now, count: 0 });
                    *told = Told { last: now, count: told.count.saturating_add(1) };
                    parts.push((open.alarm.clone(), stage, open.repetitions));
                }
                Notice::FollowUp(waits) => parts.push((waits.alarm, Stage::FollowUp, 0)),
            }
        }
        let composed = composition::compose(&config.site, &parts);
        self.last_message += 1;
        for (index, target) in recipient.targets.iter().enumerate() {
            self.queue.push_back(Message {
                key: format!("{:016x}-{}-{index}", self.seed, self.last_message),
                recipient: recipient.name.clone(),
                target: target.clone(),
                kind: composed.kind.to_owned(),
                subject: composed.subject.clone(),
                text: composed.text.clone(),
                alarms: composed.alarms.clone(),
                created: now,
                tries: 0,
                is_in_flight: false,
            });
        }
        self.recent.entry(recipient.name.clone()).or_default().push_back(now);
    }

    /// Begins to hand over the oldest message that fits; it stays in the queue meanwhile.
    pub(crate) fn begin(&mut self, fits: impl Fn(&Target) -> bool) -> Option<Message> {
        let is_next = |message: &&mut Message| fits(&message.target) && !message.is_in_flight;
        let message = self.queue.iter_mut().find(is_next)?;
        message.is_in_flight = true;
        Some(message.clone())
    }

    /// Removes a message that was delivered.
    pub(crate) fn delivered(&mut self, key: &str) {
        self.queue.retain(|message| message.key != key);
    }

    /// Removes a message that will never be delivered.
    pub(crate) fn give_up(&mut self, key: &str) {
        let before = self.queue.len();
        self.delivered(key);
        self.undelivered += (before - self.queue.len()) as u64;
    }

    /// Keeps a message for the next try; one that is too old is given up, which is reported.
    pub(crate) fn failed(&mut self, key: &str, config: &Config, now: u64) -> bool {
        let Some(message) = self.queue.iter_mut().find(|message| message.key == key) else {
            return false;
        };
        message.is_in_flight = false;
        message.tries = message.tries.saturating_add(1);
        let age = now.saturating_sub(message.created);
        let is_too_old = u128::from(age) >= config.give_up.as_millis();
        if is_too_old {
            self.give_up(key);
        }
        is_too_old
    }

    /// Removes messages to addresses that the settings do not have any more; returns their number.
    pub(crate) fn drop_unknown_targets(&mut self, config: &Config) -> usize {
        let before = self.queue.len();
        let is_known = |target: &Target| {
            config.recipients.iter().any(|recipient| recipient.targets.contains(target))
        };
        self.queue.retain(|message| is_known(&message.target));
        self.open.values_mut().for_each(|open| {
            open.told.retain(|name, _| config.recipients.iter().any(|one| one.name == *name));
        });
        before - self.queue.len()
    }

    /// Reports whether counts and times of a dispatcher that was read can be those of one.
    pub(crate) fn is_plausible(&self) -> bool {
        self.open.len() <= MAX_OPEN_ALARMS
            && self.queue.len() <= MAX_QUEUED_MESSAGES
            && self.open.iter().all(|(id, open)| *id == open.alarm.alarm)
    }
}

/// Returns a change with the texts of the alarm where it has none: a source that does not list an
/// alarm any more says nothing else of it.
fn with_texts(change: &AlarmNotification, known: &AlarmNotification) -> AlarmNotification {
    let mut alarm = change.clone();
    if alarm.message.is_empty() && alarm.place.is_empty() {
        (alarm.message, alarm.place) = (known.message.clone(), known.place.clone());
        (alarm.priority, alarm.group) = (known.priority, known.group.clone());
    }
    alarm.occurred = known.occurred;
    let mut origin = known.origin.clone();
    origin.extend(&alarm.origin);
    origin.sort_unstable();
    origin.dedup();
    AlarmNotification { origin, ..alarm }
}

#[cfg(test)]
#[path = "dispatcher_tests.rs"]
mod tests;
