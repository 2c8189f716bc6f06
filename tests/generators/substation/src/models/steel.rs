//! Galvanised steel: tubular supports, lattice gantries, masts.

use demo_model::shapes::{block, lathe, ring_of_profile, strut, sweep, torus};
use demo_model::{Finish, at};
use glam::{Mat4, Quat, Vec2, Vec3};

use super::voltage_class::Class;
use crate::body::{Body, along_x, along_z, tube, turned};

/// Depth of foundations below the ground, metres.
const BURIED: f32 = 0.3;
/// Height of foundations above the ground, metres.
const PLINTH: f32 = 0.18;

/// Builds a tubular support with head flange on a square concrete collar, from the ground up to
/// `top`.
pub(super) fn support(top: f32, radius: f32) -> Body {
    let mut body = Body::new();
    let wall = 0.8 * radius;
    let (base, head) = (PLINTH + 0.02, top - 0.03);
    let pipe = [
        (wall, PLINTH - 0.1),
        (radius * 1.9, PLINTH - 0.02),
        (radius * 1.9, base),
        (radius, base + 0.01),
        (radius, head - 0.01),
        (radius * 1.7, head),
        (radius * 1.7, top),
        (wall, top + 0.001),
    ];
    body.add(Finish::Galvanised, ring_of_profile(&pipe, 6));
    let half = radius * 3.2;
    body.add_body(collar(half), turned(Vec3::Y, 45.0));
    body
}

fn collar(half: f32) -> Body {
    let mut body = Body::new();
    let outer = half * std::f32::consts::SQRT_2;
    let profile = [(0.1, -BURIED), (outer, -BURIED), (outer, PLINTH), (0.1, PLINTH - 0.005)];
    body.add(Finish::Concrete, ring_of_profile(&profile, 4));
    body
}

/// Builds three posts on a steel frame, under the three tubes of one busbar. The tubes run along x,
/// one phase spacing apart along z.
pub(super) fn bus_support(class: &Class) -> Body {
    let mut body = Body::new();
    let beam_top = class.bus - class.column - 0.08;
    for phase in [-1.0, 0.0, 1.0] {
        let z = phase * class.phase;
        body.add_body(class.column_at(beam_top + 0.004, 0.075).body(), at(0.0, 0.0, z));
        let clamp = tube(0.045, 0.13, -0.1, 0.1, 8).transformed(along_x());
        body.add(Finish::Aluminium, clamp.moved(0.0, class.bus, z));
    }
    let length = 2.0 * class.phase + 0.7;
    body.add_body(hollow_beam(0.24, length), at(0.0, beam_top - 0.12, 0.0));
    for z in [-0.72, 0.72] {
        body.add_body(support(beam_top - 0.2, 0.17), at(0.0, 0.0, z * class.phase));
    }
    body
}

/// Builds a square hollow section along z, about its middle.
pub(super) fn hollow_beam(side: f32, length: f32) -> Body {
    let mut body = Body::new();
    let outer = side * std::f32::consts::FRAC_1_SQRT_2;
    let hollow = tube(0.8 * outer, outer, -0.5 * length, 0.5 * length, 4);
    body.add(Finish::Galvanised, hollow.transformed(along_z() * turned(Vec3::Y, 45.0)));
    body
}

/// Lattice of four legs, laced on its four sides.
struct Lattice {
    /// Start points of the legs, in turn.
    start: [Vec3; 4],
    /// End points of the legs.
    end: [Vec3; 4],
    panels: usize,
    leg: f32,
    bar: f32,
}

impl Lattice {
    fn body(&self) -> Body {
        let mut body = Body::new();
        for i in 0..4 {
            let (from, to) = (self.start[i], self.end[i]);
            let frame = Quat::from_rotation_arc(Vec3::Y, (to - from).normalize_or(Vec3::Y));
            let leg = tube(0.35 * self.leg, 0.7 * self.leg, 0.0, from.distance(to), 4);
            let place = Mat4::from_rotation_translation(frame, from);
            body.add(Finish::Galvanised, leg.transformed(place));
        }
        let half = 0.5 * self.bar;
        let section = [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, y)| Vec2::new(x, y));
        body.add(Finish::Galvanised, sweep(&self.lacing(), &section, Vec3::new(0.3, 0.5, 0.8)));
        body
    }

    /// Returns the path of the bar that is bent around the legs, from one to the next, rising.
    fn lacing(&self) -> Vec<Vec3> {
        (0..=self.panels)
            .map(|i| {
                let share = 0.02 + 0.96 * i as f32 / self.panels as f32;
                self.start[i % 4].lerp(self.end[i % 4], share)
            })
            .collect()
    }
}

