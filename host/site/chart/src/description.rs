//! Description of a chart by its plugin, with its limits.

use busbar_types::Pattern;
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

/// Rule that a chart breaks, in words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ChartError(pub(crate) String);

impl ChartError {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self(what.into())
    }
}

/// Description of a chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// Name shown to people.
    pub name: String,
    /// Axes in the order of the values in records.
    pub axes: Vec<Axis>,
    /// The states that records are in, the least urgent first.
    pub legend: Vec<State>,
    /// Ids of the equipment that records are of.
    pub equipment: Vec<String>,
    /// Duration for which a record is valid for its equipment, seconds.
    pub valid_seconds: u64,
}

/// Axis of a chart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Name shown to people.
    pub name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// True for a logarithmic scale.
    pub log: bool,
    /// Lower end, in the axis's unit.
    pub low: f32,
    /// Upper end, in the axis's unit.
    pub high: f32,
    /// Below this nothing can be measured.
    pub detection_limit: Option<f32>,
    /// Bands between the limits.
    pub bands: Vec<Band>,
}

/// Band between two limits of an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Meaning of the band.
    pub name: String,
    /// Lower limit; `None` for the lower end of the axis.
    pub from: Option<f32>,
    /// Upper limit; `None` for the upper end of the axis.
    pub to: Option<f32>,
    /// True where values in the band are abnormal.
    pub is_abnormal: bool,
}

/// A state of records.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Name shown to people.
    pub name: String,
    /// Color of lines in sRGB.
    pub color: [u8; 3],
    /// Pattern that tells states apart without colors.
    pub pattern: Pattern,
    /// True where the state is abnormal; a normal one is drawn grey.
    pub is_abnormal: bool,
}

impl Description {
    /// Validates the description against the limits.
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
