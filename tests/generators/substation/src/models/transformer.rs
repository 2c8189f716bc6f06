//! Main transformer 220/110/35 kV, 180 MVA, lean enough for the paper's number of triangles. High
//! voltage towards -z, medium voltage towards +z.

use demo_model::shapes::{block, cylinder, lathe, pipe, strut};
use demo_model::{Finish, at};
use glam::{Mat4, Vec3};

use super::insulator::Column;
use crate::body::{Body, along_x, along_z, tube, turned};

const TANK: Vec3 = Vec3::new(8.4, 3.7, 3.1);
const TANK_BOTTOM: f32 = 0.55;
const COVER_TOP: f32 = TANK_BOTTOM + TANK.y + 0.12;
const RADIATORS_PER_SIDE: usize = 8;
const RADIATOR_PITCH: f32 = 0.98;
const PANELS: usize = 10;

/// Set of bushings on their turrets.
struct Bushing {
    prefix: &'static str,
    /// Distance between phases, metres.
    pitch: f32,
    middle: [f32; 2],
    turret: [f32; 2],
    height: f32,
    core: f32,
    sheds: usize,
}

const HIGH: Bushing = Bushing {
    prefix: "1",
    pitch: 2.3,
    middle: [0.6, -0.85],
    turret: [0.42, 0.75],
    height: 3.0,
    core: 0.16,
    sheds: 40,
};
const MEDIUM: Bushing = Bushing {
    prefix: "2",
    pitch: 1.45,
    middle: [-1.2, 0.9],
    turret: [0.3, 0.5],
    height: 1.6,
    core: 0.12,
    sheds: 22,
};
const LOW: Bushing = Bushing {
    prefix: "3",
    pitch: 0.62,
    middle: [2.6, 1.1],
    turret: [0.18, 0.2],
    height: 0.55,
    core: 0.07,
    sheds: 7,
};

/// Winding of the transformer by its voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Winding {
    High,
    Medium,
    Low,
}

/// Returns the tip of a bushing; `phase` is -1, 0 or 1.
pub(crate) fn bushing_tip(winding: Winding, phase: f32) -> Vec3 {
    let set = match winding {
        Winding::High => &HIGH,
        Winding::Medium => &MEDIUM,
        Winding::Low => &LOW,
    };
    let y = COVER_TOP + set.turret[1] + set.height + 0.32;
    Vec3::new(set.middle[0] + phase * set.pitch, y, set.middle[1])
}

/// Builds the bodies and the parts: name, index of the body, place.
pub(super) fn transformer() -> (Vec<Body>, Vec<(String, usize, Mat4)>) {
    let bodies = vec![
        tank(),
        HIGH.body(),
        MEDIUM.body(),
        LOW.body(),
        radiator(),
        fan(),
        conservator(),
        cabinet(),
        tap_changer(),
    ];
    let mut parts = vec![("tank".to_owned(), 0, Mat4::IDENTITY)];
    for (body, set) in [(1, &HIGH), (2, &MEDIUM), (3, &LOW)] {
        for (phase, letter) in [(-1.0, 'U'), (0.0, 'V'), (1.0, 'W')] {
            let place = at(set.middle[0] + phase * set.pitch, COVER_TOP, set.middle[1]);
            parts.push((format!("bushing {}{letter}", set.prefix), body, place));
        }
    }
    for side in 0..2 {
        let wall = turned(Vec3::Y, 180.0 * side as f32) * at(0.0, 0.0, 0.5 * TANK.z);
        for i in 0..RADIATORS_PER_SIDE {
            let x = (i as f32 - 0.5 * (RADIATORS_PER_SIDE - 1) as f32) * RADIATOR_PITCH;
            let number = side * RADIATORS_PER_SIDE + i + 1;
            parts.push((format!("radiator {number}"), 4, wall * at(x, 1.15, 0.0)));
            parts.push((format!("fan {number}"), 5, wall * at(x, 0.78, 0.92)));
        }
    }
    parts.push(("conservator".to_owned(), 6, Mat4::IDENTITY));
    parts.push(("cabinet".to_owned(), 7, at(0.5 * TANK.x + 0.42, 1.7, 0.7)));
    parts.push(("tap changer".to_owned(), 8, at(3.6, COVER_TOP, -0.5)));
    (bodies, parts)
}

