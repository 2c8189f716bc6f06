//! Estimate of the temperatures from model and measurements, and the verdict on them.

use busbar_plugin_sdk::{Severity, Verdict, VerdictSeverity};

use crate::inputs::Inputs;
use crate::interval::Interval;
use crate::operating_point::{CoolerFault, OperatingPoint};
use crate::settings::{Loading, TransformerSettings};
use crate::temperature_band::TemperatureBand;

/// Difference of the two solutions up to which a value is good, K.
pub(crate) const GOOD_WIDTH: f64 = 1.0;
/// Share by which a load may be above a limit from rounding alone.
const ROUNDING: f64 = 1e-9;

/// Temperatures of one frame, degrees Celsius.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) top_oil: Interval,
    pub(crate) hot_spot: Interval,
    pub(crate) is_top_oil_measured: bool,
    pub(crate) is_hot_spot_measured: bool,
    /// Words for measurements above the model, and for those below.
    above_model: Option<String>,
    below_model: Option<String>,
}

impl Estimate {
    /// Estimates from the band of the model, which a measured top oil narrows, and from
    /// what is measured.
    pub(crate) fn new(band: &mut TemperatureBand, point: &OperatingPoint, tolerance: f64) -> Self {
        let mut estimate = Self {
            top_oil: band.top_oil,
            hot_spot: band.hot_spot(),
            is_top_oil_measured: point.top_oil.is_some(),
            is_hot_spot_measured: point.hot_spot.is_some(),
            above_model: None,
            below_model: None,
        };
        if let Some(measured) = point.top_oil {
            let by_oil = Interval::point(measured) + band.hot_spot_rise();
            match band.with_top_oil(Interval::around(measured, tolerance)) {
                Some(narrowed) => {
                    *band = narrowed;
                    estimate.top_oil = Interval::point(measured);
                    estimate.hot_spot = band.hot_spot().intersection(by_oil).unwrap_or(by_oil);
                }
                None => {
                    estimate.disagree("top oil", measured, band.top_oil);
                    estimate.top_oil = band.top_oil.hull(Interval::point(measured));
                    estimate.hot_spot = band.hot_spot().hull(by_oil);
                }
            }
        }
        if let Some(measured) = point.hot_spot {
            let near = Interval::around(measured, tolerance);
            match estimate.hot_spot.intersection(near) {
                Some(_) => estimate.hot_spot = Interval::point(measured),
                None => {
                    estimate.disagree("hot spot", measured, estimate.hot_spot);
                    estimate.hot_spot = estimate.hot_spot.hull(Interval::point(measured));
                }
            }
        }
        estimate
    }

    fn disagree(&mut self, name: &str, measured: f64, model: Interval) {
        let words = format!("{name} measured {measured:.1} °C, model {}", degrees(model));
        let side = match measured > model.middle() {
            true => &mut self.above_model,
            false => &mut self.below_model,
        };
        side.get_or_insert(words);
    }
}

/// Verdict with its reason, and the severities of the values.
pub(crate) struct Assessment {
    pub(crate) verdict: Verdict,
    /// Severity of an abnormal verdict.
    pub(crate) severity: VerdictSeverity,
    pub(crate) reason: String,
    /// Severity of top oil, hot spot and load.
    pub(crate) severities: [Severity; 3],
}

