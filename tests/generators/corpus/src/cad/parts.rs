//! Parts of the breaker at their places, ground at y = 0.

use glam::{Mat4, Vec2, Vec3, vec2, vec3, vec4};

use crate::cad::fasteners::{bolt, bolt_circle};
use crate::cad::profile::Profile;
use crate::cad::shape::Shape;
use crate::cad::solids::{
    Hole, coil, drilled_flange, drilled_plate, extruded, hole_circle, rounded_box, tube,
};
use crate::cad::{Assembly, Finish, along_x, along_z, at};

/// Height of the tank's axis above ground, metres.
pub(crate) const AXIS_HEIGHT: f32 = 2.1;
const TANK_RADIUS: f32 = 0.44;
const TANK_HALF: f32 = 1.15;

/// Builds the lying tank: a shell of long strips, flanges at both ends, a domed cover bolted on
/// each.
pub(crate) fn tank(assembly: &mut Assembly) {
    const SEGMENTS: usize = 80;
    let wall = 0.012;
    let shell = Profile::from(TANK_RADIUS - wall, 0.0)
        .line(TANK_RADIUS, 0.0)
        .line(TANK_RADIUS, TANK_HALF * 2.0)
        .line(TANK_RADIUS - wall, TANK_HALF * 2.0)
        .line(TANK_RADIUS - wall, 0.0);
    let lying = at(-TANK_HALF, AXIS_HEIGHT, 0.0) * along_x();
    assembly.add(Finish::Paint, &shell.revolved(SEGMENTS), lying);

    let (rim, thickness) = (TANK_RADIUS + 0.085, 0.032);
    let on_radius = TANK_RADIUS + 0.045;
    let holes = hole_circle(16, on_radius, 0.0125);
    let flange = drilled_flange([TANK_RADIUS, rim], thickness, SEGMENTS, &holes);
    // A torispherical cover: flat rim, knuckle, crown.
    let (knuckle, crown) = (0.07, 0.20);
    let inner = TANK_RADIUS - knuckle;
    let radius =
        (inner * inner + (crown - knuckle) * (crown - knuckle)) / (2.0 * (crown - knuckle));
    let top = thickness + crown;
    let cover = Profile::from(TANK_RADIUS, thickness)
        .arc([inner, thickness + knuckle], [inner, thickness], true, 8)
        .arc([0.0, top], [0.0, top - radius], true, 14);
    let bolts = bolt_circle(16, on_radius, 0.022, thickness * 2.0);
    for end in [-1.0, 1.0] {
        // Turned about, for the other end.
        let side = Mat4::from_diagonal(vec4(end, 1.0, end, 1.0));
        let place = at(0.0, AXIS_HEIGHT, 0.0) * side * at(TANK_HALF, 0.0, 0.0) * along_x();
        assembly.add(Finish::Paint, &flange, place * at(0.0, -thickness, 0.0));
        assembly.add(Finish::Paint, &flange, place);
        assembly.add(Finish::Paint, &cover.revolved(SEGMENTS), place);
        assembly.add(Finish::Galvanised, &bolts, place * at(0.0, thickness, 0.0));
    }
}

