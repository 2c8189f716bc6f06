//! Settings that hold for all samples of a run.

use std::path::PathBuf;

use dga::{c57_104, iec60599};

/// Settings that hold for all samples of a run.
#[derive(Clone, Debug, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Age of the transformers in years, for the limits of IEEE C57.104-2019.
    pub(crate) age: Age,
    /// Equipment that the oil is in, for the limit of partial discharge of IEC 60599.
    pub(crate) equipment: Equipment,
    /// Compare samples of each transformer, whose columns `equipment` and `time` are needed then:
    /// columns with the status by all tables of IEEE C57.104-2019 and with rates are added.
    pub(crate) history: bool,
    /// Accuracy of the laboratory as a share, such as 0.15: columns with the probability of
    /// each zone are added, at some 0.1 s a sample.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub(crate) uncertainty: Option<f64>,
    /// File that has the samples of a fleet, for the chart.
    pub(crate) fleet: Option<FleetSettings>,
    /// Transformers that have a monitor, for the chart and the overlay.
    pub(crate) monitors: Option<MonitorSettings>,
}

// Without documentation of their own, variants are one `enum` in the schema, whose faults
// name them all.
#[derive(Clone, Copy, Debug, Default, serde::Deserialize, schemars::JsonSchema)]
pub(crate) enum Age {
    #[default]
    #[serde(rename = "unknown")]
    Unknown,
    #[serde(rename = "1-9")]
    UpTo9,
    #[serde(rename = "10-30")]
    From10To30,
    #[serde(rename = ">30")]
    Over30,
}

#[derive(Clone, Copy, Debug, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Equipment {
    #[default]
    Transformer,
    InstrumentTransformer,
    Bushing,
}

impl From<Age> for c57_104::Age {
    fn from(age: Age) -> Self {
        match age {
            Age::Unknown => Self::Unknown,
            Age::UpTo9 => Self::UpTo9,
            Age::From10To30 => Self::From10To30,
            Age::Over30 => Self::Over30,
        }
    }
}

impl From<Equipment> for iec60599::Equipment {
    fn from(equipment: Equipment) -> Self {
        match equipment {
            Equipment::Transformer => Self::Transformer,
            Equipment::InstrumentTransformer => Self::InstrumentTransformer,
            Equipment::Bushing => Self::Bushing,
        }
    }
}

/// Settings of the file that has the samples of a fleet.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FleetSettings {
    /// Absolute path, or one that `${folder}/` begins for the folder of the configuration, of
    /// a CSV file (.csv) or an SQLite file (any other name): columns or
    /// results equipment, time, H2, CH4, C2H6, C2H4 and C2H2 in ppm, and perhaps CO, CO2, O2,
    /// N2, top_oil in °C and load per unit.
    pub(crate) file: PathBuf,
    /// Query of an SQLite file.
    #[serde(default = "default_query")]
    pub(crate) query: String,
    /// Days for which a sample speaks for its transformer.
    #[serde(default = "default_days")]
    #[schemars(range(min = 1, max = 36_500))]
    pub(crate) valid_days: u32,
}

fn default_query() -> String {
    "SELECT * FROM samples ORDER BY time".into()
}

/// A year and a month: samples are taken once a year (IEC 60422).
fn default_days() -> u32 {
    400
}

/// Transformers with a monitor.
pub(crate) const MAX_MONITORS: usize = 10_000;

/// Transformers with a monitor, whose gases are bound to them in the roles `gas_h2`, `gas_ch4`,
/// `gas_c2h6`, `gas_c2h4`, `gas_c2h2`, `gas_co`, `gas_co2`, `gas_o2` and `gas_n2` (ppm), and
/// perhaps `gas_top_oil` (°C, °F, K) and `gas_load` (per unit, %).
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MonitorSettings {
    /// Ids of the transformers.
    #[schemars(length(max = MAX_MONITORS))]
    pub(crate) equipment: Vec<String>,
    /// Ids of those without all of the tags that are needed (H2, CH4, C2H6, C2H4, C2H2): what
    /// cannot be judged is unknown, and that is no fault.
    #[serde(default)]
    #[schemars(length(max = MAX_MONITORS))]
    pub(crate) untelemetered: Vec<String>,
    /// Minutes from one sample of the history to the next, where the verdict stays the same.
    #[serde(default = "default_minutes")]
    #[schemars(range(min = 0.01, max = 10_080.0))]
    pub(crate) record_minutes: f64,
}

/// Monitors measure a few times a day.
pub(crate) fn default_minutes() -> f64 {
    60.0
}
