//! Boxes: plain, bevelled, and stretched between two points.

use glam::{Mat4, Vec3};

use crate::Solid;

/// Builds a box about the origin: 8 points, 12 triangles.
pub fn cuboid(size: Vec3) -> Solid {
    let half = size * 0.5;
    let points = (0..8).map(|octant| half * signs(octant)).collect();
    let face = |axis: usize, positive: bool| {
        let mut corners = octants_of_face(axis, positive);
        if !positive {
            corners.reverse();
        }
        let [a, b, c, d] = corners.map(|octant| octant as u32);
        [[a, b, c], [a, c, d]]
    };
    let triangles =
        (0..3).flat_map(|axis| [face(axis, false), face(axis, true)]).flatten().collect();
    Solid { points, triangles, uv: None }
}

/// Builds a box about the origin with its edges cut at 45 degrees: 24 points, 44 triangles. A bevel
/// of more than a third of the least side is reduced to it.
pub fn block(size: Vec3, bevel: f32) -> Solid {
    let bevel = bevel.min(size.min_element() / 3.0);
    if bevel <= 0.0 {
        return cuboid(size);
    }
    let half = size * 0.5;
    let inner = half - Vec3::splat(bevel);
    // Point `axis` of a corner is the one that lies in the face across `axis`.
    let points = (0..8)
        .flat_map(|octant| {
            (0..3).map(move |axis| {
                let mut extent = inner;
                extent[axis] = half[axis];
                extent * signs(octant)
            })
        })
        .collect();
    let mut solid = Solid { points, triangles: Vec::new(), uv: None };
    let point = |octant: usize, axis: usize| (octant * 3 + axis) as u32;
    for axis in 0..3 {
        for positive in [false, true] {
            add_outward(&mut solid, &octants_of_face(axis, positive).map(|o| point(o, axis)));
        }
        // The four edges that run along this axis.
        let (left, right) = ((axis + 1) % 3, (axis + 2) % 3);
        for low in (0..8).filter(|octant| octant & (1 << axis) == 0) {
            let high = low | (1 << axis);
            let quad = [(low, left), (low, right), (high, right), (high, left)];
            add_outward(&mut solid, &quad.map(|(o, a)| point(o, a)));
        }
    }
    for octant in 0..8 {
        add_outward(&mut solid, &[0, 1, 2].map(|axis| point(octant, axis)));
    }
    solid
}

/// Builds a bar of rectangular section from one point to another.
pub fn strut(from: Vec3, to: Vec3, width: f32, depth: f32) -> Solid {
    let along = (to - from).normalize_or(Vec3::Y);
    // Steep bars keep their width along x, level ones keep it upright.
    let reference = if along.y.abs() > 0.7 { Vec3::X } else { Vec3::Y };
    let across = (reference - along * reference.dot(along)).normalize_or(Vec3::Z);
    let third = across.cross(along);
    let frame = Mat4::from_cols(
        across.extend(0.0),
        along.extend(0.0),
        third.extend(0.0),
        ((from + to) * 0.5).extend(1.0),
    );
    cuboid(Vec3::new(width, from.distance(to), depth)).transformed(frame)
}

fn signs(octant: usize) -> Vec3 {
    let sign = |bit: usize| if octant & (1 << bit) == 0 { -1.0 } else { 1.0 };
    Vec3::new(sign(0), sign(1), sign(2))
}

/// Returns the corners of a face, counter-clockwise about the positive axis.
fn octants_of_face(axis: usize, positive: bool) -> [usize; 4] {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = if positive { 1 << axis } else { 0 };
    [base, base | u, base | u | v, base | v]
}

/// Adds a convex polygon of a solid about the origin, turned to face outward.
fn add_outward(solid: &mut Solid, corners: &[u32]) {
    let p = |i: usize| solid.points[corners[i] as usize];
    let inward = (p(1) - p(0)).cross(p(2) - p(0)).dot(p(0)) < 0.0;
    for i in 1..corners.len() - 1 {
        let (second, third) = if inward { (i + 1, i) } else { (i, i + 1) };
        solid.triangles.push([corners[0], corners[second], corners[third]]);
    }
}
