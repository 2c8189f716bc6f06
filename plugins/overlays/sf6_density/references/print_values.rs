//! Values of the plugin for a comparison with CoolProp: reads lines from standard input and
//! answers each with one line on standard output. See `compare.py`.
//!
//! - `at_20 PRESSURE CELSIUS`: absolute pressure, MPa, at 20 °C.
//! - `density PRESSURE CELSIUS`: density, kg/m3, by the virial equation.
//! - `vapor CELSIUS`: vapor pressure, MPa.
//! - `trend NANOS PRESSURE CELSIUS`: a sample; answered with nothing.
//! - `loss`: the loss of these samples, %/a.

use std::io::{BufRead, Write};

use sf6_density::{
    EquationOfState, REFERENCE, Sample, Trend, ZERO_CELSIUS, vapor_pressure, virial_density,
};

/// Hours of the trend: a month.
const TREND_HOURS: f64 = 730.5;

fn main() -> std::io::Result<()> {
    let equation = EquationOfState::BeattieBridgeman;
    let filling = virial_density(0.7, REFERENCE).unwrap_or(f64::NAN);
    let mut trend = Trend::new(TREND_HOURS * 3600.0, 0.0);
    let mut output = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let mut words = line.split_whitespace();
        let command = words.next().unwrap_or_default().to_owned();
        let numbers: Vec<f64> = words.map(|word| word.parse().unwrap_or(f64::NAN)).collect();
        let answer = match (command.as_str(), numbers.as_slice()) {
            ("at_20", [pressure, celsius]) => equation.at_reference(*pressure, *celsius),
            ("density", [pressure, celsius]) => virial_density(*pressure, celsius + ZERO_CELSIUS),
            ("vapor", [celsius]) => vapor_pressure(celsius + ZERO_CELSIUS),
            ("trend", [nanos, pressure, celsius]) => {
                let density = virial_density(*pressure, celsius + ZERO_CELSIUS);
                let percent = density.map_or(f64::NAN, |density| 100.0 * density / filling);
                trend.push(*nanos as i64, Sample { percent, celsius: *celsius });
                continue;
            }
            ("loss", []) => {
                trend.update();
                let loss = trend.loss().map(|loss| loss.percent_a_year);
                trend = Trend::new(TREND_HOURS * 3600.0, 0.0);
                loss
            }
            _ => None,
        };
        writeln!(output, "{}", answer.unwrap_or(f64::NAN))?;
    }
    Ok(())
}
