//! Series of the model for comparison with other implementations, as CSV.
//!
//! Arguments: number of profiles, first seed. Each profile has parameters, and a random load
//! and ambient temperature each 5 minutes, from a steady state at half the rated load.

use std::io::Write;

#[path = "../tests/common/mod.rs"]
mod common;

use common::Random;
use transformer_thermal::{Parameters, Temperatures};

/// Steps of a profile.
const STEPS: usize = 300;
/// Minutes of a step.
const MINUTES: f64 = 5.0;
/// Greatest number of profiles.
const MAX_PROFILES: u64 = 100_000;
/// Load of the steady state at the start, per unit.
const FIRST_LOAD: f64 = 0.5;
/// Columns of table 4: exponents, constants k, and time constants.
const COLUMNS: [([f64; 2], [f64; 3], [f64; 2]); 7] = [
    ([0.8, 1.6], [1.0, 1.0, 2.0], [180.0, 4.0]),
    ([0.8, 1.3], [0.5, 3.0, 2.0], [210.0, 10.0]),
    ([0.8, 1.3], [0.5, 2.0, 2.0], [210.0, 10.0]),
    ([0.8, 1.3], [0.5, 2.0, 2.0], [150.0, 7.0]),
    ([1.0, 1.3], [1.0, 1.45, 1.0], [90.0, 7.0]),
    ([1.0, 1.3], [1.0, 1.3, 1.0], [90.0, 7.0]),
    ([1.0, 2.0], [1.0, 1.0, 1.0], [90.0, 7.0]),
];

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |usual| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let profiles: u64 = number(20);
    let first_seed: u64 = number(1);
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    writeln!(
        out,
        "profile,oil_minutes,winding_minutes,top_oil_rise,gradient,hot_spot_factor,loss_ratio,x,y,\
         k11,k21,k22,minute,load,ambient,top_oil,hot_spot,ageing,ageing_upgraded"
    )?;
    for profile in 0..profiles.min(MAX_PROFILES) {
        write_profile(&mut out, profile, &mut Random::new(first_seed + profile))?;
    }
    out.flush()
}

fn write_profile(out: &mut impl Write, profile: u64, random: &mut Random) -> std::io::Result<()> {
    let (exponents, k, minutes) = COLUMNS[random.below(COLUMNS.len())];
    let parameters = Parameters {
        oil_minutes: minutes[0],
        winding_minutes: minutes[1],
        top_oil_rise: random.between(30.0, 60.0),
        gradient: random.between(8.0, 25.0),
        hot_spot_factor: random.between(1.0, 1.5),
        loss_ratio: random.between(1.0, 12.0),
        oil_exponent: exponents[0],
        winding_exponent: exponents[1],
        k,
    };
    let mut ambient = random.between(-10.0, 30.0);
    let mut load = FIRST_LOAD;
    let mut temperatures = Temperatures::steady(&parameters, load, ambient);
    for step in 0..STEPS {
        if step > 0 {
            ambient += random.between(-0.5, 0.5);
            if random.one_in(6) {
                load = random.between(0.0, 1.6);
            }
            temperatures = temperatures.after(&parameters, MINUTES, load, ambient);
        }
        let Parameters { oil_minutes, winding_minutes, top_oil_rise, gradient, .. } = parameters;
        let Parameters { hot_spot_factor, loss_ratio, .. } = parameters;
        let ([x, y], [k11, k21, k22]) = (exponents, k);
        let minute = step as f64 * MINUTES;
        let [top_oil, hot_spot] = [temperatures.top_oil, temperatures.hot_spot()];
        let ageing = [false, true].map(|is_upgraded| temperatures.ageing(is_upgraded));
        writeln!(
            out,
            "{profile},{oil_minutes},{winding_minutes},{top_oil_rise},{gradient},\
             {hot_spot_factor},{loss_ratio},{x},{y},{k11},{k21},{k22},{minute},{load},{ambient},\
             {top_oil},{hot_spot},{},{}",
            ageing[0], ageing[1]
        )?;
    }
    Ok(())
}
