//! Pole of a 252 kV centre-break disconnector, closed.
//!
//! Either column turns about its own axis with its arm: turning `column 1` by +90 degrees and
//! `column 2` by -90 degrees about y opens it.

use busbar_geometry::WeldError;
use busbar_scene::Model;
use glam::{Mat4, Vec3};

use crate::fittings::{along_x, flange_pair, rotation, terminal_palm};
use crate::shapes::{block, cuboid, cylinder, lathe, strut};
use crate::structure::{lattice_support, plinth};
use crate::{Assembly, Finish, Part, Sheds, at, insulator_profile};

const FOUNDATION_TOP: f32 = 0.2;
const SUPPORT_TOP: f32 = 3.0;
/// Half of the distance between the columns.
const HALF_SPAN: f32 = 1.3;
const BEARING_TOP: f32 = 3.42;
const COLUMN_HEIGHT: f32 = 2.4;
/// Height of the arms above the column's foot.
const ARM_Y: f32 = COLUMN_HEIGHT + 0.2;

/// Builds the disconnector pole.
///
/// # Errors
/// [`WeldError`] if a dimension above were not finite.
pub fn disconnector_pole() -> Result<Model, WeldError> {
    let (mut assembly, root) = Assembly::new("disconnector pole");
    let foundation_mesh = assembly.mesh(&plinth(1.1, 1.1, FOUNDATION_TOP))?;
    let support_mesh = assembly.mesh(&lattice_support(FOUNDATION_TOP, SUPPORT_TOP, 0.6, 0.4))?;
    let column_mesh = assembly.mesh(&column())?;
    let ends = [(1, -HALF_SPAN, Mat4::IDENTITY), (2, HALF_SPAN, rotation(Vec3::Y, 180.0))];
    for (number, x, _) in ends {
        assembly.place(&format!("foundation {number}"), root, foundation_mesh, at(x, 0.0, 0.0));
        assembly.place(&format!("support {number}"), root, support_mesh, at(x, 0.0, 0.0));
    }
    assembly.place_part("base frame", root, &base_frame(), Mat4::IDENTITY)?;
    assembly.place_part("mechanism box", root, &mechanism_box(), at(-HALF_SPAN, 1.4, 0.55))?;
    for (number, x, facing) in ends {
        let arm = if number == 1 { arm_with_fingers() } else { arm_with_blade() };
        let name = format!("column {number}");
        let column = assembly.place(&name, root, column_mesh, at(x, BEARING_TOP, 0.0) * facing);
        assembly.place_part(&format!("arm {number}"), column, &arm, at(0.0, ARM_Y, 0.0))?;
    }
    Ok(assembly.into_model())
}

fn base_frame() -> Part {
    let steel = Finish::Galvanised;
    let mut part = Part::new();
    let length = 2.0 * HALF_SPAN + 0.7;
    for z in [-0.16, 0.16] {
        part.add(
            steel,
            block(Vec3::new(length, 0.2, 0.07), 0.01).moved(0.0, SUPPORT_TOP + 0.13, z),
        );
    }
    for x in [-HALF_SPAN, HALF_SPAN] {
        part.add(
            steel,
            block(Vec3::new(0.46, 0.03, 0.46), 0.006).moved(x, SUPPORT_TOP + 0.24, 0.0),
        );
        let bearing = [(0.15, 0.0), (0.15, 0.05), (0.1, 0.07), (0.1, 0.15)];
        part.add(steel, lathe(&bearing, 16).moved(x, SUPPORT_TOP + 0.245, 0.0));
        let lever = strut(
            Vec3::new(x, 3.33, 0.0),
            Vec3::new(x + 0.02, 3.33, x.signum() * -0.3),
            0.03,
            0.06,
        );
        part.add(steel, lever);
    }
    // The crossed rod turns the second column against the first.
    let rod =
        strut(Vec3::new(-HALF_SPAN, 3.36, 0.28), Vec3::new(HALF_SPAN, 3.36, -0.28), 0.035, 0.035);
    part.add(steel, rod);
    part
}