fn tank() -> Body {
    let paint = Finish::GreyPaint;
    let mut body = Body::new();
    body.add(Finish::Concrete, block(Vec3::new(9.4, 0.6, 4.0), 0.03).moved(0.0, 0.0, 0.0));
    for x in [-3.0, 0.0, 3.0] {
        body.cuboid(Finish::DarkPaint, [0.3, 0.3, 3.4], [x, 0.42, 0.0]);
    }
    let middle = TANK_BOTTOM + 0.5 * TANK.y;
    body.add(paint, block(TANK, 0.08).moved(0.0, middle, 0.0));
    for (y, wider) in [(TANK_BOTTOM + TANK.y - 0.06, 0.24), (TANK_BOTTOM + TANK.y + 0.05, 0.22)] {
        let rim = block(Vec3::new(TANK.x + wider, 0.1, TANK.z + wider), 0.02);
        body.add(paint, rim.moved(0.0, y, 0.0));
    }
    for z in [-0.5, 0.5] {
        for i in 0..9 {
            let x = (i as f32 - 4.0) * RADIATOR_PITCH;
            body.cuboid(paint, [0.09, TANK.y - 0.5, 0.2], [x, middle, z * TANK.z]);
        }
    }
    for x in [-0.5, 0.5] {
        for z in [-1.0, 0.0, 1.0] {
            body.cuboid(paint, [0.22, TANK.y - 0.5, 0.1], [x * TANK.x, middle - 0.003, z]);
        }
    }
    for x in [-2.4, 2.2] {
        let dome = [(0.2, 0.0), (0.22, 0.1), (0.22, 0.2), (0.1, 0.28)];
        body.add(paint, lathe(&dome, 12).moved(x, COVER_TOP - 0.03, 0.1));
    }
    for (x, z) in [(-3.9, -1.3), (-3.9, 1.3), (3.9, -1.3), (3.9, 1.3)] {
        let lug = block(Vec3::new(0.3, 0.34, 0.06), 0.015);
        body.add(paint, lug.moved(x, COVER_TOP + 0.1, z));
    }
    body
}

impl Bushing {
    fn body(&self) -> Body {
        let mut body = Body::new();
        let [radius, height] = self.turret;
        let turret = [
            (radius + 0.1, -0.03),
            (radius + 0.1, 0.05),
            (radius, 0.06),
            (radius, height - 0.1),
            (radius + 0.08, height - 0.09),
            (radius + 0.08, height),
            (self.core + 0.08, height + 0.02),
        ];
        body.add(Finish::GreyPaint, lathe(&turret, 16));
        let porcelain = Column {
            base: height + 0.016,
            height: self.height,
            core: self.core,
            overhang: 0.06,
            sheds: self.sheds,
        };
        body.add_body(porcelain.body(), Mat4::IDENTITY);
        let top = porcelain.base + self.height;
        let head = [
            (self.core * 0.9, top - 0.004),
            (self.core * 0.9, top + 0.14),
            (self.core * 0.4, top + 0.18),
            (0.03, top + 0.19),
            (0.03, top + 0.36),
        ];
        body.add(Finish::Aluminium, lathe(&head, 10));
        if radius > 0.25 {
            let terminal_box = block(Vec3::new(0.26, 0.3, 0.16), 0.015);
            let z = (radius + 0.06).copysign(self.middle[1]);
            body.add(Finish::GreyPaint, terminal_box.moved(0.0, 0.5 * height, z));
        }
        body
    }
}

/// Builds a panel radiator that stands out along z from the wall, with its two pipes.
fn radiator() -> Body {
    const HEIGHT: f32 = 2.7;
    const REACH: f32 = 1.1;
    let mut body = Body::new();
    for panel in 0..PANELS {
        let z = 0.36 + REACH * panel as f32 / (PANELS - 1) as f32;
        let plate = block(Vec3::new(0.56, HEIGHT, 0.03), 0.009);
        body.add(Finish::GreyPaint, plate.moved(0.0, 0.5 * HEIGHT, z));
    }
    for y in [0.14, HEIGHT - 0.14] {
        let run = [Vec3::new(0.0, y, -0.05), Vec3::new(0.0, y, 0.4 + REACH)];
        body.add(Finish::GreyPaint, pipe(&run, 0.06, 0.0, 10));
        let flange = tube(0.05, 0.11, 0.0, 0.05, 10).transformed(along_z());
        body.add(Finish::GreyPaint, flange.moved(0.0, y, 0.18));
    }
    body
}

