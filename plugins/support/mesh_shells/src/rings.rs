//! Surfaces of revolution: their axis, their rings, and the order in which rings lose vertices.
//!
//! Insulators, bushings, coils and bolts are turned: all vertices of a ring, and of rings alike,
//! cost the same up to rounding. Rounding must not choose among them, or rings lose other
//! vertices than their neighbours and sheds become screws. [`regular_order`] is the choice: every
//! second vertex of all rings first, then every second of those that are left.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

/// Vertices of a shell from which it is looked at.
const MIN_SHELL: usize = 24;
/// Places that a ring has at least.
const MIN_RING: usize = 5;
/// Share of the vertices that must lie on rings.
const MIN_SHARE: f64 = 0.6;
/// Difference of height or radius within a ring, in radii of gyration of the shell.
const TOLERANCE: f64 = 1e-3;
/// Difference of the moments across the axis, relative to the greatest moment.
const MOMENT_TOLERANCE: f64 = 2e-2;
/// Difference of the angle between neighbours to the even one.
const ANGLE_TOLERANCE: f64 = 0.02;
/// Angle between vertices at one place, at most.
const SAME_PLACE: f64 = 1e-3;
/// Halvings of a ring that are told apart.
pub const MAX_HALVINGS: u8 = 4;
/// Sweeps of the eigenvalue iteration.
const MAX_SWEEPS: usize = 16;

/// Rounds a cost that is not negative down to `fraction_bits` (at most 52) of its fraction: vertices
/// of a ring, whose costs differ by rounding or by which neighbours went before them, cost the same.
pub fn coarse_cost(cost: f64, fraction_bits: u32) -> f64 {
    let dropped = f64::MANTISSA_DIGITS - 1 - fraction_bits;
    f64::from_bits(cost.to_bits() >> dropped << dropped)
}

/// Place of a vertex in the coordinates of an axis.
#[derive(Clone, Copy)]
struct TurnedVertex {
    vertex: u32,
    height: f64,
    radius: f64,
    /// Angle around the axis, 0 to 2 pi.
    angle: f64,
}

/// Order key of a vertex: halvings that it survives, its angle and its height.
type OrderKey = (u32, u32, u32);

/// Order of the vertices of a shell of revolution.
#[derive(Clone, Debug, Default)]
pub struct RegularOrder {
    /// Vertices in the order in which those of equal cost go.
    pub vertices: Vec<u32>,
    /// Halvings of its ring that each vertex survives, at most [`MAX_HALVINGS`]; 0 off the rings.
    pub halvings: Vec<u8>,
}

/// Returns the order of the vertices of a shell of revolution; `None` for any other shell. Positions are in metres, triangles are indices of them.
pub fn regular_order(
    positions: &[DVec3],
    triangles: impl Iterator<Item = [u32; 3]> + Clone,
) -> Option<RegularOrder> {
    if positions.len() < MIN_SHELL {
        return None;
    }
    let moments = Moments::new(positions, triangles)?;
    let (moments_along, axes) = moments.principal_axes();
    let tolerance = TOLERANCE * moments_along.max_element().sqrt();
    let mut best: Option<(usize, Vec<OrderKey>)> = None;
    for axis in 0..3 {
        let [a, b] = [moments_along[(axis + 1) % 3], moments_along[(axis + 2) % 3]];
        if (a - b).abs() <= MOMENT_TOLERANCE * a.max(b) {
            let (count, keys) = ring_keys(positions, moments.center, axes.col(axis), tolerance);
            if best.as_ref().is_none_or(|best| count > best.0) {
                best = Some((count, keys));
            }
        }
    }
    let (_, keys) = best.filter(|best| best.0 as f64 >= MIN_SHARE * positions.len() as f64)?;
    let mut vertices: Vec<u32> = (0..positions.len() as u32).collect();
    vertices.sort_by_key(|&vertex| (keys[vertex as usize], vertex));
    let halvings = keys.iter().map(|key| key.0.min(MAX_HALVINGS.into()) as u8).collect();
    Some(RegularOrder { vertices, halvings })
}

/// Center of a surface's area, and its second moments around that.
struct Moments {
    center: DVec3,
    matrix: DMat3,
}

