//! What an alarm is.

use std::time::Duration;

use busbar_tags::TagHandle;
use serde::{Deserialize, Serialize};

use crate::Condition;

/// The most alarms of one table.
pub const MAX_ALARMS: usize = 100_000;
/// The longest delay.
pub const MAX_DELAY: Duration = Duration::from_secs(86_400);

/// Names an alarm within one table: its place in the set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AlarmHandle(pub u32);

/// How soon somebody must act, the most urgent first (IEC 62682, priority).
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Priority {
    /// At once.
    Critical,
    /// Promptly.
    High,
    /// Soon.
    #[default]
    Medium,
    /// When there is time.
    Low,
}

/// A condition of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TagCondition {
    /// The tag.
    pub tag: TagHandle,
    /// What must hold of it.
    pub condition: Condition,
}

/// Where an alarm's states come from.
#[derive(Clone, Debug, PartialEq)]
pub enum AlarmSource {
    /// From a tag, decided here.
    Tag {
        /// When it is an alarm.
        trigger: TagCondition,
        /// How long the condition must hold before it occurs.
        on_delay: Duration,
        /// How long it must be over before it returns to normal.
        off_delay: Duration,
        /// While this holds, the alarm is suppressed by design.
        suppressed_by: Option<TagCondition>,
    },
    /// From another alarm system; nothing is decided here.
    Mirrored,
}

/// What an alarm is.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmSpec {
    /// Unique id.
    pub id: String,
    /// What happened, for people.
    pub message: String,
    /// What comes of it where nobody acts.
    pub consequence: String,
    /// What the operator does.
    pub response: String,
    /// Equipment id.
    pub equipment: Option<String>,
    /// How soon somebody must act.
    pub priority: Priority,
    /// Whether it stays, once it occurred, until somebody resets it.
    pub latched: bool,
    /// Alarms of one group tell which of them came first.
    pub group: Option<String>,
    /// Where its states come from.
    pub source: AlarmSource,
}

impl Priority {
    /// All, the most urgent first.
    pub const ALL: [Self; 4] = [Self::Critical, Self::High, Self::Medium, Self::Low];

    /// `critical`, `high`, `medium` or `low`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Critical => "critical",
            Self::High => "high",
            Self::Medium => "medium",
            Self::Low => "low",
        }
    }
}
