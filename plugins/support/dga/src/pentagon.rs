//! Duval's pentagons 1 and 2, of all five gases.
//!
//! Each gas lies on its own axis at its percentage of the five; the sample is the area
//! centroid of the pentagon between them. Zones are polygons.

use crate::plane::{Point, Segment, edges, has_inside, nearest};
use crate::verdict::NO_INPUT;
use crate::{Gas, Margin, Sample, Verdict, Zone};

/// Trace added to every gas, as a share of their sum. One gas alone, or two that are not
/// neighbours, span no area, and their centroid is that of the limit. A single gas lies at 33.33 on
/// its axis.
const TRACE: f64 = 1e-9;
/// Distance within which a point lies on a border: centroids are rounded to some 1e-14.
const ON_BORDER: f64 = 1e-9;

/// Cosine and sine of 18 and 54 degrees.
const COS_18: f64 = 0.951_056_516_295_153_5;
const SIN_18: f64 = 0.309_016_994_374_947_45;
const COS_54: f64 = 0.587_785_252_292_473_1;
const SIN_54: f64 = 0.809_016_994_374_947_4;

/// Axes around the pentagon: H2 at 90 degrees, C2H6 162, CH4 234, C2H4 306, C2H2 18.
const AXES: [(Gas, Point); 5] = [
    (Gas::H2, [0.0, 1.0]),
    (Gas::C2h6, [-COS_18, SIN_18]),
    (Gas::Ch4, [-COS_54, -SIN_54]),
    (Gas::C2h4, [COS_54, -SIN_54]),
    (Gas::C2h2, [COS_18, SIN_18]),
];

/// Pentagon with its zones, the borders between them, and its source.
#[derive(Debug)]
pub struct Pentagon {
    zones: &'static [(Zone, &'static [Point], &'static str)],
    borders: &'static [Segment],
    source: &'static str,
}

const PD: &[Point] = &[[0.0, 33.0], [-1.0, 33.0], [-1.0, 24.5], [0.0, 24.5]];
const D1: &[Point] = &[[0.0, 40.0], [38.0, 12.4], [32.0, -6.1], [4.0, 16.0], [0.0, 1.5]];
const D2: &[Point] = &[[4.0, 16.0], [32.0, -6.1], [24.3, -30.0], [0.0, -3.0], [0.0, 1.5]];
const S: &[Point] = &[
    [0.0, 1.5],
    [-35.0, 3.1],
    [-38.0, 12.4],
    [0.0, 40.0],
    [0.0, 33.0],
    [-1.0, 33.0],
    [-1.0, 24.5],
    [0.0, 24.5],
];

/// Pentagon 1: electrical and thermal faults, stray gassing.
pub static PENTAGON_1: Pentagon = Pentagon {
    zones: &[
        (Zone::PartialDischarge, PD, "zone PD of pentagon 1"),
        (Zone::LowEnergy, D1, "zone D1 of pentagon 1"),
        (Zone::HighEnergy, D2, "zone D2 of pentagon 1"),
        (
            Zone::Thermal3,
            &[[0.0, -3.0], [24.3, -30.0], [23.5, -32.4], [1.0, -32.4], [-6.0, -4.0]],
            "zone T3 of pentagon 1",
        ),
        (Zone::Thermal2, &[[-6.0, -4.0], [1.0, -32.4], [-22.5, -32.4]], "zone T2 of pentagon 1"),
        (
            Zone::Thermal1,
            &[[-6.0, -4.0], [-22.5, -32.4], [-23.5, -32.4], [-35.0, 3.1], [0.0, 1.5], [0.0, -3.0]],
            "zone T1 of pentagon 1",
        ),
        (Zone::StrayGassing, S, "zone S of pentagon 1"),
    ],
    borders: &[
        [[0.0, 40.0], [0.0, -3.0]],
        [[0.0, 33.0], [-1.0, 33.0]],
        [[-1.0, 33.0], [-1.0, 24.5]],
        [[-1.0, 24.5], [0.0, 24.5]],
        [[32.0, -6.1], [4.0, 16.0]],
        [[4.0, 16.0], [0.0, 1.5]],
        [[0.0, -3.0], [24.3, -30.0]],
        [[-35.0, 3.1], [0.0, 1.5]],
        [[0.0, -3.0], [-6.0, -4.0]],
        [[-6.0, -4.0], [1.0, -32.4]],
        [[-6.0, -4.0], [-22.5, -32.4]],
    ],
    source: "Duval pentagon 1 (Duval & Lamarre 2014)",
};

