use busbar_plugin_sdk::{AlarmOrigin, AlarmState, Priority};
use serde_json::{Value, json};

use super::*;
use crate::settings::Settings;

const MINUTE: u64 = 60_000;
const START: u64 = 1_700_000_000_000;

fn config(recipients: Value) -> Config {
    let settings = json!({
        "recipients": recipients,
        "mail": { "host": "mail.test", "security": "none", "from": "busbar@test.example" },
        "webhooks": { "duty": { "url": "http://hooks.test/a" } },
    });
    serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap()
}

fn one() -> Config {
    config(json!([{ "name": "duty", "mail": ["duty@test.example"] }]))
}

fn alarm(id: &str, change: AlarmChange, state: AlarmState) -> AlarmNotification {
    AlarmNotification {
        number: 0,
        alarm: id.to_owned(),
        change,
        state,
        priority: Priority::High,
        occurred: 1_700_000_000_000_000_000,
        time: 1_700_000_000_000_000_000,
        place: vec!["=S12".to_owned(), "=S12D1".to_owned(), "=S12D1T1".to_owned()],
        group: Some("Cooling".to_owned()),
        message: format!("{id} is hot"),
        consequence: String::new(),
        response: String::new(),
        operator: None,
        value: None,
        origin: Vec::new(),
        is_certain: true,
        source: None,
    }
}

fn raised(id: &str) -> AlarmNotification {
    alarm(id, AlarmChange::Raised, AlarmState::Unacknowledged)
}

fn acknowledged(id: &str) -> AlarmNotification {
    let operator = Some("A. Operator".to_owned());
    AlarmNotification { operator, ..alarm(id, AlarmChange::Acknowledged, AlarmState::Acknowledged) }
}

/// A dispatcher that is handed changes in one run.
struct Desk {
    dispatcher: Dispatcher,
    config: Config,
    number: u64,
    now: u64,
}

impl Desk {
    fn new(config: Config) -> Self {
        Self { dispatcher: Dispatcher::new(1), config, number: 0, now: START }
    }

    fn take(&mut self, changes: Vec<AlarmNotification>) {
        let changes = changes.into_iter().map(|change| {
            self.number += 1;
            AlarmNotification { number: self.number, ..change }
        });
        let changes: Vec<_> = changes.collect();
        let batch =
            NotificationBatch { run: 1, handed: self.number, changes, ..Default::default() };
        self.dispatcher.take(&batch, &self.config, self.now);
    }

    fn take_list(&mut self, run: u64, alarms: Vec<AlarmNotification>, is_complete: bool) {
        self.number += 1;
        let standing = Some(StandingAlarms { number: self.number, alarms, is_complete });
        let handed = self.number;
        let batch = NotificationBatch { run, handed, standing, ..Default::default() };
        self.dispatcher.take(&batch, &self.config, self.now);
    }

    /// Plans and sends all that waits; returns recipients and subjects.
    fn send(&mut self) -> Vec<(String, String)> {
        self.dispatcher.plan(&self.config, self.now);
        let mut sent = Vec::new();
        while let Some(message) = self.dispatcher.begin(|_| true) {
            self.dispatcher.delivered(&message.key);
            sent.push((message.recipient, message.subject));
        }
        sent
    }

    fn subjects(&mut self) -> Vec<String> {
        self.send().into_iter().map(|(_, subject)| subject).collect()
    }

    fn restart(&mut self) {
        let text = serde_json::to_string(&self.dispatcher).unwrap();
        self.dispatcher = serde_json::from_str(&text).unwrap();
    }
}

