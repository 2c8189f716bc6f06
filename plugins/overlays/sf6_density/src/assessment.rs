//! Assessment of a compartment: bounds of its density from inputs that may be missing, and
//! its level by the thresholds.
//!
//! An input that is missing is a range of all values that it may have. The density falls
//! with temperature and rises with pressure, so its bounds lie at the ends of the ranges: a
//! level is certain where both ends have it.

use crate::gas_state::{GasModel, GasState, Saturation};
use crate::settings::Settings;

/// Multiple of the filling above which a density is not believed: gas compartments are
/// relieved far below.
const MAX_FILLING: f64 = 1.5;

/// Distance from the middle of two digits within which it is not clear how text rounds.
const TIE: f64 = 1e-6;

/// Range of an input, both ends included; a known value is a range of no width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Range {
    pub(crate) fn exactly(value: f64) -> Self {
        Self { low: value, high: value }
    }

    pub(crate) fn is_exact(self) -> bool {
        self.low == self.high
    }
}

/// Level of a density, the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    /// At the lock-out pressure or below it.
    LockOut,
    /// At the alarm pressure or below it.
    Alarm,
    /// Density above both thresholds.
    Filled,
}

/// Assessment of a compartment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Assessment {
    /// Pressure at 20 °C, in the digits shown: the highest that the inputs admit.
    pub(crate) at_20: f64,
    /// Level that every value of the missing inputs has at least; `None` where some are
    /// filled and others are not.
    pub(crate) level: Option<Level>,
    /// Reports whether some value of the missing inputs locks out.
    pub(crate) may_lock_out: bool,
    /// Reports whether the gas condenses; `None` where that depends on missing inputs.
    pub(crate) condenses: Option<bool>,
    /// Reports whether all inputs are known, and the gas is dry.
    pub(crate) is_exact: bool,
}

/// Assesses gas of an absolute pressure, MPa, and a temperature, °C.
///
/// # Errors
/// Reason for which there is no density.
pub(crate) fn assess(
    settings: &Settings,
    gas: &GasModel,
    pressure: Range,
    temperature: Range,
) -> Result<Assessment, String> {
    if pressure.low < 0.0 {
        return Err("the pressure is negative".into());
    }
    let no_density = || "pressure and temperature give no density".to_owned();
    // Gas is no colder than its saturation.
    let coldest = match temperature.is_exact() {
        true => temperature.low,
        false => gas.coldest(pressure.high, [temperature.low, temperature.high]),
    };
    let loses_density = |celsius| gas.loses_density(pressure.high, celsius);
    let Some(least) = gas.state(pressure.low, temperature.high) else {
        return Err(if loses_density(temperature.high) {
            "the gas condenses: pressure and temperature give no density".into()
        } else {
            no_density()
        });
    };
    let most_filled = MAX_FILLING * settings.absolute(settings.filling);
    if least.at_20 > most_filled {
        return Err(format!(
            "implausible: {} {} at 20 °C is more than {MAX_FILLING} times the filling",
            shown(settings, least.at_20),
            settings.unit.symbol()
        ));
    }
    let is_known = pressure.is_exact() && temperature.is_exact();
    let most = match gas.state(pressure.high, coldest) {
        _ if is_known => least,
        Some(most) => most,
        // Denser than any filling, which is not believed either.
        None if !temperature.is_exact() && !loses_density(coldest) => dry(most_filled),
        None => return Err(no_density()),
    };
    let [low, high] = [least.at_20, most.at_20].map(|at_20| shown(settings, at_20));
    let [worst, best] = [low, high].map(|pressure| level(settings, pressure));
    if most.saturation == Saturation::Contradiction && is_known && best == Level::Filled {
        return Err("the pressure is above that of saturation: pressure or temperature is \
                    wrong"
            .into());
    }
    let is_wet = most.saturation != Saturation::Dry && most.at_20 <= most_filled;
    Ok(Assessment {
        at_20: high,
        level: (worst == best || best < Level::Filled).then_some(best),
        may_lock_out: worst == Level::LockOut,
        condenses: match is_wet {
            true => is_known.then_some(true),
            false => Some(false),
        },
        is_exact: is_known && !is_wet,
    })
}

fn dry(at_20: f64) -> GasState {
    GasState { at_20, saturation: Saturation::Dry }
}

/// Pressure of the settings' kind in the digits shown, of an absolute one, MPa.
fn shown(settings: &Settings, megapascals: f64) -> f64 {
    round(settings.relative(megapascals), settings.digits())
}

fn level(settings: &Settings, pressure: f64) -> Level {
    let digits = settings.digits();
    match pressure {
        _ if pressure <= round(settings.lock_out, digits) => Level::LockOut,
        _ if pressure <= round(settings.alarm, digits) => Level::Alarm,
        _ => Level::Filled,
    }
}

/// Rounds to the very number that people read.
fn round(value: f64, digits: usize) -> f64 {
    let scale = 10_f64.powi(digits as i32);
    let scaled = value * scale;
    if (scaled - scaled.floor() - 0.5).abs() > TIE {
        return scaled.round() / scale;
    }
    // The text decides ties.
    format!("{value:.digits$}").parse().unwrap_or(value)
}