/// Builds a bushing that stands on the tank's axis: turret, current transformer housing, flanges,
/// porcelain with sheds, terminal.
pub(crate) fn bushing() -> Assembly {
    const SEGMENTS: usize = 48;
    let mut assembly = Assembly::default();
    let (turret, top) = (0.21, 0.92);
    let body = Profile::from(turret, 0.3)
        .line(turret, 0.52)
        .arc([turret + 0.05, 0.57], [turret + 0.05, 0.52], false, 6)
        .line(turret + 0.05, 0.82)
        .arc([turret, 0.87], [turret, 0.82], true, 6)
        .line(turret, top);
    assembly.add(Finish::Paint, &body.revolved(SEGMENTS), Mat4::IDENTITY);
    let (rim, thickness, on_radius) = (0.30, 0.024, 0.262);
    let holes = hole_circle(12, on_radius, 0.0095);
    let flange = drilled_flange([0.14, rim], thickness, SEGMENTS, &holes);
    for low in [top, top + thickness] {
        assembly.add(Finish::Aluminium, &flange, at(0.0, low, 0.0));
    }
    let bolts = bolt_circle(12, on_radius, 0.017, thickness * 2.0);
    assembly.add(Finish::Galvanised, &bolts, at(0.0, top + thickness * 2.0, 0.0));

    let foot = top + thickness * 2.0;
    let (porcelain, height) = porcelain(foot);
    assembly.add(Finish::Porcelain, &porcelain.revolved(SEGMENTS), Mat4::IDENTITY);
    let cap = Profile::from(0.0, height)
        .line(0.12, height)
        .line(0.12, height + 0.07)
        .arc([0.1, height + 0.09], [0.1, height + 0.07], true, 5)
        .line(0.0, height + 0.09);
    assembly.add(Finish::Aluminium, &cap.revolved(48), Mat4::IDENTITY);
    assembly.add(Finish::Aluminium, &terminal(), at(0.0, height + 0.09, 0.0));
    assembly
}

/// Builds alternating sheds with round tips and hollows; returns the profile and its top.
fn porcelain(foot: f32) -> (Profile, f32) {
    const SHEDS: usize = 12;
    const PITCH: f32 = 0.11;
    let (tip, hollow) = (0.006, 0.02);
    let mut profile = Profile::from(0.14, foot).line(0.14, foot + 0.04);
    let mut low = foot + 0.04;
    for shed in 0..SHEDS {
        let core = 0.14 - 0.045 * (shed + 1) as f32 / SHEDS as f32;
        let reach = core + if shed % 2 == 0 { 0.095 } else { 0.065 };
        let slope = low + 0.05;
        profile = profile
            .line(reach, low)
            .arc([reach, low + tip * 2.0], [reach, low + tip], true, 8)
            .line(core + hollow, slope - hollow * 0.3)
            .arc([core, slope + hollow * 0.7], [core + hollow, slope + hollow * 0.7], false, 6)
            .line(core, low + PITCH);
        low += PITCH;
    }
    (profile, low)
}

/// Builds a palm with four holes and bolts on a round stud.
fn terminal() -> Shape {
    let stud = Profile::from(0.0, 0.0)
        .line(0.03, 0.0)
        .line(0.03, 0.09)
        .line(0.027, 0.093)
        .line(0.0, 0.093);
    let mut shape = stud.revolved(32);
    let spread = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
    let centres = spread.map(|[x, z]| vec2(x, z) * 0.025);
    let holes = centres.map(|centre| Hole { centre, radius: 0.007, steps: 20 });
    let upright = at(0.0, 0.14, 0.0) * along_z();
    let palm = drilled_plate(vec2(0.1, 0.1), 0.01, 0.016, &holes);
    shape.add(&palm, upright * at(0.0, -0.008, 0.0));
    for centre in centres {
        shape.add(&bolt(0.012, 0.016), upright * at(centre.x, 0.008, centre.y));
    }
    shape
}