fn square(half_x: f32, half_z: f32, y: f32) -> [Vec3; 4] {
    [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]
        .map(|(x, z)| Vec3::new(x * half_x, y, z * half_z))
}

/// Builds a lattice column that carries beams at the class's gantry height, with the peak for the
/// earth wire above.
pub(super) fn gantry_column(class: &Class) -> Body {
    let mut body = Body::new();
    let (foot, head, top) = (0.075 * class.gantry, 0.42, class.gantry + 0.5);
    let shaft = Lattice {
        start: square(0.6 * foot, foot, 0.1),
        end: square(head, head, top),
        panels: 60,
        leg: 0.11,
        bar: 0.055,
    };
    body.add_body(shaft.body(), at(0.0, 0.0, 0.0));
    let peak = [
        (0.05, top - 0.05),
        (0.3, top - 0.04),
        (0.3, top + 0.02),
        (0.11, top + 0.03),
        (0.07, top + peak_height(class)),
        (0.05, top + peak_height(class) + 0.01),
    ];
    body.add(Finish::Galvanised, ring_of_profile(&peak, 8));
    for (x, z) in [(-0.6, -1.0), (-0.6, 1.0), (0.6, -1.0), (0.6, 1.0)] {
        let pad = Mat4::from_translation(Vec3::new(x * foot, 0.03, z * foot));
        body.add_body(collar(0.36), pad * turned(Vec3::Y, 45.0));
    }
    body
}

/// Returns height of the peak above the beam's top chord, metres.
pub(crate) fn peak_height(class: &Class) -> f32 {
    0.16 * class.gantry
}

/// Builds a lattice beam along x, one bay long, about the gantry height.
pub(super) fn gantry_beam(class: &Class) -> Body {
    let half = 0.5 * class.pitch - 0.3;
    let (y, depth) = (class.gantry, 0.4);
    let face = |x: f32| {
        [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)]
            .map(|(v, w)| Vec3::new(x, y + v * depth, w * depth))
    };
    Lattice { start: face(-half), end: face(half), panels: 64, leg: 0.09, bar: 0.045 }.body()
}

/// Height of a lightning mast, metres.
pub(crate) const MAST_HEIGHT: f32 = 32.0;

/// Builds a tapering tubular lightning mast.
pub(super) fn mast() -> Body {
    let mut body = Body::new();
    let mut profile = vec![(0.5, 0.16), (0.5, 0.22), (0.36, 0.23)];
    for (radius, joint) in [(0.3, 9.0_f32), (0.22, 17.0), (0.14, 25.0)] {
        let flange = radius + 0.1;
        profile.extend([
            (radius + 0.01, joint - 0.05),
            (flange, joint - 0.04),
            (flange, joint + 0.04),
            (radius - 0.03, joint + 0.05),
        ]);
    }
    profile.extend([(0.1, 29.0), (0.02, 29.1), (0.012, MAST_HEIGHT)]);
    body.add(Finish::Galvanised, lathe(&profile, 12));
    let pad = block(Vec3::new(2.0, 0.5, 2.0), 0.04);
    body.add(Finish::Concrete, pad.moved(0.0, -0.06, 0.0));
    body
}

/// Builds a grading ring about y = 0 on its cross-bar.
pub(super) fn grading_ring(radius: f32) -> Body {
    let mut body = Body::new();
    body.add(Finish::Aluminium, torus(radius, 0.03, 16, 6));
    let bar = strut(Vec3::new(-radius, 0.003, 0.0), Vec3::new(radius, 0.0, 0.0), 0.035, 0.012);
    body.add(Finish::Aluminium, bar);
    body
}
