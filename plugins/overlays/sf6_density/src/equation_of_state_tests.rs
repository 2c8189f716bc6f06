//! Equation of state against NIST's virial coefficients and the reference equation.

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

/// Vapor pressure, MPa, by °C (CoolProp 8.0.0).
const SATURATION: [[f64; 2]; 6] = [
    [-49.0, 0.237_301],
    [-40.0, 0.340_817],
    [-20.0, 0.689_407],
    [0.0, 1.251_689],
    [20.0, 2.097_745],
    [40.0, 3.322_182],
];

#[test]
fn the_equation_meets_nists_virial_coefficients() {
    for [kelvin, b, c] in VIRIAL {
        for density in [10.0, 20.0, 30.0, 40.0] {
            let molar = density / 146.055e3; // mol/cm3
            let virial = GAS_CONSTANT * density * kelvin * (1.0 + b * molar + c * molar * molar);
            let error = pressure(density, kelvin) / virial - 1.0;
            assert!(error.abs() < 0.006, "{density} kg/m3, {kelvin} K: {error:.4}");
        }
    }
}

#[test]
fn vapor_pressures_are_those_of_the_reference_equation() {
    for [celsius, expected] in SATURATION {
        let found = vapor_pressure(celsius + ZERO_CELSIUS).expect("below the critical point");
        assert!((found / expected - 1.0).abs() < 5e-5, "{celsius} °C: {found}");
    }
    assert_eq!(vapor_pressure(320.0), None);
    // Over the solid it goes on where the liquid's ends.
    let [above, below] = [223.56, 223.55].map(|kelvin| vapor_pressure(kelvin).expect("one"));
    assert!((above / below - 1.0).abs() < 1e-3, "{above} {below}");
}

#[test]
fn virial_densities_are_those_of_the_reference_equation() {
    // Of 46.002262 kg/m3, 7 bar at 20 °C (CoolProp 8.0.0).
    for [celsius, bar] in
        [[-20.0, 5.809_260], [0.0, 6.411_362], [20.0, 7.0], [40.0, 7.579_740], [50.0, 7.867_151]]
    {
        let found = virial_density(0.1 * bar, celsius + ZERO_CELSIUS).expect("gas");
        assert!((found / 46.002_262 - 1.0).abs() < 2e-4, "{celsius} °C: {found}");
    }
    for (megapascals, kelvin) in [(-0.1, 293.0), (f64::NAN, 293.0), (90.0, 293.0), (0.6, 0.0)] {
        assert_eq!(virial_density(megapascals, kelvin), None);
    }
}

#[test]
fn pressures_are_normalized() {
    let ideal = EquationOfState::Ideal;
    // 0.600 MPa at 20 °C is 0.600 * 263.15 / 293.15 at -10 °C.
    let found = ideal.at_reference(0.538_598, -10.0).expect("gas");
    assert!((found - 0.6).abs() < 1e-5, "{found}");
    let real = EquationOfState::BeattieBridgeman;
    assert_eq!(EquationOfState::default(), real);
    // The pressure at 20 °C stays as it is.
    assert!((real.at_reference(0.6, 20.0).expect("gas") - 0.6).abs() < 1e-9);
    for celsius in [-30.0, 0.0, 40.0, 80.0] {
        for density in [1.0, 10.0, 39.0] {
            let there = pressure(density, celsius + ZERO_CELSIUS);
            let found = real.at_reference(there, celsius).expect("gas");
            assert!((found - pressure(density, REFERENCE)).abs() < 1e-9, "{celsius}: {found}");
        }
    }
    // Real gas loses more pressure than an ideal one when it cools.
    let cold = pressure(39.0, 243.15);
    assert!(ideal.at_reference(cold, -30.0) < real.at_reference(cold, -30.0));
}

#[test]
fn no_gas_has_no_density() {
    for (megapascals, celsius) in
        [(-0.1, 20.0), (f64::NAN, 20.0), (0.6, -300.0), (90.0, 20.0), (f64::INFINITY, 20.0)]
    {
        assert_eq!(EquationOfState::BeattieBridgeman.at_reference(megapascals, celsius), None);
    }
    assert_eq!(EquationOfState::BeattieBridgeman.at_reference(0.0, 20.0), Some(0.0));
}

#[test]
fn the_air_thins_by_altitude() {
    // ISO 2533:1975, table 5: 89.876 kPa at 1000 m, 70.109 kPa at 3000 m geopotential.
    for [altitude, kilopascals] in [[0.0, 101.325], [1000.0, 89.876], [3000.0, 70.109]] {
        let found = air_pressure(altitude) * 1e3;
        assert!((found - kilopascals).abs() < 0.01, "{altitude} m: {found} kPa");
    }
}
