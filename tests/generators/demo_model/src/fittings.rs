//! Small fittings of many parts: bolts, flanges, terminals, lugs.

use glam::{Mat4, Quat, Vec3};

use crate::shapes::{block, cos_sin, cuboid, cylinder, strut, turn};
use crate::{Finish, Part, Solid, at};

/// Number of sides of a bolt head.
const HEXAGON: usize = 6;

/// Returns a rotation about `axis` (unit length) in degrees.
pub(crate) fn rotation(axis: Vec3, degrees: f64) -> Mat4 {
    let half = cos_sin(degrees * 0.5);
    Mat4::from_quat(Quat::from_xyzw(axis.x * half.y, axis.y * half.y, axis.z * half.y, half.x))
}

/// Returns the rotation of the y axis onto the x axis.
pub(crate) fn along_x() -> Mat4 {
    rotation(Vec3::Z, -90.0)
}

/// Returns the rotation of the y axis onto the z axis.
pub(crate) fn along_z() -> Mat4 {
    rotation(Vec3::X, 90.0)
}

/// Builds hexagonal bolts, `height` long about the plane y = 0, on a circle.
pub(crate) fn bolt_circle(count: usize, radius: f32, across: f32, height: f32) -> Vec<Solid> {
    let place = |i| {
        let c = turn(i, count) * radius;
        cylinder(across * 0.5, height, HEXAGON).moved(c.x, -0.5 * height, c.y)
    };
    (0..count).map(place).collect()
}

/// Builds hexagonal bolts along a straight line, both ends included.
pub(crate) fn bolt_row(from: Vec3, to: Vec3, count: usize, across: f32, height: f32) -> Vec<Solid> {
    let last = count.saturating_sub(1).max(1) as f32;
    let place = |i| {
        let p = from.lerp(to, i as f32 / last);
        cylinder(across * 0.5, height, HEXAGON).moved(p.x, p.y - 0.5 * height, p.z)
    };
    (0..count).map(place).collect()
}

/// Builds a pair of flanges bolted together about y = 0.
pub(crate) fn flange_pair(radius: f32, thickness: f32, bolts: usize, finish: Finish) -> Part {
    let mut part = Part::new();
    let segments = 16;
    part.add(finish, cylinder(radius, thickness * 0.95, segments).moved(0.0, -thickness, 0.0));
    part.add(
        finish,
        cylinder(radius, thickness * 0.95, segments).moved(0.0, 0.05 * thickness, 0.0),
    );
    let across = (radius * 0.14).clamp(0.018, 0.045);
    let on_radius = radius - across * 0.85;
    part.add_all(
        Finish::Galvanised,
        bolt_circle(bolts, on_radius, across, thickness * 2.0 + across * 1.2),
    );
    part
}

/// Builds a small pipe flange without visible bolts.
pub(crate) fn plain_flange(radius: f32, thickness: f32) -> Solid {
    cylinder(radius, thickness, 8).moved(0.0, -0.5 * thickness, 0.0)
}

/// Builds a flat terminal palm with four bolts, standing on the origin, its face towards z.
pub(crate) fn terminal_palm(finish: Finish, width: f32, height: f32) -> Part {
    let mut part = Part::new();
    let thickness = width * 0.16;
    part.add(
        finish,
        block(Vec3::new(width, height, thickness), 0.004).moved(0.0, height * 0.5, 0.0),
    );
    for (x, y) in [(-0.25, 0.35), (0.25, 0.35), (-0.25, 0.75), (0.25, 0.75)] {
        let bolt = cylinder(width * 0.09, thickness * 2.2, HEXAGON)
            .moved(0.0, thickness * -1.1, 0.0)
            .transformed(at(x * width, y * height, 0.0) * along_z());
        part.add(Finish::Galvanised, bolt);
    }
    part
}

/// Builds a round dial that faces z, with a pointer, about the origin.
pub(crate) fn dial(radius: f32, pointer_degrees: f64) -> Part {
    let mut part = Part::new();
    let disc = |r: f32, depth: f32| cylinder(r, depth, 16).transformed(along_z());
    part.add(Finish::DarkPaint, disc(radius, radius * 0.7).moved(0.0, 0.0, radius * -0.7));
    part.add(Finish::WhiteEnamel, disc(radius * 0.86, 0.01));
    let tip = cos_sin(pointer_degrees) * (radius * 0.7);
    part.add(
        Finish::Rubber,
        strut(Vec3::new(0.0, 0.0, 0.011), Vec3::new(tip.x, tip.y, 0.011), radius * 0.1, 0.006),
    );
    part
}

/// Builds a lifting lug: a plate with a bollard, standing out along z.
pub(crate) fn lifting_lug() -> Part {
    let mut part = Part::new();
    part.add(Finish::GreyPaint, block(Vec3::new(0.05, 0.4, 0.22), 0.01).moved(0.0, 0.0, 0.1));
    let bollard = cylinder(0.07, 0.22, 12).moved(0.0, -0.11, 0.0).transformed(along_x());
    part.add(Finish::GreyPaint, bollard.moved(0.0, 0.05, 0.15));
    part
}

/// Builds a ladder standing on the origin, its rungs along x.
pub(crate) fn ladder(height: f32) -> Part {
    const WIDTH: f32 = 0.42;
    const RUNG_PITCH: f32 = 0.3;
    let mut part = Part::new();
    for x in [-0.5 * WIDTH, 0.5 * WIDTH] {
        part.add(
            Finish::Galvanised,
            cuboid(Vec3::new(0.02, height, 0.06)).moved(x, 0.5 * height, 0.0),
        );
    }
    let rungs = (height / RUNG_PITCH) as usize;
    for rung in 1..=rungs {
        let y = rung as f32 * RUNG_PITCH - 0.12;
        let bar =
            cylinder(0.013, WIDTH, HEXAGON).moved(0.0, -0.5 * WIDTH, 0.0).transformed(along_x());
        part.add(Finish::Galvanised, bar.moved(0.0, y, 0.0));
    }
    part
}
