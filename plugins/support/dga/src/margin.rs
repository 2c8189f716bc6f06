//! Margin of a sample to another result, for methods made of limits.

use crate::{Gas, Margin, Sample};

/// Limits at which the result of a method can change.
pub(crate) struct Limits {
    /// Ratios (numerator, denominator) and their limits.
    pub(crate) ratios: &'static [(Gas, Gas, &'static [f64])],
    /// Gases and their concentration limits, ppm.
    pub(crate) gases: &'static [(Gas, &'static [f64])],
}

/// Relative step beyond a limit at which a result is tried.
const STEP: f64 = 1e-9;

impl Limits {
    /// Computes the least factor by which one gas alone must change for another result of `method`.
    /// Only where a ratio or a gas meets a limit can that be: each limit is tried, a little below,
    /// at and a little above. `None` where none of them helps.
    pub(crate) fn margin<T: PartialEq>(
        &self,
        sample: &Sample,
        method: impl Fn(&Sample) -> T,
    ) -> Option<Margin> {
        let now = method(sample);
        let mut nearest: Option<(Gas, f64)> = None;
        self.places(sample, |gas, ppm, place| {
            let factor = (place / ppm).max(ppm / place);
            if !factor.is_finite() || nearest.is_some_and(|(_, least)| factor >= least) {
                return;
            }
            let differs = |ppm| method(&sample.varied(gas, ppm)) != now;
            if [1.0 - STEP, 1.0, 1.0 + STEP].iter().any(|by| differs(place * by)) {
                nearest = Some((gas, factor));
            }
        });
        nearest.map(|(gas, factor)| Margin::Factor { gas, factor })
    }

    /// Calls `visit` with each measured gas, its ppm, and a concentration at which it meets a
    /// limit.
    fn places(&self, sample: &Sample, mut visit: impl FnMut(Gas, f64, f64)) {
        for &(numerator, denominator, limits) in self.ratios {
            let Some([above, below]) = sample.all([numerator, denominator]) else { continue };
            for limit in limits {
                visit(numerator, above, limit * below);
                visit(denominator, below, above / limit);
            }
        }
        for &(gas, limits) in self.gases {
            let Some(ppm) = sample.ppm(gas) else { continue };
            limits.iter().for_each(|&limit| visit(gas, ppm, limit));
        }
    }
}
