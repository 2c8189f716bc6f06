//! Rogers ratios, in the form with three ratios of IEEE C57.104.

use crate::margin::Limits;
use crate::verdict::NO_INPUT;
use crate::{Gas, Ratio, Sample, Verdict, Zone};

const SOURCE: &str = "IEEE C57.104-2019, Rogers ratios";

const LIMITS: Limits = Limits {
    ratios: &[
        (Gas::C2h2, Gas::C2h4, &[0.1, 3.0]),
        (Gas::Ch4, Gas::H2, &[0.1, 1.0]),
        (Gas::C2h4, Gas::C2h6, &[1.0, 3.0]),
    ],
    gases: &[],
};

fn judge(sample: &Sample) -> (Zone, &'static str) {
    let Some([h2, ch4, c2h6, c2h4, c2h2]) = sample.all(Gas::FIVE) else {
        return (Zone::NotApplicable, NO_INPUT);
    };
    let (r2, r1, r5) = (Ratio::new(c2h2, c2h4), Ratio::new(ch4, h2), Ratio::new(c2h4, c2h6));
    let is_middle = r1.is_within(0.1, 1.0);
    if r2.is_within(0.1, 3.0) && is_middle && r5.is_more(3.0) {
        return (Zone::HighEnergy, "C2H2/C2H4 0.1 to 3, CH4/H2 0.1 to 1, C2H4/C2H6 > 3: arcing");
    }
    if r2.is_less(0.1) {
        if is_middle && r5.is_less(1.0) {
            return (Zone::Normal, "C2H2/C2H4 < 0.1, CH4/H2 0.1 to 1, C2H4/C2H6 < 1");
        }
        if r1.is_less(0.1) && r5.is_less(1.0) {
            return (Zone::PartialDischarge, "C2H2/C2H4 < 0.1, CH4/H2 < 0.1, C2H4/C2H6 < 1");
        }
        if is_middle && r5.is_within(1.0, 3.0) {
            return (Zone::Thermal1, "C2H2/C2H4 < 0.1, CH4/H2 0.1 to 1, C2H4/C2H6 1 to 3");
        }
        if r1.is_more(1.0) && r5.is_within(1.0, 3.0) {
            return (Zone::Thermal2, "C2H2/C2H4 < 0.1, CH4/H2 > 1, C2H4/C2H6 1 to 3");
        }
        if r1.is_more(1.0) && r5.is_more(3.0) {
            return (Zone::Thermal3, "C2H2/C2H4 < 0.1, CH4/H2 > 1, C2H4/C2H6 > 3");
        }
    }
    (Zone::NotDetermined, "no row of the table holds")
}

/// Returns the zone of a sample. Ranges include both ends.
pub fn zone(sample: &Sample) -> Zone {
    judge(sample).0
}

/// Diagnoses a sample as [`zone`] does, with reasons.
pub fn diagnose(sample: &Sample) -> Verdict {
    let (zone, rule) = judge(sample);
    Verdict { zone, rule, margin: LIMITS.margin(sample, self::zone), source: SOURCE }
}