#[test]
fn recipients_are_told_by_area_and_priority() {
    let mut desk = Desk::new(config(json!([
        { "name": "all", "mail": ["a@test.example"] },
        { "name": "critical", "mail": ["b@test.example"], "least_priority": "critical" },
        { "name": "above", "mail": ["c@test.example"], "areas": ["=S12D1"] },
        { "name": "beside", "mail": ["d@test.example"], "areas": ["=S12D2"] },
        { "name": "begins", "mail": ["e@test.example"], "areas": ["=S1*"] },
        { "name": "group", "mail": ["f@test.example"], "areas": ["Cooling"] },
    ])));
    desk.take(vec![raised("Oil")]);
    let told: Vec<_> = desk.send().into_iter().map(|(recipient, _)| recipient).collect();
    assert_eq!(told, ["all", "above", "begins", "group"]);
    desk.now += 2 * MINUTE;
    desk.take(vec![AlarmNotification { priority: Priority::Critical, ..raised("Fire") }]);
    assert!(desk.send().iter().any(|(recipient, _)| recipient == "critical"));
}

#[test]
fn an_alarm_escalates_while_nobody_acknowledges_and_repeats() {
    let recipients = json!([
        { "name": "first", "mail": ["a@test.example"], "repeat_seconds": 600 },
        { "name": "second", "mail": ["b@test.example"], "delay_seconds": 900 },
    ]);
    let mut desk = Desk::new(config(recipients.clone()));
    desk.take(vec![raised("Oil")]);
    assert_eq!(desk.send(), [("first".to_owned(), "HIGH: Oil is hot, =S12D1T1".to_owned())]);
    desk.now += 9 * MINUTE;
    assert_eq!(desk.send(), []);
    desk.now += MINUTE;
    let repeated = "HIGH, not acknowledged for 10 min: Oil is hot, =S12D1T1".to_owned();
    assert_eq!(desk.send(), [("first".to_owned(), repeated)]);
    desk.now += 5 * MINUTE;
    let escalated = "HIGH, not acknowledged for 15 min: Oil is hot, =S12D1T1".to_owned();
    assert_eq!(desk.send(), [("second".to_owned(), escalated)]);
    desk.take(vec![acknowledged("Oil")]);
    let ended = |name: &str| (name.to_owned(), "Acknowledged: Oil is hot, =S12D1T1".to_owned());
    assert_eq!(desk.send(), [ended("first"), ended("second")]);
    desk.now += 60 * MINUTE;
    assert_eq!(desk.send(), []);

    // Whoever acknowledges in time keeps it from the second.
    let mut desk = Desk::new(config(recipients));
    desk.take(vec![raised("Oil")]);
    desk.send();
    desk.now += MINUTE;
    desk.take(vec![acknowledged("Oil")]);
    desk.send();
    desk.now += 60 * MINUTE;
    assert_eq!(desk.send(), []);
}

#[test]
fn what_returns_within_a_delay_is_not_told_and_its_return_is_told_to_who_knows_of_it() {
    let mut desk = Desk::new(config(json!([
        { "name": "now", "mail": ["a@test.example"] },
        { "name": "later", "mail": ["b@test.example"], "delay_seconds": 60 },
    ])));
    desk.take(vec![raised("Oil")]);
    assert_eq!(desk.send().len(), 1);
    let returned = alarm("Oil", AlarmChange::Returned, AlarmState::ReturnedUnacknowledged);
    desk.take(vec![returned]);
    let told = "Returned to normal, not acknowledged: Oil is hot, =S12D1T1".to_owned();
    assert_eq!(desk.send(), [("now".to_owned(), told)]);
    desk.now += 10 * MINUTE;
    assert_eq!(desk.send(), []);
    // It comes again while it is open: told, but once the delay is over.
    desk.take(vec![raised("Oil")]);
    assert_eq!(desk.send().len(), 1, "the second recipient");
}

