//! Doernenburg ratios of IEEE C57.104, with the screening that comes first.

use crate::margin::Limits;
use crate::verdict::NO_INPUT;
use crate::{Gas, Ratio, Sample, Verdict, Zone};

const SOURCE: &str = "IEEE C57.104-2019, Doernenburg ratios (C2H2 limit of 1 ppm)";

// Limits L1, ppm. The edition of 1991 has 35 for C2H2.
const H2: f64 = 100.0;
const CH4: f64 = 120.0;
const C2H6: f64 = 65.0;
const C2H4: f64 = 50.0;
const C2H2: f64 = 1.0;
const CO: f64 = 350.0;

const LIMITS: Limits = Limits {
    ratios: &[
        (Gas::Ch4, Gas::H2, &[0.1, 1.0]),
        (Gas::C2h2, Gas::C2h4, &[0.75]),
        (Gas::C2h2, Gas::Ch4, &[0.3]),
        (Gas::C2h6, Gas::C2h2, &[0.4]),
    ],
    gases: &[
        (Gas::H2, &[H2, 2.0 * H2]),
        (Gas::Ch4, &[CH4, 2.0 * CH4]),
        (Gas::C2h6, &[C2H6]),
        (Gas::C2h4, &[C2H4, 2.0 * C2H4]),
        (Gas::C2h2, &[C2H2, 2.0 * C2H2]),
        (Gas::Co, &[CO]),
    ],
};

fn judge(sample: &Sample) -> (Zone, &'static str) {
    let Some([h2, ch4, c2h6, c2h4, c2h2]) = sample.all(Gas::FIVE) else {
        return (Zone::NotApplicable, NO_INPUT);
    };
    let has_co = sample.ppm(Gas::Co).is_some_and(|co| co > CO);
    let is_high = h2 > 2.0 * H2 || ch4 > 2.0 * CH4 || c2h2 > 2.0 * C2H2 || c2h4 > 2.0 * C2H4;
    if !is_high || !(c2h6 > C2H6 || has_co) {
        return (
            Zone::NoFault,
            "none of H2, CH4, C2H2, C2H4 is above twice L1, or neither C2H6 nor CO above L1",
        );
    }
    // Each ratio needs one of its gases above L1.
    let ratios = [
        [ch4 > CH4, h2 > H2],
        [c2h2 > C2H2, c2h4 > C2H4],
        [c2h2 > C2H2, ch4 > CH4],
        [c2h6 > C2H6, c2h2 > C2H2],
    ];
    if ratios.contains(&[false; 2]) {
        return (Zone::NotApplicable, "a ratio has neither of its gases above L1");
    }
    let (r1, r2) = (Ratio::new(ch4, h2), Ratio::new(c2h2, c2h4));
    let (r3, r4) = (Ratio::new(c2h2, ch4), Ratio::new(c2h6, c2h2));
    if r1.is_more(1.0) && r2.is_less(0.75) && r3.is_less(0.3) && r4.is_more(0.4) {
        return (Zone::Thermal, "CH4/H2 > 1, C2H2/C2H4 < 0.75, C2H2/CH4 < 0.3, C2H6/C2H2 > 0.4");
    }
    if r1.is_less(0.1) && r3.is_less(0.3) && r4.is_more(0.4) {
        return (Zone::PartialDischarge, "CH4/H2 < 0.1, C2H2/CH4 < 0.3, C2H6/C2H2 > 0.4");
    }
    let is_between = r1.is_more(0.1) && r1.is_less(1.0);
    if is_between && r2.is_more(0.75) && r3.is_more(0.3) && r4.is_less(0.4) {
        return (
            Zone::Discharge,
            "0.1 < CH4/H2 < 1, C2H2/C2H4 > 0.75, C2H2/CH4 > 0.3, C2H6/C2H2 < 0.4",
        );
    }
    (Zone::NotDetermined, "no row of the table holds")
}

/// Returns the zone of a sample: [`Zone::NoFault`] where the screening stops it,
/// [`Zone::NotApplicable`] where a ratio has neither of its gases above L1. Every limit is exceeded
/// by a greater value, not by an equal one. CO may be absent.
pub fn zone(sample: &Sample) -> Zone {
    judge(sample).0
}

/// Diagnoses a sample as [`zone`] does, with reasons.
pub fn diagnose(sample: &Sample) -> Verdict {
    let (zone, rule) = judge(sample);
    Verdict { zone, rule, margin: LIMITS.margin(sample, self::zone), source: SOURCE }
}