/// Builds the cabinet of the operating mechanism: large flat sides, a door, louvres, hinges, a
/// handle.
pub(crate) fn cabinet(assembly: &mut Assembly) {
    let centre = at(0.0, 1.0, 0.62);
    assembly.add(Finish::Paint, &rounded_box(vec3(0.9, 1.1, 0.5), 0.02, 6), centre);
    let door = rounded_box(vec3(0.82, 1.02, 0.03), 0.008, 4);
    assembly.add(Finish::Paint, &door, centre * at(0.0, 0.0, 0.26));
    let louvre = rounded_box(vec3(0.3, 0.012, 0.02), 0.005, 4);
    for row in 0..12 {
        let up = -0.42 + 0.024 * row as f32;
        assembly.add(Finish::Dark, &louvre, centre * at(-0.15, up, 0.278));
        assembly.add(Finish::Dark, &louvre, centre * at(0.2, up, 0.278));
    }
    for up in [-0.38, 0.0, 0.38] {
        let pin = Profile::from(0.0, 0.0).line(0.012, 0.0).line(0.012, 0.09).arc(
            [0.0, 0.102],
            [0.0, 0.09],
            true,
            5,
        );
        assembly.add(Finish::Stainless, &pin.revolved(24), centre * at(-0.42, up, 0.27));
    }
    let handle = [[0.34, 0.0, 0.27], [0.34, 0.0, 0.33], [0.34, 0.22, 0.33], [0.34, 0.22, 0.27]];
    let handle = tube(&handle.map(Vec3::from), 0.009, 0.025, 16, 8);
    assembly.add(Finish::Stainless, &handle, centre);
    let corners = [[-0.07, -0.045], [0.07, -0.045], [-0.07, 0.045], [0.07, 0.045]];
    let holes = corners.map(|at| Hole { centre: at.into(), radius: 0.003, steps: 12 });
    let plate = drilled_plate(vec2(0.16, 0.11), 0.006, 0.002, &holes);
    assembly.add(Finish::Stainless, &plate, centre * at(0.0, 0.3, 0.276) * along_z());
}

/// Builds closing and opening springs with their rods and seats.
pub(crate) fn mechanism(assembly: &mut Assembly) {
    for (x, radius, turns) in [(-0.26, 0.07, 11), (0.26, 0.05, 13)] {
        let place = at(x, 1.62, 0.55);
        let pitch = 0.034;
        let length = pitch * turns as f32;
        assembly.add(Finish::Dark, &coil(radius, 0.011, turns, pitch), place);
        let rod = Profile::from(0.0, -0.06)
            .line(0.015, -0.06)
            .line(0.015, length + 0.06)
            .line(0.0, length + 0.06);
        assembly.add(Finish::Stainless, &rod.revolved(32), place);
        let seat = drilled_flange([0.016, radius + 0.02], 0.014, 48, &hole_circle(4, 0.034, 0.004));
        for end in [-0.024, length + 0.01] {
            assembly.add(Finish::Galvanised, &seat, place * at(0.0, end, 0.0));
        }
    }
}

/// Builds gas pipes with bends, flanged, and a gauge.
pub(crate) fn pipes(assembly: &mut Assembly) {
    let runs: [&[[f32; 3]]; 3] = [
        &[[-0.8, 1.7, 0.1], [-0.8, 1.45, 0.1], [-0.8, 1.45, 0.5], [-0.4, 1.45, 0.5]],
        &[[0.8, 1.7, 0.1], [0.8, 1.4, 0.1], [0.8, 1.4, 0.45], [0.5, 1.2, 0.62]],
        &[[0.0, 1.68, 0.0], [0.0, 1.52, 0.0], [0.1, 1.52, 0.3], [0.1, 1.56, 0.55]],
    ];
    let holes = hole_circle(4, 0.034, 0.0045);
    let flange = drilled_flange([0.017, 0.046], 0.01, 40, &holes);
    let bolts = bolt_circle(4, 0.034, 0.008, 0.02);
    for run in runs {
        let path: Vec<Vec3> = run.iter().copied().map(Vec3::from).collect();
        assembly.add(Finish::Stainless, &tube(&path, 0.016, 0.07, 24, 12), Mat4::IDENTITY);
        let joint = at(path[0].x, path[0].y - 0.1, path[0].z);
        for low in [-0.01, 0.0] {
            assembly.add(Finish::Stainless, &flange, joint * at(0.0, low, 0.0));
        }
        assembly.add(Finish::Galvanised, &bolts, joint * at(0.0, 0.01, 0.0));
    }
    let gauge = Profile::from(0.0, 0.0)
        .line(0.05, 0.0)
        .line(0.05, 0.035)
        .arc([0.045, 0.04], [0.045, 0.035], true, 4)
        .line(0.04, 0.04)
        .line(0.04, 0.034)
        .line(0.0, 0.034);
    assembly.add(Finish::Dark, &gauge.revolved(48), at(0.3, 1.45, 0.62) * along_z());
}

