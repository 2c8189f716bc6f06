//! Signed distance field of the scanned body: negative inside, positive outside, metres.

use glam::{Vec2, Vec3};

use crate::random::{noise, signed_vector, unit};

/// Height of the porcelain, metres.
pub(crate) const HEIGHT: f32 = 1.3;
/// Outermost radius of the field's bodies, metres.
pub(crate) const REACH: f32 = 0.26;

const SHEDS: usize = 9;
const FIRST_SHED: f32 = 0.16;
const SHED_PITCH: f32 = 0.125;
/// Radius of the smooth blend between neighbouring bodies, metres.
const BLEND: f32 = 0.014;
const ISLANDS: u64 = 14;
const ISLAND_SEED: u64 = 0x15_1a4d;

/// Returns the signed distance field of the bushing with its noise, and of specks that float beside
/// it.
pub(crate) fn field(place: Vec3) -> f32 {
    let body = bushing(Vec2::new(Vec2::new(place.x, place.z).length(), place.y));
    // Registration: shots from three sides lie a little apart.
    let shot = if place.x > 0.1 * place.z { 0.0006 } else { -0.0004 };
    let waves = 0.0012 * noise(place * 22.0, 1) + 0.0006 * noise(place * 61.0, 2);
    let grain = 0.0005 * noise(place * 143.0, 3);
    (body + shot + waves + grain).min(islands(place))
}

/// Returns the signed distance of the clean body of revolution, at radius x and height y.
fn bushing(at: Vec2) -> f32 {
    let core_radius = 0.11 - 0.04 * (at.y / HEIGHT).clamp(0.0, 1.0);
    let core = (at.x - core_radius).max((at.y - 0.5 * HEIGHT).abs() - 0.5 * HEIGHT);
    let flange = slab(at, 0.17, [0.0, 0.05]);
    let cap = slab(at, 0.1, [HEIGHT - 0.06, HEIGHT + 0.02]);
    let stud = slab(at, 0.025, [HEIGHT, HEIGHT + 0.12]);
    let solid = blended(core, flange.min(cap).min(stud));
    // Only the two nearest sheds matter.
    let nearest = ((at.y - FIRST_SHED) / SHED_PITCH).round();
    let sheds = [nearest, nearest + 1.0].into_iter().filter(|n| (0.0..SHEDS as f32).contains(n));
    let shed = |n: f32| {
        let foot = Vec2::new(core_radius, FIRST_SHED + n * SHED_PITCH);
        let reach = if n % 2.0 == 0.0 { 0.225 } else { 0.195 };
        tapered(at, foot, Vec2::new(reach, foot.y - 0.03), [0.02, 0.009])
    };
    sheds.map(shed).fold(solid, blended)
}

/// Returns the signed distance of a disc with a slightly rounded rim.
fn slab(at: Vec2, radius: f32, [low, high]: [f32; 2]) -> f32 {
    const ROUND: f32 = 0.004;
    let middle = 0.5 * (low + high);
    let outside =
        Vec2::new(at.x - radius + ROUND, (at.y - middle).abs() - 0.5 * (high - low) + ROUND);
    outside.max(Vec2::ZERO).length() + outside.max_element().min(0.0) - ROUND
}

/// Returns the signed distance of a rod whose radius changes from one end to the other.
fn tapered(at: Vec2, from: Vec2, to: Vec2, radii: [f32; 2]) -> f32 {
    let along = to - from;
    let share = ((at - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    at.distance(from + along * share) - (radii[0] + (radii[1] - radii[0]) * share)
}

/// Blends two signed distances to the union of two bodies, rounded where they meet.
fn blended(a: f32, b: f32) -> f32 {
    let near = (BLEND - (a - b).abs()).max(0.0) / BLEND;
    a.min(b) - near * near * BLEND * 0.25
}

/// Returns the signed distance of specks of dust and reflections.
fn islands(place: Vec3) -> f32 {
    let island = |index: u64| {
        let seed = ISLAND_SEED + 16 * index;
        let out = signed_vector(seed) * Vec3::new(0.24, 0.0, 0.24);
        let away = (0.16 + 0.08 * unit(seed + 1)) / out.length().max(0.02);
        let centre = (out * away).with_y(0.1 + (HEIGHT - 0.1) * unit(seed + 2));
        let radius = 0.004 + 0.008 * unit(seed + 3);
        place.distance(centre) - radius + 0.003 * noise(place * 170.0, seed)
    };
    (0..ISLANDS).map(island).fold(f32::INFINITY, f32::min)
}
