//! All that is wrong with settings, so that it can be told at once.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::time::Duration;

/// Faults found so far, each naming its place and what is allowed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsFaults(Vec<String>);

impl SettingsFaults {
    /// Notes a fault.
    pub fn add(&mut self, fault: impl Into<String>) {
        self.0.push(fault.into());
    }

    /// Hands a value on, noting a fault where it is out of range.
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

    /// The same for a number of milliseconds.
    pub fn millis(&mut self, name: &str, value: u64, allowed: RangeInclusive<u64>) -> Duration {
        Duration::from_millis(self.check(name, value, allowed))
    }

    /// Nothing, if there was no fault.
    ///
    /// # Errors
    /// All faults in one text.
    pub fn into_result(self) -> Result<(), String> {
        if self.0.is_empty() { Ok(()) } else { Err(self.0.join("; ")) }
    }
}
