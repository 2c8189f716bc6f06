//! A panel radiator and the fans below it.

use glam::Vec3;

use crate::fittings::{along_x, along_z, plain_flange, rotation};
use crate::shapes::{
    Ends, cos_sin, cuboid, cylinder, lathe, loft, ring_of_profile, strut, torus, turn,
};
use crate::{Finish, Part, Solid};

/// Distance between the upper and the lower header, metres.
pub(super) const HEADER_DISTANCE: f32 = 2.7;
/// Distance from the tank wall to the first panel, metres.
const FIRST_PANEL: f32 = 0.30;
const PANEL_PITCH: f32 = 0.05;
const PANELS: usize = 20;
const PANEL_WIDTH: f32 = 0.52;
const PANEL_THICKNESS: f32 = 0.026;
const HEADER_RADIUS: f32 = 0.05;
/// Overhang of the panels beyond the headers, metres.
const PANEL_OVERHANG: f32 = 0.1;

/// Distance from the tank wall to the middle of the panels, metres.
pub(super) const MIDDLE: f32 = FIRST_PANEL + 0.5 * (PANELS - 1) as f32 * PANEL_PITCH;
/// Distance from the tank wall to the outermost panel, metres.
pub(super) const REACH: f32 = FIRST_PANEL + (PANELS - 1) as f32 * PANEL_PITCH;

/// Builds a radiator standing out along z from a wall at z = 0, its lower header at y = 0.
pub(super) fn radiator() -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    for i in 0..PANELS {
        let z = FIRST_PANEL + i as f32 * PANEL_PITCH;
        part.add(paint, panel().moved(0.0, 0.5 * HEADER_DISTANCE, z));
    }
    for y in [0.0, HEADER_DISTANCE] {
        // The header starts inside the wall and ends behind the last panel.
        let header = cylinder(HEADER_RADIUS, REACH + 0.09, 8).moved(0.0, -0.05, 0.0);
        part.add(paint, header.transformed(along_z()).moved(0.0, y, 0.0));
        for z in [0.10, 0.16] {
            part.add(paint, plain_flange(0.105, 0.03).transformed(along_z()).moved(0.0, y, z));
        }
        // The spindle of the shut-off valve.
        part.add(Finish::Galvanised, cylinder(0.014, 0.17, 6).moved(0.0, y, 0.13));
    }
    for y in [0.75, 1.95] {
        for x in [-0.5 * PANEL_WIDTH, 0.5 * PANEL_WIDTH] {
            let tie = cuboid(Vec3::new(0.012, 0.04, REACH - FIRST_PANEL + 0.03));
            part.add(paint, tie.moved(x, y, MIDDLE));
        }
    }
    part
}

/// Builds one pressed panel about the origin: three oil channels between flat seams, drawn together
/// at top and bottom.
fn panel() -> Solid {
    let half_height = 0.5 * HEADER_DISTANCE + PANEL_OVERHANG;
    let levels = [
        (-half_height, 0.12),
        (-half_height + 0.11, 1.0),
        (half_height - 0.11, 1.0),
        (half_height, 0.12),
    ];
    let ring = |&(y, fullness): &(f32, f32)| -> Vec<Vec3> {
        let front = [(0.36, 1.0), (0.18, 0.3), (0.0, 1.0), (-0.18, 0.3), (-0.36, 1.0)];
        let point =
            |x: f32, z: f32| Vec3::new(x * PANEL_WIDTH, y, 0.5 * PANEL_THICKNESS * fullness * z);
        let mut points = vec![point(0.5, 0.0)];
        points.extend(front.iter().map(|&(x, z)| point(x, -z)));
        points.push(point(-0.5, 0.0));
        points.extend(front.iter().rev().map(|&(x, z)| point(x, z)));
        points
    };
    loft(&levels.iter().map(ring).collect::<Vec<_>>(), Ends::Capped)
}

const FAN_RADIUS: f32 = 0.38;
const BLADES: usize = 6;
const SPOKES: usize = 6;

