//! Probabilities of the zones, as cells.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use dga::iec60599::{self, Equipment};
use dga::pentagon::{PENTAGON_1, PENTAGON_2};
use dga::uncertainty::{Uncertainty, probabilities};
use dga::{
    Gas, Sample, Zone, dlt722, doernenburg, key_gas, rogers, triangle_1, triangle_4, triangle_5,
};

/// Columns of probabilities, one a method.
pub(crate) const COLUMNS: [&str; 10] = [
    "iec_p",
    "rogers_p",
    "doernenburg_p",
    "keygas_p",
    "dlt722_p",
    "tri1_p",
    "tri4_p",
    "tri5_p",
    "pent1_p",
    "pent2_p",
];

const SIX: [Gas; 6] = [Gas::H2, Gas::Ch4, Gas::C2h6, Gas::C2h4, Gas::C2h2, Gas::Co];

/// The cells of [`COLUMNS`]: zones with their probabilities, the greatest first, such as
/// `T2=0.8125;T3=0.1875`.
pub(crate) fn cells(
    sample: &Sample,
    uncertainty: Uncertainty,
    equipment: Equipment,
) -> [String; COLUMNS.len()] {
    let of = |gases: &[Gas], method: fn(&Sample) -> Zone| {
        cell(probabilities(sample, uncertainty, gases, |sample| vec![method(sample)]))
    };
    let iec = probabilities(sample, uncertainty, &Gas::FIVE, |sample| {
        iec60599::zones(sample, equipment).collect::<Vec<_>>()
    });
    [
        cell(iec),
        of(&Gas::FIVE, rogers::zone),
        of(&SIX, doernenburg::zone),
        of(&SIX, key_gas::zone),
        of(&Gas::FIVE, dlt722::zone),
        of(&[Gas::Ch4, Gas::C2h4, Gas::C2h2], triangle_1::zone),
        of(&[Gas::H2, Gas::Ch4, Gas::C2h6], triangle_4::zone),
        of(&[Gas::Ch4, Gas::C2h4, Gas::C2h6], triangle_5::zone),
        of(&Gas::FIVE, |sample| PENTAGON_1.zone(sample)),
        of(&Gas::FIVE, |sample| PENTAGON_2.zone(sample)),
    ]
}

fn cell(found: BTreeMap<Vec<Zone>, f64>) -> String {
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let mut text = String::new();
    for (zones, probability) in found {
        let names: Vec<_> = zones.iter().map(|zone| zone.name()).collect();
        let separator = if text.is_empty() { "" } else { ";" };
        // Writing into a string does not fail.
        let _ = write!(text, "{separator}{}={probability:.4}", names.join("|"));
    }
    text
}