#[test]
fn a_flood_is_one_message_and_no_recipient_gets_more_than_its_limit_in_a_minute() {
    let limited = json!([{
        "name": "duty", "mail": ["duty@test.example"], "max_messages_per_minute": 3,
    }]);
    let mut desk = Desk::new(config(limited));
    desk.take((0..200).map(|number| raised(&format!("Alarm {number}"))).collect());
    assert_eq!(desk.subjects(), ["200 alarms: 200 high"]);
    let mut sent = Vec::new();
    for second in 1..=120 {
        desk.now = START + second * 1_000;
        desk.take(vec![raised(&format!("Late {second}"))]);
        sent.extend(desk.subjects().into_iter().map(|subject| (desk.now, subject)));
    }
    for (time, _) in &sent {
        let within = sent.iter().filter(|(other, _)| (*time..time + MINUTE).contains(other));
        assert!(within.count() <= 3, "{sent:?}");
    }
    desk.now += MINUTE;
    sent.extend(desk.subjects().into_iter().map(|subject| (desk.now, subject)));
    let told: usize = sent
        .iter()
        .map(|(_, subject)| match subject.split_once(" alarms: ") {
            Some((count, _)) => count.parse::<usize>().unwrap(),
            None => 1,
        })
        .sum();
    assert_eq!(told, 120, "every alarm is in some message: {sent:?}");
}

#[test]
fn what_is_not_live_says_so_and_recordings_wake_nobody_unless_the_settings_say_so() {
    let mut desk = Desk::new(config(json!([
        { "name": "duty", "mail": ["a@test.example"] },
        { "name": "trainer", "mail": ["b@test.example"], "recorded": true },
    ])));
    let simulated = AlarmNotification { origin: vec![AlarmOrigin::Simulated], ..raised("Oil") };
    desk.take(vec![simulated]);
    let sent = desk.send();
    let subject = "[SIMULATED] HIGH: Oil is hot, =S12D1T1".to_owned();
    assert_eq!(sent, [("duty".to_owned(), subject.clone()), ("trainer".to_owned(), subject)]);
    for origin in [AlarmOrigin::Recorded, AlarmOrigin::Historical] {
        let id = origin.name();
        desk.take(vec![AlarmNotification { origin: vec![origin], ..raised(id) }]);
        let sent = desk.send();
        assert_eq!(sent.len(), 1, "{sent:?}");
        assert_eq!(sent[0].0, "trainer");
        assert!(sent[0].1.starts_with(&format!("[{}] ", id.to_uppercase())), "{sent:?}");
    }
    // A mark stays, also where the alarm goes on by a live value.
    desk.take(vec![acknowledged("Oil")]);
    assert!(desk.send().iter().all(|(_, subject)| subject.starts_with("[SIMULATED] ")));
}

#[test]
fn nothing_is_told_twice_over_restarts_of_host_and_plugin() {
    let mut desk = Desk::new(one());
    desk.take(vec![raised("Oil"), raised("Gas")]);
    assert_eq!(desk.send().len(), 2);
    // The plugin: the host repeats what it does not know to be taken.
    desk.restart();
    let changes = vec![AlarmNotification { number: 2, ..raised("Gas") }];
    let batch = NotificationBatch { run: 1, handed: 2, changes, ..Default::default() };
    desk.dispatcher.take(&batch, &desk.config, desk.now);
    assert_eq!((desk.send(), desk.dispatcher.taken(1)), (vec![], 2));
    // The host: its numbers begin anew, and it lists what waits.
    desk.restart();
    desk.number = 0;
    let standing = |id: &str| alarm(id, AlarmChange::Standing, AlarmState::Unacknowledged);
    desk.take_list(2, vec![standing("Oil")], false);
    assert_eq!(desk.send(), []);
    let mut again = raised("Gas");
    again.occurred += 1;
    let changes = vec![AlarmNotification { number: 2, ..again }];
    let batch = NotificationBatch { run: 2, handed: 2, changes, ..Default::default() };
    desk.dispatcher.take(&batch, &desk.config, desk.now);
    assert_eq!(desk.send(), [], "it was told, and waits still");
    desk.number = 2;
    desk.take_list(2, vec![standing("Oil")], true);
    assert_eq!(desk.subjects(), ["Over: Gas is hot, =S12D1T1"]);
}

