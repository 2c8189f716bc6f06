//! Composition of messages: subject and text. What is not live says so in both.

use busbar_plugin_sdk::{AlarmChange, AlarmNotification, AlarmState, Priority};
use jiff::Timestamp;

/// Alarms that a digest lists; further ones are counted.
const MAX_DIGEST_ALARMS: usize = 50;
/// Bytes of a subject.
const MAX_SUBJECT_BYTES: usize = 200;

/// Stage at which a recipient is told of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// First message about the alarm.
    First,
    /// Others were told, and nobody has acknowledged for so many milliseconds.
    Escalation(u64),
    /// The recipient was told, and nobody has acknowledged for so many milliseconds.
    Repetition(u64),
    /// End or return of an alarm that the recipient was told of.
    FollowUp,
}

/// Composed message with subject and text.
pub(crate) struct Composed {
    pub(crate) kind: &'static str,
    pub(crate) subject: String,
    pub(crate) text: String,
    pub(crate) alarms: Vec<AlarmNotification>,
}

/// Alarm of a message with its stage, and how often it came again.
type Part = (AlarmNotification, Stage, u32);

/// Composes a message about one alarm, or a digest of several.
pub(crate) fn compose(site: &str, parts: &[Part]) -> Composed {
    let site = if site.is_empty() { String::new() } else { format!("{site}: ") };
    let alarms = parts.iter().map(|(alarm, ..)| alarm.clone()).take(MAX_DIGEST_ALARMS).collect();
    match parts {
        [part] => {
            let (alarm, stage, _) = part;
            let marks = origin_marks(alarm);
            let subject = format!("{marks}{site}{}", headline(alarm, *stage));
            Composed {
                kind: kind(*stage),
                subject: one_line(&subject),
                text: describe(part),
                alarms,
            }
        }
        parts => {
            let all = |alarm: fn(&AlarmNotification) -> bool| {
                !parts.is_empty() && parts.iter().all(|(told, ..)| alarm(told))
            };
            let marks = match all(|alarm| !alarm.origin.is_empty()) {
                true => "[NOT LIVE] ",
                false => "",
            };
            let subject = format!("{marks}{site}{}", digest_headline(parts));
            let text = digest(parts);
            Composed { kind: "digest", subject: one_line(&subject), text, alarms }
        }
    }
}

fn kind(stage: Stage) -> &'static str {
    match stage {
        Stage::First => "alarm",
        Stage::Escalation(_) => "escalation",
        Stage::Repetition(_) => "repetition",
        Stage::FollowUp => "follow_up",
    }
}

/// Returns `[SIMULATED] ` and the like; nothing for a live alarm.
fn origin_marks(alarm: &AlarmNotification) -> String {
    alarm.origin.iter().map(|origin| format!("[{}] ", origin.name().to_uppercase())).collect()
}

/// Returns what a subject says of an alarm: `CRITICAL: Top oil hot, =T1`.
fn headline(alarm: &AlarmNotification, stage: Stage) -> String {
    let what = if alarm.message.is_empty() { &alarm.alarm } else { &alarm.message };
    let place = alarm.place.last().map(|id| format!(", {id}")).unwrap_or_default();
    let priority = alarm.priority.name().to_uppercase();
    match stage {
        Stage::First => format!("{priority}: {what}{place}"),
        Stage::Escalation(millis) | Stage::Repetition(millis) => {
            format!("{priority}, not acknowledged for {}: {what}{place}", duration(millis))
        }
        Stage::FollowUp => format!("{}: {what}{place}", outcome(alarm)),
    }
}

/// Returns how an alarm ended, or that it returned.
fn outcome(alarm: &AlarmNotification) -> String {
    match alarm.change {
        AlarmChange::Returned => "Returned to normal, not acknowledged".to_owned(),
        AlarmChange::Acknowledged => "Acknowledged".to_owned(),
        AlarmChange::Shelved => "Shelved".to_owned(),
        AlarmChange::Suppressed => "Suppressed by design".to_owned(),
        AlarmChange::RemovedFromService => "Taken out of service".to_owned(),
        _ if alarm.state == AlarmState::Normal => "Over".to_owned(),
        _ => format!("Now {}", alarm.state.name()),
    }
}

