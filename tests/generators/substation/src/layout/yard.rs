//! Layout of a yard: its bays side by side along two busbars, and the gantries.

use glam::{Vec2, Vec3};

use super::Placement;
use super::bay::{Bay, place_bay};
use super::wires::BayKind;
use crate::models::{CLASS_126, CLASS_252, Class};

/// Yard of one voltage level.
///
/// Yard space: x along the busbars, depth positive towards the lines, zero in the middle of busbar
/// II.
pub(crate) struct Yard {
    pub(crate) class: &'static Class,
    /// Designation of the voltage level (IEC 81346), such as `=S12D1`.
    pub(crate) level: &'static str,
    /// World z of depth zero, metres.
    pub(crate) origin_z: f32,
    /// Rotation of the yard: 0 where lines leave towards -z, 180 towards +z.
    pub(crate) yaw_degrees: f32,
    /// Bays in order along x of the world.
    pub(crate) bays: &'static [BayKind],
    pub(crate) depths: Depths,
}

/// Depths of the devices of a bay, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Depths {
    pub(crate) bus_one: f32,
    pub(crate) breaker: f32,
    pub(crate) current: f32,
    pub(crate) disconnector: f32,
    pub(crate) voltage: f32,
    pub(crate) arrester: f32,
    pub(crate) gantry: f32,
    /// Depths towards the transformer: breaker, current transformer, arrester, gantry.
    pub(crate) back: [f32; 4],
}

use BayKind::{Coupler, Line, Transformer, VoltageOne, VoltageTwo};

/// Yards of 220 and 110 kV.
pub(crate) const YARDS: [Yard; 2] = [
    Yard {
        class: &CLASS_252,
        level: "=S12D1",
        origin_z: -33.0,
        yaw_degrees: 0.0,
        bays: &[
            Line,
            Line,
            VoltageOne,
            Transformer,
            Line,
            Coupler,
            Line,
            Transformer,
            VoltageTwo,
            Line,
            Line,
        ],
        depths: Depths {
            bus_one: 14.0,
            breaker: 24.0,
            current: 28.5,
            disconnector: 33.5,
            voltage: 38.5,
            arrester: 41.5,
            gantry: 46.0,
            back: [-9.5, -14.0, -18.0, -21.0],
        },
    },
    Yard {
        class: &CLASS_126,
        level: "=S12E1",
        origin_z: 25.0,
        yaw_degrees: 180.0,
        bays: &[
            Line,
            Line,
            Line,
            Transformer,
            Line,
            VoltageOne,
            Coupler,
            VoltageTwo,
            Line,
            Transformer,
            Line,
            Line,
            Line,
        ],
        depths: Depths {
            bus_one: 8.0,
            breaker: 13.8,
            current: 16.8,
            disconnector: 20.2,
            voltage: 23.6,
            arrester: 25.8,
            gantry: 28.5,
            back: [-5.4, -8.2, -10.6, -13.0],
        },
    },
];

impl Yard {
    /// Returns world x of the middle of bay slot `i` (fractions lie between slots).
    pub(crate) fn slot_x(&self, i: f32) -> f32 {
        (i - 0.5 * (self.bays.len() - 1) as f32) * self.class.pitch
    }

    /// Returns the world point at world x, height and depth.
    pub(crate) fn point(&self, x: f32, y: f32, depth: f32) -> Vec3 {
        let towards_lines = if self.yaw_degrees == 0.0 { -1.0 } else { 1.0 };
        Vec3::new(x, y, self.origin_z + towards_lines * depth)
    }

    /// Returns the distance of phase 1 to 3 from the bay's middle along world x.
    pub(crate) fn phase_x(&self, phase: u8) -> f32 {
        (f32::from(phase) - 2.0) * self.class.phase
    }
}

/// Places all devices of a yard.
pub(crate) fn place_yard(yard: &Yard, placements: &mut Vec<Placement>) {
    let mut numbers = [0_u8; 5];
    for (slot, &kind) in yard.bays.iter().enumerate() {
        let number = &mut numbers[kind as usize];
        *number += 1;
        let letter = kind.designation(*number);
        let bay =
            Bay { yard, kind, id: format!("{}{letter}", yard.level), x: yard.slot_x(slot as f32) };
        place_bay(&bay, placements);
        place_bus_tubes(yard, slot, placements);
    }
    for line in 0..=yard.bays.len() {
        place_supports(yard, line, placements);
        let x = yard.slot_x(line as f32 - 0.5);
        push(
            yard,
            "Q0",
            format!("UA{}", line + 1),
            "gantry_column",
            Vec2::new(x, yard.depths.gantry),
            placements,
        );
        if line < yard.bays.len() {
            let x = yard.slot_x(line as f32);
            let place = Vec2::new(x, yard.depths.gantry);
            push(yard, "Q0", format!("UB{}", line + 1), "gantry_beam", place, placements);
        }
    }
}

/// Places the supports of busbars I and II at one support line.
fn place_supports(yard: &Yard, line: usize, placements: &mut Vec<Placement>) {
    let x = yard.slot_x(line as f32 - 0.5);
    for (bus, depth) in [("W1", yard.depths.bus_one), ("W2", 0.0)] {
        let device = format!("UB{}", line + 1);
        push(yard, bus, device, "bus_support", Vec2::new(x, depth), placements);
    }
}

fn place_bus_tubes(yard: &Yard, slot: usize, placements: &mut Vec<Placement>) {
    for (bus, depth) in [("W1", yard.depths.bus_one), ("W2", 0.0)] {
        for phase in 1..=3 {
            let offset = (f32::from(phase) - 2.0) * yard.class.phase;
            placements.push(Placement {
                bay: format!("{}{bus}", yard.level),
                device: format!("WA{}", slot + 1),
                phase: Some(phase),
                model: yard.class.named("bus_tube"),
                translation: yard.point(yard.slot_x(slot as f32), yard.class.bus, depth + offset),
                yaw_degrees: yard.yaw_degrees,
            });
        }
    }
}

fn push(
    yard: &Yard,
    group: &str,
    device: String,
    kind: &str,
    place: Vec2,
    placements: &mut Vec<Placement>,
) {
    placements.push(Placement {
        bay: format!("{}{group}", yard.level),
        device,
        phase: None,
        model: yard.class.named(kind),
        translation: yard.point(place.x, 0.0, place.y),
        yaw_degrees: yard.yaw_degrees,
    });
}
