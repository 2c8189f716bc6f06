//! Simulated movement of a tag's value: as typed, or derived from the tag's range and limits.

use busbar_types::{SignalShape, ValueKind};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::Band;
use crate::join_pointer;
use crate::limits::*;
use crate::report::Report;

/// Bounds of a tag that has none.
const USUAL: [f64; 2] = [0.0, 100.0];
/// Resting point between the bounds of a value with a limit to one side only, as a share from the
/// other side: away from the limit, but not at the end of the range.
const REST_SHARE: f64 = 0.7;
/// Share of the way between its bounds by which it moves to both sides.
const AMPLITUDE_SHARE: f64 = 0.1;
const PERIOD_SECONDS: f64 = 120.0;
/// A switch or a single point.
const STATE_PERIOD_SECONDS: f64 = 60.0;
const COUNTER_PERIOD_SECONDS: f64 = 1.0;
/// Last value of a counter without a range, before it restarts.
const LAST_COUNT: f64 = 9999.0;
/// Double-point value of a closed switch (IEC 60870-5-101, 7.2.6.2).
const CLOSED: f64 = 2.0;
/// Changes of a text before it begins anew.
const LAST_TEXT: f64 = 3.0;

/// Movement of the value where its device is simulated; what is missing follows from type, range
/// and limits.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Simulate")]
pub(crate) struct RawSimulate {
    /// Form of the movement; a bool or double_point is constant or moves in steps.
    #[schemars(with = "SignalShape", extend("examples" = ["sine"]))]
    shape: Option<SignalShape>,
    /// Centre of the movement, in the tag's unit. A constant bool takes 0 or 1; a constant
    /// double_point 0 intermediate, 1 off, 2 on, 3 bad state. A text is `Text` and the number,
    /// rounded.
    #[schemars(with = "f64", extend("examples" = [60]))]
    base: Option<f64>,
    /// Amplitude to both sides of the base; a counter restarts after so many.
    #[schemars(with = "f64", range(min = 0.0), extend("examples" = [5]))]
    amplitude: Option<f64>,
    /// Seconds of a wave, of a walk from aim to aim, of a step or of a count.
    #[schemars(with = "f64", range(min = MIN_SIMULATED_PERIOD_SECONDS, max = MAX_SIMULATED_PERIOD_SECONDS))]
    #[schemars(extend("examples" = [120]))]
    period_seconds: Option<f64>,
}

/// Movement of a tag's value where its device is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulateConfig {
    /// Form of the movement, which the tag's type can have.
    pub shape: SignalShape,
    /// Centre of the movement, in the tag's unit.
    pub base: f64,
    /// Amplitude around the base; not negative.
    pub amplitude: f64,
    /// Seconds of a wave, of a walk from aim to aim, of a step or of a count.
    pub period_seconds: f64,
}

impl RawSimulate {
    /// Completes missing values from type, range and limits.
    pub(crate) fn resolve(
        self,
        value_type: ValueKind,
        range: Band,
        limits: Band,
    ) -> SimulateConfig {
        let usual = match value_type {
            ValueKind::F64 | ValueKind::I64 if self.shape == Some(SignalShape::Counter) => {
                let low = range.low.unwrap_or_default();
                let high = range.high.unwrap_or(low + LAST_COUNT);
                usual(SignalShape::Counter, low, high - low, COUNTER_PERIOD_SECONDS)
            }
            ValueKind::F64 => number(SignalShape::Sine, range, limits),
            ValueKind::I64 => number(SignalShape::Walk, range, limits),
            ValueKind::Bool => usual(SignalShape::Steps, 0.0, 0.0, STATE_PERIOD_SECONDS),
            ValueKind::DoublePoint => usual(SignalShape::Steps, CLOSED, 0.0, STATE_PERIOD_SECONDS),
            ValueKind::Text => usual(SignalShape::Counter, 1.0, LAST_TEXT, STATE_PERIOD_SECONDS),
        };
        SimulateConfig {
            shape: self.shape.unwrap_or(usual.shape),
            base: self.base.unwrap_or(usual.base),
            amplitude: self.amplitude.unwrap_or(usual.amplitude),
            period_seconds: self.period_seconds.unwrap_or(usual.period_seconds),
        }
    }
}

fn usual(shape: SignalShape, base: f64, amplitude: f64, period_seconds: f64) -> SimulateConfig {
    SimulateConfig { shape, base, amplitude, period_seconds }
}

