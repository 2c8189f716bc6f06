//! Numbers at equipment that the host gives a shape: positions, flows, levels.

use std::ops::RangeInclusive;

use busbar_tags::TagHandle;
use serde::{Deserialize, Serialize};

/// Mechanisms that one overlay may give positions of.
pub const MAX_MECHANISMS: usize = 16;
const MAX_CONTOUR_NAME: usize = 64;
const MAX_CONTOUR_UNIT: usize = 16;
/// Allowed reach of a contour level, metres.
const REACH_METRES: RangeInclusive<f64> = 0.1..=1000.0;

/// A quantity whose course over the ground is worked out of levels at equipment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contour {
    /// Name of the quantity.
    pub name: String,
    /// Unit of the quantity; empty for none.
    pub unit: String,
    /// Radius around equipment within which its level counts, metres.
    pub reach_metres: f64,
    /// Normal band, lower end.
    pub low: Option<f64>,
    /// Normal band, upper end.
    pub high: Option<f64>,
    /// Distance between contour levels, in the unit.
    pub step: f64,
}

/// A number at a piece of equipment, by the indices in the description.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayQuantity {
    /// Index of the equipment.
    pub equipment: u32,
    /// The tag that it rests on.
    pub tag: TagHandle,
    /// Meaning of the value.
    pub what: Quantity,
}

/// A number with its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Quantity {
    /// Position of a switch.
    Position {
        /// Index of the mechanism.
        mechanism: u32,
        /// Share of the travel from open, 0, to closed, 1; none where the reports contradict.
        travelled: Option<f64>,
    },
    /// Power flow through equipment.
    Flow {
        /// The equipment that it flows to.
        to: u32,
        /// Share of the rating; negative against that direction.
        share: f64,
    },
    /// A level of the contour, in its unit.
    Level(f64),
}

impl Contour {
    pub(crate) fn check(&self) -> Result<(), &'static str> {
        let Self { name, unit, reach_metres, low, high, step } = self;
        if name.len() > MAX_CONTOUR_NAME || unit.len() > MAX_CONTOUR_UNIT {
            return Err("the name of its contour is longer than 64 bytes, or the unit than 16");
        }
        if !REACH_METRES.contains(reach_metres) {
            return Err("levels of its contour do not reach 0.1 to 1000 m");
        }
        let is_band = match (low, high) {
            (Some(low), Some(high)) => low < high,
            _ => true,
        };
        let mut numbers = low.iter().chain(high).chain([step]);
        if !is_band || !numbers.all(|number| number.is_finite()) || *step <= 0.0 {
            return Err("its contour has limits or a step that make no sense");
        }
        Ok(())
    }
}
