//! Transformers as they are configured.

use crate::model::Parameters;

/// Transformers of one overlay.
pub(crate) const MAX_TRANSFORMERS: usize = 1_000;

/// Settings of the overlay: transformers whose load is bound to them in the role `load`,
/// and the ambient temperature in the role `ambient`.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The transformers.
    #[schemars(length(min = 1, max = MAX_TRANSFORMERS))]
    pub transformers: Vec<TransformerSettings>,
    /// Ambient temperature where no tag in the role `ambient` is bound to the
    /// transformer, degrees Celsius.
    #[serde(default = "default_ambient")]
    #[schemars(range(min = -60.0, max = 60.0))]
    pub ambient: f64,
}

/// A transformer. What is left out is as IEC 60076-7, table 4, recommends for its cooling.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformerSettings {
    /// Equipment id.
    pub equipment: String,
    /// Cooling.
    #[serde(default)]
    pub cooling: Cooling,
    /// What the tag in the role `load` is at rated load, in its unit: 100 for %, the rated
    /// current for A, the rated power for MVA.
    #[serde(default = "default_rated_load")]
    #[schemars(range(min = 0.000_001, max = 1e9))]
    pub rated_load: f64,
    /// Top-oil rise at rated load, K.
    #[serde(default = "default_top_oil_rise")]
    #[schemars(range(min = 1.0, max = 200.0))]
    pub top_oil_rise: f64,
    /// Gradient from the average winding to the oil at rated load, K.
    #[serde(default = "default_gradient")]
    #[schemars(range(min = 0.0, max = 200.0))]
    pub gradient: f64,
    /// Hot-spot factor H.
    #[serde(default = "default_hot_spot_factor")]
    #[schemars(range(min = 1.0, max = 5.0))]
    pub hot_spot_factor: f64,
    /// Load losses over no-load losses, R.
    #[serde(default = "default_loss_ratio")]
    #[schemars(range(min = 0.1, max = 10_000.0))]
    pub loss_ratio: f64,
    /// Whether the paper is thermally upgraded.
    #[serde(default)]
    pub upgraded_paper: bool,
}

/// How oil and air move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
pub enum Cooling {
    /// Both by themselves.
    #[default]
    #[serde(rename = "ONAN")]
    Onan,
    /// Air by fans.
    #[serde(rename = "ONAF")]
    Onaf,
}

fn default_ambient() -> f64 {
    20.0
}

fn default_rated_load() -> f64 {
    100.0
}

fn default_top_oil_rise() -> f64 {
    60.0
}

fn default_gradient() -> f64 {
    17.0
}

fn default_hot_spot_factor() -> f64 {
    1.3
}

fn default_loss_ratio() -> f64 {
    6.0
}

/// A number with what it must lie within.
type Bounded<'a> = (&'a str, f64, [f64; 2]);

impl Settings {
    /// The first number that lies outside what makes sense, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.transformers.is_empty() || self.transformers.len() > MAX_TRANSFORMERS {
            return Some(format!("name 1 to {MAX_TRANSFORMERS} transformers"));
        }
        let outside = |(_, value, [least, most]): &Bounded<'_>| !(*least..=*most).contains(value);
        let words = |(name, value, [least, most]): Bounded<'_>| {
            format!("{name} is {value}: give {least} to {most}")
        };
        let ambient = [("ambient", self.ambient, [-60.0, 60.0])];
        let of_transformers = self.transformers.iter().flat_map(|of| {
            [
                ("rated_load", of.rated_load, [1e-6, 1e9]),
                ("top_oil_rise", of.top_oil_rise, [1.0, 200.0]),
                ("gradient", of.gradient, [0.0, 200.0]),
                ("hot_spot_factor", of.hot_spot_factor, [1.0, 5.0]),
                ("loss_ratio", of.loss_ratio, [0.1, 10_000.0]),
            ]
        });
        ambient.into_iter().chain(of_transformers).find(outside).map(words)
    }
}

impl TransformerSettings {
    pub(crate) fn parameters(&self) -> Parameters {
        let [oil_minutes, winding_minutes] = match self.cooling {
            Cooling::Onan => [210.0, 10.0],
            Cooling::Onaf => [150.0, 7.0],
        };
        Parameters {
            oil_minutes,
            winding_minutes,
            top_oil_rise: self.top_oil_rise,
            gradient: self.gradient,
            hot_spot_factor: self.hot_spot_factor,
            loss_ratio: self.loss_ratio,
            oil_exponent: 0.8,
            winding_exponent: 1.3,
            k: [0.5, 2.0, 2.0],
        }
    }
}
