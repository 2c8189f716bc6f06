//! Records of alarm events, as the audit log stores them.

use busbar_tags::SourceTime;
use busbar_types::{AlarmState, Origin, Value};
use serde::{Deserialize, Serialize};

use crate::AlarmFlags;

/// Events of an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlarmEvent {
    /// The condition came, and held for its delay.
    Occurred,
    /// The condition went, and stayed away for its delay.
    Returned,
    /// An operator saw it.
    Acknowledged,
    /// An operator reset the latch.
    Reset,
    /// An operator shelved it.
    Shelved,
    /// An operator took it off the shelf.
    Unshelved,
    /// Shelving of the alarm expired.
    ShelfExpired,
    /// The condition that suppresses it came.
    Suppressed,
    /// The condition that suppresses it went.
    Unsuppressed,
    /// An operator took it out of service.
    RemovedFromService,
    /// An operator returned it to service.
    ReturnedToService,
    /// Another alarm system reported the state.
    Mirrored,
}

/// Event of an alarm with its circumstances: a line of the audit log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlarmRecord {
    /// One more than that of the record before.
    pub number: u64,
    /// Time by the wall clock, nanoseconds since 1970-01-01 UTC.
    pub time: SourceTime,
    /// Id of the alarm.
    pub alarm: String,
    /// Event of the alarm.
    pub happened: AlarmEvent,
    /// State before the event.
    pub from: AlarmState,
    /// State after the event.
    pub to: AlarmState,
    /// Flags from which the state after follows.
    pub standing: AlarmFlags,
    /// Operator who acted; none for other events.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// The value that the condition was judged by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Value>,
    /// Time of the event at its source.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source_time: Option<SourceTime>,
    /// Origin of the value by which the condition came or went last, where that is not live:
    /// in the log a list of names.
    #[serde(default, skip_serializing_if = "is_live", with = "origin_names")]
    pub origin: Origin,
    /// True where the verdict by which the condition came or went last rests on a default of its
    /// overlay.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_assumed: bool,
    /// Reason of the overlay's verdict that the condition was judged by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// True for the first-out alarm of its group.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_first_out: bool,
}

fn is_live(origin: &Origin) -> bool {
    origin.is_live()
}

/// An origin as a list of names.
pub(crate) mod origin_names {
    use busbar_types::Origin;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        origin: &Origin,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        // Of known length, which messages between processes need.
        serializer.collect_seq(origin.names().collect::<Vec<_>>())
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Origin, D::Error> {
        let names = Vec::<String>::deserialize(deserializer)?;
        let one = |name: &String| {
            Origin::from_name(name)
                .ok_or_else(|| D::Error::custom(format!("'{name}' is no origin")))
        };
        names.iter().map(one).try_fold(Origin::LIVE, |all, origin| Ok(all | origin?))
    }
}

impl AlarmEvent {
    /// Returns the name of the event for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Occurred => "occurred",
            Self::Returned => "returned",
            Self::Acknowledged => "acknowledged",
            Self::Reset => "reset",
            Self::Shelved => "shelved",
            Self::Unshelved => "unshelved",
            Self::ShelfExpired => "shelf expired",
            Self::Suppressed => "suppressed by design",
            Self::Unsuppressed => "no longer suppressed",
            Self::RemovedFromService => "out of service",
            Self::ReturnedToService => "back in service",
            Self::Mirrored => "mirrored",
        }
    }
}
