//! Duval's triangle 4: hydrogen, methane, ethane, for faults of low temperature.

use crate::triangle::{Border, Shares, Triangle};
use crate::{Gas, Sample, Verdict, Zone, triangle_1};

/// Borders between zones, as shares of H2, CH4, C2H6.
const BORDERS: [Border; 10] = [
    [[98.0, 2.0, 0.0], [97.0, 2.0, 1.0]],
    [[97.0, 2.0, 1.0], [84.0, 15.0, 1.0]],
    [[85.0, 15.0, 0.0], [84.0, 15.0, 1.0]],
    [[9.0, 45.0, 46.0], [54.0, 0.0, 46.0]],
    [[9.0, 61.0, 30.0], [9.0, 0.0, 91.0]],
    [[0.0, 70.0, 30.0], [9.0, 61.0, 30.0]],
    [[9.0, 61.0, 30.0], [15.0, 55.0, 30.0]],
    [[15.0, 61.0, 24.0], [15.0, 55.0, 30.0]],
    [[15.0, 61.0, 24.0], [40.0, 36.0, 24.0]],
    [[64.0, 36.0, 0.0], [40.0, 36.0, 24.0]],
];

const TRIANGLE: Triangle = Triangle {
    gases: [Gas::H2, Gas::Ch4, Gas::C2h6],
    judge,
    borders: &BORDERS,
    source: "Duval triangle 4 (IEEE C57.104-2019, annex D; Duval 2008)",
};

fn judge([h, m, e]: Shares) -> (Zone, &'static str) {
    if (2.0..15.0).contains(&m) && e < 1.0 {
        return (Zone::PartialDischarge, "2 % <= CH4 < 15 %, C2H6 < 1 %");
    }
    if h >= 9.0 && e >= 46.0 {
        return (Zone::NotDetermined, "H2 >= 9 %, C2H6 >= 46 %");
    }
    if h < 9.0 {
        return if e < 30.0 {
            (Zone::Carbonisation, "H2 < 9 %, C2H6 < 30 %")
        } else {
            (Zone::Overheating, "H2 < 9 %, C2H6 >= 30 %")
        };
    }
    if m >= 36.0 && e < 24.0 {
        return (Zone::Carbonisation, "CH4 >= 36 %, C2H6 < 24 %");
    }
    if h < 15.0 && (24.0..30.0).contains(&e) {
        return (Zone::Carbonisation, "H2 < 15 %, 24 % <= C2H6 < 30 %");
    }
    (Zone::StrayGassing, "the rest of the triangle")
}

/// Reports whether the triangle applies to a sample: triangle 1 gives PD, T1 or T2.
pub fn is_applicable(sample: &Sample) -> bool {
    matches!(triangle_1::zone(sample), Zone::PartialDischarge | Zone::Thermal1 | Zone::Thermal2)
}

/// Returns the zone of a sample, applicable or not.
pub fn zone(sample: &Sample) -> Zone {
    TRIANGLE.zone(sample)
}

/// Diagnoses a sample as [`zone`] does, with reasons.
pub fn diagnose(sample: &Sample) -> Verdict {
    TRIANGLE.diagnose(sample)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_are_where_zones_change() {
        crate::triangle::testing::check_borders(&TRIANGLE);
    }
}
