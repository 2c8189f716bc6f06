//! What a chart shows, as a plugin describes it.

use serde::{Deserialize, Serialize};

/// Axes of a chart; a binding of the ABI has as many.
pub const MAX_AXES: usize = 32;
/// States of a legend.
const MAX_STATES: usize = 64;
/// Pieces of equipment that records are of.
const MAX_EQUIPMENT: usize = 100_000;
/// Bands of an axis.
const MAX_BANDS: usize = 16;
/// Bytes of a name.
const MAX_NAME_BYTES: usize = 128;

/// The rule that a chart breaks, in words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ChartError(pub(crate) String);

impl ChartError {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self(what.into())
    }
}

/// What a chart shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// What it is called.
    pub name: String,
    /// Its axes, in the order in which records have their values.
    pub axes: Vec<Axis>,
    /// The states that records are in, the least urgent first.
    pub legend: Vec<State>,
    /// Ids of the equipment that records are of.
    pub equipment: Vec<String>,
    /// How long a record speaks for its equipment, seconds.
    pub valid_seconds: u64,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// What it is called.
    pub name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Whether it is logarithmic.
    pub log: bool,
    /// Its lower end, in its unit.
    pub low: f32,
    /// Its upper end.
    pub high: f32,
    /// Below this nothing can be measured.
    pub detection_limit: Option<f32>,
    /// Limits.
    pub bands: Vec<Band>,
}

/// What lies between two limits of an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// What is said of it.
    pub name: String,
    /// Where it begins; `None` for the lower end of the axis.
    pub from: Option<f32>,
    /// Where it ends; `None` for the upper one.
    pub to: Option<f32>,
    /// Whether what lies in it is outside the normal.
    pub is_abnormal: bool,
}

/// A state of records.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// What it says.
    pub name: String,
    /// sRGB.
    pub color: [u8; 3],
    /// Tells states apart where colours do not.
    pub pattern: Pattern,
    /// Whether it is outside the normal: what is not is drawn grey.
    pub is_abnormal: bool,
}

/// What a state looks like besides its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Plain; unbroken lines.
    #[default]
    Solid,
    /// Stripes; long dashes.
    Striped,
    /// Stripes that cross; dashes and dots.
    Crossed,
    /// Dots.
    Dotted,
}

impl Description {
    /// Whether it can be used.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self) -> Result<(), ChartError> {
        let fault = |what: String| Err(ChartError(what));
        let Self { name, axes, legend, equipment, .. } = self;
        if !(2..=MAX_AXES).contains(&axes.len()) {
            return fault(format!("it has {} axes; 2 to {MAX_AXES} can be drawn", axes.len()));
        }
        if legend.is_empty() || legend.len() > MAX_STATES {
            return fault(format!("its legend has {} states, not 1 to {MAX_STATES}", legend.len()));
        }
        if equipment.len() > MAX_EQUIPMENT {
            return fault(format!("it names more than {MAX_EQUIPMENT} pieces of equipment"));
        }
        let names = [name].into_iter().chain(axes.iter().flat_map(|axis| [&axis.name, &axis.unit]));
        let names = names.chain(legend.iter().map(|state| &state.name)).chain(equipment);
        let names = names.chain(axes.iter().flat_map(|axis| axis.bands.iter().map(|b| &b.name)));
        if let Some(long) = names.into_iter().find(|name| name.len() > MAX_NAME_BYTES) {
            let start = &long[..long.floor_char_boundary(MAX_NAME_BYTES / 4)];
            return fault(format!("the name '{start}...' is longer than {MAX_NAME_BYTES} bytes"));
        }
        axes.iter().try_for_each(Axis::check)
    }
}

impl Axis {
    fn check(&self) -> Result<(), ChartError> {
        let fault = |what: &str| Err(ChartError(format!("axis '{}': {what}", self.name)));
        let is_range = self.low.is_finite() && self.high.is_finite() && self.low < self.high;
        if !is_range {
            return fault("its ends are not finite, or its lower one is not the lower");
        }
        if self.log && self.low < f32::MIN_POSITIVE {
            return fault("a logarithmic axis begins above 0");
        }
        if self.bands.len() > MAX_BANDS {
            return fault("it has more than 16 bands");
        }
        let mut ends = self.bands.iter().flat_map(|band| [band.from, band.to]);
        let is_finite = |end: Option<f32>| end.is_none_or(f32::is_finite);
        if !ends.all(is_finite) || !is_finite(self.detection_limit) {
            return fault("a limit is not finite");
        }
        Ok(())
    }
}
