//! Signals of simulated tags: constant, sine, random walk, steps, counter.

use std::f64::consts::TAU;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_types::SignalShape;

use super::{Scenario, draw, mix, unit};
use crate::{DoublePoint, Error, Text, Value, ValueKind};

/// Longest travel time of a switch.
const MAX_TRAVEL: Duration = Duration::from_secs(2);
/// Longest period: a year.
const MAX_PERIOD: Duration = Duration::from_secs(366 * 86_400);

/// Shape with its parameters, which are in range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Behavior {
    shape: SignalShape,
    base: f64,
    amplitude: f64,
    period: Duration,
}

impl Behavior {
    /// Creates a behavior about `base`, by `amplitude` to both sides, both in the tag's unit.
    ///
    /// # Errors
    /// [`Error::settings`] for numbers that are not finite, an amplitude below 0, and a
    /// period of 0 or more than a year.
    pub fn new(
        shape: SignalShape,
        base: f64,
        amplitude: f64,
        period: Duration,
    ) -> Result<Self, Error> {
        if !base.is_finite() || !amplitude.is_finite() || amplitude < 0.0 {
            return Err(Error::settings(format!(
                "base {base} and amplitude {amplitude} must be finite, and the latter not negative"
            )));
        }
        if period.is_zero() || period > MAX_PERIOD {
            return Err(Error::settings(format!(
                "the period {period:?} must be more than 0 and at most a year"
            )));
        }
        Ok(Self { shape, base, amplitude, period })
    }
}

/// Signal of one tag: its value at any instant.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    key: u64,
    kind: ValueKind,
    behavior: Behavior,
    scenario: Option<Scenario>,
}

