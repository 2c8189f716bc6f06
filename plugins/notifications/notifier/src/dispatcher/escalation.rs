//! Escalation: which recipient is due to be told of an open alarm, after which delay, and how often
//! again.

use super::{Dispatcher, MAX_REPETITIONS, OpenAlarm};
use crate::composition::Stage;
use crate::settings::Recipient;

impl Dispatcher {
    /// Returns the open alarms that a recipient is to be told of now, the most urgent first.
    pub(super) fn due_alarms(&self, recipient: &Recipient, now: u64) -> Vec<(String, Stage)> {
        let mut due: Vec<(&OpenAlarm, Stage)> = Vec::new();
        for open in self.open.values().filter(|open| open.is_confirmed) {
            if !recipient.is_told_of(&open.alarm) {
                continue;
            }
            let waited = now.saturating_sub(open.since);
            match open.told.get(&recipient.name) {
                // What has returned by itself within a delay wakes nobody further.
                None if (open.alarm.state.is_active() || recipient.delay_millis == 0)
                    && waited >= recipient.delay_millis =>
                {
                    let escalates = recipient.delay_millis > 0 && !open.told.is_empty();
                    let stage = if escalates { Stage::Escalation(waited) } else { Stage::First };
                    due.push((open, stage));
                }
                None => {}
                Some(told) => {
                    let period = recipient.repeat_millis.filter(|_| told.count <= MAX_REPETITIONS);
                    let is_over = |period| now >= told.last.saturating_add(period);
                    if period.is_some_and(is_over) {
                        due.push((open, Stage::Repetition(waited)));
                    }
                }
            }
        }
        due.sort_by_key(|(open, _)| (open.alarm.priority, open.since));
        due.into_iter().map(|(open, stage)| (open.alarm.alarm.clone(), stage)).collect()
    }
}
