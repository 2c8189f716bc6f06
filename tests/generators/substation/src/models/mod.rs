//! Models of the equipment, one function for each kind. Models stand on the origin, y up, and turn
//! their line side towards -z.

mod civil;
mod conductor;
mod instrument;
mod insulator;
mod steel;
mod switchgear;
mod transformer;
mod voltage_class;

pub(crate) use conductor::{Wire, wire};
pub(crate) use voltage_class::{CLASS_126, CLASS_252, Class};

use crate::{Catalogue, StationError};

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
