//! Capability `busbar.alarms/1-draft`.

use busbar_plugin_abi as abi;
use serde::Serialize;

use crate::border::write_json;
use crate::{Error, Plugin};

/// Alarms of one report.
pub const MAX_SOURCE_ALARMS: usize = abi::BUSBAR_MAX_SOURCE_ALARMS;
/// Bytes of an id, a name, a source or a message.
pub const MAX_SOURCE_ALARM_TEXT: usize = abi::BUSBAR_MAX_SOURCE_ALARM_TEXT;

/// Alarms as another system has them. That system decides on them; the host shows them.
pub trait Alarms: Plugin {
    /// How the alarms stand, as far as is known. Asked for several times a second: whatever
    /// may take long belongs on a [`crate::Worker`]. Where the revision is `known_revision`
    /// still, [`AlarmReport::alarms`] may be `None`.
    ///
    /// # Errors
    /// What keeps alarms from ever being known, such as a setting. That the source is lost
    /// is said in [`AlarmReport::fault`], and its alarms stay in the report.
    fn alarms(&mut self, known_revision: u64) -> Result<AlarmReport, Error>;
}

/// All alarms of interest, and what they are worth.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AlarmReport {
    /// Grows with every change of any alarm; never 0.
    pub revision: u64,
    /// How long ago the source last gave a sign of life, milliseconds; `None` where it never
    /// did. The host marks all alarms as stale where that is too long.
    pub heard_millis: Option<u64>,
    /// Why the source is not current: the alarms are then as they last were known.
    pub fault: Option<String>,
    /// Alarms that the source has beyond [`MAX_SOURCE_ALARMS`]; the least severe are left out.
    pub left_out: u64,
    /// All that are active, unacknowledged, held back or otherwise of interest; `None` where
    /// they are as the caller knows them, or where the fault keeps them from being known: what
    /// was known before, such as by this plugin's process before it was restarted, stays shown.
    pub alarms: Option<Vec<SourceAlarm>>,
}

/// How far a source vouches for what it says of an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AlarmQuality {
    /// It holds.
    #[default]
    Good,
    /// It may not hold.
    Uncertain,
    /// Nobody knows.
    Bad,
}

/// An alarm as its source has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SourceAlarm {
    /// Unique in the source, and the same after it restarts.
    pub id: String,
    /// What it is called; may be empty.
    pub name: String,
    /// What it is about, as the source calls it: the host finds the equipment by it.
    pub source: String,
    /// What happened, for people; may be empty.
    pub message: String,
    /// 1 to 1000, 1000 the most urgent (OPC 10000-5, 6.4.2).
    pub severity: u16,
    /// Whether its condition holds.
    pub is_active: bool,
    /// Whether an operator has yet to see it.
    pub is_unacknowledged: bool,
    /// Whether an operator has yet to confirm it (OPC 10000-9, 5.7.2).
    pub is_unconfirmed: bool,
    /// Whether an operator shelved it.
    pub is_shelved: bool,
    /// Whether it is suppressed by design.
    pub is_suppressed: bool,
    /// Whether it is out of service.
    pub is_out_of_service: bool,
    /// When it came to be so, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: Option<i64>,
    /// How far the source vouches for it.
    pub quality: AlarmQuality,
}

/// # Safety
/// `output` is null or valid as the ABI's `read` demands.
pub(crate) unsafe fn read<P: Alarms>(
    plugin: &mut P,
    known_revision: u64,
    output: *mut abi::BusbarTextOutput,
) -> Result<(), Error> {
    let report = plugin.alarms(known_revision)?;
    // SAFETY: the caller vouches for the pointer.
    unsafe { write_json(&report, output) }
}
