//! Pressure of SF6 at another temperature.

/// 20 °C, to which densities are normalised (IEC 62271-1, 3.6.5.1), K.
pub const REFERENCE: f64 = 293.15;
const ZERO_CELSIUS: f64 = 273.15;
/// The gas constant over the molar mass of SF6, 146.055 g/mol: MPa m3/(kg K).
const GAS_CONSTANT: f64 = 56.926e-6;
/// Far beyond what gas compartments hold, kg/m3.
const MAX_DENSITY: f64 = 150.0;
/// Halvings of that: to a millionth of a kg/m3.
const HALVINGS: u32 = 40;

/// How pressure, density and temperature go together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EquationOfState {
    /// Pressure over absolute temperature stays: within 2 % from -40 to 60 °C at 0.6 MPa.
    #[default]
    Ideal,
    /// That of Beattie and Bridgeman with constants for SF6.
    BeattieBridgeman,
}

impl EquationOfState {
    /// The pressure at 20 °C of gas at this absolute pressure, MPa, and temperature, °C; none
    /// for what is no gas.
    pub fn at_reference(self, megapascals: f64, celsius: f64) -> Option<f64> {
        let kelvin = celsius + ZERO_CELSIUS;
        if !(megapascals >= 0.0 && kelvin > 0.0 && megapascals.is_finite() && kelvin.is_finite()) {
            return None;
        }
        match self {
            Self::Ideal => Some(megapascals * REFERENCE / kelvin),
            Self::BeattieBridgeman => Some(pressure(density(megapascals, kelvin)?, REFERENCE)),
        }
    }
}

/// Absolute pressure, MPa, at a density, kg/m3, and temperature, K (J. A. Beattie and
/// O. C. Bridgeman, J. Am. Chem. Soc. 49, 1927, 1665; constants for SF6 as engineers use
/// them).
pub fn pressure(density: f64, kelvin: f64) -> f64 {
    let a = 74.9e-6 * (1.0 - 0.727e-3 * density);
    let b = 2.51e-3 * density * (1.0 - 0.846e-3 * density);
    GAS_CONSTANT * density * kelvin * (1.0 + b) - density * density * a
}

/// The density at a pressure, kg/m3; none where there is no gas of that pressure.
fn density(megapascals: f64, kelvin: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, MAX_DENSITY);
    if pressure(high, kelvin) < megapascals {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if pressure(middle, kelvin) < megapascals { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Second and third virial coefficients, cm3/mol and cm6/mol2, by kelvin (NIST SRD 134,
    /// index of semiconductor process gases, sulfur hexafluoride).
    const VIRIAL: [[f64; 3]; 7] = [
        [250.0, -409.7, 8747.0],
        [260.0, -375.5, 13261.0],
        [270.0, -345.3, 15952.0],
        [280.0, -318.4, 17449.0],
        [290.0, -294.3, 18164.0],
        [300.0, -272.6, 18368.0],
        [310.0, -253.0, 18240.0],
    ];

    #[test]
    fn the_equation_meets_nists_virial_coefficients() {
        for [kelvin, b, c] in VIRIAL {
            for density in [10.0, 20.0, 30.0, 40.0] {
                let molar = density / 146.055e3; // mol/cm3
                let virial =
                    GAS_CONSTANT * density * kelvin * (1.0 + b * molar + c * molar * molar);
                let error = pressure(density, kelvin) / virial - 1.0;
                assert!(error.abs() < 0.006, "{density} kg/m3, {kelvin} K: {error:.4}");
            }
        }
    }

    #[test]
    fn pressures_are_normalised() {
        let ideal = EquationOfState::Ideal;
        // 0.600 MPa at 20 °C is 0.600 * 263.15 / 293.15 at -10 °C.
        let found = ideal.at_reference(0.538_598, -10.0).expect("gas");
        assert!((found - 0.6).abs() < 1e-5, "{found}");
        let real = EquationOfState::BeattieBridgeman;
        // What is at 20 °C stays as it is.
        assert!((real.at_reference(0.6, 20.0).expect("gas") - 0.6).abs() < 1e-6);
        for celsius in [-30.0, 0.0, 40.0] {
            let there = pressure(39.0, celsius + ZERO_CELSIUS);
            let found = real.at_reference(there, celsius).expect("gas");
            assert!((found - pressure(39.0, REFERENCE)).abs() < 1e-6, "{celsius}: {found}");
        }
        // Real gas loses more pressure when it cools than an ideal one.
        let cold = pressure(39.0, 243.15);
        assert!(ideal.at_reference(cold, -30.0) < real.at_reference(cold, -30.0));
    }

    #[test]
    fn what_is_no_gas_has_no_pressure() {
        for (megapascals, celsius) in [(-0.1, 20.0), (f64::NAN, 20.0), (0.6, -300.0), (90.0, 20.0)]
        {
            assert_eq!(EquationOfState::BeattieBridgeman.at_reference(megapascals, celsius), None);
        }
    }
}
