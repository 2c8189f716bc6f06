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

    /// Converts a number of milliseconds, recording a fault where it is out of range.
    pub fn millis(&mut self, name: &str, value: u64, allowed: RangeInclusive<u64>) -> Duration {
        Duration::from_millis(self.check(name, value, allowed))
    }

    /// Returns all faults as one error, if there are any.
    ///
    /// # Errors
    /// All faults in one text.
    pub fn into_result(self) -> Result<(), String> {
        if self.0.is_empty() { Ok(()) } else { Err(self.0.join("; ")) }
    }
}
