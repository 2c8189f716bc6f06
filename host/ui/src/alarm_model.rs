//! What the panels show of alarms.

use std::time::Duration;

use busbar_tags::Origin;
use egui::Pos2;

/// How soon somebody must act, the most urgent first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum AlarmPriority {
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

/// Which list of alarms is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AlarmList {
    /// What is annunciated.
    #[default]
    Alarms,
    /// What is held back: shelved, suppressed, out of service.
    Held,
    /// What happened last.
    Log,
}

/// What an operator does to an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlarmAction {
    /// Say that it was seen.
    Acknowledge,
    /// Let go of its latch.
    Reset,
    /// Put it on the shelf for so long.
    Shelve(Duration),
    /// Take it off the shelf.
    Unshelve,
    /// Take it out of service.
    RemoveFromService,
    /// Put it back.
    ReturnToService,
}

/// All that is said of alarms but the rows of the list.
#[derive(Clone, Debug, Default)]
pub struct AlarmModel {
    /// Unacknowledged ones and all annunciated, a priority each.
    pub counts: [[usize; 2]; 4],
    /// How many are held back.
    pub held: usize,
    /// Which list is shown.
    pub list: AlarmList,
    /// The one that was chosen.
    pub selected: Option<AlarmDetail>,
    /// The most urgent that nobody has acknowledged.
    pub banner: Option<AlarmRow>,
    /// What happened last, the newest first.
    pub log: Vec<String>,
    /// Other systems whose alarms are among them.
    pub sources: Vec<AlarmSourceStatus>,
    /// What keeps the audit log from being written, or an action from being done.
    pub trouble: Option<String>,
    /// How long one may be shelved.
    pub max_shelving: Duration,
    /// Whether what is unacknowledged flashes; not in pictures.
    pub flashes: bool,
}

/// An alarm that was chosen.
#[derive(Clone, Debug, Default)]
pub struct AlarmDetail {
    /// As in the list.
    pub row: AlarmRow,
    /// What makes it: `above 95 °C for 5 s`.
    pub condition: String,
    /// What comes of it where nobody acts.
    pub consequence: String,
    /// What the operator does.
    pub response: String,
    /// Who decides on it, where that is not done here: `'plc'`.
    pub decided_by: Option<String>,
    /// Whether who decides can be asked by pressing a button.
    pub can_ask: bool,
    /// Whether a latch waits for a reset.
    pub can_reset: bool,
    /// Whether it can be shelved.
    pub can_shelve: bool,
    /// Whether it is on the shelf.
    pub is_shelved: bool,
    /// Whether it is out of service.
    pub is_out_of_service: bool,
}

/// An alarm of the list.
#[derive(Clone, Debug, Default)]
pub struct AlarmRow {
    /// Its number, for commands.
    pub number: u32,
    /// Id.
    pub id: String,
    /// What happened.
    pub message: String,
    /// How soon somebody must act.
    pub priority: AlarmPriority,
    /// Its state in words.
    pub state: &'static str,
    /// Whether an operator has yet to see it.
    pub is_unacknowledged: bool,
    /// Whether its condition holds.
    pub is_active: bool,
    /// Why nobody knows whether its condition holds still, if so.
    pub doubt: Option<String>,
    /// Time of day at which it occurred.
    pub time: String,
    /// How long ago its state came about.
    pub age: Option<Duration>,
    /// The value of its tag, with unit.
    pub value: String,
    /// Equipment id.
    pub equipment: Option<String>,
    /// Occurrences since the start.
    pub occurrences: u64,
    /// Whether it comes and goes.
    pub chatters: bool,
    /// Whether it was the first of its group.
    pub is_first_out: bool,
    /// How long it stays on the shelf.
    pub shelf_left: Option<Duration>,
    /// Whether what an operator did is not on the disk yet: the state is that before.
    pub is_saving: bool,
    /// The system that decides on it, where that is not done here.
    pub source: Option<String>,
    /// Origin of the values that it rests on: as they are, and as they were when it occurred.
    pub origin: Origin,
}

/// A system whose alarms are shown and decided on elsewhere.
#[derive(Clone, Debug, Default)]
pub struct AlarmSourceStatus {
    /// What it is called.
    pub name: String,
    /// How many alarms it reports.
    pub alarms: usize,
    /// How many it has beyond those.
    pub left_out: u64,
    /// Why its alarms may not be as they are shown, if so.
    pub doubt: Option<String>,
}

/// The alarms of the list that is shown, the most urgent first, as many as there may be.
pub trait AlarmRows {
    /// Number of alarms.
    fn len(&self) -> usize;

    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One alarm.
    fn row(&self, index: usize) -> AlarmRow;

    /// The unacknowledged alarm after the one that was chosen, round and round: its number
    /// and its equipment.
    fn next_unacknowledged(&self) -> Option<(u32, Option<String>)>;
}

/// A mark at equipment in alarm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlarmMarker {
    /// Where the equipment is on the screen, points.
    pub anchor: Pos2,
    /// The most urgent of its alarms.
    pub priority: AlarmPriority,
    /// Whether one of them is unacknowledged.
    pub is_unacknowledged: bool,
    /// Whether nobody knows if any of them holds still.
    pub is_doubtful: bool,
    /// How many there are.
    pub count: usize,
    /// Origins of the values that they rest on.
    pub origin: Origin,
}

impl AlarmPriority {
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