/// A number that stays within its limits, about the middle of them.
fn number(shape: SignalShape, range: Band, limits: Band) -> SimulateConfig {
    let low = limits.low.or(range.low);
    let high = limits.high.or(range.high);
    let [low, high] = match (low, high) {
        (Some(low), Some(high)) if low < high => [low, high],
        (Some(low), None) => [low, low + USUAL[1]],
        (None, Some(high)) => [high - USUAL[1], high],
        _ => USUAL,
    };
    let rest = match (limits.low, limits.high) {
        (None, Some(_)) => REST_SHARE,
        (Some(_), None) => 1.0 - REST_SHARE,
        _ => 0.5,
    };
    let way = high - low;
    usual(shape, low + rest * way, AMPLITUDE_SHARE * way, PERIOD_SECONDS)
}

/// Reports what makes no sense for the type of a tag.
pub(crate) fn check(tag: &Value, tag_pointer: &str, report: &mut Report<'_>) {
    let simulate = &tag["simulate"];
    let pointer = join_pointer(tag_pointer, "simulate");
    let Some(value_type @ ("bool" | "double_point")) = tag["type"].as_str() else { return };
    if let Some(shape @ ("sine" | "walk" | "counter")) = simulate["shape"].as_str() {
        report.error(
            &join_pointer(&pointer, "shape"),
            format!("a tag of type '{value_type}' has no {shape}"),
            "write \"constant\" or \"steps\"",
        );
    }
    let most = if value_type == "bool" { 1.0 } else { 3.0 };
    let is_state = |base: f64| (0.0..=most).contains(&base) && base.fract() == 0.0;
    if let Some(base) = simulate["base"].as_f64().filter(|&base| !is_state(base)) {
        report.error(
            &join_pointer(&pointer, "base"),
            format!("a tag of type '{value_type}' is never {base}"),
            format!("write a whole number from 0 to {most}"),
        );
    }
    if simulate["amplitude"].is_number() {
        report.error(
            &join_pointer(&pointer, "amplitude"),
            format!("a tag of type '{value_type}' has no amplitude"),
            "remove it",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Band = Band { low: None, high: None };

    fn band(low: f64, high: f64) -> Band {
        Band { low: Some(low), high: Some(high) }
    }

    #[test]
    fn what_moves_by_itself_stays_within_its_limits() {
        let range = band(-40.0, 150.0);
        let upper = Band { low: None, high: Some(95.0) };
        let lower = Band { low: Some(5.5), high: None };
        let high_alone = Band { low: None, high: Some(-20.0) };
        for (range, limits, base) in [
            (range, NONE, 55.0),
            (range, upper, 54.5),
            (range, band(10.0, 20.0), 15.0),
            (band(0.0, 12.0), lower, 7.45),
            (NONE, NONE, 50.0),
            (NONE, lower, 35.5),
            (NONE, high_alone, -50.0),
        ] {
            let found = RawSimulate::default().resolve(ValueKind::F64, range, limits);
            assert!((found.base - base).abs() < 1e-9, "{range:?} {limits:?}: {found:?}");
            assert!(found.amplitude > 0.0 && found.shape == SignalShape::Sine);
            for end in [found.base - found.amplitude, found.base + found.amplitude] {
                assert!(limits.contains(end) && range.contains(end), "{limits:?}: {found:?}");
            }
        }
        // Nothing lies between these: any value will do.
        let beyond = Band { low: Some(2.0), high: None };
        let found = RawSimulate::default().resolve(ValueKind::F64, band(0.0, 1.0), beyond);
        assert!(found.base.is_finite() && found.amplitude > 0.0);
    }

    #[test]
    fn what_is_typed_counts() {
        let typed: RawSimulate = serde_json::from_str(
            r#"{"shape": "walk", "base": 60, "amplitude": 5, "period_seconds": 10}"#,
        )
        .unwrap();
        let expected = usual(SignalShape::Walk, 60.0, 5.0, 10.0);
        assert_eq!(typed.resolve(ValueKind::F64, band(0.0, 1.0), NONE), expected);
        let counter: RawSimulate = serde_json::from_str(r#"{"shape": "counter"}"#).unwrap();
        let expected = usual(SignalShape::Counter, 10.0, 90.0, 1.0);
        assert_eq!(counter.resolve(ValueKind::I64, band(10.0, 100.0), NONE), expected);
        let expected = usual(SignalShape::Counter, 0.0, 9999.0, 1.0);
        assert_eq!(counter.resolve(ValueKind::F64, NONE, NONE), expected);
        let steps = RawSimulate::default().resolve(ValueKind::DoublePoint, NONE, NONE);
        assert_eq!((steps.shape, steps.base), (SignalShape::Steps, 2.0));
    }
}
