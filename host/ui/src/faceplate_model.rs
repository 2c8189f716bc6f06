//! All that is said of one piece of equipment.

use std::sync::Arc;
use std::time::Duration;

use busbar_tags::Origin;

use crate::{AlarmRow, EquipmentExplanation, LegendRow, RecordSection, TagRow, ValueMark};

/// A piece of equipment: what it is called, how it is, what is known of it.
#[derive(Clone, Debug, Default)]
pub struct Faceplate {
    /// Equipment id.
    pub id: String,
    /// What people call it; may be empty.
    pub name: String,
    /// What it is a part of, from the top.
    pub within: Vec<String>,
    /// Other ids of it.
    pub aliases: Vec<String>,
    /// Its alarms that are not normal, the most urgent first.
    pub alarms: Vec<AlarmRow>,
    /// Its alarms that are normal.
    pub calm_alarms: usize,
    /// What the chart in the scene says of it.
    pub verdict: Option<EquipmentExplanation>,
    /// What overlays show it in.
    pub states: Vec<FaceplateState>,
    /// Its live values.
    pub values: Vec<FaceplateValue>,
    /// Live values beyond those.
    pub more_values: usize,
    /// What some of them were.
    pub trends: Vec<Trend>,
    /// How far back trends go.
    pub trend_span: Duration,
    /// What business and management systems have of it.
    pub records: Arc<[RecordSection]>,
}

/// A state that an overlay shows equipment in.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceplateState {
    /// The overlay.
    pub layer: String,
    /// What it is in.
    pub state: LegendRow,
    /// The pole or part of the equipment that it is; none for all of it.
    pub place: Option<String>,
    /// How the value is marked that it rests on: if that is not good, it is not known.
    pub mark: ValueMark,
    /// Age of that value.
    pub age: Option<Duration>,
    /// Origin of all values that it rests on.
    pub origin: Origin,
}

/// A live value of a piece of equipment.
#[derive(Clone, Debug, Default)]
pub struct FaceplateValue {
    /// Its tag's number, for commands.
    pub tag: u32,
    /// The tag.
    pub row: TagRow,
    /// The pole or part of the equipment that it is of; none for all of it.
    pub place: Option<String>,
    /// Whether its trend is shown; none where it has no history.
    pub is_trended: Option<bool>,
}

/// What a value was.
#[derive(Clone, Debug, Default)]
pub struct Trend {
    /// Its tag's number, for commands.
    pub tag: u32,
    /// What it is called.
    pub title: String,
    /// Its unit.
    pub unit: String,
    /// The local clock now, seconds since 1970-01-01 00:00 as that clock counts.
    pub local_seconds: f64,
    /// What it was, in order; each holds until the next, the last until now.
    pub points: Vec<TrendPoint>,
    /// Its normal band.
    pub limits: [Option<f64>; 2],
    /// Times in which the value was not live, in order.
    pub origins: Vec<TrendOrigin>,
}

/// A time in which a value was not live.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendOrigin {
    /// Begin and end, seconds after now: not positive.
    pub span: [f64; 2],
    /// Origin in that time.
    pub origin: Origin,
}

/// What a value was from an instant on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendPoint {
    /// Seconds after now: not positive.
    pub at: f64,
    /// What it was.
    pub state: TrendState,
}

/// A number as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrendState {
    /// Good.
    Good(f64),
    /// Doubtful.
    Uncertain(f64),
    /// Not known.
    Bad,
}
