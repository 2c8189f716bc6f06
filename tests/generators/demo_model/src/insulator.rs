//! Porcelain insulators: the profile of revolution.

/// Sheds of a porcelain body, large and small in turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheds {
    /// Number of sheds, large and small together.
    pub count: usize,
    /// Overhang of a large shed beyond the core, metres.
    pub large_overhang: f32,
    /// Overhang of a small shed beyond the core, metres.
    pub small_overhang: f32,
}

/// Profile rings per shed: root, drip edge, tip, shoulder.
const RINGS_PER_SHED: usize = 4;

/// Returns the (radius, height) profile of a porcelain body that stands at height `base`, its core
/// tapering from `core_radii[0]` to `core_radii[1]`.
///
/// `4 count + 2` rings: a plain collar at either end and four to a shed, whose
/// underside hangs a little and whose top slopes so that rain runs off.
pub fn insulator_profile(
    base: f32,
    length: f32,
    core_radii: [f32; 2],
    sheds: Sheds,
) -> Vec<(f32, f32)> {
    let pitch = length / (sheds.count as f32 + 1.0);
    let core = |height: f32| {
        let share = ((height - base) / length).clamp(0.0, 1.0);
        core_radii[0] + (core_radii[1] - core_radii[0]) * share
    };
    let mut profile = Vec::with_capacity(RINGS_PER_SHED * sheds.count + 2);
    profile.push((core_radii[0], base));
    for shed in 0..sheds.count {
        let root = base + pitch * (shed as f32 + 0.75);
        let overhang = if shed % 2 == 0 { sheds.large_overhang } else { sheds.small_overhang };
        let shoulder = root + 0.5 * pitch;
        profile.push((core(root), root));
        profile.push((core(root) + overhang, root - 0.12 * pitch));
        profile.push((core(root) + overhang * 0.97, root + 0.06 * pitch));
        profile.push((core(shoulder), shoulder));
    }
    profile.push((core_radii[1], base + length));
    profile
}
