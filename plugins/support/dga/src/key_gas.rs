//! Key gas method of IEEE C57.104.
//!
//! The standard gives four profiles, in percent of the combustible gases: overheated oil
//! (C2H4 63, C2H6 19, CH4 16, H2 2), overheated oil and cellulose (CO 92), corona (H2 85,
//! CH4 13, C2H4 1, C2H6 1) and arcing (H2 60, C2H2 30, CH4 5, C2H4 3, C2H6 2), and leaves
//! the comparison to the reader. Here the gas that is most decides: H2 PD, CH4 or C2H6 T1
//! (oil at low temperature), C2H4 T3, C2H2 D2, CO C. Arcing with little C2H2 is thus taken
//! for corona: programs err in half of all cases with this method (C57.104-2019, annex D).

use crate::margin::Limits;
use crate::verdict::NO_INPUT;
use crate::{Gas, Sample, Verdict, Zone};

const SOURCE: &str = "IEEE C57.104, key gas; the greatest of the combustible gases";

const KEYS: [(Gas, Zone, &str); 6] = [
    (Gas::H2, Zone::PartialDischarge, "H2 is most: corona"),
    (Gas::Ch4, Zone::Thermal1, "CH4 is most: oil overheated, at low temperature"),
    (Gas::C2h6, Zone::Thermal1, "C2H6 is most: oil overheated, at low temperature"),
    (Gas::C2h4, Zone::Thermal3, "C2H4 is most: oil overheated"),
    (Gas::C2h2, Zone::HighEnergy, "C2H2 is most: arcing"),
    (Gas::Co, Zone::Carbonisation, "CO is most: oil and cellulose overheated"),
];

/// Limits where two gases are equal: one of them becomes the greatest.
const LIMITS: Limits = Limits {
    ratios: &[
        (Gas::H2, Gas::Ch4, &[1.0]),
        (Gas::H2, Gas::C2h6, &[1.0]),
        (Gas::H2, Gas::C2h4, &[1.0]),
        (Gas::H2, Gas::C2h2, &[1.0]),
        (Gas::H2, Gas::Co, &[1.0]),
        (Gas::Ch4, Gas::C2h4, &[1.0]),
        (Gas::Ch4, Gas::C2h2, &[1.0]),
        (Gas::Ch4, Gas::Co, &[1.0]),
        (Gas::C2h6, Gas::C2h4, &[1.0]),
        (Gas::C2h6, Gas::C2h2, &[1.0]),
        (Gas::C2h6, Gas::Co, &[1.0]),
        (Gas::C2h4, Gas::C2h2, &[1.0]),
        (Gas::C2h4, Gas::Co, &[1.0]),
        (Gas::C2h2, Gas::Co, &[1.0]),
    ],
    gases: &[],
};

fn judge(sample: &Sample) -> (Zone, &'static str) {
    if sample.all(Gas::FIVE).is_none() {
        return (Zone::NotApplicable, NO_INPUT);
    }
    let mut most = (0.0, Zone::NotApplicable, NO_INPUT);
    for (gas, zone, rule) in KEYS {
        let ppm = sample.ppm(gas).unwrap_or_default();
        if ppm > most.0 {
            most = (ppm, zone, rule);
        }
    }
    (most.1, most.2)
}

/// Returns the zone of a sample. Of equal gases the first of H2, CH4, C2H6, C2H4, C2H2, CO counts.
/// CO may be absent.
pub fn zone(sample: &Sample) -> Zone {
    judge(sample).0
}

/// Diagnoses a sample as [`zone`] does, with reasons.
pub fn diagnose(sample: &Sample) -> Verdict {
    let (zone, rule) = judge(sample);
    Verdict { zone, rule, margin: LIMITS.margin(sample, self::zone), source: SOURCE }
}