impl Signal {
    /// Creates the signal of a tag.
    ///
    /// # Errors
    /// [`Error::settings`] when values of the kind cannot move so.
    pub fn new(seed: u64, id: &str, kind: ValueKind, behavior: Behavior) -> Result<Self, Error> {
        if kind.is_state() && !matches!(behavior.shape, SignalShape::Constant | SignalShape::Steps)
        {
            return Err(Error::settings(format!(
                "tag '{id}': a bool or double point is constant or moves in steps"
            )));
        }
        // FNV-1a, 64 bits.
        let hash = id.bytes().fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        });
        Ok(Self { key: mix(hash ^ mix(seed)), kind, behavior, scenario: None })
    }

    /// Returns the signal with the events of a scenario.
    ///
    /// # Errors
    /// [`Error::settings`] for values that its kind does not have.
    pub fn with_scenario(self, scenario: Scenario) -> Result<Self, Error> {
        let most = match self.kind {
            ValueKind::Bool => Some(1.0),
            ValueKind::DoublePoint => Some(3.0),
            ValueKind::F64 | ValueKind::I64 | ValueKind::Text => None,
        };
        let is_state = |(value, over): (f64, Duration)| {
            most.is_none_or(|most| {
                (0.0..=most).contains(&value) && value.fract() == 0.0 && over.is_zero()
            })
        };
        if !scenario.values().all(is_state) {
            return Err(Error::settings(
                "a bool goes to 0 or 1 and a double point to 0, 1, 2 or 3, at once",
            ));
        }
        Ok(Self { scenario: Some(scenario), ..self })
    }

    /// Returns the kind of its values.
    pub fn kind(&self) -> ValueKind {
        self.kind
    }

    /// Computes the value at an instant, independent of earlier calls. That of a text is `Text` and
    /// the number of its signal, rounded.
    pub fn at(&self, time: SystemTime) -> Value {
        let told =
            self.scenario.as_ref().and_then(|scenario| scenario.at(time, |at| self.own_at(at)));
        if let Some(told) = told {
            return match self.kind {
                ValueKind::F64 => Value::F64(told),
                ValueKind::I64 => Value::I64(told.round() as i64),
                ValueKind::Bool => Value::Bool(told != 0.0),
                ValueKind::DoublePoint => Value::DoublePoint(DoublePoint::from_bits(told as u64)),
                ValueKind::Text => Value::Text(numbered_text(told)),
            };
        }
        match self.kind {
            ValueKind::F64 => Value::F64(self.number_at(time)),
            ValueKind::I64 => Value::I64(self.number_at(time).round() as i64),
            ValueKind::Bool => Value::Bool(self.is_on_at(time)),
            ValueKind::DoublePoint => Value::DoublePoint(self.position_at(time)),
            ValueKind::Text => Value::Text(numbered_text(self.number_at(time))),
        }
    }

    /// Returns the least and the greatest number of the signal; 0 and 1 for a bool, 0 and 3 for a
    /// double point.
    pub fn range(&self) -> (f64, f64) {
        let Behavior { shape, base, amplitude, .. } = self.behavior;
        let own = match (self.kind, shape) {
            (ValueKind::Bool, _) => return (0.0, 1.0),
            (ValueKind::DoublePoint, _) => return (0.0, 3.0),
            (_, SignalShape::Constant) => (base, base),
            (_, SignalShape::Counter) => (base, base + amplitude.floor()),
            _ => (base - amplitude, base + amplitude),
        };
        let told = self.scenario.iter().flat_map(Scenario::values);
        let (low, high) =
            told.fold(own, |(low, high), (value, _)| (low.min(value), high.max(value)));
        if self.kind == ValueKind::I64 { (low.round(), high.round()) } else { (low, high) }
    }

    /// Returns the greatest change in a second; none where the signal jumps.
    pub fn max_slope(&self) -> Option<f64> {
        let Behavior { shape, amplitude, period, .. } = self.behavior;
        match shape {
            _ if self.kind != ValueKind::F64 || self.scenario.is_some() => None,
            SignalShape::Constant => Some(0.0),
            SignalShape::Sine => Some(TAU * amplitude / period.as_secs_f64()),
            // From one end to the other, and 3/2 of the mean slope in the middle.
            SignalShape::Walk => Some(3.0 * amplitude / period.as_secs_f64()),
            SignalShape::Steps | SignalShape::Counter => None,
        }
    }

    /// Computes the value by the signal's own shape. States return the base: a scenario does not
    /// ramp them.
    fn own_at(&self, time: SystemTime) -> f64 {
        match self.kind {
            ValueKind::F64 | ValueKind::I64 | ValueKind::Text => self.number_at(time),
            ValueKind::Bool | ValueKind::DoublePoint => self.behavior.base,
        }
    }

    fn number_at(&self, time: SystemTime) -> f64 {
        let Behavior { shape, base, amplitude, .. } = self.behavior;
        let (period, fraction) = self.period_at(time);
        match shape {
            SignalShape::Constant => base,
            SignalShape::Sine => base + amplitude * (TAU * (fraction + unit(self.key))).sin(),
            SignalShape::Walk => {
                let (from, to) = (self.level(period), self.level(period + 1));
                let eased = fraction * fraction * (3.0 - 2.0 * fraction);
                base + amplitude * (from + (to - from) * eased)
            }
            SignalShape::Steps => base + amplitude * self.level(period),
            SignalShape::Counter => base + (period as f64) % (amplitude.floor() + 1.0),
        }
    }

    fn is_on_at(&self, time: SystemTime) -> bool {
        match self.behavior.shape {
            SignalShape::Steps => self.is_on(self.period_at(time).0),
            _ => self.behavior.base != 0.0,
        }
    }

    fn position_at(&self, time: SystemTime) -> DoublePoint {
        let Behavior { shape, base, period, .. } = self.behavior;
        if shape != SignalShape::Steps {
            return DoublePoint::from_bits(base as u64);
        }
        let (number, fraction) = self.period_at(time);
        let travel = MAX_TRAVEL.min(period / 4);
        let is_on = self.is_on(number);
        let was_on = self.is_on(number.wrapping_sub(1));
        if is_on != was_on && period.mul_f64(fraction) < travel {
            DoublePoint::Intermediate
        } else if is_on {
            DoublePoint::On
        } else {
            DoublePoint::Off
        }
    }

    /// Returns the number of the period since 1970, and the share of it that is over, 0 to less
    /// than 1.
    fn period_at(&self, time: SystemTime) -> (u64, f64) {
        let nanos = time.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let period = self.behavior.period.as_nanos();
        let number = u64::try_from(nanos / period).unwrap_or_default();
        (number, (nanos % period) as f64 / period as f64)
    }

    /// Returns the level of a period, -1 to 1.
    fn level(&self, period: u64) -> f64 {
        2.0 * unit(draw(self.key, period)) - 1.0
    }

    fn is_on(&self, period: u64) -> bool {
        draw(self.key, period) >> 63 == 1
    }
}

/// Makes the text that a simulated text tag has for a number of its signal.
fn numbered_text(number: f64) -> Text {
    Text::cut(&format!("Text {}", number.round() as i64))
}

#[cfg(test)]
#[path = "signal_tests.rs"]
mod tests;
