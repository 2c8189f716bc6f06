//! Gassing rates from samples of one transformer.

use std::fmt;

/// Concentration at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Time, days since any instant.
    pub day: f64,
    /// Concentration at that time, ppm.
    pub ppm: f64,
}

/// Days of a year, for rates a year.
pub const DAYS_A_YEAR: f64 = 365.25;
/// Days of a month, for rates a month (DL/T 722).
pub const DAYS_A_MONTH: f64 = 30.0;

/// Error of readings that give no rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateError {
    /// Number that is not finite, or a negative concentration.
    NotValid,
    /// Fewer readings than the rule demands, or more.
    Count,
    /// Times that do not increase.
    Order,
    /// First concentration of 0: no relative rate.
    FromZero,
    /// Mass of oil, or its density, that is not above 0.
    Oil,
}

impl fmt::Display for RateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotValid => "a reading is not finite or negative",
            Self::Count => "too few or too many readings for a rate",
            Self::Order => "readings are not in the order of time, each later than the one before",
            Self::FromZero => "there was nothing at first, so no relative rate",
            Self::Oil => "the mass and the density of oil are above 0",
        })
    }
}

impl std::error::Error for RateError {}

fn check(readings: &[Reading]) -> Result<(), RateError> {
    if readings.iter().any(|r| !(r.day.is_finite() && r.ppm.is_finite() && r.ppm >= 0.0)) {
        return Err(RateError::NotValid);
    }
    if readings.windows(2).any(|pair| pair[1].day <= pair[0].day) {
        return Err(RateError::Order);
    }
    Ok(())
}

/// Computes (C2 - C1) / Δt, ppm a day.
///
/// # Errors
/// [`RateError::NotValid`], [`RateError::Order`].
pub fn per_day(first: Reading, second: Reading) -> Result<f64, RateError> {
    check(&[first, second])?;
    Ok((second.ppm - first.ppm) / (second.day - first.day))
}

/// Computes the absolute rate of DL/T 722-2014, 9.3.2: (C2 - C1) / Δt · m / ρ, mL a day. The oil's
/// mass is in tonnes, its density in tonnes a cubic metre.
///
/// # Errors
/// Returns the errors of [`per_day`], and [`RateError::Oil`].
pub fn absolute(
    first: Reading,
    second: Reading,
    oil_tonnes: f64,
    tonnes_a_cubic_metre: f64,
) -> Result<f64, RateError> {
    let is_positive = |value: f64| value.is_finite() && value > 0.0;
    if !is_positive(oil_tonnes) || !is_positive(tonnes_a_cubic_metre) {
        return Err(RateError::Oil);
    }
    // 1 µL/L in a cubic metre is 1 mL.
    Ok(per_day(first, second)? * oil_tonnes / tonnes_a_cubic_metre)
}

/// Computes the relative rate of DL/T 722-2014, 9.3.2: (C2 - C1) / C1 / Δt · 100, percent a month.
///
/// # Errors
/// Returns the errors of [`per_day`], and [`RateError::FromZero`].
pub fn relative(first: Reading, second: Reading) -> Result<f64, RateError> {
    let rate = per_day(first, second)?;
    if first.ppm <= 0.0 {
        return Err(RateError::FromZero);
    }
    Ok(rate / first.ppm * 100.0 * DAYS_A_MONTH)
}

/// Number of readings that a rate by regression rests on (IEEE C57.104-2019, table 4).
pub const REGRESSION_READINGS: std::ops::RangeInclusive<usize> = 3..=6;

/// Computes the slope of the least-squares line through 3 to 6 readings, ppm a year, and the months
/// that they span (IEEE C57.104-2019, 6.1.3).
///
/// # Errors
/// [`RateError::Count`], [`RateError::NotValid`], [`RateError::Order`].
pub fn regression(readings: &[Reading]) -> Result<(f64, f64), RateError> {
    if !REGRESSION_READINGS.contains(&readings.len()) {
        return Err(RateError::Count);
    }
    check(readings)?;
    let count = readings.len() as f64;
    let mean = |of: fn(&Reading) -> f64| readings.iter().map(of).sum::<f64>() / count;
    let (day, ppm) = (mean(|r| r.day), mean(|r| r.ppm));
    let (mut covariance, mut variance) = (0.0, 0.0);
    for reading in readings {
        covariance += (reading.day - day) * (reading.ppm - ppm);
        variance += (reading.day - day) * (reading.day - day);
    }
    let days = readings[readings.len() - 1].day - readings[0].day;
    Ok((covariance / variance * DAYS_A_YEAR, days / (DAYS_A_YEAR / 12.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(day: f64, ppm: f64) -> Reading {
        Reading { day, ppm }
    }

    #[test]
    fn rates_of_two_readings() {
        let (first, second) = (at(10.0, 100.0), at(40.0, 130.0));
        assert_eq!(per_day(first, second), Ok(1.0));
        assert_eq!(absolute(first, second, 45.0, 0.9), Ok(50.0));
        assert_eq!(relative(first, second), Ok(30.0));
        assert_eq!(relative(at(0.0, 0.0), second), Err(RateError::FromZero));
        assert_eq!(per_day(second, first), Err(RateError::Order));
        assert_eq!(per_day(first, at(10.0, 1.0)), Err(RateError::Order));
        assert_eq!(per_day(first, at(f64::NAN, 1.0)), Err(RateError::NotValid));
        assert_eq!(absolute(first, second, 0.0, 0.9), Err(RateError::Oil));
    }

    #[test]
    fn a_line_is_found_again() {
        let year = |months: f64| months * DAYS_A_YEAR / 12.0;
        let readings: Vec<_> =
            [0.0, 2.0, 3.0, 6.0].map(|months| at(year(months), 20.0 + 4.0 * months)).into();
        let (slope, months) = regression(&readings).unwrap();
        assert!((slope - 48.0).abs() < 1e-9 && (months - 6.0).abs() < 1e-9, "{slope} {months}");
        assert_eq!(regression(&readings[..2]), Err(RateError::Count));
        assert_eq!(regression(&[at(0.0, 1.0); 7]), Err(RateError::Count));
    }
}
