//! Ratios of IEC 60599, table 1.
//!
//! Zones overlap: C2H2/C2H4 from 1 to 2.5 with CH4/H2 from 0.1 to 0.5 and C2H4/C2H6 above 2
//! is D1 and D2. So the result is a set.

use crate::margin::Limits;
use crate::verdict::NO_INPUT;
use crate::{Gas, Ratio, Sample, Verdict, Zone};

const SOURCE: &str = "IEC 60599:2015, table 1";

/// Equipment that contains the oil; it decides which CH4/H2 is still partial discharge (table 1,
/// notes).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Equipment {
    /// Power transformer or reactor: below 0.1.
    #[default]
    Transformer,
    /// Instrument transformer: below 0.2.
    InstrumentTransformer,
    /// Bushing: CH4/H2 below 0.07.
    Bushing,
}

/// C2H2/C2H4, CH4/H2 and C2H4/C2H6.
struct Ratios {
    r2: Ratio,
    r1: Ratio,
    r5: Ratio,
}

struct Row {
    zone: Zone,
    rule: &'static str,
    holds: fn(&Ratios, Equipment) -> bool,
}

/// Table 1. Ranges include both ends. CH4/H2 of T1 is "above 1, or of no significance" in
/// the standard: above 1 here, since T1 would cover PD otherwise.
const TABLE: [Row; 6] = [
    Row {
        zone: Zone::PartialDischarge,
        rule: "CH4/H2 < 0.1 (0.2 in instrument transformers, 0.07 in bushings), C2H4/C2H6 < 0.2",
        holds: |r, equipment| {
            let limit = match equipment {
                Equipment::Transformer => 0.1,
                Equipment::InstrumentTransformer => 0.2,
                Equipment::Bushing => 0.07,
            };
            r.r1.is_less(limit) && r.r5.is_less(0.2)
        },
    },
    Row {
        zone: Zone::LowEnergy,
        rule: "C2H2/C2H4 > 1, CH4/H2 0.1 to 0.5, C2H4/C2H6 > 1",
        holds: |r, _| r.r2.is_more(1.0) && r.r1.is_within(0.1, 0.5) && r.r5.is_more(1.0),
    },
    Row {
        zone: Zone::HighEnergy,
        rule: "C2H2/C2H4 0.6 to 2.5, CH4/H2 0.1 to 1, C2H4/C2H6 > 2",
        holds: |r, _| r.r2.is_within(0.6, 2.5) && r.r1.is_within(0.1, 1.0) && r.r5.is_more(2.0),
    },
    Row {
        zone: Zone::Thermal1,
        rule: "CH4/H2 > 1, C2H4/C2H6 < 1",
        holds: |r, _| r.r1.is_more(1.0) && r.r5.is_less(1.0),
    },
    Row {
        zone: Zone::Thermal2,
        rule: "C2H2/C2H4 < 0.1, CH4/H2 > 1, C2H4/C2H6 1 to 4",
        holds: |r, _| r.r2.is_less(0.1) && r.r1.is_more(1.0) && r.r5.is_within(1.0, 4.0),
    },
    Row {
        zone: Zone::Thermal3,
        rule: "C2H2/C2H4 < 0.2, CH4/H2 > 1, C2H4/C2H6 > 4",
        holds: |r, _| r.r2.is_less(0.2) && r.r1.is_more(1.0) && r.r5.is_more(4.0),
    },
];

const LIMITS: Limits = Limits {
    ratios: &[
        (Gas::C2h2, Gas::C2h4, &[0.1, 0.2, 0.6, 1.0, 2.5]),
        (Gas::Ch4, Gas::H2, &[0.07, 0.1, 0.2, 0.5, 1.0]),
        (Gas::C2h4, Gas::C2h6, &[0.2, 1.0, 2.0, 4.0]),
    ],
    gases: &[],
};

/// Returns the rows of table 1 that hold; `None` if one of the five gases is absent.
fn rows(sample: &Sample, equipment: Equipment) -> Option<[bool; TABLE.len()]> {
    let [h2, ch4, c2h6, c2h4, c2h2] = sample.all(Gas::FIVE)?;
    let ratios =
        Ratios { r2: Ratio::new(c2h2, c2h4), r1: Ratio::new(ch4, h2), r5: Ratio::new(c2h4, c2h6) };
    Some(std::array::from_fn(|row| (TABLE[row].holds)(&ratios, equipment)))
}

/// Returns the zones of a sample, in the order of the table: [`Zone::NotDetermined`] alone where no
/// row holds, [`Zone::NotApplicable`] alone where one of the five gases is absent.
pub fn zones(sample: &Sample, equipment: Equipment) -> impl Iterator<Item = Zone> {
    let rows = rows(sample, equipment);
    let none = match rows {
        None => Some(Zone::NotApplicable),
        Some(rows) => (!rows.contains(&true)).then_some(Zone::NotDetermined),
    };
    let held = TABLE.iter().zip(rows.unwrap_or_default());
    none.into_iter().chain(held.filter(|(_, holds)| *holds).map(|(row, _)| row.zone))
}

/// Diagnoses a sample as [`zones`] does, with reasons. The margin is that of the whole set.
pub fn diagnose(sample: &Sample, equipment: Equipment) -> Vec<Verdict> {
    let margin = LIMITS.margin(sample, |sample| rows(sample, equipment));
    let rule = |zone| match zone {
        Zone::NotApplicable => NO_INPUT,
        zone => {
            let row = TABLE.iter().find(|row| row.zone == zone);
            row.map_or("no row of the table holds", |row| row.rule)
        }
    };
    zones(sample, equipment)
        .map(|zone| Verdict { zone, rule: rule(zone), margin, source: SOURCE })
        .collect()
}
