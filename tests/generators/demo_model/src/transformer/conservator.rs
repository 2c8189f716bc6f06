//! The conservator with its bracket, Buchholz relay, pipes and breather.

use glam::Vec3;

use crate::fittings::{along_x, along_z, dial, flange_pair, plain_flange};
use crate::shapes::{block, cuboid, cylinder, lathe, pipe, strut};
use crate::{Finish, Part, at};

pub(super) const RADIUS: f32 = 0.55;
pub(super) const LENGTH: f32 = 6.0;
/// Distance of the bracket's posts from z = 0, metres.
const POST_Z: f32 = 1.25;

/// Builds the vessel about the origin, lying along z.
pub(super) fn vessel() -> Part {
    let mut part = Part::new();
    let (half, dish) = (0.5 * LENGTH, 0.18);
    let profile = [
        (RADIUS * 0.55, -half),
        (RADIUS * 0.85, -half + 0.3 * dish),
        (RADIUS, -half + dish),
        (RADIUS, half - dish),
        (RADIUS * 0.85, half - 0.3 * dish),
        (RADIUS * 0.55, half),
    ];
    part.add(Finish::GreyPaint, lathe(&profile, 28).transformed(along_z()));
    // The bolted end through which the bag is drawn, and the wall to the
    // tap changer's own compartment.
    for z in [half - dish - 0.08, -half + 1.1] {
        let flanges = flange_pair(RADIUS + 0.07, 0.03, 28, Finish::GreyPaint);
        part.add_part(flanges, at(0.0, 0.0, z) * along_z());
    }
    for z in [-1.9, 1.9] {
        part.add(
            Finish::GreyPaint,
            cuboid(Vec3::new(0.03, 0.2, 0.16)).moved(0.0, RADIUS + 0.06, z),
        );
    }
    let gauge = at(0.0, -0.05, half - 0.02);
    part.add_part(dial(0.17, 60.0), gauge * at(0.0, 0.0, 0.08));
    let drain = cylinder(0.03, 0.2, 8).moved(0.0, -RADIUS - 0.16, 1.6);
    part.add(Finish::GreyPaint, drain);
    part.add(Finish::Galvanised, plain_flange(0.07, 0.03).moved(0.0, -RADIUS - 0.14, 1.6));
    part
}

/// Builds the bracket on the tank's end wall. The origin lies below the vessel's axis; the wall is
/// at x = `wall`, the vessel's underside at y = 0.
pub(super) fn bracket(wall: f32, foot: f32) -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    for z in [-POST_Z, POST_Z] {
        let post = block(Vec3::new(0.16, -foot - 0.05, 0.16), 0.015);
        part.add(paint, post.moved(0.0, 0.5 * foot - 0.09, z));
        for y in [foot + 0.25, foot + 1.9] {
            let arm = cuboid(Vec3::new(wall + 0.12, 0.16, 0.12));
            part.add(paint, arm.moved(0.5 * wall, y, z));
        }
        let brace =
            strut(Vec3::new(wall, foot + 0.35, z), Vec3::new(0.0, foot + 1.75, z), 0.1, 0.08);
        part.add(paint, brace);
        let saddle = block(Vec3::new(0.75, 0.2, 0.2), 0.02);
        part.add(paint, saddle.moved(0.0, 0.03, z));
        for x in [-0.33, 0.33] {
            part.add(paint, block(Vec3::new(0.12, 0.18, 0.2), 0.01).moved(x, 0.17, z));
        }
    }
    let beam = block(Vec3::new(0.14, 0.14, 2.0 * POST_Z + 0.3), 0.01);
    part.add(paint, beam.moved(0.0, -0.14, 0.0));
    for (low, high) in [(-POST_Z, POST_Z), (POST_Z, -POST_Z)] {
        let tie = strut(Vec3::new(0.0, foot + 0.4, low), Vec3::new(0.0, -0.2, high), 0.07, 0.012);
        part.add(paint, tie.moved(low * 0.01, 0.0, 0.0));
    }
    part
}

/// Builds the Buchholz relay about the origin, between flanges along x.
pub(super) fn buchholz_relay() -> Part {
    let mut part = Part::new();
    part.add(Finish::DarkPaint, block(Vec3::new(0.2, 0.22, 0.2), 0.03));
    part.add(
        Finish::DarkPaint,
        cylinder(0.075, 0.36, 14).moved(0.0, -0.18, 0.0).transformed(along_x()),
    );
    for x in [-0.17, 0.17] {
        part.add_part(flange_pair(0.11, 0.018, 6, Finish::DarkPaint), at(x, 0.0, 0.0) * along_x());
    }
    for z in [-0.1, 0.1] {
        part.add(Finish::Glass, cuboid(Vec3::new(0.1, 0.09, 0.02)).moved(0.0, 0.01, z));
    }
    part.add(Finish::DarkPaint, cylinder(0.07, 0.06, 12).moved(0.0, 0.09, 0.0));
    part.add(Finish::Galvanised, cylinder(0.012, 0.07, 6).moved(0.03, 0.14, 0.0));
    part.add(Finish::GreyPaint, block(Vec3::new(0.12, 0.1, 0.1), 0.01).moved(-0.02, 0.19, 0.0));
    part
}

/// Builds the pipe of the main tank's conservator through `path`, with a flange at either end.
pub(super) fn oil_pipe(path: &[Vec3], radius: f32) -> Part {
    let mut part = Part::new();
    part.add(Finish::GreyPaint, pipe(path, radius, radius * 3.0, 12));
    if let (Some(first), Some(last)) = (path.first(), path.last()) {
        for end in [first, last] {
            let flange = plain_flange(radius * 1.9, 0.04);
            part.add(Finish::GreyPaint, flange.moved(end.x, end.y, end.z));
        }
    }
    part
}

/// Builds the breather at the foot of a pipe that comes down from the vessel; the origin is the
/// pipe's lower end.
pub(super) fn breather() -> Part {
    let mut part = Part::new();
    part.add(Finish::DarkPaint, lathe(&[(0.1, -0.06), (0.1, -0.02), (0.04, 0.02)], 14));
    part.add(Finish::SilicaGel, cylinder(0.085, 0.32, 14).moved(0.0, -0.37, 0.0));
    part.add(
        Finish::DarkPaint,
        lathe(&[(0.06, -0.52), (0.09, -0.48), (0.1, -0.38), (0.1, -0.35)], 14),
    );
    for x in [-0.095, 0.095] {
        part.add(Finish::Galvanised, cylinder(0.007, 0.33, 6).moved(x, -0.37, 0.0));
    }
    part
}
