//! The tank with its cover, base and fittings.

use glam::Vec3;

use super::{COVER_TOP, RADIATOR_PITCH, RADIATORS_PER_SIDE, TANK_BOTTOM, TANK_HALF};
use crate::fittings::{
    along_x, along_z, bolt_circle, bolt_row, lifting_lug, plain_flange, rotation,
};
use crate::shapes::{block, cuboid, cylinder, lathe, torus};
use crate::{Finish, Part, PlanarUv, at};

const FLANGE: f32 = 0.045;
/// Distance between the tank's wall and the flange's outer edge, metres.
const FLANGE_WIDTH: f32 = 0.15;
const RIB_DEPTH: f32 = 0.15;

/// Builds the walls, stiffeners, bottom, flange, lugs, jacking pads and the drain.
pub(super) fn tank() -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    let walls_top = COVER_TOP - 2.0 * FLANGE;
    let height = walls_top - TANK_BOTTOM;
    let middle = 0.5 * (walls_top + TANK_BOTTOM);
    let body = block(Vec3::new(2.0 * TANK_HALF.x, height, 2.0 * TANK_HALF.y), 0.06);
    part.add(paint, body.moved(0.0, middle, 0.0));
    let bottom = block(Vec3::new(2.0 * TANK_HALF.x + 0.2, 0.06, 2.0 * TANK_HALF.y + 0.2), 0.01);
    part.add(paint, bottom.moved(0.0, TANK_BOTTOM + 0.01, 0.0));
    let flange = flange_plate();
    part.add(paint, block(flange, 0.008).moved(0.0, walls_top + 0.5 * FLANGE, 0.0));

    for side in [-1.0, 1.0] {
        for gap in 0..=RADIATORS_PER_SIDE {
            let x = (gap as f32 - 0.5 * RADIATORS_PER_SIDE as f32) * RADIATOR_PITCH;
            let rib = block(Vec3::new(0.1, height - 0.1, RIB_DEPTH), 0.015);
            part.add(paint, rib.moved(x, middle, side * (TANK_HALF.y + 0.5 * RIB_DEPTH - 0.02)));
        }
        for z in [-1.3, -0.45, 0.45, 1.3] {
            let rib = block(Vec3::new(RIB_DEPTH, height - 0.1, 0.1), 0.015);
            part.add(paint, rib.moved(side * (TANK_HALF.x + 0.5 * RIB_DEPTH - 0.02), middle, z));
        }
        for end in [-1.0, 1.0] {
            let turned = if side > 0.0 { at(0.0, 0.0, 0.0) } else { rotation(Vec3::Y, 180.0) };
            let lug = at(end * (TANK_HALF.x - 0.2), walls_top - 0.35, side * TANK_HALF.y) * turned;
            part.add_part(lifting_lug(), lug);
            let pad = block(Vec3::new(0.36, 0.14, 0.3), 0.015);
            let pad_x = end * (TANK_HALF.x - 0.22);
            part.add(paint, pad.moved(pad_x, TANK_BOTTOM + 0.35, side * (TANK_HALF.y + 0.13)));
        }
    }
    part.add_part(valve(), at(-TANK_HALF.x, TANK_BOTTOM + 0.3, 0.0) * rotation(Vec3::Y, 180.0));
    part.add_part(valve(), at(-TANK_HALF.x, walls_top - 0.4, 0.85) * rotation(Vec3::Y, 180.0));
    // The earthing bolts, copper, at two corners near the ground.
    for (x, z) in [(-3.9, 1.0), (3.9, -1.0)] {
        let boss = cylinder(0.03, 0.06, 10).transformed(along_z());
        part.add(Finish::Copper, boss.moved(x, TANK_BOTTOM + 0.16, z * (TANK_HALF.y + 0.02)));
    }
    part
}

/// Builds the bolted cover with manholes and jack bolts.
pub(super) fn cover() -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    let plate = flange_plate();
    part.add(paint, block(plate, 0.008).moved(0.0, COVER_TOP - 0.5 * FLANGE + 0.004, 0.0));
    // A strip of rubber shows between flange and cover.
    let seal = cuboid(Vec3::new(plate.x - 0.03, 0.012, plate.z - 0.03));
    part.add(Finish::Rubber, seal.moved(0.0, COVER_TOP - FLANGE, 0.0));
    let (x, z) = (0.5 * plate.x - 0.055, 0.5 * plate.z - 0.055);
    let y = COVER_TOP - FLANGE;
    const BOLT: f32 = 0.046;
    const BOLT_HEIGHT: f32 = 0.16;
    for side in [-z, z] {
        let (from, to) = (Vec3::new(-x, y, side), Vec3::new(x, y, side));
        part.add_all(Finish::Galvanised, bolt_row(from, to, 44, BOLT, BOLT_HEIGHT));
    }
    for side in [-x, x] {
        let (from, to) = (Vec3::new(side, y, 0.18 - z), Vec3::new(side, y, z - 0.18));
        part.add_all(Finish::Galvanised, bolt_row(from, to, 15, BOLT, BOLT_HEIGHT));
    }
    for manhole_x in [-0.7, 1.75] {
        part.add(paint, cylinder(0.27, 0.1, 20).moved(manhole_x, COVER_TOP - 0.02, 0.02));
        part.add(paint, cylinder(0.33, 0.03, 20).moved(manhole_x, COVER_TOP + 0.075, 0.02));
        let mut bolts = Part::new();
        bolts.add_all(Finish::Galvanised, bolt_circle(12, 0.3, 0.036, 0.06));
        part.add_part(bolts, at(manhole_x, COVER_TOP + 0.1, 0.02));
    }
    part
}

