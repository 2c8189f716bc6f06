//! Thermal parameters, limits and assumptions that follow from a transformer's settings.

use crate::ageing::Paper;
use crate::interval::Interval;
use crate::model::Parameters;
use crate::settings::{Cooling, Loading, Settings, Size, StageSettings, TransformerSettings};
use crate::temperature_band::CoolingStage;
use crate::thermal_constants::{CoolingConstants, Limits, MAX_HOT_SPOT_RISE};

/// Ambient temperature where neither a tag nor the settings give one, degrees Celsius.
const ASSUMED_AMBIENT: f64 = 20.0;
/// Hot-spot factor where none is given (IEC 60076-7:2018, medium and large transformers).
const ASSUMED_HOT_SPOT_FACTOR: f64 = 1.3;

impl Settings {
    /// Ambient temperature without a tag, degrees Celsius; and its assumption.
    pub(crate) fn fixed_ambient(&self) -> (f64, Option<String>) {
        match self.ambient {
            Some(ambient) => (ambient, None),
            None => (ASSUMED_AMBIENT, Some(format!("ambient {ASSUMED_AMBIENT} °C"))),
        }
    }
}

impl TransformerSettings {
    /// Size category, given or of the rated power.
    pub(crate) fn size(&self) -> Option<Size> {
        self.size.or_else(|| self.rated_power.map(Size::of_rated_power))
    }

    /// Rated current, given or of rated power and voltage of three phases, A.
    pub(crate) fn any_rated_current(&self) -> Option<f64> {
        let of_power = || Some(1e3 * self.rated_power? / (3f64.sqrt() * self.rated_voltage?));
        self.rated_current.or_else(of_power)
    }

    /// Limits in force: load per unit, top oil and hot spot in degrees Celsius.
    pub(crate) fn limits(&self, loading: Loading) -> (f64, [f64; 2]) {
        let Limits { load, temperatures } = Limits::new(loading, self.size());
        let [top_oil, hot_spot] = temperatures.unwrap_or([f64::INFINITY; 2]);
        let own = |own: Option<f64>, table: f64| match loading == self.loading {
            true => own.unwrap_or(table),
            false => own.map_or(table, |own| own.max(table)),
        };
        (load, [own(self.top_oil_limit, top_oil), own(self.hot_spot_limit, hot_spot)])
    }

    /// Load in time that nobody saw, per unit.
    pub(crate) fn plausible_load(&self) -> Interval {
        let greatest = Limits::new(Loading::ShortTimeEmergency, self.size()).load;
        let [low, high] = self.plausible_load.unwrap_or([0.0, greatest]);
        Interval::new(low, high)
    }

    pub(crate) fn paper(&self) -> Paper {
        let Self { moisture, oxygen, upgraded_paper: is_upgraded, .. } = *self;
        Paper { is_upgraded, moisture, oxygen }
    }

    /// Stages of cooling, in the order of the settings; one where none are given.
    pub(crate) fn cooling_stages(&self) -> Vec<CoolingStage> {
        if self.stages.is_empty() {
            let rises = [self.top_oil_rise, self.gradient];
            return vec![CoolingStage::new(self.parameters(self.cooling(), rises, 1.0), 1.0)];
        }
        let stage = |of: &StageSettings| {
            let rises = [of.top_oil_rise, of.gradient];
            let parameters = self.parameters(of.cooling, rises, of.rated_share);
            CoolingStage::new(parameters, of.rated_share)
        };
        self.stages.iter().map(stage).collect()
    }

    fn cooling(&self) -> Cooling {
        self.cooling.unwrap_or(Cooling::Onan)
    }

    fn hot_spot_factor(&self) -> f64 {
        self.hot_spot_factor.unwrap_or(ASSUMED_HOT_SPOT_FACTOR)
    }

    /// Parameters with the rises given. Those that are left out are the guide's, less what
    /// the given ones leave of 78 K.
    fn parameters(
        &self,
        cooling: Cooling,
        [top_oil_rise, gradient]: [Option<f64>; 2],
        rated_share: f64,
    ) -> Parameters {
        let constants = CoolingConstants::new(cooling, self.size(), self.restricted_oil_flow);
        let hot_spot_factor = self.hot_spot_factor();
        let [usual_rise, usual_over_oil] = constants.rises;
        let rise = top_oil_rise.unwrap_or_else(|| {
            let over_oil = gradient.map_or(usual_over_oil, |gradient| gradient * hot_spot_factor);
            usual_rise.min(MAX_HOT_SPOT_RISE - over_oil).max(1.0)
        });
        let over_oil = usual_over_oil.min((MAX_HOT_SPOT_RISE - rise).max(0.0));
        let loss_ratio = self.loss_ratio.unwrap_or(constants.loss_ratio);
        let [oil_minutes, winding_minutes] = constants.minutes;
        Parameters {
            oil_minutes: self.oil_minutes.unwrap_or(oil_minutes),
            winding_minutes: self.winding_minutes.unwrap_or(winding_minutes),
            top_oil_rise: rise,
            gradient: gradient.unwrap_or(over_oil / hot_spot_factor),
            hot_spot_factor,
            // Load losses go with the square of the load.
            loss_ratio: loss_ratio * rated_share * rated_share,
            oil_exponent: constants.oil_exponent,
            winding_exponent: constants.winding_exponent,
            k: constants.k,
        }
    }

    /// Defaults of ours that the model rests on, each in words.
    pub(crate) fn assumptions(&self) -> Vec<String> {
        let mut assumptions = Vec::new();
        if self.cooling.is_none() && self.stages.is_empty() {
            assumptions.push("ONAN cooling".to_owned());
        }
        let is_onan = self.cooling() == Cooling::Onan && self.stages.is_empty();
        if self.size().is_none() && is_onan {
            assumptions.push("medium or large transformer".to_owned());
        }
        let mut missing = |is_missing: bool, name: &str, value: f64, unit: &str| {
            if is_missing {
                assumptions.push(format!("{name} {value:.1}{unit}"));
            }
        };
        for (index, stage) in self.cooling_stages().iter().enumerate() {
            let own = self.stages.get(index);
            let rise = own.map_or(self.top_oil_rise, |own| own.top_oil_rise);
            let gradient = own.map_or(self.gradient, |own| own.gradient);
            missing(rise.is_none(), "top-oil rise", stage.parameters.top_oil_rise, " K");
            missing(gradient.is_none(), "gradient", stage.parameters.gradient, " K");
            if index == 0 {
                missing(self.hot_spot_factor.is_none(), "H", self.hot_spot_factor(), "");
                missing(self.loss_ratio.is_none(), "R", stage.parameters.loss_ratio, "");
            }
        }
        assumptions
    }
}

#[cfg(test)]
#[path = "ratings_tests.rs"]
mod tests;