/// Builds a fan under a radiator, blowing upwards.
fn fan() -> Body {
    let mut body = Body::new();
    body.add(Finish::DarkPaint, tube(0.39, 0.41, -0.09, 0.09, 16));
    body.add(Finish::DarkPaint, cylinder(0.1, 0.2, 10).moved(0.0, -0.12, 0.0));
    for blade in 0..3 {
        let plate = block(Vec3::new(0.3, 0.012, 0.16), 0.003);
        let place = turned(Vec3::Y, 120.0 * blade as f32 + 12.0)
            * at(0.23, 0.0, 0.0)
            * turned(Vec3::X, 24.0);
        body.add(Finish::DarkPaint, plate.transformed(place));
    }
    body
}

fn conservator() -> Body {
    const AXIS: Vec3 = Vec3::new(-4.9, 6.2, 0.0);
    const HALF: f32 = 1.9;
    let paint = Finish::GreyPaint;
    let mut body = Body::new();
    let vessel = [
        (0.2, -HALF - 0.1),
        (0.42, -HALF - 0.06),
        (0.55, -HALF),
        (0.55, HALF),
        (0.42, HALF + 0.06),
        (0.2, HALF + 0.1),
    ];
    let place = Mat4::from_translation(AXIS) * along_z();
    body.add(paint, lathe(&vessel, 20).transformed(place));
    for z in [-1.2, 1.2] {
        let foot = Vec3::new(-0.5 * TANK.x, 2.6, z);
        body.add(paint, strut(foot, Vec3::new(AXIS.x, AXIS.y - 0.4, z), 0.16, 0.12));
        body.cuboid(paint, [1.0, 0.14, 0.16], [-4.6, AXIS.y - 0.55, z]);
        let post = [0.14, AXIS.y - 1.2, 0.14];
        body.cuboid(paint, post, [-4.28, 0.5 * AXIS.y + 0.1, z * 1.06]);
    }
    let oil = [
        Vec3::new(-3.2, COVER_TOP - 0.02, 0.2),
        Vec3::new(-3.2, 5.05, 0.2),
        Vec3::new(AXIS.x, 5.12, 0.2),
        Vec3::new(AXIS.x, AXIS.y - 0.5, 0.2),
    ];
    body.add(paint, pipe(&oil, 0.05, 0.2, 10));
    let relay = block(Vec3::new(0.3, 0.26, 0.24), 0.03);
    body.add(paint, relay.moved(-3.95, 5.08, 0.2));
    let breather =
        [Vec3::new(AXIS.x - 0.1, AXIS.y - 0.5, -0.9), Vec3::new(AXIS.x - 0.1, 2.2, -0.9)];
    body.add(paint, pipe(&breather, 0.025, 0.0, 8));
    let glass = cylinder(0.09, 0.42, 12).moved(AXIS.x - 0.1, 1.8, -0.9);
    body.add(Finish::SilicaGel, glass);
    body
}

fn cabinet() -> Body {
    let mut body = Body::new();
    body.add(Finish::GreyPaint, block(Vec3::new(0.55, 1.7, 1.1), 0.02));
    let door = block(Vec3::new(0.03, 1.55, 1.0), 0.01);
    body.add(Finish::GreyPaint, door.moved(0.28, 0.0, 0.0));
    let handle = block(Vec3::new(0.04, 0.2, 0.04), 0.008);
    body.add(Finish::Rubber, handle.moved(0.31, 0.0, 0.36));
    body
}

fn tap_changer() -> Body {
    let mut body = Body::new();
    let head = [(0.42, -0.04), (0.42, 0.1), (0.36, 0.12), (0.36, 0.34), (0.2, 0.42)];
    body.add(Finish::GreyPaint, lathe(&head, 16));
    let shaft = cylinder(0.03, 0.95, 8).transformed(along_x());
    body.add(Finish::Galvanised, shaft.moved(0.0, 0.25, 0.0));
    let drop = cylinder(0.035, 3.03, 8).moved(0.93, -2.75, 0.0);
    body.add(Finish::Galvanised, drop);
    let drive = block(Vec3::new(0.42, 1.0, 0.6), 0.02);
    body.add(Finish::GreyPaint, drive.moved(0.9, -2.7, 0.0));
    body
}