fn mechanism_box() -> Part {
    let mut part = Part::new();
    part.add(Finish::GreyPaint, block(Vec3::new(0.5, 0.75, 0.38), 0.02));
    part.add(Finish::GreyPaint, block(Vec3::new(0.58, 0.03, 0.46), 0.008).moved(0.0, 0.38, 0.0));
    part.add(Finish::GreyPaint, block(Vec3::new(0.44, 0.66, 0.03), 0.008).moved(0.0, -0.01, 0.195));
    part.add(Finish::Rubber, block(Vec3::new(0.03, 0.12, 0.03), 0.008).moved(0.17, 0.0, 0.22));
    for y in [-0.25, 0.25] {
        part.add(Finish::Galvanised, cuboid(Vec3::new(0.6, 0.07, 0.05)).moved(0.0, y, -0.23));
        part.add(Finish::Galvanised, cuboid(Vec3::new(0.1, 0.07, 0.14)).moved(0.2, y, -0.3));
        part.add(Finish::Galvanised, cuboid(Vec3::new(0.1, 0.07, 0.14)).moved(-0.2, y, -0.3));
    }
    // The vertical shaft, up to the first column's lever.
    part.add(Finish::Galvanised, cylinder(0.028, 1.63, 10).moved(0.0, 0.36, -0.25));
    part
}

fn column() -> Part {
    const SEGMENTS: usize = 12;
    let sheds = Sheds { count: 36, large_overhang: 0.062, small_overhang: 0.045 };
    let mut part = Part::new();
    let unit = 0.5 * COLUMN_HEIGHT;
    let half_sheds = Sheds { count: sheds.count / 2, ..sheds };
    for (base, radii) in [(0.0, [0.085, 0.08]), (unit, [0.08, 0.075])] {
        let profile = insulator_profile(base + 0.06, unit - 0.12, radii, half_sheds);
        part.add(Finish::BrownPorcelain, lathe(&profile, SEGMENTS));
        for y in [base + 0.02, base + unit - 0.1] {
            part.add(
                Finish::Galvanised,
                cylinder(radii[0] + 0.025, 0.08, SEGMENTS).moved(0.0, y, 0.0),
            );
        }
    }
    for y in [0.0, unit, COLUMN_HEIGHT] {
        part.add_part(flange_pair(0.15, 0.025, 6, Finish::Galvanised), at(0.0, y, 0.0));
    }
    part.add(
        Finish::Aluminium,
        block(Vec3::new(0.24, 0.14, 0.2), 0.02).moved(0.0, COLUMN_HEIGHT + 0.09, 0.0),
    );
    part
}

/// Builds the part of both arms that stands on a column, the arm along x.
fn arm(length: f32) -> Part {
    let metal = Finish::Aluminium;
    let mut part = Part::new();
    part.add(metal, cylinder(0.05, length, 14).transformed(along_x()));
    part.add(metal, block(Vec3::new(0.2, 0.14, 0.18), 0.02));
    part.add(metal, cylinder(0.075, 0.1, 14).moved(0.0, 0.05, 0.0));
    let outward = at(-0.09, 0.0, 0.0) * rotation(Vec3::Z, 90.0);
    part.add_part(terminal_palm(metal, 0.13, 0.22), outward);
    part
}

fn arm_with_fingers() -> Part {
    let mut part = arm(HALF_SPAN - 0.17);
    part.add(
        Finish::Aluminium,
        block(Vec3::new(0.1, 0.16, 0.12), 0.02).moved(HALF_SPAN - 0.2, 0.0, 0.0),
    );
    for (y, z) in [(-0.045, -0.035), (-0.045, 0.035), (0.045, -0.035), (0.045, 0.035)] {
        let finger = block(Vec3::new(0.24, 0.045, 0.016), 0.004);
        part.add(Finish::Copper, finger.moved(HALF_SPAN - 0.06, y, z));
    }
    part
}

fn arm_with_blade() -> Part {
    let mut part = arm(HALF_SPAN - 0.12);
    part.add(
        Finish::Copper,
        block(Vec3::new(0.22, 0.15, 0.045), 0.008).moved(HALF_SPAN - 0.06, 0.0, 0.0),
    );
    part
}
