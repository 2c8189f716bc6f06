//! Probabilities of results under the measurement uncertainty of the gases.
//!
//! Every gas lies, independent of the others and evenly, within so many percent of what was
//! measured; one below its detection limit from 0 to that limit. The probability of a result
//! is the share of that box in which a method gives it.

use std::collections::BTreeMap;
use std::fmt;

use crate::{Gas, Sample};

/// Number of sample points of a method. With so many, probabilities are within 0.005 of the exact
/// ones (`tests/uncertainty.rs` measures it).
pub const POINTS: u32 = 1 << 15;

/// Measurement uncertainty of a laboratory, as a share of the measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty(f64);

impl Uncertainty {
    /// Uncertainty that laboratories commonly reach, 15 %.
    pub const DEFAULT: Self = Self(0.15);

    /// Creates an uncertainty from a share from 0 to below 1.
    ///
    /// # Errors
    /// [`InvalidUncertainty`] for anything else.
    pub fn new(share: f64) -> Result<Self, InvalidUncertainty> {
        (0.0..1.0).contains(&share).then_some(Self(share)).ok_or(InvalidUncertainty)
    }

    /// Returns the share of the measured value.
    pub fn share(self) -> f64 {
        self.0
    }
}

impl Default for Uncertainty {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Error of an uncertainty that is not from 0 to below 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidUncertainty;

impl fmt::Display for InvalidUncertainty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an uncertainty is a share from 0 to below 1, such as 0.15")
    }
}

impl std::error::Error for InvalidUncertainty {}

/// Returns the position of a gas in the box of uncertainty: from 0 to 1.
pub(crate) fn place(sample: &Sample, gas: Gas, uncertainty: Uncertainty, at: f64) -> Option<f64> {
    let measured = sample.concentration(gas)?;
    Some(match measured.detection_limit() {
        Some(limit) => limit * at,
        None => measured.ppm() * (1.0 + uncertainty.0 * (2.0 * at - 1.0)),
    })
}

/// Computes the probability of each result of `method`, which rests on `gases` alone; they sum up
/// to 1. Deterministic: the first [`POINTS`] points of Halton's sequence (J. H. Halton, Numerische
/// Mathematik 2, 1960), a gas a dimension.
pub fn probabilities<T: Ord>(
    sample: &Sample,
    uncertainty: Uncertainty,
    gases: &[Gas],
    method: impl Fn(&Sample) -> T,
) -> BTreeMap<T, f64> {
    let mut found = BTreeMap::new();
    for point in 1..=POINTS {
        let mut varied = *sample;
        for (&gas, base) in gases.iter().zip(BASES) {
            let at = radical_inverse(point, base);
            if let Some(ppm) = place(sample, gas, uncertainty, at) {
                varied = varied.varied(gas, ppm);
            }
        }
        *found.entry(method(&varied)).or_insert(0_u32) += 1;
    }
    let share = |count| f64::from(count) / f64::from(POINTS);
    found.into_iter().map(|(zone, count)| (zone, share(count))).collect()
}

/// Bases of the dimensions: primes, one for each gas.
const BASES: [u32; Gas::ALL.len()] = [2, 3, 5, 7, 11, 13, 17, 19, 23];

/// Mirrors the digits of a number at the point: from 0 to below 1.
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut digit, mut sum) = (1.0, 0.0);
    while number > 0 {
        digit /= f64::from(base);
        sum += digit * f64::from(number % base);
        number /= base;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Concentration, triangle_1};

    #[test]
    fn digits_are_mirrored() {
        assert_eq!([1, 2, 3, 4, 6].map(|i| radical_inverse(i, 2)), [0.5, 0.25, 0.75, 0.125, 0.375]);
        assert!((radical_inverse(5, 3) - 7.0 / 9.0).abs() < 1e-15);
    }

    #[test]
    fn only_shares_are_uncertainties() {
        assert_eq!(Uncertainty::new(0.0).map(Uncertainty::share), Ok(0.0));
        for share in [-0.1, 1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Uncertainty::new(share), Err(InvalidUncertainty));
        }
    }

    #[test]
    fn a_certain_sample_has_one_result() {
        let sample = Sample::of_five([1.0, 98.0, 0.0, 1.0, 1.0]).unwrap();
        let exact = Uncertainty::new(0.0).unwrap();
        let found = probabilities(&sample, exact, &Gas::FIVE, triangle_1::zone);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [(triangle_1::zone(&sample), 1.0)]);
    }

    #[test]
    fn what_is_below_its_limit_may_be_anything_up_to_it() {
        let below = Concentration::below(2.0).unwrap();
        let sample = Sample::of_five([0.0; 5]).unwrap().with(Gas::H2, below);
        let is_more = |sample: &Sample| sample.ppm(Gas::H2) > Some(0.5);
        let found = probabilities(&sample, Uncertainty::DEFAULT, &[Gas::H2], is_more);
        assert!((found[&true] - 0.75).abs() < 1e-3, "{found:?}");
    }
}
