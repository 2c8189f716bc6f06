//! Equation of state of SF6, its vapor pressure, and the pressure of the air by altitude.

/// 20 °C, to which densities are normalized (IEC 62271-1:2017, 3.6.6), K.
pub const REFERENCE: f64 = 293.15;
/// Temperature of 0 °C, K.
pub const ZERO_CELSIUS: f64 = 273.15;
/// Gas constant over the molar mass of SF6, 146.055 g/mol: MPa m3/(kg K).
const GAS_CONSTANT: f64 = 56.926e-6;
/// Greatest density that the equation is solved for, kg/m3: far beyond gas compartments.
const MAX_DENSITY: f64 = 300.0;
/// Newton steps of a density: five are enough below 80 kg/m3.
const MAX_STEPS: u32 = 60;
/// Relative step at which Newton's method ends.
const PRECISION: f64 = 1e-12;

/// Gas constant over the molar mass of the reference equation, MPa m3/(kg K).
const REFERENCE_GAS_CONSTANT: f64 = 56.926_83e-6;
/// Second and third virial coefficients, m3/kg and m6/kg2: factors of the powers 0 to 3 of
/// 300 K over the temperature. They are fitted to the reference equation (Guder and Wagner
/// 2009, by CoolProp 8.0.0) and meet its pressures within 0.01 % up to 75 kg/m3 of vapor from
/// -50 to 90 °C.
const VIRIAL_FACTORS: [[f64; 4]; 2] = [
    [1.622_369e-3, -4.113_756e-3, 1.962_685e-3, -1.326_697e-3],
    [9.094_68e-6, -3.379_575e-5, 4.309_812e-5, -1.756_992e-5],
];

/// Critical temperature of SF6, K.
const CRITICAL_KELVIN: f64 = 318.7232;
/// Critical pressure of SF6, MPa.
const CRITICAL_PRESSURE: f64 = 3.754_983;
/// Triple point of SF6: K, MPa.
const TRIPLE_POINT: [f64; 2] = [223.555, 0.231_42];
/// Sublimation point of SF6 at 101.325 kPa: K, MPa.
const SUBLIMATION_POINT: [f64; 2] = [209.3, 0.101_325];
/// Vapor pressure equation (C. Guder and W. Wagner, J. Phys. Chem. Ref. Data 38, 2009, 33):
/// coefficient and exponent of each term.
const VAPOR_TERMS: [[f64; 2]; 5] = [
    [-7.096_346_42, 1.0],
    [1.676_662, 1.5],
    [-2.392_159_9, 2.5],
    [5.860_783_02, 4.0],
    [-9.029_787_35, 4.5],
];

/// Equation that pressure, density and temperature of pure SF6 obey.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EquationOfState {
    /// Ideal gas: up to 4.9 % off in the pressure at 20 °C. Verdicts say that it was assumed.
    Ideal,
    /// Equation of Beattie and Bridgeman with constants for SF6: within 0.7 % from -40 to
    /// 80 °C at 10 to 60 kg/m3.
    #[default]
    BeattieBridgeman,
}

impl EquationOfState {
    /// Absolute pressure, MPa, at a density, kg/m3, and temperature, K.
    pub fn pressure(self, density: f64, kelvin: f64) -> f64 {
        match self {
            Self::Ideal => GAS_CONSTANT * density * kelvin,
            Self::BeattieBridgeman => pressure(density, kelvin),
        }
    }

    /// Density, kg/m3, at an absolute pressure, MPa, and temperature, K; `None` where there
    /// is no gas of that pressure.
    pub fn density(self, megapascals: f64, kelvin: f64) -> Option<f64> {
        let is_gas = megapascals >= 0.0 && kelvin > 0.0;
        if !(is_gas && megapascals.is_finite() && kelvin.is_finite()) {
            return None;
        }
        let ideal = megapascals / (GAS_CONSTANT * kelvin);
        match self {
            Self::Ideal => Some(ideal),
            Self::BeattieBridgeman => {
                let state = |density| [pressure(density, kelvin), slope(density, kelvin)];
                solve_density(ideal, megapascals, state)
            }
        }
    }

    /// Absolute pressure at 20 °C, MPa, of gas at an absolute pressure, MPa, and a
    /// temperature, °C.
    pub fn at_reference(self, megapascals: f64, celsius: f64) -> Option<f64> {
        let density = self.density(megapascals, celsius + ZERO_CELSIUS)?;
        Some(self.pressure(density, REFERENCE))
    }
}

