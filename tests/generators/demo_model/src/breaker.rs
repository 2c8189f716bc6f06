//! Pole of a 252 kV live-tank SF6 breaker with spring mechanism.
//!
//! The scene places it three times, 4 m apart. Lower terminal at 5.5 m.

use busbar_geometry::WeldError;
use busbar_scene::Model;
use glam::{Mat4, Vec3};

use crate::fittings::{along_x, along_z, dial, flange_pair, rotation, terminal_palm};
use crate::shapes::{block, cuboid, cylinder, lathe, pipe};
use crate::structure::{lattice_support, plinth};
use crate::{Assembly, Finish, Part, Sheds, at, insulator_profile};

const FOUNDATION_TOP: f32 = 0.2;
const SUPPORT_TOP: f32 = 2.55;
const HOUSING_HEIGHT: f32 = 0.34;
const COLUMN_HEIGHT: f32 = 2.4;
const CHAMBER_HEIGHT: f32 = 0.38;
const INTERRUPTER_HEIGHT: f32 = 1.9;
/// Middle of the mechanism box, metres.
const BOX: Vec3 = Vec3::new(0.0, 1.55, 0.74);
const BOX_SIZE: Vec3 = Vec3::new(0.72, 1.15, 0.55);
/// Height of a flange pair between the pole's stages, metres.
const JOINT: f32 = 0.05;

/// Builds the breaker pole.
///
/// # Errors
/// [`WeldError`] if a dimension above were not finite.
pub fn breaker_pole() -> Result<Model, WeldError> {
    let (mut assembly, root) = Assembly::new("breaker pole");
    let place = Mat4::IDENTITY;
    assembly.place_part("foundation", root, &plinth(1.5, 1.5, FOUNDATION_TOP), place)?;
    let support = lattice_support(FOUNDATION_TOP, SUPPORT_TOP, 0.86, 0.5);
    assembly.place_part("support", root, &support, place)?;

    let cabinet =
        assembly.place_part("mechanism box", root, &mechanism_box(), at(BOX.x, BOX.y, BOX.z))?;
    let front = 0.5 * BOX_SIZE.z;
    let indicator_at = at(-0.14, 0.34, front + 0.036);
    assembly.place_part("position indicator", cabinet, &position_indicator(), indicator_at)?;
    assembly.place_part("drive rod", root, &drive_rod(), place)?;

    let mut level = SUPPORT_TOP + 0.03;
    assembly.place_part("bell crank housing", root, &bell_crank_housing(), at(0.0, level, 0.0))?;
    let monitor_at = at(0.24, level + 0.12, 0.12) * rotation(Vec3::Y, 90.0);
    assembly.place_part("gas density monitor", root, &dial(0.07, 35.0), monitor_at)?;
    level += HOUSING_HEIGHT;
    assembly.place_part("support insulator", root, &support_insulator(), at(0.0, level, 0.0))?;
    level += COLUMN_HEIGHT;
    assembly.place_part("lower chamber", root, &lower_chamber(), at(0.0, level, 0.0))?;
    let terminal_mesh = assembly.mesh(&terminal())?;
    let outward_left = at(-0.17, level + 0.2, 0.0) * rotation(Vec3::Y, 180.0);
    assembly.place("terminal 1", root, terminal_mesh, outward_left);
    level += CHAMBER_HEIGHT;
    let interrupter =
        assembly.place_part("interrupter", root, &interrupter(), at(0.0, level, 0.0))?;
    let outward_right = at(0.17, INTERRUPTER_HEIGHT + 0.12, 0.0);
    assembly.place("terminal 2", interrupter, terminal_mesh, outward_right);
    Ok(assembly.into_model())
}

fn mechanism_box() -> Part {
    let paint = Finish::GreyPaint;
    let mut part = Part::new();
    let front = 0.5 * BOX_SIZE.z;
    part.add(paint, block(BOX_SIZE, 0.02));
    let roof = block(Vec3::new(BOX_SIZE.x + 0.1, 0.04, BOX_SIZE.z + 0.1), 0.01);
    part.add(paint, roof.moved(0.0, 0.5 * BOX_SIZE.y + 0.012, 0.0));
    let door = block(Vec3::new(BOX_SIZE.x - 0.06, BOX_SIZE.y - 0.1, 0.03), 0.01);
    part.add(paint, door.moved(0.0, -0.01, front + 0.008));
    let frame = cylinder(0.1, 0.02, 20).transformed(along_z());
    part.add(Finish::Rubber, frame.moved(-0.14, 0.34, front + 0.014));
    let counter = cuboid(Vec3::new(0.14, 0.06, 0.012));
    part.add(Finish::Glass, counter.moved(0.14, 0.34, front + 0.026));
    let handle = block(Vec3::new(0.03, 0.15, 0.035), 0.008);
    part.add(Finish::Rubber, handle.moved(0.27, -0.05, front + 0.035));
    for slat in 0..5 {
        let louvre = cuboid(Vec3::new(0.3, 0.012, 0.02));
        part.add(Finish::DarkPaint, louvre.moved(0.0, -0.46 + slat as f32 * 0.035, front + 0.022));
    }
    // Brackets that reach back to the lattice.
    for y in [-0.35, 0.35] {
        for x in [-0.25, 0.25] {
            let bracket = cuboid(Vec3::new(0.06, 0.08, 0.24));
            part.add(Finish::Galvanised, bracket.moved(x, y, -front - 0.08));
        }
        let crossbar = cuboid(Vec3::new(0.9, 0.09, 0.05));
        part.add(Finish::Galvanised, crossbar.moved(0.0, y, -front - 0.12));
    }
    for x in [-0.2, 0.2] {
        let conduit = pipe(&[Vec3::new(x, -0.55, 0.0), Vec3::new(x, -1.5, 0.0)], 0.04, 0.0, 10);
        part.add(Finish::Galvanised, conduit);
    }
    part
}