/// Builds the pressure-relief device on the cover, standing on the origin.
pub(super) fn pressure_relief() -> Part {
    let mut part = Part::new();
    part.add(
        Finish::GreyPaint,
        lathe(&[(0.17, -0.02), (0.17, 0.06), (0.13, 0.07), (0.13, 0.12)], 18),
    );
    part.add(Finish::DarkPaint, lathe(&[(0.2, 0.11), (0.2, 0.2), (0.14, 0.26), (0.05, 0.27)], 18));
    part.add(Finish::Galvanised, cylinder(0.012, 0.1, 6).moved(0.0, 0.25, 0.0));
    part.add(Finish::GreyPaint, block(Vec3::new(0.1, 0.08, 0.08), 0.01).moved(0.2, 0.17, 0.0));
    part
}

/// Builds skids across the rails, with their bolts.
pub(super) fn skids(bottom: f32) -> Part {
    let mut part = Part::new();
    let height = TANK_BOTTOM - bottom;
    for x in [-3.1, -1.05, 1.05, 3.1] {
        let web = cuboid(Vec3::new(0.05, height, 2.0 * TANK_HALF.y));
        part.add(Finish::DarkPaint, web.moved(x, bottom + 0.5 * height, 0.0));
        for (y, thickness) in [(bottom + 0.016, 0.028), (TANK_BOTTOM - 0.024, 0.03)] {
            let plate = block(Vec3::new(0.34, thickness, 2.0 * TANK_HALF.y + 0.1), 0.005);
            part.add(Finish::DarkPaint, plate.moved(x, y, 0.0));
        }
    }
    part
}

/// Builds the rating plate about the origin, facing x.
pub(super) fn rating_plate() -> Part {
    const WIDTH: f32 = 0.52;
    const HEIGHT: f32 = 0.39;
    let mut part = Part::new();
    part.add(
        Finish::GreyPaint,
        block(Vec3::new(0.02, HEIGHT + 0.06, WIDTH + 0.06), 0.004).moved(-0.01, 0.0, 0.0),
    );
    let plate = cuboid(Vec3::new(0.008, HEIGHT, WIDTH)).moved(0.003, 0.0, 0.0);
    part.add(Finish::RatingPlate, plate.textured(facing_x(WIDTH, HEIGHT)));
    for z in [-0.2, 0.2] {
        let stay = cuboid(Vec3::new(0.2, 0.03, 0.03)).moved(-0.11, 0.0, z);
        part.add(Finish::GreyPaint, stay);
    }
    part
}

/// Returns the texture of a plate about the origin that is read from +x.
pub(super) fn facing_x(width: f32, height: f32) -> PlanarUv {
    PlanarUv {
        top_left: Vec3::new(0.0, 0.5 * height, 0.5 * width),
        along_u: Vec3::new(0.0, 0.0, -width),
        along_v: Vec3::new(0.0, -height, 0.0),
    }
}

/// Builds a gate valve standing out along x from a wall at x = 0.
fn valve() -> Part {
    let mut part = Part::new();
    part.add(
        Finish::GreyPaint,
        cylinder(0.045, 0.3, 12).moved(0.0, -0.03, 0.0).transformed(along_x()),
    );
    for x in [0.11, 0.26] {
        part.add(
            Finish::GreyPaint,
            plain_flange(0.09, 0.025).transformed(along_x()).moved(x, 0.0, 0.0),
        );
    }
    part.add(Finish::GreyPaint, block(Vec3::new(0.1, 0.15, 0.11), 0.02).moved(0.185, 0.02, 0.0));
    part.add(Finish::Galvanised, cylinder(0.012, 0.17, 6).moved(0.185, 0.06, 0.0));
    part.add(Finish::DarkPaint, torus(0.07, 0.012, 16, 6).moved(0.185, 0.22, 0.0));
    part.add(Finish::DarkPaint, cuboid(Vec3::new(0.14, 0.012, 0.02)).moved(0.185, 0.22, 0.0));
    part
}

fn flange_plate() -> Vec3 {
    let width = 2.0 * FLANGE_WIDTH;
    Vec3::new(2.0 * TANK_HALF.x + width, FLANGE - 0.008, 2.0 * TANK_HALF.y + width)
}
