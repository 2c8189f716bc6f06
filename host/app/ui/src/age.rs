//! Age of a value, as far as it is displayed.

use std::fmt;
use std::time::Duration;

/// Time since something came or changed, or until it ends. Two are equal if they are displayed by
/// the same text: an age is a reason to draw once its text changes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Age(Duration);

impl Age {
    /// Returns the exact time.
    pub fn duration(self) -> Duration {
        self.0
    }

    /// Returns the displayed number and its unit.
    fn displayed(self) -> (u64, &'static str) {
        match self.0.as_secs() {
            seconds @ 0..120 => (seconds, "s"),
            seconds @ 120..7200 => (seconds / 60, "min"),
            seconds => (seconds / 3600, "h"),
        }
    }
}

impl From<Duration> for Age {
    fn from(age: Duration) -> Self {
        Self(age)
    }
}

impl PartialEq for Age {
    fn eq(&self, other: &Self) -> bool {
        self.displayed() == other.displayed()
    }
}

impl fmt::Display for Age {
    /// Formats an age: `4 s`, `3 min`, `5 h`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (number, unit) = self.displayed();
        write!(formatter, "{number} {unit}")
    }
}

/// Formats an age as [`Age`] does.
pub fn age_text(age: impl Into<Age>) -> String {
    age.into().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_are_formatted_readably_and_differ_as_their_texts_do() {
        let all = [0, 400, 999, 1000, 12_900, 119_999, 120_000, 180_000, 7_199_999, 7_200_000];
        let texts =
            ["0 s", "0 s", "0 s", "1 s", "12 s", "119 s", "2 min", "3 min", "119 min", "2 h"];
        let ages = all.map(|millis| Age::from(Duration::from_millis(millis)));
        for (age, text) in ages.iter().zip(texts) {
            assert_eq!(age.to_string(), text);
            for (other, other_text) in ages.iter().zip(texts) {
                assert_eq!(age == other, text == other_text, "{age:?} {other:?}");
            }
        }
    }
}
