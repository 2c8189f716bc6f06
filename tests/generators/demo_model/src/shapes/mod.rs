//! Shape builders. Each gives a closed solid with outward normals; sizes are
//! metres and must be positive, counts below the least sensible are raised.

mod block;
mod loft;
mod sweep;

pub use block::{block, cuboid, strut};
pub use loft::{Ends, cylinder, lathe, loft, ring_of_profile, torus};
pub use sweep::{pipe, rounded_path, sweep};

use glam::Vec2;

/// Least number of points of a ring.
pub(crate) const MIN_SEGMENTS: usize = 3;

/// Returns cosine and sine of part `i` of a full turn cut into `n`.
pub(crate) fn turn(i: usize, n: usize) -> Vec2 {
    cos_sin(360.0 * i as f64 / n as f64)
}

/// Returns cosine and sine of an angle, the same on every machine.
pub(crate) fn cos_sin(degrees: f64) -> Vec2 {
    let radians = degrees.to_radians();
    Vec2::new(libm::cos(radians) as f32, libm::sin(radians) as f32)
}
