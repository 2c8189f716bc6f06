//! Seeded random samples of gases.
#![allow(dead_code)]

use dga::{Concentration, Gas, Sample};

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Returns a number from 0 to below 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.bits() % end
    }

    pub(crate) fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }

    /// Returns a number that is evenly distributed on a logarithmic scale.
    pub(crate) fn log(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }
}

/// Creates a sample of these gases, in the order of [`Gas::ALL`].
pub(crate) fn sample(ppm: &[Option<f64>; 9]) -> Sample {
    let mut sample = Sample::new();
    for (gas, ppm) in Gas::ALL.into_iter().zip(ppm) {
        if let Some(ppm) = ppm {
            sample = sample.with(gas, Concentration::measured(*ppm).expect("it is valid"));
        }
    }
    sample
}
