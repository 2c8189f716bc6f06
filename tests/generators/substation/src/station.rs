//! Station as models and their placements.

use std::collections::HashMap;

use crate::StationError;
use crate::catalogue::{Catalogue, Counts};
use crate::filler_counts::{earth_wires, solve};
use crate::layout::{Placement, YARDS, add_site_wires, add_wires, place_site, place_yard};
use crate::models;
use crate::seeded_random::SeededRandom;

/// Station as models and their placements.
#[derive(Debug)]
pub struct Station {
    /// Catalogue of the models.
    pub catalogue: Catalogue,
    /// Placements of the equipment, bay after bay.
    pub placements: Vec<Placement>,
}

impl Station {
    /// Generates the station; the seed decides the millimetres by which each piece of equipment
    /// stands off its drawn place.
    ///
    /// # Errors
    /// [`StationError`] if the dimensions in this crate contradict themselves.
    pub fn generate(seed: u64) -> Result<Self, StationError> {
        let mut catalogue = Catalogue::default();
        models::add_all(&mut catalogue)?;
        let mut placements = Vec::new();
        for yard in &YARDS {
            add_wires(yard, &mut catalogue)?;
            place_yard(yard, &mut placements);
        }
        add_site_wires(&mut catalogue)?;
        place_site(&mut placements);
        let mut scatter = SeededRandom::new(seed);
        for placement in &mut placements {
            placement.translation.x += scatter.metres();
            placement.translation.z += scatter.metres();
        }
        let rest = sum(&catalogue, placements.iter().filter(|p| !closes_sums(&p.model)))?;
        let fillers = solve(rest)?;
        catalogue.add("trench", models::trench(fillers.covers))?;
        catalogue.add("earth_wires", earth_wires(&fillers.spans))?;
        Ok(Self { catalogue, placements })
    }

    /// Counts positions and triangles of all equipment.
    ///
    /// # Errors
    /// [`StationError::NoModel`] if a placement names no model.
    pub fn counts(&self) -> Result<Counts, StationError> {
        sum(&self.catalogue, self.placements.iter())
    }

    /// Counts the placements of each model.
    pub fn uses(&self) -> HashMap<&str, usize> {
        let mut uses = HashMap::new();
        for placement in &self.placements {
            *uses.entry(placement.model.as_str()).or_default() += 1;
        }
        uses
    }
}

fn closes_sums(model: &str) -> bool {
    matches!(model, "trench" | "earth_wires")
}

fn sum<'p>(
    catalogue: &Catalogue,
    placements: impl Iterator<Item = &'p Placement>,
) -> Result<Counts, StationError> {
    let mut total = Counts::default();
    for placement in placements {
        let entry = catalogue
            .get(&placement.model)
            .ok_or_else(|| StationError::NoModel(placement.model.clone()))?;
        total.vertices += entry.counts.vertices;
        total.triangles += entry.counts.triangles;
    }
    Ok(total)
}
