//! Formats of numbers and times in cells of business systems.

use source_units::units_conflict;
use text_table::{NumberFormat, Separators, TimeFormat, TimeReader, Zone};

use crate::{ListSettings, shown};

/// Formats of the cells of a list, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellFormats {
    times: TimeReader,
}

impl CellFormats {
    /// Creates the formats of a list whose numbers have a decimal point.
    ///
    /// # Errors
    /// The setting at fault, and what is allowed.
    pub fn with_decimal_point<S>(list: &ListSettings<S>) -> Result<Self, String> {
        Self::with_separators(list, Separators { decimal: '.', thousands: None })
    }

    /// Creates the formats of a list whose numbers have these separators.
    ///
    /// # Errors
    /// The setting at fault, and what is allowed.
    pub fn with_separators<S>(
        list: &ListSettings<S>,
        separators: Separators,
    ) -> Result<Self, String> {
        let format = list.time_format.as_deref().map_or(Ok(TimeFormat::Iso), TimeFormat::parse);
        let format = format.map_err(|fault| format!("time_format: {fault}"))?;
        if format.is_relative() {
            return Err("time_format: seconds from any start are no date".into());
        }
        let zone = list.zone.as_deref().map_or_else(|| Ok(Zone::utc()), Zone::parse);
        let zone = Some(zone.map_err(|fault| format!("zone: {fault}"))?);
        Ok(Self { times: TimeReader { format, zone, numbers: NumberFormat::new(separators) } })
    }

    /// Parses a time or a date, to nanoseconds since 1970-01-01 UTC.
    ///
    /// # Errors
    /// What it is not, in words.
    pub fn unix_nanos(&self, text: &str) -> Result<i64, String> {
        self.times.read(None, text, None).map(|instant| instant.nanos)
    }

    /// Converts a date to ISO 8601, as records have it.
    ///
    /// # Errors
    /// What it is not, in words.
    pub(crate) fn date(&self, text: &str) -> Result<String, String> {
        let nanos = self.unix_nanos(text)?;
        if self.times.format == TimeFormat::Iso {
            return Ok(text.to_owned());
        }
        let zone = self.times.zone.clone().unwrap_or_else(Zone::utc);
        zone.in_words(nanos).ok_or_else(|| format!("'{}' is out of reach", shown(text)))
    }

    /// Converts a number to the form of records: a decimal point and no unit.
    ///
    /// # Errors
    /// What it is not, or that its unit is another than the column's, in words.
    pub(crate) fn number(&self, text: &str, unit: &str) -> Result<String, String> {
        let numbers = &self.times.numbers;
        let (number, found) = numbers.split_unit(text, Some(unit).filter(|unit| !unit.is_empty()));
        let plain = numbers.normalize(number)?;
        if !plain.parse().is_ok_and(f64::is_finite) {
            return Err(format!("'{}' is no number", shown(text)));
        }
        match found {
            Some(found) if found.trim() != unit.trim() && units_conflict(found, unit) => {
                Err(format!("'{}' is in {found}, its column in {}", shown(text), shown(unit)))
            }
            Some(found) if unit.is_empty() => {
                Err(format!("'{}' is in {found}: give the column its `unit`", shown(text)))
            }
            _ => Ok(plain.into_owned()),
        }
    }
}

#[cfg(test)]
#[path = "cell_formats_tests.rs"]
mod tests;