impl Assessment {
    /// Judges the estimate by the limits in force. `cause`: words for what was not seen.
    pub(crate) fn new(
        estimate: &Estimate,
        point: &OperatingPoint,
        settings: &TransformerSettings,
        inputs: &Inputs,
        cause: &str,
    ) -> Self {
        let (load_limit, temperature_limits) = settings.limits(settings.loading);
        let values = [estimate.top_oil, estimate.hot_spot, point.load];
        let [top_oil_limit, hot_spot_limit] = temperature_limits;
        let limits = [top_oil_limit, hot_spot_limit, load_limit * (1.0 + ROUNDING)];
        let next = next_limits(settings, limits);
        let severities = severities(values, limits, next);
        let may_be_alarm = values.iter().zip(next).any(|(value, next)| value.high > next)
            || inputs.is_lower_bound();
        let severity =
            VerdictSeverity::from_bounds(severities.contains(&Severity::Alarm), may_be_alarm);
        let named = ["top oil", "hot spot"].into_iter().zip(values).zip(limits);
        let mut abnormal: Vec<String> = named
            .filter(|((_, value), limit)| value.low > *limit)
            .map(|((name, value), limit)| format!("{name} {} above {limit} °C", degrees(value)))
            .collect();
        if values[2].low > limits[2] {
            abnormal.push(format!("load {} above {load_limit} p.u.", per_unit(point.load)));
        }
        if point.cooler_fault == CoolerFault::Reported {
            abnormal.push("a fault of the coolers is reported".to_owned());
        }
        if let Some(words) = &estimate.above_model {
            abnormal.push(format!("{words}: check coolers, sensor and settings"));
        }
        let judged = |verdict, reason| Self { verdict, severity, reason, severities };
        if !abnormal.is_empty() {
            return judged(Verdict::Abnormal, abnormal.join("; "));
        }
        if let Some(words) = &estimate.below_model {
            return judged(Verdict::Unknown, format!("{words}: check sensor and settings"));
        }
        let hottest = (0..2).find(|index| values[*index].high > limits[*index]);
        if let Some(index) = hottest {
            let name = ["top oil", "hot spot"][index];
            let reason = format!("{name} {}: {cause}", degrees(values[index]));
            return judged(Verdict::Unknown, reason);
        }
        if inputs.is_lower_bound() {
            let reason = "the load is at least its active power; bind reactive power, apparent \
                          power or current to judge it";
            return judged(Verdict::Unknown, reason.to_owned());
        }
        // Where no tag tells the load, it is not judged: temperatures are.
        if !inputs.loads.is_empty() && values[2].high > limits[2] {
            let reason = format!("load {}: {}", per_unit(point.load), point.doubts.join("; "));
            return judged(Verdict::Unknown, reason);
        }
        if point.cooler_fault == CoolerFault::Unknown {
            let reason = format!("faults of the coolers: {}", point.doubts.join("; "));
            return judged(Verdict::Unknown, reason);
        }
        judged(Verdict::Normal, String::new())
    }
}

/// Returns the limits above which a value is an alarm: the next ones to those in force, where they
/// are higher.
fn next_limits(settings: &TransformerSettings, limits: [f64; 3]) -> [f64; 3] {
    let next = match settings.loading {
        Loading::NormalCyclic => Loading::LongTimeEmergency,
        Loading::LongTimeEmergency | Loading::ShortTimeEmergency => Loading::ShortTimeEmergency,
    };
    let (load, [top_oil, hot_spot]) = settings.limits(next);
    let next = [top_oil, hot_spot, load * (1.0 + ROUNDING)];
    std::array::from_fn(|of| limits[of].max(next[of]))
}

/// Severity of each value that is surely above the limit in force, or above the next one.
fn severities(values: [Interval; 3], limits: [f64; 3], next: [f64; 3]) -> [Severity; 3] {
    std::array::from_fn(|of| match values[of].low {
        low if low > next[of] => Severity::Alarm,
        low if low > limits[of] => Severity::Warning,
        _ => Severity::Normal,
    })
}

/// Words for a temperature: a value where both solutions agree, else its bounds.
pub(crate) fn degrees(of: Interval) -> String {
    match of.width() <= GOOD_WIDTH {
        true => format!("{:.1} °C", no_negative_zero(of.middle(), 1)),
        false => format!(
            "between {:.1} and {:.1} °C",
            no_negative_zero(of.low, 1),
            no_negative_zero(of.high, 1)
        ),
    }
}

/// Words for a load.
pub(crate) fn per_unit(of: Interval) -> String {
    match of.width() < 0.005 {
        true => format!("{:.2} p.u.", of.middle()),
        false => format!("between {:.2} and {:.2} p.u.", of.low, of.high),
    }
}

/// A number that does not show as "-0.0" in so many digits.
fn no_negative_zero(number: f64, digits: i32) -> f64 {
    match number.abs() < 0.5 * 10f64.powi(-digits) {
        true => 0.0,
        false => number,
    }
}
