//! Three-ratio method of DL/T 722-2014, tables 6 and 7.

use crate::margin::Limits;
use crate::verdict::NO_INPUT;
use crate::{Gas, Ratio, Sample, Verdict, Zone};

const SOURCE: &str = "DL/T 722-2014, tables 6 and 7";

const LIMITS: Limits = Limits {
    ratios: &[
        (Gas::C2h2, Gas::C2h4, &[0.1, 1.0, 3.0]),
        (Gas::Ch4, Gas::H2, &[0.1, 1.0, 3.0]),
        (Gas::C2h4, Gas::C2h6, &[0.1, 1.0, 3.0]),
    ],
    gases: &[],
};

/// Table 6: the code of a ratio below 0.1, from there to below 1, to below 3, and from 3.
fn code(ratio: Ratio, codes: [u8; 4]) -> Option<u8> {
    ratio.value().map(|value| match value {
        value if value < 0.1 => codes[0],
        value if value < 1.0 => codes[1],
        value if value < 3.0 => codes[2],
        _ => codes[3],
    })
}

fn judge(sample: &Sample) -> (Zone, &'static str) {
    let Some([h2, ch4, c2h6, c2h4, c2h2]) = sample.all(Gas::FIVE) else {
        return (Zone::NotApplicable, NO_INPUT);
    };
    // Without C2H2 there is no discharge to code, whatever C2H4 is.
    let acetylene = code(Ratio::new(c2h2, c2h4), [0, 1, 1, 2]).unwrap_or(0);
    let methane = code(Ratio::new(ch4, h2), [1, 0, 2, 2]);
    let ethylene = code(Ratio::new(c2h4, c2h6), [0, 0, 1, 2]);
    match (acetylene, methane, ethylene) {
        (0, _, Some(2)) => (Zone::Thermal3, "code 0, 0|1|2, 2: overheating above 700 °C"),
        (0, Some(0), Some(0)) => (Zone::Thermal0, "code 0, 0, 0: overheating below 150 °C"),
        (0, Some(2), Some(0)) => (Zone::Thermal1, "code 0, 2, 0: overheating, 150 to 300 °C"),
        (0, Some(0), Some(1)) => {
            (Zone::Thermal1, "code 0, 0, 1, which the table lacks: taken as 0, 2, 0")
        }
        (0, Some(2), Some(1)) => (Zone::Thermal2, "code 0, 2, 1: overheating, 300 to 700 °C"),
        (0, Some(1), Some(0)) => (Zone::PartialDischarge, "code 0, 1, 0: partial discharge"),
        (1, Some(2), _) => (Zone::HighEnergyThermal, "code 1, 2, any: arc and overheating"),
        (1, _, _) => (Zone::HighEnergy, "code 1, 0|1, any: arc"),
        (2, Some(2), _) => {
            (Zone::LowEnergyThermal, "code 2, 2, any: discharge of low energy, overheating")
        }
        (2, _, _) => (Zone::LowEnergy, "code 2, 0|1, any: discharge of low energy"),
        _ => (Zone::NotDetermined, "the table has no row for the code"),
    }
}

/// Returns the zone of a sample.
///
/// Of ratios 0/0 (the standard has none): C2H2/C2H4 is coded 0; CH4/H2 fits the rows with
/// "any" digit there, and a discharge whose overheating is not known is one without; all
/// else is not determined. Code 0, 1, 1, which the table lacks, is not determined either.
pub fn zone(sample: &Sample) -> Zone {
    judge(sample).0
}

/// Diagnoses a sample as [`zone`] does, with reasons.
pub fn diagnose(sample: &Sample) -> Verdict {
    let (zone, rule) = judge(sample);
    Verdict { zone, rule, margin: LIMITS.margin(sample, self::zone), source: SOURCE }
}