/// Absolute pressure, MPa, at a density, kg/m3, and temperature, K (J. A. Beattie and
/// O. C. Bridgeman, J. Am. Chem. Soc. 49, 1927, 1665). The constants for SF6 are those in
/// common use for switchgear.
pub fn pressure(density: f64, kelvin: f64) -> f64 {
    let a = 74.9e-6 * (1.0 - 0.727e-3 * density);
    let b = 2.51e-3 * density * (1.0 - 0.846e-3 * density);
    GAS_CONSTANT * density * kelvin * (1.0 + b) - density * density * a
}

/// Slope of [`pressure`] over density, MPa m3/kg.
fn slope(density: f64, kelvin: f64) -> f64 {
    let thermal = 1.0 + 2.0 * 2.51e-3 * density - 3.0 * 2.51e-3 * 0.846e-3 * density * density;
    let attraction = 2.0 * 74.9e-6 * density - 3.0 * 74.9e-6 * 0.727e-3 * density * density;
    GAS_CONSTANT * kelvin * thermal - attraction
}

/// Density of SF6, kg/m3, at an absolute pressure, MPa, and a temperature, K, by the virial
/// equation: close enough to tell a leak from a change of the weather.
pub fn virial_density(megapascals: f64, kelvin: f64) -> Option<f64> {
    if !(megapascals >= 0.0 && kelvin > 0.0 && megapascals.is_finite() && kelvin.is_finite()) {
        return None;
    }
    let reduced = 300.0 / kelvin;
    let [second, third] =
        VIRIAL_FACTORS.map(|factors| factors.iter().rev().fold(0.0, |sum, of| sum * reduced + of));
    let thermal = REFERENCE_GAS_CONSTANT * kelvin;
    let state = |density: f64| {
        let squared = density * density;
        let pressure = thermal * density * (1.0 + second * density + third * squared);
        [pressure, thermal * (1.0 + 2.0 * second * density + 3.0 * third * squared)]
    };
    solve_density(megapascals / thermal, megapascals, state)
}

/// Newton's method from the ideal gas, by the pressure and its slope at a density. The ideal
/// density lies below the root, and the vapor branch is concave, so the steps rise to the
/// root of the vapor and never pass it.
fn solve_density(ideal: f64, megapascals: f64, state: impl Fn(f64) -> [f64; 2]) -> Option<f64> {
    let mut density = ideal;
    for _ in 0..MAX_STEPS {
        let [pressure, slope] = state(density);
        if slope <= 0.0 || !(0.0..=MAX_DENSITY).contains(&density) {
            return None;
        }
        let step = (megapascals - pressure) / slope;
        density += step;
        if step.abs() <= PRECISION * density.abs() + f64::MIN_POSITIVE {
            return Some(density);
        }
    }
    None
}

/// Pressure of saturated SF6, MPa, at a temperature, K: over the liquid by Guder and Wagner,
/// over the solid by Clausius and Clapeyron. `None` from the critical temperature up.
pub fn vapor_pressure(kelvin: f64) -> Option<f64> {
    if !(kelvin > 0.0 && kelvin < CRITICAL_KELVIN) {
        return None;
    }
    let [triple, at_triple] = TRIPLE_POINT;
    if kelvin < triple {
        let [sublimation, at_sublimation] = SUBLIMATION_POINT;
        let share = (1.0 / sublimation - 1.0 / kelvin) / (1.0 / sublimation - 1.0 / triple);
        return Some(at_sublimation * (at_triple / at_sublimation).powf(share));
    }
    let reduced = 1.0 - kelvin / CRITICAL_KELVIN;
    let sum: f64 =
        VAPOR_TERMS.iter().map(|[factor, exponent]| factor * reduced.powf(*exponent)).sum();
    Some(CRITICAL_PRESSURE * (CRITICAL_KELVIN / kelvin * sum).exp())
}

/// Pressure of the air, MPa, at an altitude, m (ISO 2533:1975, standard atmosphere below
/// 11 km).
pub fn air_pressure(altitude_metres: f64) -> f64 {
    0.101_325 * (1.0 - 2.255_77e-5 * altitude_metres).max(0.0).powf(5.255_88)
}

#[cfg(test)]
#[path = "equation_of_state_tests.rs"]
mod tests;
