//! Capability `busbar.alarms/1-draft`: alarms of another system.

use busbar_plugin_abi as abi;
use serde::Serialize;

use crate::boundary::write_json;
use crate::{Error, Plugin, QualityLevel};

/// Alarms of one report, at most.
pub const MAX_SOURCE_ALARMS: usize = abi::BUSBAR_MAX_SOURCE_ALARMS;
/// Bytes of an id, a name, a source or a message, at most.
pub const MAX_SOURCE_ALARM_TEXT: usize = abi::BUSBAR_MAX_SOURCE_ALARM_TEXT;

/// Alarms of another system. That system decides on them; the host shows them.
pub trait Alarms: Plugin {
    /// Reports the state of the alarms, as far as it is known. The host calls it several times a
    /// second: work that may take long belongs on a [`crate::Worker`]. Where the revision is still
    /// `known_revision`, [`AlarmReport::alarms`] may be `None`.
    ///
    /// # Errors
    /// What keeps alarms from ever being known, such as a setting. That the source is lost
    /// is said in [`AlarmReport::fault`], and its alarms stay in the report.
    fn alarms(&mut self, known_revision: u64) -> Result<AlarmReport, Error>;
}

/// State of all alarms of interest, and of their source.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct AlarmReport {
    /// Revision of the report, which grows with every change of any alarm; never 0.
    pub revision: u64,
    /// Time since the last sign of life of the source, milliseconds; `None` where there was none.
    /// The host marks all alarms as stale where that is too long.
    pub heard_millis: Option<u64>,
    /// Reason for which the source is not current. The alarms are then as they last were known.
    pub fault: Option<String>,
    /// Number of alarms beyond [`MAX_SOURCE_ALARMS`]; the least severe are left out.
    pub left_out: u64,
    /// All alarms that are active, unacknowledged, shelved, suppressed or otherwise of interest.
    /// `None` where they are as the caller knows them, or where a fault keeps them unknown. Alarms
    /// known before then stay shown, also over a restart of this plugin's process.
    pub alarms: Option<Vec<SourceAlarm>>,
}

/// Alarm with the state that its source gives it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SourceAlarm {
    /// Id that is unique in the source, and the same after it restarts.
    pub id: String,
    /// Name of the alarm; may be empty.
    pub name: String,
    /// Name that the source has for the equipment concerned: the host finds the equipment by it.
    pub source: String,
    /// Message for operators; may be empty.
    pub message: String,
    /// Severity from 1 to 1000, 1000 the most urgent (OPC 10000-5, 6.4.2).
    pub severity: u16,
    /// Reports whether the condition of the alarm holds.
    pub is_active: bool,
    /// Reports whether an operator has yet to acknowledge the alarm.
    pub is_unacknowledged: bool,
    /// Reports whether an operator has yet to confirm the alarm (OPC 10000-9, 5.7.2).
    pub is_unconfirmed: bool,
    /// Reports whether an operator shelved the alarm.
    pub is_shelved: bool,
    /// Reports whether the alarm is suppressed by design.
    pub is_suppressed: bool,
    /// Reports whether the alarm is out of service.
    pub is_out_of_service: bool,
    /// Time of the last change of state, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: Option<i64>,
    /// Quality of the alarm's state.
    pub quality: QualityLevel,
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
