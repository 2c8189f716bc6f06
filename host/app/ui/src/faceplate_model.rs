//! View model of a faceplate.

use std::sync::Arc;
use std::time::Duration;

use busbar_types::Origin;

use crate::{Age, AlarmRow, EquipmentExplanation, LegendRow, RecordSection, TagRow, ValueMark};

/// Faceplate of a piece of equipment: names, alarms, states, values, records.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faceplate {
    /// Equipment id of the faceplate.
    pub id: String,
    /// Descriptive name; may be empty.
    pub name: String,
    /// Ids of the parent equipment, from the top.
    pub within: Vec<String>,
    /// Other ids of it.
    pub aliases: Vec<String>,
    /// Alarms that are not in the normal state, the most urgent first.
    pub alarms: Vec<AlarmRow>,
    /// Number of alarms in the normal state.
    pub calm_alarms: usize,
    /// Explanation by the chart in the scene.
    pub verdict: Option<EquipmentExplanation>,
    /// States that overlays show the equipment in.
    pub states: Vec<FaceplateState>,
    /// Live values of the equipment and its parts.
    pub values: Vec<FaceplateValue>,
    /// Live values beyond those.
    pub more_values: usize,
    /// Trends of selected values.
    pub trends: Vec<Trend>,
    /// Time span of the trends.
    pub trend_span: Duration,
    /// Records of business and asset management systems.
    pub records: Arc<[RecordSection]>,
}

/// A state that an overlay shows equipment in.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceplateState {
    /// Name of the overlay.
    pub layer: String,
    /// Legend entry of the state.
    pub state: LegendRow,
    /// The pole or part of the equipment that it is; none for all of it.
    pub place: Option<String>,
    /// Mark of the underlying value; the state is unknown unless the mark is good.
    pub mark: ValueMark,
    /// Age of that value.
    pub age: Option<Age>,
    /// Origin of all values that it rests on.
    pub origin: Origin,
}

/// A live value of a piece of equipment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaceplateValue {
    /// Tag number that commands refer to.
    pub tag: u32,
    /// Row of the tag table.
    pub row: TagRow,
    /// The pole or part of the equipment that it is of; none for all of it.
    pub place: Option<String>,
    /// True while the trend is shown; none for a value without history.
    pub is_trended: Option<bool>,
}

/// Trend of a value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trend {
    /// Tag number that commands refer to.
    pub tag: u32,
    /// Title of the trend.
    pub title: String,
    /// Unit of the value.
    pub unit: String,
    /// The local clock now, seconds since 1970-01-01 00:00 as that clock counts.
    pub local_seconds: f64,
    /// Samples in order of time; each holds until the next, the last until now.
    pub points: Vec<TrendPoint>,
    /// Low and high limit of the normal band.
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

/// Sample of a trend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendPoint {
    /// Seconds after now: not positive.
    pub at: f64,
    /// Value and quality from that instant on.
    pub state: TrendState,
}

/// A number as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrendState {
    /// Value of good quality.
    Good(f64),
    /// Value of uncertain quality.
    Uncertain(f64),
    /// Unknown value: bad quality.
    Bad,
}
