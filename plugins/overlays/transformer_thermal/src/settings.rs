//! Settings of the overlay: transformers, their ratings, limits, and what is plausible.

use crate::ageing::{MAX_MOISTURE, Oxygen};
use crate::interval::Interval;

/// Transformers of one overlay.
pub(crate) const MAX_TRANSFORMERS: usize = 1_000;
/// Stages of cooling of one transformer.
pub(crate) const MAX_STAGES: usize = 8;
/// Taps of one transformer.
pub(crate) const MAX_TAPS: usize = 100;
/// Greatest load that a value may give, per unit of the rated one.
pub(crate) const MAX_PLAUSIBLE_LOAD: f64 = 3.0;
/// Ambient temperatures that a value may give, degrees Celsius.
pub(crate) const PLAUSIBLE_AMBIENT: Interval = Interval::new(-60.0, 60.0);
/// Settings of the overlay: transformers whose load is bound to them in the role `load`,
/// `current`, `apparent_power` or `active_power`, and the ambient temperature in the role
/// `ambient`.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Transformers that are judged.
    #[schemars(length(min = 1, max = MAX_TRANSFORMERS))]
    pub transformers: Vec<TransformerSettings>,
    /// Ambient temperature where no tag in the role `ambient` is bound to the
    /// transformer, degrees Celsius; 20 is assumed where it is left out.
    #[schemars(range(min = -60.0, max = 60.0))]
    pub ambient: Option<f64>,
    /// Least and greatest ambient temperature in time that nobody saw, degrees Celsius; the
    /// usual service conditions of IEC 60076-2 are -25 to 40.
    #[serde(default = "default_plausible_ambient")]
    pub plausible_ambient: [f64; 2],
    /// Longest time between two frames in which the values of the second one count, seconds
    /// of the scene clock. Time beyond it was not seen.
    #[serde(default = "default_longest_step_seconds")]
    #[schemars(range(min = 0.6, max = 3_600.0))]
    #[schemars(extend("x-busbar-formerly" = ["longest_step_minutes"]))]
    pub longest_step_seconds: f64,
    /// File that keeps the temperatures and the loss of life across restarts: an absolute
    /// path, or one that `${folder}/` begins for the folder of the configuration.
    pub state_file: Option<String>,
}

/// A transformer. Rises, gradient, hot-spot factor and loss ratio that are left out are
/// assumed, and verdicts say so; exponents and constants are those of IEC 60076-7:2018,
/// table 4, for its cooling.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformerSettings {
    /// Equipment id of the transformer.
    pub equipment: String,
    /// Cooling with all coolers running; ONAN is assumed where it is left out.
    pub cooling: Option<Cooling>,
    /// Restricted flow of oil through the windings, as zigzag cooling with spacers below
    /// 3 mm has it.
    #[serde(default)]
    pub restricted_oil_flow: bool,
    /// Size category; that of the rated power where it is left out.
    pub size: Option<Size>,
    /// Rated power of the transformer, MVA.
    #[schemars(range(min = 0.001, max = 10_000.0))]
    pub rated_power: Option<f64>,
    /// Rated voltage where the voltage is measured, line to line, kV.
    #[schemars(range(min = 0.1, max = 2_000.0))]
    pub rated_voltage: Option<f64>,
    /// Rated current where the current is measured, A; of the principal tap where `taps`
    /// are given.
    #[schemars(range(min = 0.1, max = 1e6))]
    pub rated_current: Option<f64>,
    /// Rated current by tap.
    #[serde(default)]
    #[schemars(length(max = MAX_TAPS))]
    pub taps: Vec<TapSettings>,
    /// Value of the tag in the role `load` at rated load, in its own unit: 100 for %, the
    /// rated current for A, the rated power for MVA. Where it is left out the tag has a unit
    /// of a ratio, or ratings are given.
    #[schemars(range(min = 0.000_001, max = 1e9))]
    pub rated_load: Option<f64>,
    /// Top-oil rise at rated load, K.
    #[schemars(range(min = 1.0, max = 200.0))]
    pub top_oil_rise: Option<f64>,
    /// Gradient from the average winding to the oil at rated load, K.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub gradient: Option<f64>,
    /// Hot-spot factor H of the winding.
    #[schemars(range(min = 1.0, max = 5.0))]
    pub hot_spot_factor: Option<f64>,
    /// Load losses over no-load losses, R.
    #[schemars(range(min = 0.1, max = 10_000.0))]
    pub loss_ratio: Option<f64>,
    /// Time constant of the oil, minutes, in place of that of table 4.
    #[schemars(range(min = 1.0, max = 10_000.0))]
    pub oil_minutes: Option<f64>,
    /// Time constant of the winding, minutes, in place of that of table 4.
    #[schemars(range(min = 0.1, max = 1_000.0))]
    pub winding_minutes: Option<f64>,
    /// Stages of cooling, told by a tag in the role `cooler_stage` or `fans`. Without any
    /// the coolers are taken to run.
    #[serde(default)]
    #[schemars(length(max = MAX_STAGES))]
    pub stages: Vec<StageSettings>,
    /// Kind of loading whose limits of table 2 count.
    #[serde(default)]
    pub loading: Loading,
    /// Limit of the top oil in place of that of table 2, degrees Celsius.
    #[schemars(range(min = 20.0, max = 300.0))]
    pub top_oil_limit: Option<f64>,
    /// Limit of the hot spot in place of that of table 2, degrees Celsius.
    #[schemars(range(min = 20.0, max = 400.0))]
    pub hot_spot_limit: Option<f64>,
    /// Least and greatest load in time that nobody saw, per unit; 0 to the limit of
    /// short-time emergency loading of the size where it is left out.
    pub plausible_load: Option<[f64; 2]>,
    /// Difference between a measured temperature and the model from which they disagree, K.
    #[serde(default = "default_disagreement")]
    #[schemars(range(min = 1.0, max = 100.0))]
    pub disagreement: f64,
    /// Thermally upgraded paper of the winding.
    #[serde(default)]
    pub upgraded_paper: bool,
    /// Moisture of the paper, % of mass; dry paper is assumed where it is left out.
    #[schemars(range(min = 0.0, max = MAX_MOISTURE))]
    pub moisture: Option<f64>,
    /// Oxygen in the oil; oil free of it is assumed where it is left out.
    pub oxygen: Option<Oxygen>,
    /// Declares that no tag tells the load: the transformer is unknown, which is no fault.
    #[serde(default)]
    pub untelemetered: bool,
}

