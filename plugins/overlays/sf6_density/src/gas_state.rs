//! State of the gas of a compartment: density as a pressure at 20 °C, and condensation.

use crate::equation_of_state::{EquationOfState, ZERO_CELSIUS, vapor_pressure, virial_density};
use crate::mixture::Mixture;

/// Share of the saturation pressure from which on gas is taken to condense: sensors err by
/// half a percent.
const AT_SATURATION: f64 = 0.99;
/// Share of the saturation pressure above which pressure and temperature contradict each
/// other.
const CONTRADICTION: f64 = 1.1;
/// Halvings of a range of temperatures.
const MAX_HALVINGS: u32 = 50;

/// Relation of pressure, temperature and density of a gas.
#[derive(Clone, Debug)]
pub(crate) enum GasModel {
    /// Pure SF6 by an equation.
    Sf6(EquationOfState),
    /// Mixture by its maker's isochores.
    Mixture(Mixture),
}

/// State of gas at one pressure and temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GasState {
    /// Absolute pressure at 20 °C of gas as dense as the vapor, MPa.
    pub(crate) at_20: f64,
    /// Saturation, as far as it is reached.
    pub(crate) saturation: Saturation,
}

/// Place of gas relative to its line of condensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Saturation {
    /// Gas without any liquid.
    Dry,
    /// On the line of condensation: a part of it is liquid.
    Condensing,
    /// Pressure far above that of saturation, which no gas has.
    Contradiction,
}

impl GasModel {
    /// State at an absolute pressure, MPa, and a temperature, °C; `None` where these give no
    /// density.
    pub(crate) fn state(&self, megapascals: f64, celsius: f64) -> Option<GasState> {
        let saturated = self.saturation_pressure(celsius).unwrap_or(f64::INFINITY);
        let saturation = match megapascals / saturated {
            share if share > CONTRADICTION => Saturation::Contradiction,
            share if share >= AT_SATURATION => Saturation::Condensing,
            _ => Saturation::Dry,
        };
        let at_20 = match self {
            // What insulates is the vapor, which is no denser than when saturated.
            Self::Sf6(equation) => equation.at_reference(megapascals.min(saturated), celsius),
            Self::Mixture(_) if self.loses_density(megapascals, celsius) => None,
            Self::Mixture(mixture) => mixture.at_reference(megapascals, celsius),
        };
        Some(GasState { at_20: at_20?, saturation })
    }

    /// Reports whether gas condenses such that pressure and temperature give no density.
    pub(crate) fn loses_density(&self, megapascals: f64, celsius: f64) -> bool {
        let Self::Mixture(mixture) = self else { return false };
        let saturated = mixture.dew_pressure(celsius).unwrap_or(f64::INFINITY);
        mixture.loses_density && megapascals >= AT_SATURATION * saturated
    }

    /// Pressure of saturation, MPa, at a temperature, °C; `None` where it never condenses, or
    /// that is not known.
    pub(crate) fn saturation_pressure(&self, celsius: f64) -> Option<f64> {
        match self {
            Self::Sf6(_) => vapor_pressure(celsius + ZERO_CELSIUS),
            Self::Mixture(mixture) => mixture.dew_pressure(celsius),
        }
    }

    /// Lowest temperature from a range, °C, that gas of a pressure, MPa, can have: that of
    /// its saturation, where the range reaches it.
    pub(crate) fn coldest(&self, megapascals: f64, [low, high]: [f64; 2]) -> f64 {
        let is_gas =
            |celsius| self.saturation_pressure(celsius).is_none_or(|most| megapascals <= most);
        if is_gas(low) || !is_gas(high) {
            return if is_gas(low) { low } else { high };
        }
        let [mut below, mut above] = [low, high];
        for _ in 0..MAX_HALVINGS {
            let middle = 0.5 * (below + above);
            if is_gas(middle) { above = middle } else { below = middle }
        }
        above
    }

    /// Quantity that the loss of gas is a share of, at an absolute pressure, MPa, and a
    /// temperature, °C: density, kg/m3, of SF6, and pressure at 20 °C, MPa, of mixtures.
    pub(crate) fn quantity(&self, megapascals: f64, celsius: f64) -> Option<f64> {
        match self {
            Self::Sf6(_) => virial_density(megapascals, celsius + ZERO_CELSIUS),
            Self::Mixture(mixture) => mixture.at_reference(megapascals, celsius),
        }
    }

    /// Default of ours that results rest on; empty for none.
    pub(crate) fn assumption(&self) -> &'static str {
        match self {
            Self::Sf6(EquationOfState::Ideal) => "ideal gas, up to 4.9 % off",
            Self::Sf6(EquationOfState::BeattieBridgeman) => "",
            Self::Mixture(mixture) if mixture.has_dew_line() => "",
            Self::Mixture(_) => "no condensation, as no dew line is given",
        }
    }
}