#[test]
fn an_alarm_from_the_file_wakes_nobody_before_the_host_has_named_it() {
    let recipients = json!([
        { "name": "second", "mail": ["b@test.example"], "delay_seconds": 60 },
    ]);
    let mut desk = Desk::new(config(recipients));
    desk.take(vec![raised("Oil")]);
    desk.restart();
    desk.now += 10 * MINUTE;
    assert_eq!(desk.send(), []);
    desk.take_list(2, vec![alarm("Oil", AlarmChange::Standing, AlarmState::Unacknowledged)], false);
    assert_eq!(desk.send().len(), 1);
}

#[test]
fn what_ends_before_it_was_sent_is_not_sent() {
    let mut desk = Desk::new(one());
    desk.take(vec![raised("Oil")]);
    desk.dispatcher.plan(&desk.config, desk.now);
    assert_eq!(desk.dispatcher.waiting(), 1);
    desk.take(vec![acknowledged("Oil")]);
    assert_eq!((desk.send(), desk.dispatcher.waiting()), (vec![], 0));
    // One whose hand-over has begun may have come: its end is told.
    desk.take(vec![raised("Gas")]);
    desk.dispatcher.plan(&desk.config, desk.now);
    let begun = desk.dispatcher.begin(|_| true).unwrap();
    desk.take(vec![acknowledged("Gas")]);
    desk.dispatcher.delivered(&begun.key);
    assert_eq!(desk.subjects(), ["Acknowledged: Gas is hot, =S12D1T1"]);
}

#[test]
fn shelving_is_an_end_and_unshelving_a_raise() {
    let mut desk = Desk::new(one());
    desk.take(vec![raised("Oil")]);
    desk.send();
    desk.take(vec![alarm("Oil", AlarmChange::Shelved, AlarmState::Shelved)]);
    assert_eq!(desk.subjects(), ["Shelved: Oil is hot, =S12D1T1"]);
    desk.take(vec![alarm("Oil", AlarmChange::Unshelved, AlarmState::Unacknowledged)]);
    assert_eq!(desk.subjects(), ["HIGH: Oil is hot, =S12D1T1"]);
}

#[test]
fn a_full_queue_keeps_alarms_for_the_next_digest() {
    let recipients: Vec<Value> = (0..60)
        .map(|number| {
            let mail: Vec<_> = (0..16).map(|at| format!("u{number}.{at}@test.example")).collect();
            json!({ "name": format!("r{number}"), "mail": mail })
        })
        .collect();
    let mut desk = Desk::new(config(json!(recipients)));
    desk.take(vec![raised("Oil")]);
    desk.dispatcher.plan(&desk.config, desk.now);
    assert!(desk.dispatcher.waiting() <= MAX_QUEUED_MESSAGES);
    let mut told = 0;
    for _ in 0..4 {
        told += desk.send().len();
    }
    assert_eq!((told, desk.dispatcher.undelivered()), (60 * 16, 0));
}

#[test]
fn a_message_that_is_too_old_is_given_up_and_counted() {
    let mut desk = Desk::new(one());
    desk.take(vec![raised("Oil")]);
    desk.dispatcher.plan(&desk.config, desk.now);
    let message = desk.dispatcher.begin(|_| true).unwrap();
    assert!(!desk.dispatcher.failed(&message.key, &desk.config, desk.now + MINUTE));
    let again = desk.dispatcher.begin(|_| true).unwrap();
    assert_eq!((again.key.as_str(), again.tries), (message.key.as_str(), 1));
    assert!(desk.dispatcher.failed(&again.key, &desk.config, desk.now + 24 * 60 * MINUTE));
    assert_eq!((desk.dispatcher.waiting(), desk.dispatcher.undelivered()), (0, 1));
}
