//! Steel and concrete under the equipment.

use glam::Vec3;

use crate::fittings::bolt_circle;
use crate::shapes::{block, cuboid, strut};
use crate::{Finish, Part, at};

/// Builds a concrete block whose top lies at `top`, reaching below the ground.
pub(crate) fn plinth(width: f32, depth: f32, top: f32) -> Part {
    const BELOW_GROUND: f32 = 0.15;
    let mut part = Part::new();
    let height = top + BELOW_GROUND;
    let body = block(Vec3::new(width, height, depth), 0.03);
    part.add(Finish::Concrete, body.moved(0.0, top - 0.5 * height, 0.0));
    part
}

/// Builds a four-legged galvanised lattice from `bottom` to `top`, square in plan, with foot
/// plates, anchor bolts and a head plate.
pub(crate) fn lattice_support(bottom: f32, top: f32, foot_width: f32, head_width: f32) -> Part {
    const LEG: f32 = 0.09;
    const BAR: f32 = 0.05;
    const PANELS: usize = 3;
    const PLATE: f32 = 0.03;
    let steel = Finish::Galvanised;
    let mut part = Part::new();
    let corner = |level: f32, side: usize| {
        let half = 0.5 * (foot_width + (head_width - foot_width) * level);
        let [x, z] = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]][side % 4];
        Vec3::new(x * half, bottom + (top - bottom) * level, z * half)
    };
    for side in 0..4 {
        part.add(steel, strut(corner(0.0, side), corner(1.0, side), LEG, LEG));
        for panel in 0..PANELS {
            let (low, high) = (panel as f32 / PANELS as f32, (panel + 1) as f32 / PANELS as f32);
            // Each face's diagonals turn the other way at every panel.
            let (a, b) = if panel % 2 == 0 { (side, side + 1) } else { (side + 1, side) };
            part.add(steel, strut(corner(low, a), corner(high, b), BAR, 0.012));
            if panel > 0 {
                part.add(steel, strut(corner(low, side), corner(low, side + 1), BAR, 0.012));
            }
        }
        let foot = corner(0.0, side);
        part.add(
            steel,
            cuboid(Vec3::new(0.26, PLATE, 0.26)).moved(foot.x, bottom + 0.5 * PLATE, foot.z),
        );
        let mut anchors = Part::new();
        anchors.add_all(steel, bolt_circle(4, 0.135, 0.036, 0.14));
        part.add_part(anchors, at(foot.x, bottom + 0.03, foot.z));
    }
    let head = Vec3::new(head_width + 0.24, 0.05, head_width + 0.24);
    part.add(steel, block(head, 0.008).moved(0.0, top + 0.01, 0.0));
    part
}
