//! Top-oil and hot-spot temperatures of an oil-immersed transformer from its load: the
//! exponential model of IEC 60076-7:2018, 8.2.2 and annex C, in steps of any length (the
//! load and the ambient temperature are constant within one).

use crate::ageing::dry_ageing_rate;

/// Thermal parameters of a transformer. Rises in kelvin, times in minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Time constant of the oil, minutes.
    pub oil_minutes: f64,
    /// Time constant of the winding, minutes.
    pub winding_minutes: f64,
    /// Top-oil rise at rated load, K.
    pub top_oil_rise: f64,
    /// Gradient from the winding to the oil at rated load, K.
    pub gradient: f64,
    /// Hot-spot factor H of the winding.
    pub hot_spot_factor: f64,
    /// Load losses over no-load losses, R.
    pub loss_ratio: f64,
    /// Oil exponent x of table 4.
    pub oil_exponent: f64,
    /// Winding exponent y of table 4.
    pub winding_exponent: f64,
    /// Constants k11, k21 and k22.
    pub k: [f64; 3],
}

/// Temperatures of a transformer at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperatures {
    /// Top oil, degrees Celsius.
    pub top_oil: f64,
    /// Two differences, the difference of which is the hot-spot's rise over the top oil, K.
    rises: [f64; 2],
}

impl Temperatures {
    /// State with a known top oil and no load before.
    pub fn with_top_oil(top_oil: f64) -> Self {
        Self { top_oil, rises: [0.0; 2] }
    }

    /// State after a load that has been constant for long. `load`: per unit of the rated one;
    /// `ambient`: degrees Celsius.
    pub fn steady(parameters: &Parameters, load: f64, ambient: f64) -> Self {
        Self {
            top_oil: parameters.steady_top_oil(load, ambient),
            rises: parameters.steady_rises(load),
        }
    }

    /// Hot spot of the winding, degrees Celsius.
    pub fn hot_spot(&self) -> f64 {
        self.top_oil + self.rises[0] - self.rises[1]
    }

    /// Advances the state by minutes of a load and an ambient temperature.
    pub fn after(&self, parameters: &Parameters, minutes: f64, load: f64, ambient: f64) -> Self {
        let Parameters { oil_minutes, winding_minutes, k: [k11, _, k22], .. } = *parameters;
        let towards =
            |from: f64, to: f64, constant: f64| to + (from - to) * (-minutes / constant).exp();
        let [first, second] = parameters.steady_rises(load);
        Self {
            top_oil: towards(
                self.top_oil,
                parameters.steady_top_oil(load, ambient),
                oil_minutes * k11,
            ),
            rises: [
                towards(self.rises[0], first, winding_minutes * k22),
                towards(self.rises[1], second, oil_minutes / k22),
            ],
        }
    }

    /// Relative ageing rate of dry, oxygen-free paper: 1 at 98 degrees Celsius for normal
    /// paper, at 110 for thermally upgraded paper (IEC 60076-7:2018, 6.3).
    pub fn ageing(&self, upgraded_paper: bool) -> f64 {
        dry_ageing_rate(self.hot_spot(), upgraded_paper)
    }
}

impl Parameters {
    fn steady_top_oil(&self, load: f64, ambient: f64) -> f64 {
        ambient + self.steady_top_oil_rise(load)
    }

    /// Top-oil rise over the ambient temperature at a constant load, K.
    pub(crate) fn steady_top_oil_rise(&self, load: f64) -> f64 {
        let losses = (1.0 + self.loss_ratio * load * load) / (1.0 + self.loss_ratio);
        self.top_oil_rise * losses.powf(self.oil_exponent)
    }

    /// The two differences that the hot-spot rise over the top oil comes to, K.
    pub(crate) fn steady_rises(&self, load: f64) -> [f64; 2] {
        let [_, k21, _] = self.k;
        let rise = self.hot_spot_factor * self.gradient * load.abs().powf(self.winding_exponent);
        [k21 * rise, (k21 - 1.0) * rise]
    }
}

#[cfg(test)]
#[path = "model_tests.rs"]
mod tests;
