//! Bolts, nuts and washers: small, many, and full of small triangles.

use glam::{Mat4, Vec2, Vec3};

use crate::cad::profile::{Profile, circle, turn};
use crate::cad::shape::{Shape, Vertex};

/// Segments of round parts.
const ROUND: usize = 12;
const HEXAGON: usize = 6;

/// Builds a bolt through `grip` metres of flange that lies on y = -grip to 0: washer and head
/// above, washer, nut and thread below. `diameter` is the shank's.
pub(crate) fn bolt(diameter: f32, grip: f32) -> Shape {
    let washer = diameter * 0.16;
    let mut shape = Shape::default();
    shape.add(&ring(diameter, washer), Mat4::IDENTITY);
    shape.add(&hexagon(diameter, diameter * 0.65), Mat4::from_translation(Vec3::Y * washer));
    let below = -grip - washer;
    shape.add(&ring(diameter, washer), Mat4::from_translation(Vec3::Y * below));
    let nut = diameter * 0.8;
    shape.add(&hexagon(diameter, nut), Mat4::from_translation(Vec3::Y * (below - nut)));
    let end = below - nut - diameter * 0.8;
    shape.add(&thread(diameter, end, below - nut), Mat4::IDENTITY);
    shape
}

/// Builds a washer with chamfered edges.
fn ring(diameter: f32, height: f32) -> Shape {
    let (bore, rim, edge) = (diameter * 0.53, diameter * 1.0, height * 0.2);
    Profile::from(bore, 0.0)
        .line(rim, 0.0)
        .line(rim, height - edge)
        .line(rim - edge, height)
        .line(bore, height)
        .line(bore, 0.0)
        .revolved(ROUND)
}

/// Builds a hexagonal head or nut with a chamfered top.
fn hexagon(diameter: f32, height: f32) -> Shape {
    let across = diameter * 0.92;
    let corners = circle(Vec2::ZERO, across, HEXAGON);
    let shoulder = height * 0.88;
    let flat = 0.84;
    let mut shape = Shape::default();
    for side in 0..HEXAGON {
        let ends = [corners[side], corners[(side + 1) % HEXAGON]];
        let out = (ends[0] + ends[1]).normalize();
        shape.net([1, 1], |end, top| Vertex {
            position: Vec3::new(ends[end].x, shoulder * top as f32, ends[end].y),
            normal: Vec3::new(out.x, 0.0, out.y),
            uv: Vec2::new(end as f32 * across, shoulder * top as f32),
        });
        shape.net([1, 1], |end, top| {
            let point = ends[end] * if top == 0 { 1.0 } else { flat };
            let height = if top == 0 { shoulder } else { height };
            let normal = Vec3::new(out.x * 0.6, 0.8, out.y * 0.6);
            Vertex { position: Vec3::new(point.x, height, point.y), normal, uv: point }
        });
    }
    shape.plate(&[circle(Vec2::ZERO, across, HEXAGON)], 0.0, false);
    shape.plate(&[corners.iter().map(|&corner| corner * flat).collect()], height, true);
    shape
}

/// Builds the end of a shank: rings for a thread, with a rounded tip below.
fn thread(diameter: f32, from: f32, to: f32) -> Shape {
    const RIDGES: usize = 4;
    let (crest, root) = (diameter * 0.5, diameter * 0.43);
    let tip = root * 0.3;
    let pitch = (to - from - tip) / RIDGES as f32;
    let mut profile = Profile::from(0.0, from).line(root - tip, from).arc(
        [root, from + tip],
        [root - tip, from + tip],
        true,
        3,
    );
    for ridge in 0..RIDGES {
        let low = from + tip + ridge as f32 * pitch;
        profile = profile
            .line(crest, low + pitch * 0.4)
            .line(crest, low + pitch * 0.6)
            .line(root, low + pitch);
    }
    profile.line(0.0, to).revolved(ROUND)
}

/// Places bolts on a circle about the y axis, each turned by another angle, as tightening leaves
/// them.
pub(crate) fn bolt_circle(count: usize, on_radius: f32, diameter: f32, grip: f32) -> Shape {
    let one = bolt(diameter, grip);
    let mut shape = Shape::default();
    for i in 0..count {
        let at = turn(i, count) * on_radius;
        let turned = turn(i * 7 % 24, 24);
        let (x, z) = (Vec3::new(turned.x, 0.0, turned.y), Vec3::new(-turned.y, 0.0, turned.x));
        let place = Mat4::from_cols(
            x.extend(0.0),
            Vec3::Y.extend(0.0),
            z.extend(0.0),
            Vec3::new(at.x, 0.0, at.y).extend(1.0),
        );
        shape.add(&one, place);
    }
    shape
}