/// Builds the frame: rolled columns on drilled foot plates, and beams.
pub(crate) fn frame(assembly: &mut Assembly) {
    let holes = |x: f32, z: f32, radius: f32| {
        let spread = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        spread.map(|s| Hole { centre: vec2(x, z) * Vec2::from(s), radius, steps: 24 })
    };
    let feet = holes(0.13, 0.13, 0.014);
    let foot = drilled_plate(vec2(0.36, 0.36), 0.02, 0.025, &feet);
    let column = extruded(&beam_section(0.16, 0.16, 0.008, 0.013, 0.015), 1.55, &[]);
    for x in [-0.8, 0.8] {
        for z in [-0.3, 0.3] {
            let place = at(x, 0.0, z);
            assembly.add(Finish::Galvanised, &foot, place);
            assembly.add(Finish::Galvanised, &column, place * at(0.0, 0.025, 0.0));
            for hole in &feet {
                let on = place * at(hole.centre.x, 0.025, hole.centre.y);
                assembly.add(Finish::Galvanised, &bolt(0.024, 0.025), on);
            }
        }
    }
    let long = extruded(&beam_section(0.12, 0.14, 0.007, 0.011, 0.012), 1.9, &[]);
    let short = extruded(&beam_section(0.1, 0.12, 0.006, 0.01, 0.01), 0.7, &[]);
    for z in [-0.3, 0.3] {
        assembly.add(Finish::Galvanised, &long, at(-0.95, 1.6, z) * along_x());
    }
    for x in [-0.8, 0.0, 0.8] {
        assembly.add(Finish::Galvanised, &short, at(x, 1.5, -0.35) * along_z());
    }
    let saddle = drilled_plate(vec2(0.5, 0.24), 0.015, 0.018, &holes(0.2, 0.09, 0.011));
    for x in [-0.8, 0.8] {
        assembly.add(Finish::Galvanised, &saddle, at(x, 1.655, 0.0));
        for hole in holes(0.2, 0.09, 0.011) {
            let on = at(x + hole.centre.x, 1.673, hole.centre.y);
            assembly.add(Finish::Galvanised, &bolt(0.02, 0.018), on);
        }
    }
}

/// Returns an I section with hollows where web and flanges meet.
fn beam_section(width: f32, depth: f32, web: f32, flange: f32, hollow: f32) -> Profile {
    let (x, z, w, r) = (width * 0.5, depth * 0.5, web * 0.5, hollow);
    let inner = z - flange;
    Profile::from(x, -z)
        .line(x, -inner)
        .line(w + r, -inner)
        .arc([w, r - inner], [w + r, r - inner], false, 6)
        .line(w, inner - r)
        .arc([w + r, inner], [w + r, inner - r], false, 6)
        .line(x, inner)
        .line(x, z)
        .line(-x, z)
        .line(-x, inner)
        .line(-w - r, inner)
        .arc([-w, inner - r], [-w - r, inner - r], false, 6)
        .line(-w, r - inner)
        .arc([-w - r, -inner], [-w - r, r - inner], false, 6)
        .line(-x, -inner)
        .line(-x, -z)
        .line(x, -z)
}

/// Builds cooling fins between two headers at the back.
pub(crate) fn cooler(assembly: &mut Assembly) {
    const FINS: usize = 16;
    let fin = rounded_box(vec3(0.004, 0.62, 0.22), 0.0018, 3);
    for index in 0..FINS {
        let x = (index as f32 - (FINS - 1) as f32 * 0.5) * 0.04;
        assembly.add(Finish::Aluminium, &fin, at(x, 1.0, -0.62));
    }
    for up in [0.66, 1.34] {
        let header = tube(&[vec3(-0.36, up, -0.62), vec3(0.36, up, -0.62)], 0.032, 0.0, 48, 1);
        assembly.add(Finish::Aluminium, &header, Mat4::IDENTITY);
    }
    let slab = drilled_plate(vec2(2.6, 1.9), 0.05, 0.2, &[]);
    assembly.add(Finish::Dark, &slab, at(0.0, -0.2, 0.0));
}
