//! The on-load tap changer: head on the cover, motor drive on the wall.

use glam::Vec3;

use crate::fittings::{along_x, bolt_circle, flange_pair};
use crate::shapes::{block, cuboid, cylinder, lathe};
use crate::{Finish, Part, at};

/// Height of the head's drive shaft above the cover, metres.
pub(super) const SHAFT_HEIGHT: f32 = 0.52;

/// Builds the head, standing on the cover at y = 0; its shaft leaves along x.
pub(super) fn head(shaft_length: f32) -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    part.add(paint, cylinder(0.36, 0.22, 24).moved(0.0, -0.02, 0.0));
    part.add_part(flange_pair(0.44, 0.03, 24, paint), at(0.0, 0.2, 0.0));
    part.add(paint, lathe(&[(0.37, 0.22), (0.36, 0.3), (0.28, 0.38), (0.14, 0.42)], 24));
    part.add(
        Finish::DarkPaint,
        block(Vec3::new(0.24, 0.16, 0.22), 0.02).moved(0.05, SHAFT_HEIGHT - 0.03, 0.0),
    );
    part.add(Finish::Glass, cylinder(0.06, 0.02, 14).moved(-0.2, 0.37, 0.12));
    // The bursting disc and the stub of the oil pipe.
    part.add(Finish::Galvanised, cylinder(0.1, 0.03, 16).moved(-0.02, 0.41, -0.2));
    part.add(paint, cylinder(0.05, 0.2, 12).moved(-0.24, 0.25, -0.16));
    let mut bolts = Part::new();
    bolts.add_all(Finish::Galvanised, bolt_circle(8, 0.08, 0.022, 0.04));
    part.add_part(bolts, at(-0.02, 0.44, -0.2));
    let shaft = cylinder(0.022, shaft_length, 8).transformed(along_x());
    part.add(Finish::Galvanised, shaft.moved(0.12, SHAFT_HEIGHT, 0.0));
    part.add(
        Finish::DarkPaint,
        block(Vec3::new(0.17, 0.17, 0.15), 0.02).moved(shaft_length + 0.13, SHAFT_HEIGHT, 0.0),
    );
    part
}

/// Builds the motor drive on an end wall whose ribs end at x = 0: the box about the origin in y and
/// z, its shaft rising by `shaft_rise`.
pub(super) fn motor_drive(shaft_rise: f32) -> Part {
    const SIZE: Vec3 = Vec3::new(0.42, 0.95, 0.66);
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    let x = 0.1 + 0.5 * SIZE.x;
    part.add(paint, block(SIZE, 0.02).moved(x, 0.0, 0.0));
    part.add(
        paint,
        block(Vec3::new(SIZE.x + 0.08, 0.03, SIZE.z + 0.08), 0.008).moved(
            x,
            0.5 * SIZE.y + 0.01,
            0.0,
        ),
    );
    let door = block(Vec3::new(0.03, SIZE.y - 0.1, SIZE.z - 0.08), 0.01);
    part.add(paint, door.moved(x + 0.5 * SIZE.x + 0.008, -0.02, 0.0));
    let window = cuboid(Vec3::new(0.012, 0.14, 0.2));
    part.add(Finish::Glass, window.moved(x + 0.5 * SIZE.x + 0.026, 0.22, 0.0));
    let handle = block(Vec3::new(0.03, 0.14, 0.03), 0.008);
    part.add(Finish::Rubber, handle.moved(x + 0.5 * SIZE.x + 0.03, -0.05, -0.24));
    for y in [-0.35, 0.35] {
        let bar = cuboid(Vec3::new(0.14, 0.06, 0.5));
        part.add(paint, bar.moved(0.05, y, 0.0));
    }
    part.add(Finish::Galvanised, cylinder(0.022, shaft_rise - 0.45, 8).moved(x, 0.46, 0.0));
    part.add(Finish::DarkPaint, cylinder(0.05, 0.09, 10).moved(x, 0.5 * SIZE.y, 0.0));
    part
}

/// Distance from the ribs' face to the motor drive's shaft, metres.
pub(super) const DRIVE_SHAFT_X: f32 = 0.31;
