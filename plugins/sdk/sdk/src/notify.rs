//! Capability `busbar.notify/1-draft`: changes of alarms for people who are not in the room.

use busbar_plugin_abi as abi;
use busbar_types::{AlarmState, Priority};
use serde::{Deserialize, Serialize};

use crate::boundary::{text, write_json};
use crate::{Error, LinkState, Plugin};

/// Changes of one batch, at most.
pub const MAX_NOTIFY_CHANGES: usize = abi::BUSBAR_MAX_NOTIFY_CHANGES;
/// Alarms of one list of standing alarms, at most.
pub const MAX_NOTIFY_STANDING: usize = abi::BUSBAR_MAX_NOTIFY_STANDING;
/// Bytes of the sentence in a report, at most.
pub const MAX_NOTIFY_MESSAGE: usize = abi::BUSBAR_MAX_NOTIFY_MESSAGE;

/// Delivery of alarms to people who are not in the room.
pub trait Notify: Plugin {
    /// Takes over changes of alarms, and reports what was taken and how delivery goes. It returns
    /// at once: delivery belongs on a [`crate::Worker`]. The host calls it about once a second,
    /// also without changes. Changes come again until [`NotificationReport::taken`] has reached
    /// their numbers: whoever keeps changes in a file takes them once they are in it.
    ///
    /// # Errors
    /// What keeps messages from ever being sent, such as a setting. Faults of delivery are said in
    /// the report.
    fn notify(&mut self, batch: NotificationBatch) -> Result<NotificationReport, Error>;
}

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
    /// Nothing changed: the alarm is in a list of standing alarms.
    Standing,
}

/// Origin of a value that is not live.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlarmOrigin {
    /// Put in place of the measured value by a person or program.
    Substituted,
    /// Sent by a device under test.
    Test,
    /// Made by a simulator.
    Simulated,
    /// Replayed from a recording.
    Recorded,
    /// Value of the past, as its source marks it.
    Historical,
}

impl AlarmOrigin {
    /// Returns the name of the origin for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Substituted => "substituted",
            Self::Test => "test",
            Self::Simulated => "simulated",
            Self::Recorded => "recorded",
            Self::Historical => "historical",
        }
    }
}

/// Alarm as people are told of it, with what changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlarmNotification {
    /// Number of the change, growing within a run of the host; 0 in a standing list.
    pub number: u64,
    /// Id of the alarm.
    pub alarm: String,
    /// Kind of the change.
    pub change: AlarmChange,
    /// State after the change.
    pub state: AlarmState,
    /// Priority of the alarm.
    pub priority: Priority,
    /// Time at which the alarm came, nanoseconds since 1970-01-01 UTC: with the id it names an
    /// occurrence. After a restart of the host it may be the time of a later change.
    pub occurred: i64,
    /// Time of the change, nanoseconds since 1970-01-01 UTC.
    pub time: i64,
    /// Ids of the equipment and of all nodes above it, the outermost first; may be empty.
    #[serde(default)]
    pub place: Vec<String>,
    /// Group of the alarm.
    #[serde(default)]
    pub group: Option<String>,
    /// Message about the event.
    #[serde(default)]
    pub message: String,
    /// Consequence of inaction; may be empty.
    #[serde(default)]
    pub consequence: String,
    /// Corrective action; may be empty.
    #[serde(default)]
    pub response: String,
    /// Person who acted, if any.
    #[serde(default)]
    pub operator: Option<String>,
    /// Value with its unit by which the condition came or went.
    #[serde(default)]
    pub value: Option<String>,
    /// Origins of that value; empty for a live one. Whoever is told must be told of them.
    #[serde(default)]
    pub origin: Vec<AlarmOrigin>,
    /// Reports whether the alarm's value or source is good and current.
    pub is_certain: bool,
    /// Name of the alarm system that decides on the alarm; none for the host itself.
    #[serde(default)]
    pub source: Option<String>,
}

/// Changes of alarms, or all alarms that wait for somebody.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NotificationBatch {
    /// Run of the host that the numbers are of; the next one has another, and begins at 1.
    pub run: u64,
    /// Greatest number that was handed over in this run, with those of this batch; 0 for none.
    pub handed: u64,
    /// Changes in the order of their numbers, at most [`MAX_NOTIFY_CHANGES`]. The first may have
    /// been handed over before.
    pub changes: Vec<AlarmNotification>,
    /// All unacknowledged alarms; a batch with them has no changes.
    pub standing: Option<StandingAlarms>,
    /// Changes of this run that found no room in the host and never come.
    pub lost: u64,
}

/// All unacknowledged alarms, after a start of the host or of the plugin.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StandingAlarms {
    /// Number of the list among the changes.
    pub number: u64,
    /// Alarms, the most urgent first, at most [`MAX_NOTIFY_STANDING`].
    pub alarms: Vec<AlarmNotification>,
    /// Reports whether an alarm that is not in the list waits for nobody any more.
    pub is_complete: bool,
}

/// Report on what was handed over and what became of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NotificationReport {
    /// Greatest number of the run that is kept, also beyond a restart where the plugin has a file;
    /// 0 for none.
    pub taken: u64,
    /// State of delivery: connecting before the first message, down while a message cannot be
    /// handed over.
    pub delivery: LinkState,
    /// Sentence for operators with fault and remedy, in one line of at most
    /// [`MAX_NOTIFY_MESSAGE`] bytes.
    pub message: String,
    /// Messages that wait to be sent.
    pub waiting: u64,
    /// Messages that reached nobody and are not tried again.
    pub undelivered: u64,
}

/// # Safety
/// `batch` and `output` are valid as the ABI's `notify` demands.
pub(crate) unsafe fn notify<P: Notify>(
    plugin: &mut P,
    batch: abi::BusbarStr,
    output: *mut abi::BusbarTextOutput,
) -> Result<(), Error> {
    // SAFETY: the host's text is valid for the call.
    let batch = unsafe { text(batch)? };
    let batch: NotificationBatch = serde_json::from_str(batch)
        .map_err(|error| Error::argument(format!("notify: the batch: {error}")))?;
    if batch.changes.len() > MAX_NOTIFY_CHANGES {
        return Err(Error::argument("notify: the batch has more changes than one may have"));
    }
    if batch.standing.as_ref().is_some_and(|list| list.alarms.len() > MAX_NOTIFY_STANDING) {
        return Err(Error::argument("notify: the list has more alarms than one may have"));
    }
    let report = plugin.notify(batch)?;
    // SAFETY: the caller vouches for the pointer.
    unsafe { write_json(&report, output) }
}
