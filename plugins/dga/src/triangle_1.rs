//! Duval's triangle 1: methane, ethylene, acetylene.

use crate::triangle::{Border, Shares, Triangle};
use crate::{Gas, Sample, Verdict, Zone};

/// Where zones meet, as shares of CH4, C2H4, C2H2.
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

/// The zone of a sample. Each limit belongs to the side of the greater share.
pub fn zone(sample: &Sample) -> Zone {
    TRIANGLE.zone(sample)
}

/// As [`zone`], with reasons.
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