/// Pentagon 2: as pentagon 1, and a distinction of carbonised paper.
pub static PENTAGON_2: Pentagon = Pentagon {
    zones: &[
        (Zone::PartialDischarge, PD, "zone PD of pentagon 2"),
        (Zone::LowEnergy, D1, "zone D1 of pentagon 2"),
        (Zone::HighEnergy, D2, "zone D2 of pentagon 2"),
        (Zone::StrayGassing, S, "zone S of pentagon 2"),
        (
            Zone::Thermal3Oil,
            &[[0.0, -3.0], [24.3, -30.0], [23.5, -32.4], [2.5, -32.4], [-3.5, -3.0]],
            "zone T3H of pentagon 2",
        ),
        (
            Zone::Carbonisation,
            &[[-3.5, -3.0], [2.5, -32.4], [-21.5, -32.4], [-11.0, -8.0]],
            "zone C of pentagon 2",
        ),
        (
            Zone::Overheating,
            &[
                [-3.5, -3.0],
                [-11.0, -8.0],
                [-21.5, -32.4],
                [-23.5, -32.4],
                [-35.0, 3.1],
                [0.0, 1.5],
                [0.0, -3.0],
            ],
            "zone O of pentagon 2",
        ),
    ],
    borders: &[
        [[0.0, 40.0], [0.0, -3.0]],
        [[0.0, 33.0], [-1.0, 33.0]],
        [[-1.0, 33.0], [-1.0, 24.5]],
        [[-1.0, 24.5], [0.0, 24.5]],
        [[32.0, -6.1], [4.0, 16.0]],
        [[4.0, 16.0], [0.0, 1.5]],
        [[0.0, -3.0], [24.3, -30.0]],
        [[-35.0, 3.1], [0.0, 1.5]],
        [[0.0, -3.0], [-3.5, -3.0]],
        [[-3.5, -3.0], [2.5, -32.4]],
        [[-3.5, -3.0], [-11.0, -8.0]],
        [[-11.0, -8.0], [-21.5, -32.4]],
    ],
    source: "Duval pentagon 2 (Duval & Lamarre 2014)",
};

/// Computes the position of a sample in both pentagons, percent; `None` if one of the five gases is
/// absent or all of them are 0.
///
/// The area centroid, with A = 1/2 Σ c and C = Σ (P + P') c / 6A over neighbouring corners
/// P, P', where c = x y' - x' y. Angles between axes being equal, c is the product of the two
/// shares but for a factor that cancels, so that all terms are positive and none is lost.
pub fn point(sample: &Sample) -> Option<[f64; 2]> {
    let mut ppm = [0.0; 5];
    for (ppm, (gas, _)) in ppm.iter_mut().zip(AXES) {
        *ppm = sample.ppm(gas)?;
    }
    let sum: f64 = ppm.iter().sum();
    if sum <= 0.0 {
        return None;
    }
    let shares = ppm.map(|ppm| 100.0 * (ppm / sum + TRACE) / (1.0 + 5.0 * TRACE));
    let corner = |i: usize| AXES[i].1.map(|axis| axis * shares[i]);
    let (mut weights, mut weighted) = (0.0, [0.0; 2]);
    for i in 0..5 {
        let next = (i + 1) % 5;
        let weight = shares[i] * shares[next];
        weights += weight;
        let (here, there) = (corner(i), corner(next));
        for axis in 0..2 {
            weighted[axis] += weight * (here[axis] + there[axis]);
        }
    }
    Some(weighted.map(|total| total / (3.0 * weights)))
}

impl Pentagon {
    /// Returns the zone of a point. Of several on whose border it is, the first in the order of the
    /// source: PD, D1, D2, T3, T2, T1, S (pentagon 1) or PD, D1, D2, S, T3H, C, O (pentagon 2).
    fn zone_at(&self, point: Point) -> (Zone, &'static str) {
        let near = |polygon: &[Point]| nearest(point, edges(polygon));
        let has = |polygon: &[Point]| has_inside(polygon, point) || near(polygon) <= ON_BORDER;
        let found = self.zones.iter().find(|(_, polygon, _)| has(polygon));
        // Polygons leave no gap where centroids are; a rounded outer corner is its neighbour's.
        let nearest = || self.zones.iter().min_by(|a, b| near(a.1).total_cmp(&near(b.1)));
        found
            .or_else(nearest)
            .map_or((Zone::NotDetermined, "outside"), |&(zone, _, rule)| (zone, rule))
    }

    /// Returns the zone of a sample.
    pub fn zone(&self, sample: &Sample) -> Zone {
        point(sample).map_or(Zone::NotApplicable, |point| self.zone_at(point).0)
    }

    /// Returns the zones with their corners.
    pub fn outlines(&self) -> impl Iterator<Item = (Zone, &'static [Point])> {
        self.zones.iter().map(|(zone, corners, _)| (*zone, *corners))
    }

    /// Diagnoses a sample as [`Pentagon::zone`] does, with reasons.
    pub fn diagnose(&self, sample: &Sample) -> Verdict {
        let source = self.source;
        let Some(point) = point(sample) else {
            return Verdict { zone: Zone::NotApplicable, rule: NO_INPUT, margin: None, source };
        };
        let (zone, rule) = self.zone_at(point);
        let margin = Margin::Distance(nearest(point, self.borders.iter().copied()));
        Verdict { zone, rule, margin: Some(margin), source }
    }
}

#[cfg(test)]
#[path = "pentagon_tests.rs"]
mod tests;
