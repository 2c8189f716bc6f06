//! Collected faults of settings, so that all can be reported at once.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::time::Duration;

/// Faults found so far, each naming its place and what is allowed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsFaults(Vec<String>);

impl SettingsFaults {
    /// Records a fault of the settings.
    pub fn add(&mut self, fault: impl Into<String>) {
        self.0.push(fault.into());
    }

    /// Passes a value on, recording a fault where it is out of range.
    pub fn check<T: Copy + PartialOrd + Display>(
        &mut self,
        name: &str,
        value: T,
        allowed: RangeInclusive<T>,
    ) -> T {
        if !allowed.contains(&value) {
            let (min, max) = (allowed.start(), allowed.end());
            self.add(format!("{name}: {value} is not within {min} to {max}"));
        }
        value
    }

    /// Converts a number of seconds, recording a fault where it is out of the range, which is in
    /// milliseconds.
    pub fn seconds(
        &mut self,
        name: &str,
        value: f64,
        allowed_millis: RangeInclusive<u64>,
    ) -> Duration {
        let [min, max] = [allowed_millis.start(), allowed_millis.end()].map(|end| *end as f64);
        let millis = (value * 1_000.0).round();
        // No number at all is not within it either.
        if !(min..=max).contains(&millis) {
            let (min, max) = (min / 1_000.0, max / 1_000.0);
            self.add(format!("{name}: {value} is not within {min} to {max}"));
        }
        // The nearest one within brings no further fault.
        Duration::from_millis(millis.clamp(min, max) as u64)
    }

    /// Returns all faults as one error, if there are any.
    ///
    /// # Errors
    /// All faults in one text.
    pub fn into_result(self) -> Result<(), String> {
        if self.0.is_empty() { Ok(()) } else { Err(self.0.join("; ")) }
    }
}
