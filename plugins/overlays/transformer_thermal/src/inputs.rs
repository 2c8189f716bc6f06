//! Tags that a transformer's inputs are read from.

use busbar_plugin_sdk::units::UnitConversion;
use busbar_plugin_sdk::{Binding, Quality, TagValue, Value};

use crate::input_search::InputSearch;
use crate::settings::TransformerSettings;

/// Roles of tags: the load by its ways, what the load is worked out with, and the rest.
pub(crate) mod role {
    pub(crate) const LOAD: &str = "load";
    pub(crate) const CURRENT: &str = "current";
    pub(crate) const APPARENT_POWER: &str = "apparent_power";
    pub(crate) const ACTIVE_POWER: &str = "active_power";
    pub(crate) const REACTIVE_POWER: &str = "reactive_power";
    pub(crate) const VOLTAGE: &str = "voltage";
    pub(crate) const TAP: &str = "tap";
    pub(crate) const AMBIENT: &str = "ambient";
    pub(crate) const TOP_OIL: &str = "top_oil";
    pub(crate) const HOT_SPOT: &str = "hot_spot";
    pub(crate) const COOLER_STAGE: &str = "cooler_stage";
    pub(crate) const FANS: &str = "fans";
    pub(crate) const COOLER_FAULT: &str = "cooler_fault";
}

/// Tag with its conversion to the unit of the model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Source {
    /// Index of the binding.
    pub(crate) binding: usize,
    pub(crate) tag_id: String,
    pub(crate) role: String,
    pub(crate) conversion: UnitConversion,
}

impl Source {
    /// Number of a good value, in the unit of the model.
    ///
    /// # Errors
    /// The reason for which there is none, in words.
    pub(crate) fn number(&self, values: &[TagValue]) -> Result<f64, String> {
        let value = self.good_value(values)?;
        let number = match value {
            Value::Bool(is_set) => f64::from(u8::from(*is_set)),
            Value::F64(number) => *number,
            Value::I64(number) => *number as f64,
            Value::DoublePoint(_) | Value::Text(_) => f64::NAN,
        };
        match number.is_finite() {
            true => Ok(self.conversion.apply(number)),
            false => Err(self.doubt("no number")),
        }
    }

    fn good_value<'v>(&self, values: &'v [TagValue]) -> Result<&'v Value, String> {
        let value = values.get(self.binding).ok_or_else(|| self.doubt("missing"))?;
        match (value.quality, &value.value) {
            (Quality::Good, Some(value)) => Ok(value),
            (Quality::Good, None) => Err(self.doubt("without a value yet")),
            (Quality::Uncertain(_), _) => Err(self.doubt("uncertain")),
            (Quality::Bad(_), _) => Err(self.doubt("bad")),
        }
    }

    /// Words for a value that is not used.
    pub(crate) fn doubt(&self, state: &str) -> String {
        format!("{} ({}) is {state}", self.role.replace('_', " "), self.tag_id)
    }
}

/// Way in which the load is told; the first one that is good counts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum LoadSource {
    /// Load over the rated one.
    Ratio { source: Source, rated: f64 },
    /// Currents of the phases, A.
    Current(Vec<Source>),
    /// Apparent power over the rated one, MVA.
    ApparentPower { source: Source, rated: f64 },
    /// Active and reactive power, MW and Mvar.
    Power { active: Source, reactive: Option<Source>, rated: f64 },
}

/// Inputs of a transformer.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Inputs {
    /// Node that lines stand at, and the binding that they rest on.
    pub(crate) label: Option<(u32, usize)>,
    pub(crate) loads: Vec<LoadSource>,
    pub(crate) voltage: Option<Source>,
    pub(crate) tap: Option<Source>,
    pub(crate) ambient: Option<Source>,
    pub(crate) top_oil: Option<Source>,
    pub(crate) hot_spot: Option<Source>,
    pub(crate) cooler_stage: Option<Source>,
    pub(crate) cooler_fault: Option<Source>,
    /// Faults of the bindings, as cause and remedy.
    pub(crate) findings: Vec<String>,
    /// Defaults that the inputs rest on.
    pub(crate) assumptions: Vec<String>,
}

impl Inputs {
    /// Finds the inputs of a transformer among the bindings.
    pub(crate) fn new(settings: &TransformerSettings, bindings: &[Binding]) -> Self {
        let mut search = InputSearch::new(settings, bindings);
        if !settings.untelemetered {
            search.find_all();
        }
        search.inputs
    }

    /// Reports whether the load is told by active power alone, which is a lower bound.
    pub(crate) fn is_lower_bound(&self) -> bool {
        let is_lower = |of: &LoadSource| matches!(of, LoadSource::Power { reactive: None, .. });
        !self.loads.is_empty() && self.loads.iter().all(is_lower)
    }
}

#[cfg(test)]
#[path = "inputs_tests.rs"]
mod tests;
