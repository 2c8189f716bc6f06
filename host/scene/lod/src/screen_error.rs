//! Screen-space error: levels of detail by the size of an error in pixels.

use std::sync::LazyLock;

/// The error of the finest level that collapses anything, metres: an eye one
/// metre away sees it as a tenth of a pixel.
const FINEST_ERROR: f64 = 1e-4;
/// Levels to each doubling of the error. A mesh is resolved again once in such a part of a doubling
/// of the distance, not at each step of the camera.
const LEVELS_A_DOUBLING: f64 = 2.0;
/// Coarsest level, whose error is some 3,000 km: all meshes vanish.
const MAX_LEVEL: u32 = 70;

/// Level of detail by screen-space error: no error is more than so many pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenError {
    max_pixels: f64,
    /// Share of a pixel's size at which a coarser level is taken up.
    coarser_share: f64,
}

impl ScreenError {
    /// Allows errors of at most `max_pixels`. `hysteresis`, from 0 to below 1, is the share to
    /// spare before a coarser level is chosen. A finer level is chosen at once, since the bound
    /// always holds.
    pub fn new(max_pixels: f64, hysteresis: f64) -> Self {
        Self { max_pixels, coarser_share: 1.0 - hysteresis }
    }

    /// Returns the level where a pixel covers so many metres.
    pub(crate) fn level(&self, pixel: f32, last: Option<u32>) -> u32 {
        let allowed = f64::from(pixel) * self.max_pixels;
        // From frame to frame few change, and this costs least.
        if let Some(last) = last
            && allowed >= Self::error(last)
            && allowed * self.coarser_share < Self::error(last + 1)
        {
            return last;
        }
        let coarsest = coarsest_within(allowed);
        match last {
            Some(last) if last < coarsest => {
                last.max(coarsest_within(allowed * self.coarser_share))
            }
            _ => coarsest,
        }
    }

    /// Returns the error of a level, metres; 0 at the finest.
    pub(crate) fn error(level: u32) -> f64 {
        ERRORS.get(level as usize).copied().unwrap_or(f64::INFINITY)
    }
}

/// Errors of the levels.
static ERRORS: LazyLock<[f64; MAX_LEVEL as usize + 1]> = LazyLock::new(|| {
    std::array::from_fn(|level| match level.checked_sub(1) {
        None => 0.0,
        Some(step) => FINEST_ERROR * (step as f64 / LEVELS_A_DOUBLING).exp2(),
    })
});

/// Returns the coarsest level whose error is within some metres.
fn coarsest_within(metres: f64) -> u32 {
    let steps = (metres / FINEST_ERROR).log2() * LEVELS_A_DOUBLING;
    // Also where there is no error to speak of, or no number.
    if steps >= 0.0 { (steps as u32).min(MAX_LEVEL - 1) + 1 } else { 0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn levels_climb_with_what_a_pixel_covers() {
        let policy = ScreenError::new(0.5, 0.1);
        let level = |pixel| policy.level(pixel, None);
        assert_eq!(level(0.0), 0);
        assert_eq!(level(1.9e-4), 0, "half of it is less than the finest error");
        assert_eq!([level(2.1e-4), level(2.1e-4 * 2.0), level(2.1e-4 * 1024.0)], [1, 3, 21]);
        assert_eq!([level(f32::INFINITY), level(f32::NAN)], [MAX_LEVEL, 0]);
        assert_eq!([ScreenError::error(0), ScreenError::error(1)], [0.0, FINEST_ERROR]);
    }

    #[test]
    fn an_eye_that_trembles_keeps_the_finer_level() {
        let policy = ScreenError::new(1.0, 0.1);
        let mut last = None;
        let mut step = |pixel: f32| {
            last = Some(policy.level(pixel, last));
            last.unwrap_or_default()
        };
        let limit = FINEST_ERROR as f32;
        assert_eq!([step(limit * 1.01), step(limit * 0.99)], [1, 0]);
        for _ in 0..20 {
            assert_eq!([step(limit * 1.05), step(limit * 0.95)], [0, 0]);
        }
        assert_eq!(step(limit * 1.2), 1, "once there is enough to spare");
    }

    proptest! {
        /// The bound holds after any history, and the level is at most one coarser step from it.
        #[test]
        fn the_error_on_the_screen_stays_within_the_bound(
            pixel in 0.0_f32..100.0,
            max_pixels in 0.1_f64..16.0,
            last in prop::option::of(0_u32..MAX_LEVEL),
        ) {
            let policy = ScreenError::new(max_pixels, 0.1);
            let level = policy.level(pixel, last);
            let allowed = f64::from(pixel) * max_pixels;
            prop_assert!(ScreenError::error(level) <= allowed * (1.0 + 1e-9));
            let coarser = ScreenError::error((level + 2).min(MAX_LEVEL));
            prop_assert!(level + 2 > MAX_LEVEL || coarser > allowed * 0.9);
            prop_assert_eq!(policy.level(pixel, Some(level)), level, "it stands still");
        }
    }
}
