//! Duval's triangle 1: methane, ethylene, acetylene.

use crate::triangle::{self, Border, Shares, Triangle};
use crate::{Gas, Sample, Verdict, Zone};

/// Borders between zones, as shares of CH4, C2H4, C2H2.
const BORDERS: [Border; 13] = [
    [[98.0, 0.0, 2.0], [98.0, 2.0, 0.0]],
    [[80.0, 20.0, 0.0], [76.0, 20.0, 4.0]],
    [[50.0, 50.0, 0.0], [46.0, 50.0, 4.0]],
    [[96.0, 0.0, 4.0], [76.0, 20.0, 4.0]],
    [[76.0, 20.0, 4.0], [46.0, 50.0, 4.0]],
    [[46.0, 50.0, 4.0], [35.0, 50.0, 15.0]],
    [[35.0, 50.0, 15.0], [0.0, 85.0, 15.0]],
    [[87.0, 0.0, 13.0], [64.0, 23.0, 13.0]],
    [[64.0, 23.0, 13.0], [47.0, 40.0, 13.0]],
    [[47.0, 40.0, 13.0], [31.0, 40.0, 29.0]],
    [[31.0, 40.0, 29.0], [0.0, 71.0, 29.0]],
    [[64.0, 23.0, 13.0], [48.0, 23.0, 29.0]],
    [[48.0, 23.0, 29.0], [0.0, 23.0, 77.0]],
];

const TRIANGLE: Triangle = Triangle {
    gases: [Gas::Ch4, Gas::C2h4, Gas::C2h2],
    judge,
    borders: &BORDERS,
    source: "Duval triangle 1 (IEC 60599:2015, annex B; IEEE C57.104-2019, annex D)",
};

fn judge([m, e, a]: Shares) -> (Zone, &'static str) {
    if m >= 98.0 {
        return (Zone::PartialDischarge, "CH4 >= 98 %");
    }
    if a < 4.0 {
        return match e {
            e if e < 20.0 => (Zone::Thermal1, "C2H2 < 4 %, C2H4 < 20 %"),
            e if e < 50.0 => (Zone::Thermal2, "C2H2 < 4 %, 20 % <= C2H4 < 50 %"),
            _ => (Zone::Thermal3, "C2H2 < 4 %, C2H4 >= 50 %"),
        };
    }
    if a < 15.0 && e >= 50.0 {
        return (Zone::Thermal3, "C2H2 < 15 %, C2H4 >= 50 %");
    }
    if a >= 13.0 && e < 23.0 {
        return (Zone::LowEnergy, "C2H2 >= 13 %, C2H4 < 23 %");
    }
    if (13.0..29.0).contains(&a) && (23.0..40.0).contains(&e) {
        return (Zone::HighEnergy, "13 % <= C2H2 < 29 %, 23 % <= C2H4 < 40 %");
    }
    if a >= 29.0 && e >= 23.0 {
        return (Zone::HighEnergy, "C2H2 >= 29 %, C2H4 >= 23 %");
    }
    (Zone::DischargeThermal, "the rest of the triangle")
}

/// Returns the zone of a sample. Each limit belongs to the side of the greater share.
pub fn zone(sample: &Sample) -> Zone {
    TRIANGLE.zone(sample)
}

/// Diagnoses a sample as [`zone`] does, with reasons.
pub fn diagnose(sample: &Sample) -> Verdict {
    TRIANGLE.diagnose(sample)
}

/// Corners of the zones, as shares of CH4, C2H4, C2H2 (IEC 60599:2015, annex B).
const ZONES: [(Zone, &[Shares]); 7] = [
    (Zone::PartialDischarge, &[[100.0, 0.0, 0.0], [98.0, 2.0, 0.0], [98.0, 0.0, 2.0]]),
    (
        Zone::Thermal1,
        &[
            [98.0, 2.0, 0.0],
            [98.0, 0.0, 2.0],
            [96.0, 0.0, 4.0],
            [76.0, 20.0, 4.0],
            [80.0, 20.0, 0.0],
        ],
    ),
    (Zone::Thermal2, &[[80.0, 20.0, 0.0], [76.0, 20.0, 4.0], [46.0, 50.0, 4.0], [50.0, 50.0, 0.0]]),
    (
        Zone::Thermal3,
        &[[50.0, 50.0, 0.0], [35.0, 50.0, 15.0], [0.0, 85.0, 15.0], [0.0, 100.0, 0.0]],
    ),
    (
        Zone::DischargeThermal,
        &[
            [96.0, 0.0, 4.0],
            [87.0, 0.0, 13.0],
            [47.0, 40.0, 13.0],
            [31.0, 40.0, 29.0],
            [0.0, 71.0, 29.0],
            [0.0, 85.0, 15.0],
            [35.0, 50.0, 15.0],
            [46.0, 50.0, 4.0],
        ],
    ),
    (
        Zone::LowEnergy,
        &[[87.0, 0.0, 13.0], [64.0, 23.0, 13.0], [0.0, 23.0, 77.0], [0.0, 0.0, 100.0]],
    ),
    (
        Zone::HighEnergy,
        &[
            [64.0, 23.0, 13.0],
            [47.0, 40.0, 13.0],
            [31.0, 40.0, 29.0],
            [0.0, 71.0, 29.0],
            [0.0, 23.0, 77.0],
        ],
    ),
];

/// Returns the zones with their corners in an equilateral triangle with sides of 100: CH4 at its
/// left, C2H4 at its right, C2H2 at its top.
pub fn outlines() -> impl Iterator<Item = (Zone, Vec<[f64; 2]>)> {
    ZONES.iter().map(|(zone, corners)| {
        (*zone, corners.iter().map(|shares| triangle::place(*shares)).collect())
    })
}

/// Computes the position of a sample in that triangle; `None` if a gas is absent or all are 0.
pub fn point(sample: &Sample) -> Option<[f64; 2]> {
    triangle::shares(sample, TRIANGLE.gases).map(triangle::place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_inside_the_outline_of_its_zone() {
        let mut inside = 0;
        for m in 0..=40 {
            for e in 0..=40 - m {
                let [m, e] = [m, e].map(|step| f64::from(step) * 2.5 - 0.3);
                if m < 0.0 || e < 0.0 || m + e > 100.0 {
                    continue;
                }
                let ppm = [0.0, m, 0.0, e, 100.0 - m - e];
                let sample = Sample::of_five(ppm).unwrap();
                let at = point(&sample).unwrap();
                let found: Vec<Zone> = outlines()
                    .filter(|(_, outline)| crate::plane::has_inside(outline, at))
                    .map(|(zone, _)| zone)
                    .collect();
                assert_eq!(found, [zone(&sample)], "{ppm:?}");
                inside += 1;
            }
        }
        assert!(inside > 700);
    }

    #[test]
    fn borders_are_where_zones_change() {
        crate::triangle::testing::check_borders(&TRIANGLE);
    }
}
