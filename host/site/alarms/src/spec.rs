//! Alarm definitions: trigger, delays, priority and texts.

use std::time::Duration;

use busbar_tags::TagHandle;
use busbar_types::Priority;

use crate::Condition;

/// The most alarms of one table.
pub const MAX_ALARMS: usize = 100_000;
/// Upper limit of on-delay and off-delay.
pub const MAX_DELAY: Duration = Duration::from_secs(86_400);

/// Names an alarm within one table: its place in the set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AlarmHandle(pub u32);

/// A condition of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TagCondition {
    /// Handle of the tag.
    pub tag: TagHandle,
    /// Condition on its value.
    pub condition: Condition,
}

/// Source of an alarm's states.
#[derive(Clone, Debug, PartialEq)]
pub enum AlarmSource {
    /// Tag whose value is evaluated here.
    Tag {
        /// Condition that raises the alarm.
        trigger: TagCondition,
        /// Time for which the condition must hold before the alarm occurs.
        on_delay: Duration,
        /// Time for which the condition must be over before the alarm returns to normal.
        off_delay: Duration,
        /// Condition that suppresses the alarm by design.
        suppressed_by: Option<TagCondition>,
    },
    /// Another alarm system; nothing is decided here.
    Mirrored,
}

/// Definition of an alarm.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmSpec {
    /// Unique id of the alarm.
    pub id: String,
    /// Message about the event, for people.
    pub message: String,
    /// Consequence of inaction, for people.
    pub consequence: String,
    /// Corrective action of the operator.
    pub response: String,
    /// Id of the equipment.
    pub equipment: Option<String>,
    /// Priority of the alarm.
    pub priority: Priority,
    /// True where the alarm, once it occurred, stays until an operator resets it.
    pub latched: bool,
    /// Alarms of one group tell which of them came first.
    pub group: Option<String>,
    /// Source of its states.
    pub source: AlarmSource,
}