impl Moments {
    /// Measures a surface by its triangles: unlike those of vertices, moments of area do not
    /// depend on vertices that are there twice. `None` for a surface without area.
    fn new(positions: &[DVec3], triangles: impl Iterator<Item = [u32; 3]> + Clone) -> Option<Self> {
        let triangles = || {
            triangles.clone().map(|triangle| {
                let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
                ((b - a).cross(c - a).length(), (a + b + c) / 3.0)
            })
        };
        let area: f64 = triangles().map(|(area, _)| area).sum();
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let center = triangles().map(|(area, middle)| area * middle).sum::<DVec3>() / area;
        let mut matrix = DMat3::ZERO;
        for (share, middle) in triangles() {
            let offset = middle - center;
            let columns = [offset.x, offset.y, offset.z].map(|part| offset * part * (share / area));
            matrix += DMat3::from_cols(columns[0], columns[1], columns[2]);
        }
        matrix.is_finite().then_some(Self { center, matrix })
    }

    /// Moments along the principal axes, square metres, and the axes as columns (Jacobi's
    /// eigenvalue iteration).
    fn principal_axes(&self) -> (DVec3, DMat3) {
        let mut matrix = self.matrix;
        let mut axes = DMat3::IDENTITY;
        for turn in 0..3 * MAX_SWEEPS {
            let (p, q) = [(0, 1), (0, 2), (1, 2)][turn % 3];
            let [app, aqq, apq] = [matrix.col(p)[p], matrix.col(q)[q], matrix.col(q)[p]];
            if apq.abs() <= f64::EPSILON * (app.abs() + aqq.abs()) {
                continue;
            }
            let ratio = (aqq - app) / (2.0 * apq);
            let tangent = 1.0_f64.copysign(ratio) / (ratio.abs() + ratio.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = cosine;
            rotation.col_mut(q)[q] = cosine;
            rotation.col_mut(q)[p] = tangent * cosine;
            rotation.col_mut(p)[q] = -tangent * cosine;
            matrix = rotation.transpose() * matrix * rotation;
            axes *= rotation;
        }
        (DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z), axes)
    }
}

/// Number of vertices on even rings around an axis, and the key of each vertex.
fn ring_keys(
    positions: &[DVec3],
    center: DVec3,
    axis: DVec3,
    tolerance: f64,
) -> (usize, Vec<OrderKey>) {
    let across = axis.any_orthonormal_vector();
    let third = axis.cross(across);
    let turned = |(position, vertex): (&DVec3, u32)| {
        let offset = *position - center;
        let [x, y] = [offset.dot(across), offset.dot(third)];
        let angle = y.atan2(x).rem_euclid(TAU);
        TurnedVertex { vertex, height: offset.dot(axis), radius: x.hypot(y), angle }
    };
    let mut turned: Vec<TurnedVertex> = positions.iter().zip(0..).map(turned).collect();
    turned.sort_by(|a, b| a.height.total_cmp(&b.height));
    for level in turned.chunk_by_mut(|a, b| b.height - a.height <= tolerance) {
        level.sort_by(|a, b| a.radius.total_cmp(&b.radius));
    }
    let is_same_ring = |a: &TurnedVertex, b: &TurnedVertex| {
        (b.height - a.height).abs() <= tolerance && (b.radius - a.radius).abs() <= tolerance
    };
    let mut rings: Vec<(&mut [TurnedVertex], usize)> = Vec::new();
    for ring in turned.chunk_by_mut(is_same_ring) {
        ring.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        if let Some(size) = even_size(ring) {
            rings.push((ring, size));
        }
    }
    // Steps of the finest ring, so that rings of other sizes keep vertices at the same angles.
    let steps = rings.iter().map(|ring| ring.1).max().unwrap_or(1);
    let reference = rings.first().map_or(0.0, |ring| ring.0[0].angle);
    let mut keys = vec![OrderKey::default(); positions.len()];
    let mut count = 0;
    for ((ring, _), level) in rings.iter().zip(0..) {
        count += ring.len();
        for place in ring.iter() {
            let share = (place.angle - reference).rem_euclid(TAU) / TAU;
            let step = (share * steps as f64).round() as u32 % steps as u32;
            let halvings = if step == 0 { u32::BITS } else { step.trailing_zeros() };
            keys[place.vertex as usize] = (halvings, step, level);
        }
    }
    (count, keys)
}

/// Number of places of a ring, in order of angles, if they are evenly spaced.
fn even_size(ring: &[TurnedVertex]) -> Option<usize> {
    let next = ring.iter().cycle().skip(1);
    let gaps = ring.iter().zip(next).map(|(a, b)| (b.angle - a.angle).rem_euclid(TAU));
    // Several vertices may be at one place, as along a seam.
    let gaps = gaps.filter(|gap| *gap > SAME_PLACE && *gap < TAU - SAME_PLACE);
    let size = gaps.clone().count();
    let even = TAU / size as f64;
    (size >= MIN_RING && gaps.clone().all(|gap| (gap - even).abs() <= ANGLE_TOLERANCE * even))
        .then_some(size)
}
