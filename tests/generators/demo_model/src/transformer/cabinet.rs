//! The cooler-control cubicle with its warning sign.

use glam::Vec3;

use super::tank::facing_x;
use crate::shapes::{block, cuboid, cylinder, pipe};
use crate::{Finish, Part};

const SIZE: Vec3 = Vec3::new(0.5, 1.8, 1.2);
const DOOR_HALF: f32 = 0.29;

/// Builds the cubicle on an end wall whose ribs end at x = 0, about the origin in y and z, its
/// doors facing x.
pub(super) fn cabinet() -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    let x = 0.1 + 0.5 * SIZE.x;
    let front = x + 0.5 * SIZE.x;
    part.add(paint, block(SIZE, 0.015).moved(x, 0.0, 0.0));
    let roof = block(Vec3::new(SIZE.x + 0.12, 0.04, SIZE.z + 0.12), 0.012);
    part.add(paint, roof.moved(x + 0.01, 0.5 * SIZE.y + 0.015, 0.0));
    for y in [-0.6, 0.6] {
        part.add(paint, cuboid(Vec3::new(0.14, 0.08, 1.1)).moved(0.05, y, 0.0));
    }
    for side in [-1.0, 1.0] {
        let z = side * (DOOR_HALF + 0.004);
        let door = block(Vec3::new(0.03, SIZE.y - 0.12, 2.0 * DOOR_HALF - 0.02), 0.01);
        part.add(paint, door.moved(front + 0.008, 0.0, z));
        let handle = block(Vec3::new(0.035, 0.16, 0.03), 0.008);
        part.add(Finish::Rubber, handle.moved(front + 0.035, -0.05, side * 0.08));
        for y in [-0.6, 0.0, 0.6] {
            let hinge = cylinder(0.014, 0.1, 8);
            part.add(Finish::Galvanised, hinge.moved(front + 0.015, y - 0.05, side * 0.585));
        }
        for slat in 0..5 {
            let louvre = cuboid(Vec3::new(0.02, 0.012, 0.3));
            part.add(
                Finish::DarkPaint,
                louvre.moved(front + 0.022, -0.72 + slat as f32 * 0.035, z),
            );
        }
        // Cable conduits: down to the trench and up to the cover.
        let down = pipe(
            &[Vec3::new(x, -0.8, side * 0.25), Vec3::new(x, -1.62, side * 0.25)],
            0.045,
            0.0,
            10,
        );
        part.add(Finish::Galvanised, down);
        let sign = cuboid(Vec3::new(0.006, 0.24, 0.24)).textured(facing_x(0.24, 0.24));
        part.add(Finish::WarningSign, sign.moved(front + 0.026, 0.5, z));
    }
    let up = [
        Vec3::new(x - 0.1, 0.85, 0.3),
        Vec3::new(x - 0.1, 2.72, 0.3),
        Vec3::new(-0.5, 2.72, 0.3),
        Vec3::new(-0.5, 2.55, 0.3),
    ];
    part.add(Finish::Galvanised, pipe(&up, 0.035, 0.15, 10));
    part
}
