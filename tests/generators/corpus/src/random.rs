//! Pseudo-random numbers by hashing, the same on every machine.

use glam::{IVec3, Vec3};

/// Hashes a seed by SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
fn mixed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns the pseudo-random number of a seed, 0 to 1.
pub(crate) fn unit(seed: u64) -> f32 {
    // 24 bits are exact.
    (mixed(seed) >> 40) as f32 / (1_u32 << 24) as f32
}

/// Returns the pseudo-random number of a seed, -1 to 1.
pub(crate) fn signed(seed: u64) -> f32 {
    unit(seed) * 2.0 - 1.0
}

/// Returns a pseudo-random vector in the cube of -1 to 1.
pub(crate) fn signed_vector(seed: u64) -> Vec3 {
    let seed = mixed(seed);
    Vec3::new(signed(seed), signed(seed ^ 1), signed(seed ^ 2))
}

/// Returns smooth noise at a place, -1 to 1: values at whole coordinates, blended.
pub(crate) fn noise(place: Vec3, seed: u64) -> f32 {
    let floor = place.floor();
    let cell = floor.as_ivec3();
    let share = place - floor;
    let blend = share * share * (3.0 - 2.0 * share);
    let value = |corner: usize| {
        let offset = IVec3::new(corner as i32 & 1, corner as i32 >> 1 & 1, corner as i32 >> 2);
        let key = (cell + offset).to_array().map(|c| u64::from(c as u32));
        signed(mixed(mixed(mixed(seed) ^ key[0]) ^ key[1]) ^ key[2])
    };
    let along = |from: f32, to: f32, share: f32| from + (to - from) * share;
    let x = |low: usize| along(value(low), value(low | 1), blend.x);
    let xy = |low: usize| along(x(low), x(low | 2), blend.y);
    along(xy(0), xy(4), blend.z)
}