/// Stage of cooling with its ratings.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageSettings {
    /// Value of the tag in this stage: 0 and 1 for fans that stand still and run.
    pub stage: i64,
    /// Cooling in this stage.
    pub cooling: Cooling,
    /// Rated load in this stage over that of the transformer.
    #[serde(default = "default_rated_share")]
    #[schemars(range(min = 0.05, max = 2.0))]
    pub rated_share: f64,
    /// Top-oil rise at the rated load of the stage, K.
    #[schemars(range(min = 1.0, max = 200.0))]
    pub top_oil_rise: Option<f64>,
    /// Gradient from the average winding to the oil at the rated load of the stage, K.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub gradient: Option<f64>,
}

/// Tap with its rated current.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TapSettings {
    /// Value of the tag in the role `tap`.
    pub tap: i64,
    /// Rated current at this tap, A.
    #[schemars(range(min = 0.1, max = 1e6))]
    pub rated_current: f64,
}

/// Movement of oil and air (IEC 60076-2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "UPPERCASE")]
pub enum Cooling {
    /// Oil and air by convection.
    Onan,
    /// Natural oil circulation by convection, air by fans.
    Onaf,
    /// Forced oil circulation by pumps, not directed through the windings.
    Of,
    /// Forced oil circulation, not directed; air by convection.
    Ofan,
    /// Forced oil circulation, not directed; air by fans.
    Ofaf,
    /// Forced oil circulation, not directed; water as coolant.
    Ofwf,
    /// Forced oil circulation by pumps, directed through the windings.
    Od,
    /// Forced and directed oil circulation; air by convection.
    Odan,
    /// Forced and directed oil circulation; air by fans.
    Odaf,
    /// Forced and directed oil circulation; water as coolant.
    Odwf,
}

/// Size category of IEC 60076-7:2018.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// Up to 2.5 MVA.
    Small,
    /// Up to 100 MVA.
    Medium,
    /// Rated power above 100 MVA.
    Large,
}

/// Kind of loading of IEC 60076-7:2018, table 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Loading {
    /// Normal cyclic loading (IEC 60076-7).
    #[default]
    NormalCyclic,
    /// Long-time emergency loading (IEC 60076-7).
    LongTimeEmergency,
    /// Short-time emergency loading (IEC 60076-7).
    ShortTimeEmergency,
}

fn default_plausible_ambient() -> [f64; 2] {
    [-25.0, 40.0]
}

fn default_longest_step_seconds() -> f64 {
    300.0
}

fn default_disagreement() -> f64 {
    10.0
}

fn default_rated_share() -> f64 {
    1.0
}
