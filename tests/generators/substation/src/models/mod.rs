//! Models of the equipment, one function for each kind. Models stand on the origin, y up, and turn
//! their line side towards -z.

mod civil;
mod conductor;
mod instrument;
mod insulator;
mod steel;
mod switchgear;
mod transformer;

pub(crate) use conductor::{Wire, wire};

use crate::{Catalogue, StationError};
use insulator::Column;

/// Dimensions of one voltage level's equipment, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Class {
    /// Highest voltage of the equipment, kV; part of model names.
    pub(crate) highest_kilovolts: u32,
    /// Height of terminals above ground.
    pub(crate) terminal: f32,
    /// Height of the busbar's axis above ground.
    pub(crate) bus: f32,
    /// Height of the line gantry's beam.
    pub(crate) gantry: f32,
    /// Height of an insulator column.
    pub(crate) column: f32,
    /// Number of sheds of a column.
    pub(crate) sheds: usize,
    /// Number of discs of a string.
    pub(crate) discs: usize,
    /// Distance between phases, metres.
    pub(crate) phase: f32,
    /// Distance between bays, metres.
    pub(crate) pitch: f32,
}

/// Dimensions of 220 kV equipment.
pub(crate) const CLASS_252: Class = Class {
    highest_kilovolts: 252,
    terminal: 5.5,
    bus: 9.0,
    gantry: 14.5,
    column: 2.35,
    sheds: 20,
    discs: 16,
    phase: 4.0,
    pitch: 14.0,
};

/// Dimensions of 110 kV equipment.
pub(crate) const CLASS_126: Class = Class {
    highest_kilovolts: 126,
    terminal: 4.1,
    bus: 6.3,
    gantry: 10.5,
    column: 1.3,
    sheds: 9,
    discs: 9,
    phase: 2.2,
    pitch: 28.0 / 3.0,
};

impl Class {
    /// Returns the name of this class's model of a kind.
    pub(crate) fn named(&self, kind: &str) -> String {
        format!("{kind}_{}", self.highest_kilovolts)
    }

    /// Returns the scale of parts without voltage, relative to 252 kV.
    fn scale(&self) -> f32 {
        self.column / CLASS_252.column
    }

    /// Returns a column from `base` upwards, its core `core` metres in radius.
    fn column_at(&self, base: f32, core: f32) -> Column {
        let overhang = 0.045 + 0.02 * self.scale();
        Column { base, height: self.column, core, overhang, sheds: self.sheds }
    }
}

/// Fills a catalogue with all models except the filler geometry.
pub(crate) fn add_all(catalogue: &mut Catalogue) -> Result<(), StationError> {
    for class in [&CLASS_252, &CLASS_126] {
        for (kind, body) in [
            ("breaker", switchgear::breaker(class)),
            ("current_transformer", instrument::current_transformer(class)),
            ("voltage_transformer", instrument::voltage_transformer(class)),
            ("arrester", instrument::arrester(class)),
            ("post", instrument::post(class)),
            ("bus_support", steel::bus_support(class)),
            ("bus_tube", conductor::bus_tube(class)),
            ("tension_set", insulator::tension_set(class)),
            ("suspension_set", insulator::suspension_set(class)),
            ("gantry_column", steel::gantry_column(class)),
            ("gantry_beam", steel::gantry_beam(class)),
        ] {
            catalogue.add(&class.named(kind), body)?;
        }
        for (kind, parts) in [
            ("pantograph", switchgear::pantograph(class)),
            ("disconnector", switchgear::disconnector(class)),
        ] {
            catalogue.add_parts(&class.named(kind), &parts.bodies, &parts.places)?;
        }
    }
    let (bodies, parts) = transformer::transformer();
    catalogue.add_parts("transformer", &bodies, &parts)?;
    for (name, body) in [
        ("mast", steel::mast()),
        ("ground", civil::ground()),
        ("road", civil::road()),
        ("control_house", civil::house([18.0, 4.6, 10.0], 6)),
        ("switch_house", civil::house([26.0, 5.4, 9.0], 8)),
        ("capacitor_bank", civil::capacitor_bank()),
        ("cubicle", civil::cubicle()),
        ("fire_wall", civil::fire_wall()),
        ("fence", civil::fence()),
        ("oil_pit", civil::oil_pit()),
    ] {
        catalogue.add(name, body)?;
    }
    Ok(())
}

pub(crate) use civil::{SITE_MAX, SITE_MIN, trench, trench_metres};
pub(crate) use instrument::primary_rise;
pub(crate) use insulator::{suspension_reach, tension_reach};
pub(crate) use steel::{MAST_HEIGHT, peak_height};
pub(crate) use switchgear::{BLADE, EARTHING_BLADE, breaker_top, disconnector_reach, moving_parts};
pub(crate) use transformer::{Winding, bushing_tip};