fn describe((alarm, stage, repetitions): &Part) -> String {
    let mut lines = Vec::new();
    if !alarm.origin.is_empty() {
        let names: Vec<_> = alarm.origin.iter().map(|origin| origin.name()).collect();
        lines.push(format!("NOT A LIVE VALUE: {}", names.join(", ").to_uppercase()));
        lines.push(String::new());
    }
    lines.push(headline(alarm, *stage));
    lines.push(String::new());
    let mut line = |name: &str, text: &str| {
        if !text.is_empty() {
            lines.push(format!("{name}: {text}"));
        }
    };
    line("Alarm", &alarm.alarm);
    line("Equipment", alarm.place.last().map_or("", String::as_str));
    let above = alarm.place.len().saturating_sub(1);
    line("Area", &alarm.place[..above].join(" / "));
    line("Group", alarm.group.as_deref().unwrap_or_default());
    line("Priority", alarm.priority.name());
    line("State", alarm.state.name());
    line("Came", &time(alarm.occurred));
    if alarm.time != alarm.occurred {
        line("Changed", &time(alarm.time));
    }
    line("By", alarm.operator.as_deref().unwrap_or_default());
    line("Value", alarm.value.as_deref().unwrap_or_default());
    if !alarm.is_certain {
        line("Quality", "not certain: the value or its source is bad or out of date");
    }
    if *repetitions > 0 {
        line("Came again", &format!("{repetitions} times since"));
    }
    line("Consequence", &alarm.consequence);
    line("Response", &alarm.response);
    line("Decided by", alarm.source.as_deref().unwrap_or_default());
    lines.push(String::new());
    lines.push(match stage {
        Stage::FollowUp => "You got a message about this alarm.".to_owned(),
        _ => "Nobody has acknowledged this alarm yet.".to_owned(),
    });
    lines.join("\n") + "\n"
}

/// Returns `37 alarms: 2 critical, 35 high`.
fn digest_headline(parts: &[Part]) -> String {
    let is_alarm = |part: &&Part| part.1 != Stage::FollowUp;
    let alarms: Vec<&Part> = parts.iter().filter(is_alarm).collect();
    let counts = Priority::ALL.into_iter().filter_map(|priority| {
        let count = alarms.iter().filter(|(alarm, ..)| alarm.priority == priority).count();
        (count > 0).then(|| format!("{count} {}", priority.name()))
    });
    let counts: Vec<String> = counts.collect();
    let updates = parts.len() - alarms.len();
    match (alarms.len(), updates) {
        (0, updates) => format!("{updates} updates on alarms"),
        (count, 0) => format!("{count} alarms: {}", counts.join(", ")),
        (count, updates) => format!("{count} alarms: {}; {updates} updates", counts.join(", ")),
    }
}

fn digest(parts: &[Part]) -> String {
    let mut text = format!("{}\n\n", digest_headline(parts));
    text += "They came faster than your limit of messages in a minute; this is one message for \
             all of them.\n\n";
    for (alarm, stage, _) in parts.iter().take(MAX_DIGEST_ALARMS) {
        let marks = origin_marks(alarm);
        text += &format!("- {marks}{} ({})\n", headline(alarm, *stage), time(alarm.time));
    }
    let more = parts.len().saturating_sub(MAX_DIGEST_ALARMS);
    if more > 0 {
        text += &format!("\nand {more} more: see the list of alarms.\n");
    }
    text
}

/// Returns a time in UTC by RFC 3339, to the second.
fn time(unix_nanos: i64) -> String {
    Timestamp::from_second(unix_nanos.div_euclid(1_000_000_000))
        .map_or_else(|_| "at an unknown time".to_owned(), |time| time.to_string())
}

/// Returns a duration for people: `15 min`.
fn duration(millis: u64) -> String {
    match millis / 1_000 {
        seconds @ 0..=119 => format!("{seconds} s"),
        seconds @ 120..=7_199 => format!("{} min", seconds / 60),
        seconds => format!("{} h", seconds / 3_600),
    }
}

/// Returns a text without control characters, cut at a character.
fn one_line(text: &str) -> String {
    let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    line[..line.floor_char_boundary(MAX_SUBJECT_BYTES)].to_owned()
}

/// Composes a test message.
pub(crate) fn test(site: &str, recipient: &str) -> Composed {
    let site = if site.is_empty() { String::new() } else { format!("{site}: ") };
    let text = format!(
        "This is a test message of Busbar to {recipient}. No alarm is behind it.\n\
         Alarms of this recipient come the same way.\n"
    );
    let subject = one_line(&format!("[TEST] {site}Test message"));
    Composed { kind: "test", subject, text, alarms: Vec::new() }
}
