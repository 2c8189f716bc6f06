//! Gas concentrations of one oil sample.

use std::fmt;

use crate::Gas;

/// Greatest valid concentration, ppm. Oil holds no more than some three times its own volume of the
/// gas that dissolves best (ethane, 2.8e6 ppm). A greater number is an error of data.
pub const MAX_PPM: f64 = 1e7;

/// Concentration in ppm (µL/L): finite, from 0 to [`MAX_PPM`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Concentration(Inner);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Inner {
    Measured(f64),
    Below(f64),
}

impl Concentration {
    /// Creates a measured concentration, ppm.
    ///
    /// # Errors
    /// [`SampleError`] unless it is finite, not negative and at most [`MAX_PPM`].
    pub fn measured(ppm: f64) -> Result<Self, SampleError> {
        SampleError::check(ppm).map(|ppm| Self(Inner::Measured(ppm)))
    }

    /// Creates a concentration below a detection limit, ppm.
    ///
    /// # Errors
    /// Returns the errors of [`Concentration::measured`].
    pub fn below(limit_ppm: f64) -> Result<Self, SampleError> {
        SampleError::check(limit_ppm).map(|ppm| Self(Inner::Below(ppm)))
    }

    /// Returns the number that methods take, ppm: 0 for a concentration below its detection limit.
    pub fn ppm(self) -> f64 {
        match self.0 {
            Inner::Measured(ppm) => ppm,
            Inner::Below(_) => 0.0,
        }
    }

    /// Returns the detection limit that the concentration is below, ppm.
    pub fn detection_limit(self) -> Option<f64> {
        match self.0 {
            Inner::Measured(_) => None,
            Inner::Below(limit) => Some(limit),
        }
    }
}

/// Gases of one sample. Any of them may be absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample([Option<Concentration>; Gas::ALL.len()]);

impl Sample {
    /// Creates a sample in which nothing was measured yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Creates a sample of the five gases in the order of [`Gas::FIVE`], ppm.
    ///
    /// # Errors
    /// Returns the errors of [`Concentration::measured`].
    pub fn of_five(ppm: [f64; 5]) -> Result<Self, SampleError> {
        let mut sample = Self::new();
        for (gas, ppm) in Gas::FIVE.into_iter().zip(ppm) {
            sample = sample.with(gas, Concentration::measured(ppm)?);
        }
        Ok(sample)
    }

    /// Returns the sample with this concentration of one gas.
    #[must_use]
    pub fn with(mut self, gas: Gas, concentration: Concentration) -> Self {
        self.0[gas as usize] = Some(concentration);
        self
    }

    /// Returns the concentration of a gas; `None` if it is absent.
    pub fn concentration(&self, gas: Gas) -> Option<Concentration> {
        self.0[gas as usize]
    }

    /// Returns a gas as methods take it, ppm; `None` if it is absent.
    pub fn ppm(&self, gas: Gas) -> Option<f64> {
        self.concentration(gas).map(Concentration::ppm)
    }

    /// Returns several gases, ppm; `None` if one is absent.
    pub(crate) fn all<const N: usize>(&self, gases: [Gas; N]) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for (value, gas) in values.iter_mut().zip(gases) {
            *value = self.ppm(gas)?;
        }
        Some(values)
    }

    /// Returns the sample with another measured value, clamped to the valid range.
    pub(crate) fn varied(mut self, gas: Gas, ppm: f64) -> Self {
        self.0[gas as usize] = Some(Concentration(Inner::Measured(ppm.clamp(0.0, MAX_PPM))));
        self
    }
}

/// Error of a number that is no concentration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampleError {
    /// Number that is NaN or infinite.
    NotFinite,
    /// Number that is less than 0.
    Negative(f64),
    /// Number that is greater than [`MAX_PPM`].
    TooLarge(f64),
}

impl SampleError {
    fn check(ppm: f64) -> Result<f64, Self> {
        match ppm {
            ppm if !ppm.is_finite() => Err(Self::NotFinite),
            ppm if ppm < 0.0 => Err(Self::Negative(ppm)),
            ppm if ppm > MAX_PPM => Err(Self::TooLarge(ppm)),
            // -0.0 too becomes 0.
            ppm => Ok(ppm + 0.0),
        }
    }
}

impl fmt::Display for SampleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a concentration is a finite number"),
            Self::Negative(ppm) => write!(f, "{ppm} ppm is negative; a concentration is not"),
            Self::TooLarge(ppm) => {
                write!(f, "{ppm} ppm is more than oil can hold ({MAX_PPM}); is the unit ppm?")
            }
        }
    }
}

impl std::error::Error for SampleError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_valid_concentrations_exist() {
        let made = |ppm| Concentration::measured(ppm).map(Concentration::ppm);
        assert_eq!((made(0.0), made(MAX_PPM)), (Ok(0.0), Ok(MAX_PPM)));
        assert!(made(-0.0).unwrap().is_sign_positive());
        assert_eq!(made(-1.0), Err(SampleError::Negative(-1.0)));
        assert_eq!(made(MAX_PPM.next_up()), Err(SampleError::TooLarge(MAX_PPM.next_up())));
        for ppm in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(made(ppm), Err(SampleError::NotFinite));
        }
    }

    #[test]
    fn below_the_detection_limit_counts_as_nothing() {
        let below = Concentration::below(0.5).unwrap();
        assert_eq!((below.ppm(), below.detection_limit()), (0.0, Some(0.5)));
        let sample = Sample::new().with(Gas::C2h2, below);
        assert_eq!((sample.ppm(Gas::C2h2), sample.ppm(Gas::H2)), (Some(0.0), None));
        assert_eq!(sample.all([Gas::C2h2, Gas::H2]), None);
    }
}
