//! Notifications: changes of alarms that plugins tell to people who are not in the room.

use busbar_tags::SourceTime;
use busbar_types::{AlarmState, Origin, Priority};
use serde::{Deserialize, Serialize};

use crate::record::origin_names;

/// Changes of one batch.
pub const MAX_BATCH_CHANGES: usize = 256;
/// Alarms of one standing list; the least urgent are left out.
pub const MAX_STANDING_ALARMS: usize = 2_000;
/// Bytes of the sentence about delivery.
pub const MAX_DELIVERY_MESSAGE_BYTES: usize = 1_024;

/// Kinds of a change that people are told of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlarmChange {
    /// The alarm came, or came again after it had returned.
    Raised,
    /// The condition of the alarm went.
    Returned,
    /// Somebody acknowledged the alarm.
    Acknowledged,
    /// An operator shelved the alarm.
    Shelved,
    /// The alarm came off the shelf.
    Unshelved,
    /// The alarm was suppressed by design.
    Suppressed,
    /// Suppression by design ended.
    Unsuppressed,
    /// An operator took the alarm out of service.
    RemovedFromService,
    /// An operator returned the alarm to service.
    ReturnedToService,
    /// Nothing changed: the alarm stands as told, in a standing list.
    Standing,
}

impl AlarmChange {
    /// Returns the kind of a change between two states; none where nobody needs to be told.
    pub fn between(from: AlarmState, to: AlarmState) -> Option<Self> {
        let is_active = |state: AlarmState| {
            matches!(state, AlarmState::Unacknowledged | AlarmState::Acknowledged)
        };
        match (from, to) {
            _ if from == to => None,
            (_, AlarmState::Shelved) => Some(Self::Shelved),
            (_, AlarmState::SuppressedByDesign) => Some(Self::Suppressed),
            (_, AlarmState::OutOfService) => Some(Self::RemovedFromService),
            (AlarmState::Shelved, _) => Some(Self::Unshelved),
            (AlarmState::SuppressedByDesign, _) => Some(Self::Unsuppressed),
            (AlarmState::OutOfService, _) => Some(Self::ReturnedToService),
            _ if to == AlarmState::Unacknowledged => Some(Self::Raised),
            _ if to.is_unacknowledged() && !from.is_unacknowledged() => Some(Self::Raised),
            _ if from.is_unacknowledged() && !to.is_unacknowledged() => Some(Self::Acknowledged),
            _ if is_active(from) && !is_active(to) => Some(Self::Returned),
            _ => None,
        }
    }
}

/// Alarm as people are told of it, with what changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlarmNotification {
    /// Number of the change, one more than that of the one before in the same run; 0 in a standing
    /// list.
    pub number: u64,
    /// Id of the alarm.
    pub alarm: String,
    /// Kind of the change.
    pub change: AlarmChange,
    /// State after the change, the letter of IEC 62682.
    pub state: AlarmState,
    /// Priority of the alarm.
    pub priority: Priority,
    /// Time at which the alarm came, as far as it is known: with the id it names an occurrence.
    pub occurred: SourceTime,
    /// Time of the change.
    pub time: SourceTime,
    /// Ids of the equipment and of all nodes above it, the outermost first; empty without
    /// equipment in the scene.
    pub place: Vec<String>,
    /// Group of the alarm.
    pub group: Option<String>,
    /// Message about the event.
    pub message: String,
    /// Consequence of inaction, for people.
    pub consequence: String,
    /// Corrective action of the operator.
    pub response: String,
    /// Person who acted, if any.
    pub operator: Option<String>,
    /// Value with its unit by which the condition came or went.
    pub value: Option<String>,
    /// Origin of that value, where it is not live: a list of names.
    #[serde(with = "origin_names")]
    pub origin: Origin,
    /// True where the alarm's value or source is good and current.
    pub is_certain: bool,
    /// Plugin instance of the alarm system that decides on the alarm; none for this one.
    pub source: Option<String>,
}

