//! Erection tolerance: how far foundations stand from where they are drawn.

/// Greatest distance from the drawn place along either axis, metres.
const TOLERANCE_METRES: f32 = 0.004;

/// A generator of tolerances (SplitMix64), the same on every machine.
pub(crate) struct Scatter(u64);

impl Scatter {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A length between minus and plus the tolerance, metres.
    pub(crate) fn metres(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        let unit = (z >> 40) as f32 / (1_u64 << 24) as f32;
        (2.0 * unit - 1.0) * TOLERANCE_METRES
    }
}
