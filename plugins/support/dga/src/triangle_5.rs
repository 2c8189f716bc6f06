//! Duval's triangle 5: methane, ethylene, ethane, for faults of higher temperature.

use crate::triangle::{Border, Shares, Triangle};
use crate::{Gas, Sample, Verdict, Zone, triangle_1};

/// Borders between zones, as shares of CH4, C2H4, C2H6.
const BORDERS: [Border; 14] = [
    [[98.0, 0.0, 2.0], [97.0, 1.0, 2.0]],
    [[97.0, 1.0, 2.0], [84.0, 1.0, 15.0]],
    [[85.0, 0.0, 15.0], [75.0, 10.0, 15.0]],
    [[46.0, 0.0, 54.0], [36.0, 10.0, 54.0]],
    [[90.0, 10.0, 0.0], [0.0, 10.0, 90.0]],
    [[60.0, 10.0, 30.0], [35.0, 35.0, 30.0]],
    [[35.0, 35.0, 30.0], [0.0, 35.0, 65.0]],
    [[35.0, 35.0, 30.0], [0.0, 70.0, 30.0]],
    [[78.0, 10.0, 12.0], [53.0, 35.0, 12.0]],
    [[65.0, 35.0, 0.0], [53.0, 35.0, 12.0]],
    [[53.0, 35.0, 12.0], [38.0, 50.0, 12.0]],
    [[38.0, 50.0, 12.0], [36.0, 50.0, 14.0]],
    [[36.0, 50.0, 14.0], [16.0, 70.0, 14.0]],
    [[16.0, 70.0, 14.0], [0.0, 70.0, 30.0]],
];

const TRIANGLE: Triangle = Triangle {
    gases: [Gas::Ch4, Gas::C2h4, Gas::C2h6],
    judge,
    borders: &BORDERS,
    source: "Duval triangle 5 (IEEE C57.104-2019, annex D)",
};

fn judge([_, y, e]: Shares) -> (Zone, &'static str) {
    if y < 1.0 && (2.0..15.0).contains(&e) {
        return (Zone::PartialDischarge, "C2H4 < 1 %, 2 % <= C2H6 < 15 %");
    }
    if y < 10.0 {
        return match e {
            e if e < 15.0 => (Zone::Overheating, "C2H4 < 10 %, C2H6 < 15 %"),
            e if e < 54.0 => (Zone::StrayGassing, "C2H4 < 10 %, 15 % <= C2H6 < 54 %"),
            _ => (Zone::Overheating, "C2H4 < 10 %, C2H6 >= 54 %"),
        };
    }
    if e >= 30.0 {
        return if y < 35.0 {
            (Zone::NotDetermined, "10 % <= C2H4 < 35 %, C2H6 >= 30 %")
        } else {
            (Zone::Thermal3, "C2H4 >= 35 %, C2H6 >= 30 %")
        };
    }
    match y {
        y if y < 35.0 && e < 12.0 => (Zone::Thermal2, "10 % <= C2H4 < 35 %, C2H6 < 12 %"),
        y if y < 35.0 => (Zone::Carbonisation, "10 % <= C2H4 < 35 %, 12 % <= C2H6 < 30 %"),
        y if y < 50.0 && e < 12.0 => (Zone::Thermal3, "35 % <= C2H4 < 50 %, C2H6 < 12 %"),
        y if y < 50.0 => (Zone::Carbonisation, "35 % <= C2H4 < 50 %, 12 % <= C2H6 < 30 %"),
        y if y < 70.0 && e < 14.0 => (Zone::Thermal3, "50 % <= C2H4 < 70 %, C2H6 < 14 %"),
        y if y < 70.0 => (Zone::Carbonisation, "50 % <= C2H4 < 70 %, 14 % <= C2H6 < 30 %"),
        _ => (Zone::Thermal3, "C2H4 >= 70 %"),
    }
}

/// Reports whether the triangle applies to a sample: triangle 1 gives T2 or T3.
pub fn is_applicable(sample: &Sample) -> bool {
    matches!(triangle_1::zone(sample), Zone::Thermal2 | Zone::Thermal3)
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
