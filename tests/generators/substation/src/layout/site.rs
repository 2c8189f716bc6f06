//! Layout of the site between and around the yards.

use glam::Vec3;

use super::Placement;
use super::wires::add_low_voltage;
use super::yard::YARDS;
use crate::models::{MAST_HEIGHT, SITE_MAX, SITE_MIN, peak_height};
use crate::{Catalogue, StationError};

/// World x of the two transformers.
const TRANSFORMERS: [f32; 2] = [-28.0, 28.0];
/// Half the length of the 35 kV house, metres.
const HOUSE_HALF_LENGTH: f32 = 13.0;
/// World x and z of the lightning masts.
const MASTS: [[f32; 2]; 4] = [[-81.5, -47.0], [81.5, -47.0], [-70.0, 38.0], [70.0, 38.0]];

/// Adds the conductors from the transformers to the 35 kV house.
pub(crate) fn add_site_wires(catalogue: &mut Catalogue) -> Result<(), StationError> {
    for (i, x) in TRANSFORMERS.into_iter().enumerate() {
        let wall = (HOUSE_HALF_LENGTH - 0.1).copysign(x);
        add_low_voltage(&low_voltage(i), wall - x, catalogue)?;
    }
    Ok(())
}

/// Returns the name of the model of transformer `i`'s conductors to the 35 kV house.
fn low_voltage(i: usize) -> String {
    format!("wires_low_voltage_{}", i + 1)
}

/// Places transformers, houses, capacitor banks, masts and the site.
pub(crate) fn place_site(placements: &mut Vec<Placement>) {
    let mut push = |bay: &str, device: &str, model: &str, [x, z]: [f32; 2], yaw_degrees: f32| {
        placements.push(Placement {
            bay: bay.to_owned(),
            device: device.to_owned(),
            phase: None,
            model: model.to_owned(),
            translation: Vec3::new(x, 0.0, z),
            yaw_degrees,
        });
    };
    for (i, x) in TRANSFORMERS.into_iter().enumerate() {
        let bay = format!("=S12T{}", i + 1);
        push(&bay, "TA1", "transformer", [x, 0.0], 0.0);
        push(&bay, "UP1", "oil_pit", [x, 0.0], 0.0);
        push(&bay, "WB1", &low_voltage(i), [x, 0.0], 0.0);
        for (wall, side) in [("UW1", -1.0), ("UW2", 1.0)] {
            push(&bay, wall, "fire_wall", [x + 8.4 * side, 0.0], 0.0);
        }
    }
    push("=S12H1", "UH1", "switch_house", [0.0, 0.0], 0.0);
    for (i, x) in [-49.0, -65.0, 49.0, 65.0].into_iter().enumerate() {
        push(&format!("=S12H1C{}", i + 1), "CA1", "capacitor_bank", [x, 0.6], 0.0);
    }
    push("=S12Z1", "UH1", "control_house", [-70.0, 24.5], 90.0);
    for (i, place) in MASTS.into_iter().enumerate() {
        push("=S12Z1", &format!("FE{}", i + 1), "mast", place, 0.0);
    }
    for (device, model) in [
        ("UG1", "ground"),
        ("UR1", "road"),
        ("UF1", "fence"),
        ("UT1", "trench"),
        ("WE1", "earth_wires"),
    ] {
        push("=S12Z1", device, model, [0.0, 0.0], 0.0);
    }
}

/// Returns the ends of the earth wires: from peak to peak along the line gantries, and from their
/// ends to the masts.
pub(crate) fn earth_spans() -> Vec<[Vec3; 2]> {
    let mut spans = Vec::new();
    for (yard, masts) in YARDS.iter().zip([&MASTS[..2], &MASTS[2..]]) {
        let y = yard.class.gantry + 0.5 + peak_height(yard.class) - 0.03;
        let peak = |line: usize| yard.point(yard.slot_x(line as f32 - 0.5), y, yard.depths.gantry);
        let last = yard.bays.len();
        spans.extend((0..last).map(|line| [peak(line), peak(line + 1)]));
        for (&[x, z], line) in masts.iter().zip([0, last]) {
            spans.push([peak(line), Vec3::new(x, 0.8 * MAST_HEIGHT, z)]);
        }
    }
    debug_assert!(spans.iter().flatten().all(|p| {
        (SITE_MIN[0]..SITE_MAX[0]).contains(&p.x) && (SITE_MIN[1]..SITE_MAX[1]).contains(&p.z)
    }));
    spans
}