/// Changes of alarms for one plugin, or all alarms that wait for somebody.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NotificationBatch {
    /// Run of the host that the numbers are of: its start, nanoseconds since 1970-01-01 UTC.
    pub run: u64,
    /// Greatest number that was handed over in this run, with those of this batch; 0 for none.
    pub handed: u64,
    /// Changes in the order of their numbers. The first may have been handed over before.
    pub changes: Vec<AlarmNotification>,
    /// All unacknowledged alarms; a batch with them has no changes.
    pub standing: Option<StandingAlarms>,
    /// Changes of this run that found no room and are not handed over.
    pub lost: u64,
}

/// All unacknowledged alarms after a start of the host or of the plugin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StandingAlarms {
    /// Number of the list among the changes.
    pub number: u64,
    /// Alarms, the most urgent first.
    pub alarms: Vec<AlarmNotification>,
    /// True where an alarm that is not in the list does not wait for anybody any more.
    pub is_complete: bool,
}

/// State of a plugin's delivery of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeliveryState {
    /// Nothing was sent yet.
    #[default]
    Connecting,
    /// The last messages were taken.
    Up,
    /// A message could not be handed over, or waits.
    Down,
}

/// Report of a plugin on what it was handed and what became of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotificationReport {
    /// Greatest number that the plugin keeps, also beyond a restart where it can; 0 for none.
    pub taken: u64,
    /// State of delivery to people.
    pub delivery: DeliveryState,
    /// Sentence for operators: fault and remedy.
    pub message: String,
    /// Messages that wait to be sent.
    pub waiting: u64,
    /// Messages that reached nobody and are not tried again.
    pub undelivered: u64,
}

/// The rule that a report breaks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its report on notifications: {0}")]
pub struct NotificationReportError(&'static str);

impl NotificationReport {
    /// Validates a report on a host that has handed over numbers up to `handed`.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self, handed: u64) -> Result<(), NotificationReportError> {
        if self.taken > handed {
            return Err(NotificationReportError(
                "it has taken a number that was never handed over",
            ));
        }
        if self.message.len() > MAX_DELIVERY_MESSAGE_BYTES
            || self.message.chars().any(char::is_control)
        {
            return Err(NotificationReportError("its message is too long or not one line"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_of_state_are_told_by_their_kind() {
        use AlarmState::{
            Acknowledged, LatchedAcknowledged, LatchedUnacknowledged, Normal, OutOfService,
            ReturnedUnacknowledged, Shelved, SuppressedByDesign, Unacknowledged,
        };
        for (from, to, change) in [
            (Normal, Unacknowledged, Some(AlarmChange::Raised)),
            (ReturnedUnacknowledged, Unacknowledged, Some(AlarmChange::Raised)),
            (LatchedAcknowledged, Unacknowledged, Some(AlarmChange::Raised)),
            (Unacknowledged, ReturnedUnacknowledged, Some(AlarmChange::Returned)),
            (Unacknowledged, LatchedUnacknowledged, Some(AlarmChange::Returned)),
            (Acknowledged, Normal, Some(AlarmChange::Returned)),
            (Unacknowledged, Acknowledged, Some(AlarmChange::Acknowledged)),
            (ReturnedUnacknowledged, Normal, Some(AlarmChange::Acknowledged)),
            (Unacknowledged, Shelved, Some(AlarmChange::Shelved)),
            (Shelved, Unacknowledged, Some(AlarmChange::Unshelved)),
            (Shelved, OutOfService, Some(AlarmChange::RemovedFromService)),
            (SuppressedByDesign, Normal, Some(AlarmChange::Unsuppressed)),
            (OutOfService, Unacknowledged, Some(AlarmChange::ReturnedToService)),
            (LatchedAcknowledged, Normal, None),
            (Shelved, Shelved, None),
        ] {
            assert_eq!(AlarmChange::between(from, to), change, "{from:?} {to:?}");
        }
    }

    #[test]
    fn reports_keep_their_rules() {
        let report = NotificationReport { taken: 7, ..NotificationReport::default() };
        assert_eq!(report.check(7), Ok(()));
        assert!(report.check(6).expect_err("a number of nobody").to_string().contains("never"));
        let lines = NotificationReport { message: "a\nb".to_owned(), ..report.clone() };
        assert!(lines.check(7).expect_err("two lines").to_string().contains("one line"));
        let message = "m".repeat(MAX_DELIVERY_MESSAGE_BYTES + 1);
        assert!(NotificationReport { message, ..report }.check(7).is_err());
    }
}