/// Builds a disc with a bar, turning about z: upright closed, level open.
fn position_indicator() -> Part {
    let mut part = Part::new();
    part.add(
        Finish::WhiteEnamel,
        cylinder(0.082, 0.012, 18).transformed(along_z()).moved(0.0, 0.0, -0.006),
    );
    part.add(Finish::Rubber, block(Vec3::new(0.028, 0.12, 0.012), 0.003).moved(0.0, 0.0, 0.009));
    part
}

/// Builds the rod from the mechanism box up to the bell crank's lever.
fn drive_rod() -> Part {
    let mut part = Part::new();
    let (z, bottom, top) = (BOX.z - 0.15, BOX.y + 0.55, SUPPORT_TOP + 0.19);
    part.add(Finish::Galvanised, cylinder(0.025, top - bottom, 10).moved(0.0, bottom, z));
    let guard = lathe(&[(0.06, 0.0), (0.06, 0.12), (0.035, 0.16)], 12);
    part.add(Finish::DarkPaint, guard.moved(0.0, BOX.y + 0.58, z));
    part.add(
        Finish::Galvanised,
        block(Vec3::new(0.05, 0.09, 0.44), 0.01).moved(0.0, top - 0.02, z - 0.19),
    );
    let pin = cylinder(0.022, 0.12, 10).moved(0.0, -0.06, 0.0).transformed(along_x());
    part.add(Finish::Galvanised, pin.moved(0.0, top - 0.02, z));
    part
}

fn bell_crank_housing() -> Part {
    let metal = Finish::GreyPaint;
    let mut part = Part::new();
    part.add(
        metal,
        block(Vec3::new(0.42, HOUSING_HEIGHT - 0.04, 0.38), 0.04).moved(
            0.0,
            0.5 * HOUSING_HEIGHT - 0.01,
            0.0,
        ),
    );
    let bearing = cylinder(0.09, 0.52, 16).moved(0.0, -0.26, 0.0).transformed(along_x());
    part.add(metal, bearing.moved(0.0, 0.15, 0.02));
    let gas = [Vec3::new(0.18, 0.12, 0.12), Vec3::new(0.23, 0.12, 0.12)];
    part.add(Finish::Copper, pipe(&gas, 0.012, 0.0, 8));
    part.add(metal, cylinder(0.2, 0.04, 20).moved(0.0, HOUSING_HEIGHT - 0.06, 0.0));
    part
}

/// Builds a hollow porcelain between two flange pairs, from y = 0 to `height`.
fn porcelain_stage(height: f32, core_radii: [f32; 2], sheds: Sheds) -> Part {
    const SEGMENTS: usize = 12;
    const FITTING: f32 = 0.11;
    let mut part = Part::new();
    for (y, inward, radius) in [(0.0, 1.0, core_radii[0]), (height, -1.0, core_radii[1])] {
        part.add_part(
            flange_pair(radius + 0.1, 0.5 * JOINT, 8, Finish::Aluminium),
            at(0.0, y, 0.0),
        );
        let low = if inward > 0.0 { y + 0.01 } else { y - FITTING };
        part.add(
            Finish::Aluminium,
            cylinder(radius + 0.035, FITTING - 0.01, SEGMENTS).moved(0.0, low, 0.0),
        );
    }
    let length = height - 2.0 * FITTING + 0.04;
    let profile = insulator_profile(FITTING - 0.02, length, core_radii, sheds);
    part.add(Finish::BrownPorcelain, lathe(&profile, SEGMENTS));
    part
}

fn support_insulator() -> Part {
    let sheds = Sheds { count: 34, large_overhang: 0.065, small_overhang: 0.045 };
    porcelain_stage(COLUMN_HEIGHT, [0.125, 0.115], sheds)
}

fn lower_chamber() -> Part {
    let mut part = Part::new();
    let profile = [
        (0.16, 0.02),
        (0.17, 0.06),
        (0.19, 0.1),
        (0.19, CHAMBER_HEIGHT - 0.08),
        (0.24, CHAMBER_HEIGHT - 0.04),
        (0.24, CHAMBER_HEIGHT - 0.02),
    ];
    part.add(Finish::Aluminium, lathe(&profile, 16));
    part
}

fn interrupter() -> Part {
    let sheds = Sheds { count: 24, large_overhang: 0.07, small_overhang: 0.05 };
    let mut part = porcelain_stage(INTERRUPTER_HEIGHT, [0.18, 0.18], sheds);
    let head = [(0.19, 0.02), (0.19, 0.2), (0.23, 0.22), (0.23, 0.26), (0.17, 0.34), (0.07, 0.38)];
    part.add(Finish::Aluminium, lathe(&head, 16).moved(0.0, INTERRUPTER_HEIGHT, 0.0));
    part.add(
        Finish::Aluminium,
        cylinder(0.04, 0.05, 10).moved(0.0, INTERRUPTER_HEIGHT + 0.37, 0.0),
    );
    part
}

/// Builds a palm that stands out along x, its face upwards.
fn terminal() -> Part {
    let mut part = Part::new();
    part.add(Finish::Aluminium, block(Vec3::new(0.14, 0.12, 0.16), 0.015).moved(0.05, 0.0, 0.0));
    let outward = at(0.1, 0.0, 0.0) * rotation(Vec3::X, -90.0) * rotation(Vec3::Z, -90.0);
    part.add_part(terminal_palm(Finish::Aluminium, 0.14, 0.26), outward);
    part
}