/// Builds a fan that blows upwards, about the origin.
pub(super) fn fan() -> Part {
    let mut part = Part::new();
    let shroud = [
        (FAN_RADIUS, -0.09),
        (FAN_RADIUS + 0.03, -0.11),
        (FAN_RADIUS + 0.03, 0.09),
        (FAN_RADIUS, 0.09),
    ];
    part.add(Finish::GreyPaint, ring_of_profile(&shroud, 16));
    for radius in [0.14, 0.24, 0.32] {
        part.add(Finish::Galvanised, torus(radius, 0.006, 16, 3).moved(0.0, -0.115, 0.0));
    }
    for i in 0..SPOKES {
        let direction = turn(i, SPOKES);
        let (from, to) = (direction * 0.05, direction * (FAN_RADIUS + 0.015));
        let spoke =
            strut(Vec3::new(from.x, -0.105, from.y), Vec3::new(to.x, -0.105, to.y), 0.012, 0.012);
        part.add(Finish::Galvanised, spoke);
    }
    let motor = [(0.06, -0.24), (0.085, -0.22), (0.085, -0.06), (0.05, -0.05)];
    part.add(Finish::DarkPaint, lathe(&motor, 10));
    part.add(Finish::DarkPaint, lathe(&[(0.075, -0.045), (0.075, 0.02), (0.04, 0.045)], 12));
    let box_on_motor = cuboid(Vec3::new(0.1, 0.08, 0.08)).moved(0.11, -0.15, 0.0);
    part.add(Finish::DarkPaint, box_on_motor);
    for i in 0..BLADES {
        let turned = rotation(Vec3::Y, 360.0 * i as f64 / BLADES as f64);
        part.add(Finish::Aluminium, blade().transformed(turned));
    }
    part
}

/// Builds a twisted blade along x: flatter at the tip than at the root.
fn blade() -> Solid {
    let stations = [(0.05, 0.07, 42.0), (0.2, 0.1, 30.0), (FAN_RADIUS - 0.02, 0.12, 20.0)];
    let ring = |&(x, half_chord, degrees): &(f32, f32, f64)| -> Vec<Vec3> {
        let pitch = cos_sin(degrees);
        // Counter-clockwise about +x, seen in (z, y): a flat lozenge.
        [(1.0, 0.0), (0.0, -0.05), (-1.0, 0.0), (0.0, 0.05)]
            .map(|(chord, thick)| (chord * half_chord, thick * half_chord))
            .map(|(c, t)| Vec3::new(x, c * pitch.y + t * pitch.x, c * pitch.x - t * pitch.y))
            .to_vec()
    };
    loft(&stations.iter().map(ring).collect::<Vec<_>>(), Ends::Capped)
}

/// Builds the frame that carries the fans of one side: two rails along x, hangers to the tank wall
/// at z = 0. The fans' plane is y = 0.
pub(super) fn fan_frame(length: f32) -> Part {
    let steel = Finish::Galvanised;
    let mut part = Part::new();
    let (inner, outer) = (MIDDLE - FAN_RADIUS - 0.055, MIDDLE + FAN_RADIUS + 0.055);
    for z in [inner, outer] {
        part.add(steel, cuboid(Vec3::new(length, 0.07, 0.05)).moved(0.0, 0.0, z));
    }
    const HANGERS: usize = 5;
    for i in 0..HANGERS {
        let x = (i as f32 / (HANGERS - 1) as f32 - 0.5) * (length - 0.1);
        let arm = Vec3::new(0.05, 0.06, outer + 0.05);
        part.add(steel, cuboid(arm).moved(x, -0.055, 0.5 * outer - 0.025));
        let brace = strut(Vec3::new(x, 0.95, -0.02), Vec3::new(x, -0.04, outer - 0.1), 0.04, 0.02);
        part.add(steel, brace);
    }
    let conduit = cylinder(0.02, length, 8).moved(0.0, -0.5 * length, 0.0);
    part.add(steel, conduit.transformed(along_x()).moved(0.0, -0.08, inner - 0.06));
    part
}
