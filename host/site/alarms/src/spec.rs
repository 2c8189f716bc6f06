//! Alarm definitions: trigger, delays, priority and texts.

use std::time::Duration;

use busbar_tags::TagHandle;
use busbar_types::Priority;
use busbar_types::Severity;

use crate::Condition;

/// The most alarms of one table.
pub const MAX_ALARMS: usize = 100_000;
/// Upper limit of on-delay and off-delay.
pub const MAX_DELAY: Duration = Duration::from_secs(86_400);

/// Names an alarm within one table: its place in the set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AlarmHandle(pub u32);

/// A condition of a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct TagCondition {
    /// Handle of the tag.
    pub tag: TagHandle,
    /// Condition on its value.
    pub condition: Condition,
}

/// A verdict of an overlay on a piece of equipment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerdictCondition {
    /// Plugin instance of the overlay.
    pub overlay: String,
    /// Id of the equipment, as the configuration or the overlay names it.
    pub equipment: String,
    /// Least severity of an abnormal verdict that raises the alarm.
    pub severity: Severity,
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
    /// Overlay whose verdict on a piece of equipment is followed.
    Verdict {
        /// Verdict that raises the alarm.
        trigger: VerdictCondition,
        /// Time from the first abnormal verdict on before the alarm occurs, unless the equipment
        /// is judged normal in between.
        on_delay: Duration,
        /// Time for which the equipment must be judged normal before the alarm returns to normal.
        off_delay: Duration,
        /// Condition that suppresses the alarm by design.
        suppressed_by: Option<TagCondition>,
    },
    /// Another alarm system; nothing is decided here.
    Mirrored,
}

impl AlarmSource {
    /// Reports whether another alarm system decides on the alarm.
    pub fn is_mirrored(&self) -> bool {
        *self == Self::Mirrored
    }

    /// Returns on-delay and off-delay; none of a mirrored alarm.
    pub fn delays(&self) -> [Duration; 2] {
        match *self {
            Self::Tag { on_delay, off_delay, .. } | Self::Verdict { on_delay, off_delay, .. } => {
                [on_delay, off_delay]
            }
            Self::Mirrored => [Duration::ZERO; 2],
        }
    }

    /// Returns the condition that suppresses the alarm by design.
    pub fn suppressed_by(&self) -> Option<&TagCondition> {
        match self {
            Self::Tag { suppressed_by, .. } | Self::Verdict { suppressed_by, .. } => {
                suppressed_by.as_ref()
            }
            Self::Mirrored => None,
        }
    }

    /// Reports whether the alarm can be suppressed by design: here, or by the system that decides.
    pub(crate) fn is_suppressible(&self) -> bool {
        self.is_mirrored() || self.suppressed_by().is_some()
    }
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
