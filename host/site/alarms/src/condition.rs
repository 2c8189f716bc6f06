//! Alarm conditions: limits with deadband, states, and bad quality.

use busbar_types::{Limit, Quality, Value, ValueKind};

/// Condition that raises an alarm.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// A number beyond a limit.
    Limit {
        /// Kind of the limit.
        limit: Limit,
        /// Limit value, in the tag's unit; the limit itself is not beyond it.
        at: f64,
        /// Deadband before the condition clears, in the tag's unit.
        deadband: f64,
    },
    /// State, count or text equal to this one.
    Equals(Value),
    /// State, count or text different from this one.
    Differs(Value),
    /// A tag whose quality is bad.
    BadQuality,
}

impl Condition {
    /// Evaluates the condition; none where the value decides nothing. `held` is the result
    /// before, to which the deadband applies.
    pub(crate) fn evaluate(
        &self,
        value: Option<&Value>,
        quality: Quality,
        held: bool,
    ) -> Option<bool> {
        let is_bad = matches!(quality, Quality::Bad(_));
        if *self == Self::BadQuality {
            return Some(is_bad);
        }
        let value = value.filter(|_| !is_bad)?;
        match self {
            Self::Limit { limit, at, deadband } => {
                let (at, deadband) = (*at, *deadband);
                let number = value.as_number()?;
                let slack = if held { deadband } else { 0.0 };
                Some(if limit.is_upper() { number > at - slack } else { number < at + slack })
            }
            Self::Equals(other) => Some(value == other),
            Self::Differs(other) => Some(value != other),
            Self::BadQuality => Some(is_bad),
        }
    }

    /// Checks the condition against the kind of a tag: returns cause and remedy of a mismatch.
    pub(crate) fn fault(&self, kind: ValueKind) -> Option<(String, &'static str)> {
        match self {
            Self::BadQuality => None,
            Self::Limit { at, deadband, .. } => {
                if !kind.is_quantity() {
                    let cause = "its tag is a state or a text and has no limit".to_owned();
                    return Some((cause, "compare with \"equals\" or \"differs\""));
                }
                let is_sound = at.is_finite() && deadband.is_finite() && *deadband >= 0.0;
                (!is_sound).then(|| {
                    let cause = format!("a limit at {at} with a deadband of {deadband}");
                    (cause, "write finite numbers, and a deadband of 0 or more")
                })
            }
            Self::Equals(value) | Self::Differs(value) => {
                if kind == ValueKind::F64 {
                    let cause = "its tag is a measurement, which hardly equals anything";
                    return Some((cause.to_owned(), "write a limit"));
                }
                (value.kind() != kind).then(|| {
                    let cause = format!("its tag never has the value {value:?}");
                    (cause, "compare with a value of the tag's type")
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use busbar_types::Reason;

    use super::*;

    const GOOD: Quality = Quality::Good;

    #[test]
    fn a_deadband_holds_on_until_the_number_is_well_back() {
        let high = Condition::Limit { limit: Limit::High, at: 95.0, deadband: 2.0 };
        let low = Condition::Limit { limit: Limit::LowLow, at: 5.0, deadband: 0.5 };
        for (condition, number, held, expected) in [
            (&high, 95.0, false, false),
            (&high, 95.1, false, true),
            (&high, 93.1, true, true),
            (&high, 93.0, true, false),
            (&low, 5.0, false, false),
            (&low, 4.9, false, true),
            (&low, 5.4, true, true),
            (&low, 5.5, true, false),
        ] {
            let found = condition.evaluate(Some(&Value::F64(number)), GOOD, held);
            assert_eq!(found, Some(expected), "{condition:?} at {number}, held: {held}");
        }
    }

    #[test]
    fn a_bad_value_says_nothing_but_that_it_is_bad() {
        let high = Condition::Limit { limit: Limit::High, at: 1.0, deadband: 0.0 };
        let stale = Quality::Bad(Reason::Stale);
        assert_eq!(high.evaluate(Some(&Value::F64(2.0)), stale, false), None);
        assert_eq!(high.evaluate(None, GOOD, true), None);
        let doubtful = Quality::Uncertain(Reason::OutOfRange);
        assert_eq!(high.evaluate(Some(&Value::F64(2.0)), doubtful, false), Some(true));
        assert_eq!(Condition::BadQuality.evaluate(None, stale, false), Some(true));
        assert_eq!(Condition::BadQuality.evaluate(None, doubtful, true), Some(false));
    }
}
