//! View model of alarms: list rows, details, counts and sources.

use std::time::Duration;

use busbar_types::{Origin, Priority};
use egui::Pos2;

use crate::Age;

/// List that the alarm panel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlarmList {
    /// Annunciated alarms, active or unacknowledged.
    #[default]
    Alarms,
    /// Suppressed alarms: shelved, suppressed by design, out of service.
    Held,
    /// Newest records of the audit log.
    Log,
}

/// View model of the alarm panel without the rows of its list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlarmModel {
    /// Unacknowledged ones and all annunciated, a priority each.
    pub counts: [[usize; 2]; 4],
    /// Number of suppressed alarms.
    pub held: usize,
    /// List that is shown.
    pub list: AlarmList,
    /// The one that was chosen.
    pub selected: Option<AlarmDetail>,
    /// Most urgent unacknowledged alarm.
    pub banner: Option<AlarmRow>,
    /// Newest records of the audit log, the newest first.
    pub log: Vec<String>,
    /// Other systems whose alarms are among them.
    pub sources: Vec<AlarmSourceStatus>,
    /// Fault of the audit log, or reason why the last action was refused.
    pub trouble: Option<String>,
    /// Longest shelving time that the configuration permits.
    pub max_shelving: Duration,
    /// True if unacknowledged alarms flash; never in still pictures.
    pub flashes: bool,
}

/// An alarm that was chosen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlarmDetail {
    /// Row of the alarm list.
    pub row: AlarmRow,
    /// Alarm condition as text: `above 95 °C for 5 s`.
    pub condition: String,
    /// Consequence of inaction, as configured.
    pub consequence: String,
    /// Operator response, as configured.
    pub response: String,
    /// Name of the external system that decides on the alarm: `'plc'`; none for own alarms.
    pub decided_by: Option<String>,
    /// True if a button press can ask the external system to act.
    pub can_ask: bool,
    /// True while a latched alarm waits for a reset.
    pub can_reset: bool,
    /// True if the operator may shelve it.
    pub can_shelve: bool,
    /// True while the alarm is shelved.
    pub is_shelved: bool,
    /// True while the alarm is out of service.
    pub is_out_of_service: bool,
}

/// An alarm of the list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlarmRow {
    /// Alarm number that commands refer to.
    pub number: u32,
    /// Alarm id of the configuration.
    pub id: String,
    /// Alarm message for the operator.
    pub message: String,
    /// Priority of the alarm.
    pub priority: Priority,
    /// State name after IEC 62682.
    pub state: &'static str,
    /// True until an operator acknowledges the alarm.
    pub is_unacknowledged: bool,
    /// True while the alarm condition holds.
    pub is_active: bool,
    /// Reason why the state of the condition is uncertain; none while it is certain.
    pub uncertainty: Option<String>,
    /// Time of day at which it occurred.
    pub time: String,
    /// Time since the last change of state.
    pub age: Option<Age>,
    /// The value of its tag, with unit.
    pub value: String,
    /// Equipment id; none for an alarm without equipment.
    pub equipment: Option<String>,
    /// Occurrences since the start.
    pub occurrences: u64,
    /// True for a chattering alarm (IEC 62682).
    pub chatters: bool,
    /// True if this alarm was the first of its first-out group.
    pub is_first_out: bool,
    /// Remaining shelving time; none while not shelved.
    pub shelf_left: Option<Age>,
    /// True until the audit log has stored the last action; the previous state is shown meanwhile.
    pub is_saving: bool,
    /// The system that decides on it, where that is not done here.
    pub source: Option<String>,
    /// Origin of the values that it rests on: as they are, and as they were when it occurred.
    pub origin: Origin,
}

/// A system whose alarms are shown and decided on elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlarmSourceStatus {
    /// Name of the source's plugin instance.
    pub name: String,
    /// Number of alarms that the source reports.
    pub alarms: usize,
    /// Number of the source's alarms beyond the reported ones.
    pub left_out: u64,
    /// Reason why the reported alarms may be outdated; none while they are current.
    pub uncertainty: Option<String>,
}

/// The alarms of the list that is shown, the most urgent first, as many as there may be.
pub trait AlarmRows {
    /// Returns the number of alarms.
    fn len(&self) -> usize;

    /// Reports whether the list is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns one row of the list.
    fn row(&self, index: usize) -> AlarmRow;

    /// The unacknowledged alarm after the one that was chosen, round and round: its number
    /// and its equipment.
    fn next_unacknowledged(&self) -> Option<(u32, Option<String>)>;
}

/// A mark at equipment in alarm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlarmMarker {
    /// Screen position of the equipment, points.
    pub anchor: Pos2,
    /// The most urgent of its alarms.
    pub priority: Priority,
    /// True if at least one of its alarms is unacknowledged.
    pub is_unacknowledged: bool,
    /// True if the state of all its alarms is uncertain.
    pub is_uncertain: bool,
    /// Number of alarms at the equipment.
    pub count: usize,
    /// Origins of the values that they rest on.
    pub origin: Origin,
}
